#pragma once

// What the files of System share. Internal to `dynamics`.

#include "dynamics/workspace.hpp"

#include <optional>
#include <vector>

namespace flexboom {

struct System::Impl {
  ReducedBody hub;
  std::vector<Appendage> appendages;
  bool fixed_hub = false;
  std::optional<OrbitalField> field;
  Layout layout;
  equations::Model model;
};

/// 1/2 quaternion * (0, omega).
inline void quaternion_rate(const double* q, const double* w, double* q_dot) {
  q_dot[0] = 0.5 * (-q[1] * w[0] - q[2] * w[1] - q[3] * w[2]);
  q_dot[1] = 0.5 * (q[0] * w[0] + q[2] * w[2] - q[3] * w[1]);
  q_dot[2] = 0.5 * (q[0] * w[1] + q[3] * w[0] - q[1] * w[2]);
  q_dot[3] = 0.5 * (q[0] * w[2] + q[1] * w[1] - q[2] * w[0]);
}

/// Vector from hub to inertial axes by a quaternion that is unit up to integration error.
inline Eigen::Vector3d to_inertial(const double* q, const Eigen::Vector3d& a) {
  const Eigen::Vector3d v(q[1], q[2], q[3]);
  const Eigen::Vector3d t = 2 * v.cross(a);
  return a + q[0] * t + v.cross(t);
}

}  // namespace flexboom
