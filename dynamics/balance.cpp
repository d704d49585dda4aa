#include "dynamics/rotation.hpp"
#include "dynamics/system.hpp"

#include <algorithm>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/// Momenta of one body about its BRF origin, and its kinetic energy, all in BRF axes (FORMULATION 2, 3): straight from
/// the invariants.
struct BodyMotion {
  double kinetic = 0;
  double m = 0;
  Vector3d mc, momentum, angular_momentum;
};

BodyMotion body_motion(const ReducedBody& b, const Vector3d& v, const Vector3d& w, const VectorXd& q,
                       const VectorXd& q_dot) {
  Matrix3d J = b.J0;
  Matrix3Xd Cr = b.Cr0;
  for (int k = 0; k < b.n(); ++k) {
    const auto ku = static_cast<size_t>(k);
    J += q[k] * b.J1[ku];
    Cr += q[k] * b.Cr1[ku];
    for (int l = 0; l < b.n(); ++l) J += q[k] * q[l] * b.J2[ku][static_cast<size_t>(l)];
  }
  BodyMotion r;
  r.m = b.m;
  r.mc = b.mc0;
  Vector3d flow = Vector3d::Zero(), swirl = Vector3d::Zero();
  if (b.n()) {
    r.mc += b.Ct * q;
    flow = b.Ct * q_dot;
    swirl = Cr * q_dot;
    r.kinetic = 0.5 * q_dot.dot(b.Me * q_dot);
  }
  r.momentum = b.m * v + w.cross(r.mc) + flow;
  r.angular_momentum = r.mc.cross(v) + J * w + swirl;
  r.kinetic += 0.5 * b.m * v.squaredNorm() + 0.5 * w.dot(J * w) + v.dot(w.cross(r.mc)) + v.dot(flow) + w.dot(swirl);
  return r;
}

double hinge_energy(const HingeMechanism& m, double angle) {
  const double stretch = angle - m.rest, depth = std::max(0.0, angle - m.threshold);
  return 0.5 * m.stiffness * stretch * stretch + 0.5 * m.stop_stiffness * depth * depth;
}

/// Sums over the bodies, about the inertial origin.
struct Totals {
  Balance balance;
  double m = 0;
  Vector3d first_moment = Vector3d::Zero();

  void add(const BodyMotion& b, const Matrix3d& A, const Vector3d& R) {
    const Vector3d P = A * b.momentum;
    const Vector3d H = A * b.angular_momentum;
    balance.kinetic += b.kinetic;
    balance.momentum += P;
    balance.momentum_scale += P.norm();
    balance.angular_momentum += H + R.cross(P);
    balance.angular_momentum_scale += H.norm();
    m += b.m;
    first_moment += b.m * R + A * b.mc;
  }
};

}  // namespace

Balance System::balance(const Eigen::Ref<const VectorXd>& y) const {
  const State s = unpack(y);
  const Matrix3d A = fixed_hub() ? Matrix3d::Identity() : rotation_matrix(s.attitude);
  Totals totals;
  const VectorXd none(0);
  if (!fixed_hub()) totals.add(body_motion(hub(), A.transpose() * s.velocity, s.omega, none, none), A, s.position);
  for (size_t i = 0; i < appendages().size(); ++i) {
    const Appendage& a = appendages()[i];
    const Matrix3d C = boom_to_hub(static_cast<int>(i), s.angle[i]);
    const Vector3d v = C.transpose() * (A.transpose() * s.velocity + s.omega.cross(a.hinge.point));
    const Vector3d w = C.transpose() * s.omega + s.rate[i] * Vector3d::UnitZ();
    totals.add(body_motion(a.body, v, w, s.q[i], s.q_dot[i]), A * C, s.position + A * a.hinge.point);
    totals.balance.elastic += hinge_energy(a.hinge.mechanism, s.angle[i]);
    if (a.body.n()) totals.balance.elastic += 0.5 * s.q[i].dot(a.body.Ke * s.q[i]);
  }
  totals.balance.angular_momentum -= (totals.first_moment / totals.m).cross(totals.balance.momentum);
  return totals.balance;
}

}  // namespace flexboom
