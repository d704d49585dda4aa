#include "dynamics/environment/gravity.hpp"

#include "fem/base/check.hpp"
#include "reduction/invariants/root_loads.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::Vector3d;

LocalGravity OrbitalField::at(double t, const Vector3d& rho) const {
  const Vector3d R = orbit.at(t).position;
  const Planet& planet = orbit.planet();
  if (exact) return {differential_gravity(planet, R, rho), strength * gravity_gradient(planet, R + rho)};
  const Matrix3d G = gravity_gradient(planet, R);
  return {G * rho, strength * G};
}

// With u = u0 + S q and the second moment sum dm u u^T = tr(J)/2 I - J, and tr G = 0:
// force m a + G mc; torque mc x a + axial(G J); modal Ct^T a - 1/2 G : dJ/dq_k.
BodyGravity body_gravity(const ReducedBody& b, const LocalGravity& field, const Eigen::VectorXd& q) {
  if (q.size() != b.n())
    throw InputError(fmt::format("body {}: {} elastic coordinates are given, it has {}", b.name, q.size(), b.n()));
  const DeformedInertia d = deformed_inertia(b, q);
  const Matrix3d& G = field.gradient;
  const Matrix3d GJ = G * d.J;
  BodyGravity r;
  r.force = b.m * field.acceleration + G * d.mc;
  r.torque = d.mc.cross(field.acceleration) + Vector3d(GJ(1, 2) - GJ(2, 1), GJ(2, 0) - GJ(0, 2), GJ(0, 1) - GJ(1, 0));
  r.modal = b.Ct.transpose() * field.acceleration;
  for (Eigen::Index k = 0; k < b.n(); ++k) {
    Matrix3d slope = b.J1[static_cast<size_t>(k)];
    for (Eigen::Index l = 0; l < b.n(); ++l) slope += 2 * q[l] * b.J2[static_cast<size_t>(k)][static_cast<size_t>(l)];
    r.modal[k] -= 0.5 * G.cwiseProduct(slope).sum();
  }
  return r;
}

}  // namespace flexboom
