#include "dynamics/relative/loaded_bodies.hpp"

#include "dynamics/model/load_values.hpp"
#include "dynamics/model/second_order_shapes.hpp"
#include "reduction/invariants/geometric_stiffness.hpp"

#include <algorithm>
#include <utility>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

LoadedBodies::LoadedBodies(const Multibody& scene, Where where) : scene_(scene), where_(std::move(where)) {
  for (const ReducedBody& body : scene.bodies) K_.emplace_back(MatrixXd::Zero(body.n(), body.n()));
  shortening_.resize(K_.size());
}

void LoadedBodies::bend(size_t body, const Eigen::VectorXd& q) {
  for (const MarkerStiffness& m : scene_.bodies[body].Kg.markers) {
    Vector3d u2 = Vector3d::Zero();
    for (size_t i = 0; i < m.force.size() && q.size() > 0; ++i)
      u2[static_cast<Eigen::Index>(i)] = -0.5 * q.dot(m.force[i] * q);
    shortening_[body] = std::max(shortening_[body], u2.norm());
  }
}

void LoadedBodies::move(size_t body, const Vector3d& omega, const Vector3d& acceleration,
                        const Vector3d& angular_acceleration, const Eigen::VectorXd& q_ddot) {
  K_[body] += motion_stiffness(scene_.bodies[body], omega, acceleration, angular_acceleration) +
              modal_stiffness(scene_.bodies[body], q_ddot);
}

bool LoadedBodies::counts(const Place& at) const {
  return at.body >= 0 && std::ranges::any_of(scene_.bodies[static_cast<size_t>(at.body)].Kg.markers,
                                             [&](const MarkerStiffness& m) { return m.marker == at.marker; });
}

void LoadedBodies::push(const Place& at, const Vector3d& force, const Vector3d& torque) {
  if (!counts(at)) return;
  const auto body = static_cast<size_t>(at.body);
  const Matrix3d to_body = where_(Place{.body = at.body, .marker = {}}).axes.transpose();
  K_[body] += marker_stiffness(scene_.bodies[body], at.marker, to_body * force, to_body * torque);
}

void LoadedBodies::push_by_joints(const std::vector<JointLoad>& loads) {
  for (size_t i = 0; i < loads.size(); ++i) {
    const Place &at_a = scene_.joints[i].a, &at_b = scene_.joints[i].b;
    if (!counts(at_a) && !counts(at_b)) continue;
    const PlaceMotionInSpace a = where_(at_a), b = where_(at_b);
    const Vector3d force = b.axes * loads[i].force, torque = b.axes * loads[i].torque;
    push(at_b, force, torque);
    push(at_a, -force, -torque - (b.position - a.position).cross(force));
  }
}

void LoadedBodies::push_by_loads(double t) {
  for (const Load& load : scene_.loads) {
    if (!counts(load.at)) continue;
    const ForceAndTorque own = load_in_own_axes(load, t);
    const Matrix3d axes = load.inertial_axes ? Matrix3d::Identity() : where_(load.at).axes;
    push(load.at, axes * spatial::eigen(own.force), axes * spatial::eigen(own.torque));
  }
}

void LoadedBodies::push_by_springs() {
  for (const SpringDamper& spring : scene_.springs) {
    if (!counts(spring.a) && !counts(spring.b)) continue;
    const PlaceMotionInSpace a = where_(spring.a), b = where_(spring.b);
    const Vector3d way = b.position - a.position;
    const double length = way.norm();
    if (!(length > 0)) continue;  // no direction
    const Vector3d along = way / length;
    const double rate = along.dot(b.velocity - a.velocity);
    const Vector3d force = (spring.stiffness * (length - spring.free_length) + spring.damping * rate) * along;
    push(spring.a, force, Vector3d::Zero());
    push(spring.b, -force, Vector3d::Zero());
  }
}

std::vector<StiffeningEffect> LoadedBodies::effects() const {
  std::vector<StiffeningEffect> effects;
  for (size_t i = 0; i < K_.size(); ++i) {
    const auto [least, most] = relative_stiffness(scene_.bodies[i], K_[i]);
    effects.push_back({std::max(-least, most), std::max(-least, 0.0), shortening_[i]});
  }
  return effects;
}

}  // namespace flexboom
