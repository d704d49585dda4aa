#include "dynamics/rotation.hpp"
#include "dynamics/system.hpp"
#include "reduction/root_loads.hpp"

#include <algorithm>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

double hinge_energy(const HingeMechanism& m, double angle) {
  const double stretch = angle - m.rest, depth = std::max(0.0, angle - m.threshold);
  return 0.5 * m.stiffness * stretch * stretch + 0.5 * m.stop_stiffness * depth * depth;
}

/// Sums over the bodies, about the inertial origin.
struct Totals {
  Balance balance;
  double m = 0;
  Vector3d first_moment = Vector3d::Zero();

  /// `motion` in the axes of the body, A: these -> inertial, R: its BRF origin.
  void add(const ReducedBody& b, const BodyMotion& motion, const Matrix3d& A, const Vector3d& R) {
    const BodyMomenta of_body = momenta(b, motion);
    const Vector3d P = A * of_body.linear;
    const Vector3d H = A * of_body.angular;
    balance.kinetic += of_body.kinetic;
    balance.momentum += P;
    balance.momentum_scale += P.norm();
    balance.angular_momentum += H + R.cross(P);
    balance.angular_momentum_scale += H.norm();
    m += b.m;
    first_moment += b.m * R + A * b.mc0;
    if (b.n() > 0) first_moment += A * (b.Ct * motion.q);
  }
};

}  // namespace

Balance System::balance(const Eigen::Ref<const VectorXd>& y) const {
  const State s = unpack(y);
  const Matrix3d A = fixed_hub() ? Matrix3d::Identity() : rotation_matrix(s.attitude);
  Totals totals;
  if (!fixed_hub()) totals.add(hub(), {.v = A.transpose() * s.velocity, .omega = s.omega}, A, s.position);
  for (size_t i = 0; i < appendages().size(); ++i) {
    const Appendage& a = appendages()[i];
    const Matrix3d C = boom_to_hub(static_cast<int>(i), s.angle[i]);
    const Vector3d v = C.transpose() * (A.transpose() * s.velocity + s.omega.cross(a.hinge.point));
    const Vector3d w = C.transpose() * s.omega + s.rate[i] * Vector3d::UnitZ();
    totals.add(a.body, {.v = v, .omega = w, .q = s.q[i], .q_dot = s.q_dot[i]}, A * C, s.position + A * a.hinge.point);
    totals.balance.elastic += hinge_energy(a.hinge.mechanism, s.angle[i]);
    if (a.body.n()) totals.balance.elastic += 0.5 * s.q[i].dot(a.body.Ke * s.q[i]);
  }
  totals.balance.angular_momentum -= (totals.first_moment / totals.m).cross(totals.balance.momentum);
  return totals.balance;
}

}  // namespace flexboom
