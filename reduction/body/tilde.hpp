#pragma once

#include <Eigen/Core>

namespace flexboom {

/// tilde(a) b = a x b.
inline Eigen::Matrix3d tilde(const Eigen::Vector3d& a) {
  Eigen::Matrix3d A;
  A << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return A;
}

}  // namespace flexboom
