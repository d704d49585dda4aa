#include "dynamics/redundant/multipliers.hpp"

#include "dynamics/model/joint.hpp"
#include "dynamics/model/multibody_check.hpp"
#include "dynamics/model/second_order_shapes.hpp"
#include "dynamics/numerics/rotation.hpp"
#include "dynamics/redundant/start.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <cmath>

namespace flexboom {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;
using spatial::eigen;
using spatial::vec3;

namespace redundant {

namespace {

/// Non-zeros of a vector of matrices, by component, times a factor.
std::vector<Entry> entries_of(const std::vector<Eigen::MatrixXd>& K, double factor) {
  std::vector<Entry> entries;
  for (size_t c = 0; c < K.size(); ++c)
    for (Index k = 0; k < K[c].rows(); ++k)
      for (Index l = 0; l < K[c].cols(); ++l)
        if (K[c](k, l) != 0)
          entries.push_back({static_cast<size_t>(k), static_cast<size_t>(l), c, factor * K[c](k, l)});
  return entries;
}

}  // namespace

BodyData body_data(const ReducedBody& body, Stiffening stiffening) {
  const Index n = body.n();
  BodyData d;
  d.n = d.shapes = static_cast<size_t>(n);
  d.Me = body.Me, d.Ke = body.Ke, d.De = body.De;
  ReducedBody with_shapes;
  const bool second_order = stiffening == Stiffening::on && n > 0;
  if (second_order) {
    SecondOrderShapes shapes = with_second_order_shapes(body);
    d.follow = entries_of(shapes.follow, 1);
    with_shapes = std::move(shapes.body);
    d.shapes = static_cast<size_t>(with_shapes.n());
    d.Me_follow = with_shapes.Me.bottomLeftCorner(with_shapes.n() - n, n);
  }
  const ReducedBody& b = second_order ? with_shapes : body;
  d.m = b.m, d.mc0 = spatial::vec3(b.mc0), d.J0 = spatial::sym3(b.J0);
  constexpr std::array<std::array<Index, 2>, 6> symmetric = {{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}}};
  const auto nonzeros = [&](const Matrix3d& M, size_t k, size_t l, std::vector<Entry>& out) {
    for (size_t c = 0; c < 6; ++c)
      if (const double v = M(symmetric[c][0], symmetric[c][1]); v != 0) out.push_back({k, l, c, v});
  };
  for (size_t k = 0; k < d.shapes; ++k) {
    const auto column = static_cast<Index>(k);
    d.Ct.push_back(spatial::vec3(b.Ct.col(column)));
    d.Cr0.push_back(spatial::vec3(b.Cr0.col(column)));
    nonzeros(b.J1[k], k, k, d.J1);
    for (size_t l = 0; l < d.shapes; ++l) {
      nonzeros(b.J2[k][l], k, l, d.J2);
      for (size_t c = 0; c < 3; ++c)
        if (const double v = b.Cr1[k](static_cast<Index>(c), static_cast<Index>(l)); v != 0)
          d.Cr1.push_back({k, l, c, v});
    }
  }
  return d;
}

PlaceData place_data(const Multibody& scene, const std::vector<Stiffening>& stiffening, const Place& place) {
  PlaceData p;
  p.body = place.body;
  if (!place.marker.empty()) {
    const ReducedBody& body = scene.bodies[static_cast<size_t>(place.body)];
    const Marker& m = marker(body, place.marker);
    p.flexible = body.n() > 0;
    p.S = m.S, p.S_theta = m.S_theta;
    if (p.flexible && p.S.cols() == 0) p.S = Eigen::Matrix3Xd::Zero(3, body.n());
    if (p.flexible && p.S_theta.cols() == 0) p.S_theta = Eigen::Matrix3Xd::Zero(3, body.n());
    for (const MarkerStiffness& K : body.Kg.markers) {  // a load on it does the work -1/2 q^T Kg q
      if (K.marker != place.marker || stiffening[static_cast<size_t>(place.body)] == Stiffening::off) continue;
      p.S_slope = entries_of(K.force, -1);
      p.theta_slope = entries_of(K.torque, -1);
    }
  }
  p.position = vec3(position_of(scene, place));
  p.axes = spatial::mat3(place.axes);
  return p;
}

}  // namespace redundant

