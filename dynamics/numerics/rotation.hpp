#pragma once

#include "reduction/body/tilde.hpp"

#include <Eigen/Geometry>

#include <cmath>

namespace flexboom {

/// Rotation vector [rad] of a unit quaternion (w, x, y, z), angle in [0, pi]; exact for small angles.
inline Eigen::Vector3d rotation_vector(const Eigen::Vector4d& q) {
  const Eigen::Vector3d v = (q[0] < 0 ? -1.0 : 1.0) * q.tail<3>();
  const double s = v.norm();
  const double w = std::abs(q[0]);
  return s < 1e-150 ? Eigen::Vector3d(2 * v) : Eigen::Vector3d((2 * std::atan2(s, w) / s) * v);
}

/// The quaternion (w, x, y, z) of a rotation vector [rad], exact for small angles.
inline Eigen::Vector4d quaternion_of(const Eigen::Vector3d& theta) {
  const double half = 0.5 * theta.norm();
  const double s = half < 1e-4 ? 0.5 * (1 - half * half / 6) : 0.5 * std::sin(half) / half;
  return {std::cos(half), s * theta.x(), s * theta.y(), s * theta.z()};
}

/// The quaternion (w, x, y, z) of a rotation matrix.
inline Eigen::Vector4d quaternion_of_axes(const Eigen::Matrix3d& A) {
  const Eigen::Quaterniond q(A);
  return {q.w(), q.x(), q.y(), q.z()};
}

/// Rotation matrix body -> inertial of a quaternion (w, x, y, z), normalised first.
inline Eigen::Matrix3d rotation_matrix(const Eigen::Vector4d& q) {
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
}

/// Product of two quaternions (w, x, y, z).
inline Eigen::Vector4d quaternion_product(const Eigen::Vector4d& a, const Eigen::Vector4d& b) {
  const Eigen::Quaterniond c = Eigen::Quaterniond(a[0], a[1], a[2], a[3]) * Eigen::Quaterniond(b[0], b[1], b[2], b[3]);
  return {c.w(), c.x(), c.y(), c.z()};
}

}  // namespace flexboom
