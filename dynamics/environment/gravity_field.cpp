#include "dynamics/environment/gravity_field.hpp"

#include <cmath>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/// (1 + e)^(-k/2) - 1 = -((1 + e)^k - 1) / ((1 + e)^k + (1 + e)^(k/2)) for odd k, without subtraction at small e.
double power_difference(double e, int k) {
  const double s = 1 + e;
  double sum = 0, power = 1;  // (1 + e)^k - 1 = e (1 + s + ... + s^(k-1))
  for (int i = 0; i < k; ++i, power *= s) sum += power;
  return -e * sum / (power + std::sqrt(power));
}

/// -3/2 J2 mu radius^2.
double oblateness(const Planet& p) { return -1.5 * p.J2 * p.mu * p.radius * p.radius; }

}  // namespace

// With z = r . pole: g = -mu r / r^3 - 3/2 J2 mu radius^2 [r / r^5 - 5 z^2 r / r^7 + 2 z pole / r^5].
Vector3d gravity(const Planet& p, const Vector3d& r) {
  const double d2 = r.squaredNorm();
  return -p.mu / (d2 * std::sqrt(d2)) * r + oblateness_gravity(p, r);
}

Vector3d oblateness_gravity(const Planet& p, const Vector3d& r) {
  if (p.J2 == 0) return Vector3d::Zero();
  const double d2 = r.squaredNorm(), d5 = d2 * d2 * std::sqrt(d2), z = r.dot(p.pole);
  return oblateness(p) / d5 * ((1 - 5 * z * z / d2) * r + 2 * z * p.pole);
}

// The difference of each product, factor by factor: D(a b) = Da b(R + rho) + a(R) Db.
Vector3d differential_gravity(const Planet& p, const Vector3d& R, const Vector3d& rho) {
  const double D2 = R.squaredNorm(), D3 = D2 * std::sqrt(D2);
  const double e = rho.dot(2 * R + rho) / D2;
  const Vector3d r = R + rho;
  const double f3 = power_difference(e, 3);
  Vector3d g = -p.mu / D3 * (rho + f3 * r);
  if (p.J2 == 0) return g;
  const double Z = R.dot(p.pole), dz = rho.dot(p.pole), z = Z + dz;
  const double f5 = power_difference(e, 5), f7 = power_difference(e, 7);
  const Vector3d along = rho + f5 * r;                                                        // of r / r^5, times R^5
  const Vector3d squared = (dz * (2 * Z + dz) * (1 + f7) * r + Z * Z * (rho + f7 * r)) / D2;  // of z^2 r / r^7
  g += oblateness(p) / (D3 * D2) * (along - 5 * squared + 2 * (dz + f5 * z) * p.pole);
  return g;
}

Matrix3d gravity_gradient(const Planet& p, const Vector3d& r) {
  const double d2 = r.squaredNorm(), d3 = d2 * std::sqrt(d2);
  const Vector3d c = r / std::sqrt(d2);
  Matrix3d G = p.mu / d3 * (3 * c * c.transpose() - Matrix3d::Identity());
  if (p.J2 == 0) return G;
  const double s = c.dot(p.pole);
  const Matrix3d mixed = c * p.pole.transpose() + p.pole * c.transpose();
  G += oblateness(p) / (d3 * d2) *
       ((1 - 5 * s * s) * Matrix3d::Identity() + (35 * s * s - 5) * c * c.transpose() - 10 * s * mixed +
        2 * p.pole * p.pole.transpose());
  return G;
}

}  // namespace flexboom