using namespace redundant;

Multipliers::Multipliers(Multibody scene, std::vector<Stiffening> stiffening) : impl_(std::make_unique<Impl>()) {
  Impl& p = *impl_;
  p.scene = std::move(scene);
  require(!p.scene.bodies.empty(), "a multibody system needs a body");
  require(stiffening.size() == 1 || stiffening.size() == p.scene.bodies.size(),
          "geometric stiffness: one choice for all bodies or one per body is needed");
  p.stiffening = std::move(stiffening);
  p.stiffening.resize(p.scene.bodies.size(), p.stiffening.front());
  check(p.scene);
  for (size_t i = 0; i < p.scene.bodies.size(); ++i) p.bodies.push_back(body_data(p.scene.bodies[i], p.stiffening[i]));
  for (const Joint& j : p.scene.joints) {
    JointData d{place_data(p.scene, p.stiffening, j.a), place_data(p.scene, p.stiffening, j.b), joint_rows(j)};
    require(d.a.body != d.b.body, fmt::format("joint {}: both places are on one body", j.name));
    const HingeMechanism& m = j.mechanism;
    d.law = j.law.given();
    d.mechanism = d.law || m.stiffness != 0 || m.damping != 0 || m.stop_stiffness != 0;
    d.stop = m.stop_stiffness > 0 && !d.law;
    p.joints.push_back(std::move(d));
  }
  for (const SpringDamper& s : p.scene.springs)
    p.springs.push_back({place_data(p.scene, p.stiffening, s.a), place_data(p.scene, p.stiffening, s.b), {}});
  for (const Load& l : p.scene.loads) p.loads.push_back(place_data(p.scene, p.stiffening, l.at));
}

Multipliers::~Multipliers() = default;
Multipliers::Multipliers(Multipliers&&) noexcept = default;

const Multibody& Multipliers::multibody() const { return impl_->scene; }
Stiffening Multipliers::stiffening(int body) const { return impl_->stiffening[static_cast<size_t>(body)]; }

namespace {

struct Relative {
  Vector3d way = Vector3d::Zero(), way_rate = Vector3d::Zero();  // axes of a
  Matrix3d turn = Matrix3d::Identity();                          // axes of b -> of a
  Vector3d omega = Vector3d::Zero();                             // axes of a
};

Matrix3d about(const Vector3d& axis, double angle) { return Eigen::AngleAxisd(angle, axis).toRotationMatrix(); }

/// d/dt exp(v) = tilde(J_l(v) v_dot) exp(v).
Matrix3d left_jacobian(const Vector3d& v) {
  const double x = v.squaredNorm();
  return eigen(isotropic(1.0, rotation_series(x, 2), rotation_series(x, 3), vec3(v)));
}

Relative relative_motion(const Joint& joint, std::vector<double> c, std::vector<double> r) {
  const auto freedoms = static_cast<size_t>(joint_type(joint.kind).freedoms);
  for (std::vector<double>* list : {&c, &r}) {
    if (list->empty()) list->assign(freedoms, 0.0);
    require(list->size() == freedoms,
            fmt::format("joint \"{}\" has {} freedoms, {} values were given", joint.name, freedoms, list->size()));
  }
  Relative m;
  const Vector3d z = Vector3d::UnitZ();
  if (joint.kind == JointKind::hinge) m.turn = about(z, c[0]), m.omega = r[0] * z;
  if (joint.kind == JointKind::slider) m.way = c[0] * z, m.way_rate = r[0] * z;
  if (joint.kind == JointKind::universal) {
    m.turn = about(z, c[0]) * about(Vector3d::UnitY(), c[1]);
    m.omega = r[0] * z + about(z, c[0]) * Vector3d(0, r[1], 0);
  }
  const size_t first = joint.kind == JointKind::free ? 3 : 0;
  if (joint.kind == JointKind::spherical || joint.kind == JointKind::free) {
    const Vector3d v(c[first], c[first + 1], c[first + 2]), v_dot(r[first], r[first + 1], r[first + 2]);
    m.turn = rotation_matrix(quaternion_of(v));
    m.omega = left_jacobian(v) * v_dot;
  }
  if (joint.kind == JointKind::free) m.way = {c[0], c[1], c[2]}, m.way_rate = {r[0], r[1], r[2]};
  return m;
}

}  // namespace

