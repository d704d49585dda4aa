#include "dynamics/multipliers_balance.hpp"

#include "dynamics/multipliers_scales.hpp"

#include "dynamics/rotation.hpp"

#include <algorithm>
#include <cmath>

namespace flexboom::redundant {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

Balance balance_of(const Equations& equations, const VectorXd& y, const JointMemory& memory) {
  const Multibody& scene = equations.scene();
  Balance b;
  double m = 0;
  Vector3d first_moment = Vector3d::Zero();
  const std::vector<BodyState> states = equations.unpack(y.data());
  for (size_t i = 0; i < states.size(); ++i) {
    const BodyState& s = states[i];
    const ReducedBody& body = scene.bodies[i];
    const Matrix3d A = rotation_matrix(s.attitude);
    Equations::Momenta of = equations.momenta(i, y.data());
    for (size_t k = 0; k < scene.wheels.size(); ++k) {
      const ReactionWheel& w = scene.wheels[k];
      if (w.body != static_cast<int>(i)) continue;
      const double h = y[equations.wheel(k)];
      of.angular += A * (h * w.axis);
      of.kinetic += h * h / (2 * w.inertia);
    }
    b.kinetic += of.kinetic;
    b.momentum += of.linear;
    b.momentum_scale += of.linear.norm();
    b.angular_momentum += of.angular + s.position.cross(of.linear);
    b.angular_momentum_scale += of.angular.norm();
    m += body.m;
    first_moment += body.m * s.position + of.first_moment;
  }
  b.angular_momentum -= (first_moment / m).cross(b.momentum);
  b.elastic = equations.potential(y.data(), memory);
  return b;
}

bool is_held(const Multibody& scene) {
  const auto grounded = [](const auto& pair) { return pair.a.body < 0 || pair.b.body < 0; };
  return std::ranges::any_of(scene.joints, [&](const Joint& j) { return j.kind != JointKind::free && grounded(j); }) ||
         std::ranges::any_of(scene.springs, grounded);
}

bool is_isolated(const Multibody& scene) { return scene.loads.empty() && scene.gravity.isZero(0) && !is_held(scene); }

void set_drifts(const Multibody& scene, MultibodyTrajectory& r) {
  MultipliersSummary& s = r.summary;
  const Balance& first = r.balance.front();
  double energy = 0, gap = 0, dP = 0, dH = 0, P = 0, H = 0;
  for (size_t i = 0; i < r.time.size(); ++i) {
    const Balance& b = r.balance[i];
    const MultibodyState &at = r.states[i], &start = r.states.front();
    energy = std::max({energy, std::abs(b.kinetic) + std::abs(b.elastic), std::abs(at.work), at.dissipated});
    const double since = at.dissipated - start.dissipated - (at.work - start.work);
    gap = std::max(gap, std::abs(b.kinetic + b.elastic - first.kinetic - first.elastic + since));
    dP = std::max(dP, (b.momentum - first.momentum).norm());
    dH = std::max(dH, (b.angular_momentum - first.angular_momentum).norm());
    P = std::max(P, b.momentum_scale);
    H = std::max(H, b.angular_momentum_scale);
  }
  s.energy_balance = energy > nothing * slow_energy(scene) ? gap / energy : 0;
  if (is_isolated(scene)) s.momentum_drift = std::max(P > 0 ? dP / P : 0, H > 0 ? dH / H : 0);
}

}  // namespace flexboom::redundant
