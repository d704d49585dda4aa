#include "dynamics/environment/gravity.hpp"

#include "dynamics/numerics/rotation.hpp"
#include "dynamics_testing.hpp"
#include "fem/base/check.hpp"

#include <gtest/gtest.h>

namespace flexboom {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Sums over the points of a body of made-up shapes, with the field of each point: no invariants.
TEST(BodyGravity, EqualsTheSumOverPointMasses) {
  std::mt19937 random(7);
  const testing::PointBody p = testing::random_point_body(random, 40, 3, "points");
  const VectorXd q = Vector3d(0.02, -0.05, 0.03);
  const Matrix3d A = rotation_matrix(Eigen::Vector4d(0.5, -0.3, 0.7, 0.2));
  for (const double J2 : {0.0, earth_J2})
    for (const double r : {7e6, 1e3}) {
      const Planet planet{.mu = 3.986e14 * std::pow(r / 7e6, 3), .radius = 0.9 * r, .J2 = J2};
      const Orbit orbit({.semi_major_axis = r, .inclination = 0.9, .mean_anomaly = 0.4}, planet, 10);
      const Vector3d R = orbit.at(0).position, rho(0.02 * r, -0.01 * r, 0.015 * r);
      const BodyGravity g = body_gravity(p.body, OrbitalField{orbit}.at(0, rho).in_axes(A), q);
      Vector3d force = Vector3d::Zero(), torque = force;
      VectorXd modal = VectorXd::Zero(3);
      for (size_t i = 0; i < p.dm.size(); ++i) {
        const Vector3d u = p.u0[i] + p.S[i] * q;
        const Vector3d f = p.dm[i] * A.transpose() * differential_gravity(planet, R, rho + A * u);
        force += f;
        torque += u.cross(f);
        modal += p.S[i].transpose() * f;
      }
      const double left_out = 6 / r;  // second order of a body of about 1 m, less than 3 (u / r)
      const double scale = (gravity_gradient(planet, R) * Vector3d::Ones()).norm() * p.body.m;
      EXPECT_LT((g.force - force).norm(), (1e-14 * rho.norm() + left_out) * scale);
      EXPECT_LT((g.torque - torque).norm(), (1e-14 * rho.norm() + left_out) * scale);
      EXPECT_LT((g.modal - modal).norm(), (1e-14 * rho.norm() + left_out) * scale);
    }
}

TEST(BodyGravity, RigidBodyFeelsTheGradientTorque) {
  const Matrix3d J = (Matrix3d() << 3, 0.2, -0.1, 0.2, 2, 0.3, -0.1, 0.3, 1.5).finished();
  const ReducedBody body = rigid_body("body", 10, Vector3d::Zero(), J);
  const Orbit orbit(circular_orbit(405e3, 0.9), {});
  const Vector3d R = orbit.at(1000).position;
  const Matrix3d A = rotation_matrix(Eigen::Vector4d(0.5, -0.3, 0.7, 0.2));
  const Vector3d c = A.transpose() * R.normalized();
  const Vector3d expected = 3 * orbit.planet().mu / std::pow(R.norm(), 3) * c.cross(J * c);
  const BodyGravity g = body_gravity(body, OrbitalField{orbit}.at(1000, Vector3d::Zero()).in_axes(A), VectorXd());
  EXPECT_LT((g.torque - expected).norm(), 1e-14 * expected.norm());
  EXPECT_EQ(g.force, Vector3d::Zero().eval());
}

/// The linear field within the body and the exact one between its origins: same forces about another origin.
TEST(BodyGravity, DoesNotDependOnTheOrigin) {
  const Orbit orbit(circular_orbit(405e3, 0.9), {.J2 = earth_J2}, 10);
  const LocalGravity here = OrbitalField{orbit}.at(3, {20, -30, 10});
  const Vector3d d(0.3, -0.2, 0.1), mc(1, 2, -1);
  const Matrix3d J0 = 20 * Matrix3d::Identity();
  const double m = 4;
  const Matrix3d moved = J0 - tilde(d) * tilde(mc) - tilde(mc) * tilde(d) - m * tilde(d) * tilde(d);
  const BodyGravity a = body_gravity(rigid_body("a", m, mc, J0), here.at(d), VectorXd());
  const BodyGravity b = body_gravity(rigid_body("b", m, mc + m * d, moved), here, VectorXd());
  EXPECT_LT((a.force - b.force).norm(), 1e-14 * a.force.norm());
  EXPECT_LT((a.torque + d.cross(a.force) - b.torque).norm(), 1e-13 * b.torque.norm());
  EXPECT_THROW(body_gravity(rigid_body("a", m, mc, J0), here, VectorXd::Zero(1)), InputError);
}

}  // namespace
}  // namespace flexboom