std::vector<BodyState> place_bodies(const Multibody& scene, const std::vector<std::vector<double>>& coordinates,
                                    const std::vector<std::vector<double>>& rates) {
  require(coordinates.size() <= scene.joints.size() && rates.size() <= scene.joints.size(),
          "more lists of coordinates than joints");
  std::vector<BodyState> states(scene.bodies.size());
  std::vector<char> placed(scene.bodies.size(), 0);
  for (bool progress = true; progress;) {
    progress = false;
    for (size_t i = 0; i < scene.joints.size(); ++i) {
      const Joint& j = scene.joints[i];
      if (j.closes_loop || j.b.body < 0 || placed[static_cast<size_t>(j.b.body)]) continue;
      if (j.a.body >= 0 && !placed[static_cast<size_t>(j.a.body)]) continue;
      const Relative m = relative_motion(j, i < coordinates.size() ? coordinates[i] : std::vector<double>{},
                                         i < rates.size() ? rates[i] : std::vector<double>{});
      BodyState root;
      const BodyState& a = j.a.body < 0 ? root : states[static_cast<size_t>(j.a.body)];
      const Matrix3d A = rotation_matrix(a.attitude), axes = A * j.a.axes, B = axes * m.turn * j.b.axes.transpose();
      const Vector3d arm_a = A * position_of(scene, j.a), arm_b = B * position_of(scene, j.b);
      const Vector3d omega_a = A * a.omega, omega = omega_a + axes * m.omega, way = axes * m.way;
      BodyState& b = states[static_cast<size_t>(j.b.body)];
      b.position = a.position + arm_a + way - arm_b;
      b.velocity = a.velocity + omega_a.cross(arm_a + way) + axes * m.way_rate - omega.cross(arm_b);
      b.omega = B.transpose() * omega;
      b.attitude = quaternion_of_axes(B);
      placed[static_cast<size_t>(j.b.body)] = 1;
      progress = true;
    }
  }
  for (size_t i = 0; i < placed.size(); ++i)
    require(placed[i], fmt::format("body \"{}\" (number {}) is carried by no joint of the tree; a free body has a free "
                                   "joint from the inertial frame",
                                   scene.bodies[i].name, i));
  for (size_t i = 0; i < states.size(); ++i) {
    states[i].q = states[i].q_dot = VectorXd::Zero(scene.bodies[i].n());
    states[i].attitude.normalize();
  }
  return states;
}

std::vector<BodyState> close_joints(const Multipliers& system, const std::vector<BodyState>& states, double t) {
  Equations e(system.impl());
  VectorXd y = e.pack(states);
  // Rows that depend on others at one configuration need not do so at the next.
  for (int round = 0; round < 3; ++round) {
    e.keep_rows(constraint_rank(e, t, y.data()).kept);
    y.conservativeResize(e.size());
    e.project(t, y);
  }
  Equations::RowValues values;
  e.row_values(t, y.data(), values);
  const Violation v = violation(e, values.g);
  if (!(v.position < 1e-9 && v.angle < 1e-9)) {
    const bool place = !(v.position < 1e-9);
    throw InputError(fmt::format("{} does not close: {:.3g} {} are left",
                                 describe(e, place ? v.worst_position : v.worst_angle), place ? v.position : v.angle,
                                 place ? "m" : "rad"));
  }
  check_branches(e, t, y.data());
  return e.unpack(y.data());
}

}  // namespace flexboom
