#include "reduction/invariants/root_loads.hpp"

#include "fem/base/check.hpp"
#include "reduction/basis/mode_selection.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <numbers>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Coordinates, or zeros for none.
VectorXd coordinates(const ReducedBody& body, const VectorXd& q, const char* name) {
  if (q.size() != 0 && q.size() != body.n())
    throw InputError(
        fmt::format("body \"{}\": motion has {} values of {}, must have {}", body.name, q.size(), name, body.n()));
  return q.size() > 0 ? q : VectorXd::Zero(body.n());
}

/// Jdot = sum q_dot_k (J1[k] + 2 sum q_l J2[k][l]).
Matrix3d inertia_rate(const ReducedBody& body, const VectorXd& q, const VectorXd& q_dot) {
  Matrix3d J_dot = Matrix3d::Zero();
  for (Index k = 0; k < body.n(); ++k) {
    const auto kk = static_cast<size_t>(k);
    J_dot += q_dot(k) * body.J1[kk];
    for (Index l = 0; l < body.n(); ++l) J_dot += 2 * q_dot(k) * q(l) * body.J2[kk][static_cast<size_t>(l)];
  }
  return J_dot;
}

}  // namespace

DeformedInertia deformed_inertia(const ReducedBody& body, const VectorXd& q) {
  DeformedInertia r{body.mc0 + body.Ct * q, body.J0, body.Cr0};
  for (Index k = 0; k < body.n(); ++k) {
    const auto kk = static_cast<size_t>(k);
    r.J += q(k) * body.J1[kk];
    r.Cr += q(k) * body.Cr1[kk];
    for (Index l = 0; l < body.n(); ++l) r.J += q(k) * q(l) * body.J2[kk][static_cast<size_t>(l)];
  }
  return r;
}

BodyMomenta momenta(const ReducedBody& body, const BodyMotion& motion) {
  const Vector3d &v = motion.v, &w = motion.omega;
  const VectorXd q = coordinates(body, motion.q, "q"), q_dot = coordinates(body, motion.q_dot, "q_dot");
  const auto& [mc, J, Cr] = deformed_inertia(body, q);
  const Vector3d slid = body.Ct * q_dot, turned = Cr * q_dot;
  const double elastic = q_dot.dot(body.Me * q_dot);
  // P = m v + w x mc + Ct q_dot, H = mc x v + J w + Cr q_dot,
  // 2 T = v . P + w . H + q_dot . (Ct^T v + Cr^T w + Me q_dot)
  BodyMomenta r;
  r.linear = body.m * v + w.cross(mc) + slid;
  r.angular = mc.cross(v) + J * w + turned;
  r.kinetic = (v.dot(r.linear) + w.dot(r.angular) + v.dot(slid) + w.dot(turned) + elastic) / 2;
  return r;
}

RootLoads root_loads(const ReducedBody& body, const BodyMotion& motion, const std::vector<MarkerLoad>& loads) {
  const VectorXd q = coordinates(body, motion.q, "q"), q_dot = coordinates(body, motion.q_dot, "q_dot"),
                 q_ddot = coordinates(body, motion.q_ddot, "q_ddot");
  const auto& [mc, J, Cr] = deformed_inertia(body, q);
  const Vector3d& w = motion.omega;
  RootLoads r;
  r.force = body.m * motion.a + motion.alpha.cross(mc) + body.Ct * q_ddot +
            w.cross(w.cross(mc) + 2 * Vector3d(body.Ct * q_dot));
  r.moment = mc.cross(motion.a) + J * motion.alpha + Cr * q_ddot + w.cross(J * w + Cr * q_dot) +
             inertia_rate(body, q, q_dot) * w;
  for (const MarkerLoad& load : loads) {
    const Marker& at = marker(body, load.marker);
    r.force -= load.force;
    r.moment -= load.torque + Vector3d(at.position + at.S * q).cross(load.force);
  }
  return r;
}

MatrixXd root_load_participation(const ReducedBody& body) {
  MatrixXd L = rigid_coupling(body);
  for (Index k = 0; k < body.n(); ++k) {
    const double omega = 2 * std::numbers::pi * body.coordinates[static_cast<size_t>(k)].frequency_hz;
    L.col(k) *= omega * omega;
  }
  return L;
}

}  // namespace flexboom
