#include "dynamics/rotation.hpp"
#include "dynamics/system.hpp"
#include "reduction/root_loads.hpp"

#include <algorithm>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::Ref;
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

  /// v, w in the axes of the body, A: these -> inertial, R: its BRF origin.
  void add(const ReducedBody& b, const Vector3d& v, const Vector3d& w, const Ref<const VectorXd>& q,
           const Ref<const VectorXd>& q_dot, const Matrix3d& A, const Vector3d& R) {
    const BodyMomenta of_body = momenta(b, v, w, q, q_dot);
    const Vector3d P = A * of_body.linear;
    const Vector3d H = A * of_body.angular;
    balance.kinetic += of_body.kinetic;
    balance.momentum += P;
    balance.momentum_scale += P.norm();
    balance.angular_momentum += H + R.cross(P);
    balance.angular_momentum_scale += H.norm();
    m += b.m;
    first_moment += b.m * R + A * b.mc0;
    if (b.n() > 0) first_moment += A * Vector3d(b.Ct.lazyProduct(q));
  }
};

}  // namespace

Balance System::balance(const Eigen::Ref<const VectorXd>& y) const {
  const Layout& l = layout();
  Matrix3d A = Matrix3d::Identity();
  Vector3d R = Vector3d::Zero(), V = Vector3d::Zero(), omega = Vector3d::Zero();
  Totals totals;
  if (!fixed_hub()) {
    A = rotation_matrix(y.segment<4>(l.attitude()));
    R = y.segment<3>(l.position());
    V = y.segment<3>(l.velocity());
    omega = y.segment<3>(l.u_begin());
    const auto none = y.head(0);
    totals.add(hub(), A.transpose() * V, omega, none, none, A, R);
  }
  for (size_t i = 0; i < appendages().size(); ++i) {
    const Appendage& a = appendages()[i];
    const int at = l.body[i], rate = l.u_begin() + l.base + at, n = a.body.n();
    const double angle = y[at] + a.hinge.mechanism.threshold;
    const auto q = y.segment(at + 1, n), q_dot = y.segment(rate + 1, n);
    const Matrix3d C = boom_to_hub(static_cast<int>(i), angle);
    const Vector3d v = C.transpose() * (A.transpose() * V + omega.cross(a.hinge.point));
    const Vector3d w = C.transpose() * omega + y[rate] * Vector3d::UnitZ();
    totals.add(a.body, v, w, q, q_dot, A * C, R + A * a.hinge.point);
    totals.balance.elastic += hinge_energy(a.hinge.mechanism, angle);
    if (n > 0) totals.balance.elastic += 0.5 * q.dot(a.body.Ke.lazyProduct(q));
  }
  totals.balance.angular_momentum -= (totals.first_moment / totals.m).cross(totals.balance.momentum);
  return totals.balance;
}

Whole System::whole(const Eigen::Ref<const VectorXd>& y) const {
  const Layout& l = layout();
  const Vector3d omega = y.segment<3>(l.u_begin());
  // What |r + b|^2 I - (r + b) (r + b)^T has beyond those of r and of b.
  const auto crossed = [](const Vector3d& r, const Vector3d& b) -> Matrix3d {
    return 2 * r.dot(b) * Matrix3d::Identity() - r * b.transpose() - b * r.transpose();
  };
  double m = hub().m;
  Vector3d moment = hub().mc0, rate = Vector3d::Zero();
  Matrix3d J = hub().J0;
  for (size_t i = 0; i < appendages().size(); ++i) {
    const Appendage& a = appendages()[i];
    const ReducedBody& b = a.body;
    const int at = l.body[i], turn = l.u_begin() + l.base + at;
    const Matrix3d C = boom_to_hub(static_cast<int>(i), y[at] + a.hinge.mechanism.threshold);
    Vector3d mc = b.mc0, mc_rate = Vector3d::Zero();
    Matrix3d own = b.J0;
    for (int k = 0; k < b.n(); ++k) {
      mc += b.Ct.col(k) * y[at + 1 + k];
      mc_rate += b.Ct.col(k) * y[turn + 1 + k];
      own += b.J1[static_cast<size_t>(k)] * y[at + 1 + k];
    }
    const Vector3d& d = a.hinge.point;
    const Vector3d out = C * mc;
    m += b.m;
    moment += b.m * d + out;
    rate += C * (y[turn] * Vector3d::UnitZ().cross(mc) + mc_rate);
    J += C * own * C.transpose() + crossed(d, out) + 0.5 * b.m * crossed(d, d);
  }
  const Vector3d c = moment / m;
  return {c, omega.cross(c) + rate / m, J - 0.5 * m * crossed(c, c)};
}

}  // namespace flexboom
