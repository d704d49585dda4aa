#pragma once

#include <Eigen/Core>

namespace flexboom {

/// tilde(a) b = a x b.
inline Eigen::Matrix3d tilde(const Eigen::Vector3d& a) {
  Eigen::Matrix3d A;
  A << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return A;
}

/// sum dm a x b of W = sum dm a b^T.
inline Eigen::Vector3d axial(const Eigen::Matrix3d& W) {
  return {W(1, 2) - W(2, 1), W(2, 0) - W(0, 2), W(0, 1) - W(1, 0)};
}

}  // namespace flexboom
