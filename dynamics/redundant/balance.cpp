#include "dynamics/redundant/balance.hpp"

#include "dynamics/events/conservation.hpp"
#include "dynamics/numerics/rotation.hpp"

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
      b.kinetic += h * h / (2 * w.inertia);
    }
    b.kinetic += of.kinetic;
    b.bodies += of.kinetic;
    b.momentum += of.linear;
    b.momentum_scale += of.linear.norm();
    b.angular_momentum += of.angular + s.position.cross(of.linear);
    b.angular_momentum_scale += of.angular.norm();
    m += body.m;
    first_moment += body.m * s.position + of.first_moment;
  }
  b.angular_momentum -= (first_moment / m).cross(b.momentum);
  b.ledger = equations.ledger(y.data(), memory);
  b.elastic = b.ledger.stored(), b.dissipated = b.ledger.lost(), b.work = y[equations.work()];
  b.potential = 0 - scene.gravity.dot(first_moment);
  return b;
}

void set_drifts(const Multibody& scene, const MotionScales& before, MultibodyTrajectory& r) {
  Conservation kept(scene.bodies, before);
  for (const Balance& b : r.balance) kept.add(b);
  r.summary.largest = kept.largest();
  r.summary.energy_balance = kept.energy_balance();
  if (is_isolated(scene)) r.summary.momentum_drift = kept.momentum_drift();
}

}  // namespace flexboom::redundant
