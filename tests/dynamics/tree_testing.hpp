#pragma once

#include "dynamics/relative/split.hpp"
#include "dynamics_testing.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <string>

namespace flexboom::testing {

/// Place with the given axes.
inline Place place(int body, const Eigen::Vector3d& position = Eigen::Vector3d::Zero(),
                   const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity()) {
  return {.body = body, .marker = {}, .position = position, .axes = axes};
}

inline Place at_marker(int body, const std::string& marker, const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity()) {
  return {.body = body, .marker = marker, .position = Eigen::Vector3d::Zero(), .axes = axes};
}

inline Joint joint(const std::string& name, JointKind kind, const Place& a, const Place& b) {
  Joint j;
  j.name = name, j.kind = kind, j.a = a, j.b = b;
  return j;
}

inline Eigen::Matrix3d random_rotation(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  return Eigen::Quaterniond(uniform(random), uniform(random), uniform(random), uniform(random))
      .normalized()
      .toRotationMatrix();
}

/// A wave.
inline TimeFunction swing(double size) {
  return {[size](double t) { return size * std::sin(1.3 * t + 0.4); },
          [size](double t) { return 1.3 * size * std::cos(1.3 * t + 0.4); },
          [size](double t) { return -1.69 * size * std::sin(1.3 * t + 0.4); }};
}

/// Is the mass centre by itself that of all that floats?
inline void expect_same_mass_centre(const Tree& tree, const Eigen::VectorXd& y) {
  const auto problem = split(tree);
  const MassCentre centre = problem->mass_centre(0, 0, y.data()), of_all = problem->floating(0, 0, y.data()).centre;
  EXPECT_LT((centre.position - of_all.position).norm(), 1e-13 * (1 + of_all.position.norm()));
  EXPECT_LT((centre.velocity - of_all.velocity).norm(), 1e-13 * (1 + of_all.velocity.norm()));
}

/// Random joint states, small random deflections, everything moving.
inline TreeState random_state(const Tree& tree, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto noise = [&] { return uniform(random); };
  TreeState s = tree.at_rest();
  for (JointState& j : s.joints) {
    for (double& x : j.coordinate) x = noise();
    for (double& x : j.rate) x = noise();
    j.attitude = Eigen::Vector4d::NullaryExpr(noise).normalized();
    j.omega = Eigen::Vector3d::NullaryExpr(noise);
    j.position = Eigen::Vector3d::NullaryExpr(noise);
    j.velocity = Eigen::Vector3d::NullaryExpr(noise);
  }
  for (size_t i = 0; i < s.q.size(); ++i) {
    s.q[i] = 0.2 * Eigen::VectorXd::NullaryExpr(s.q[i].size(), noise);
    s.q_dot[i] = Eigen::VectorXd::NullaryExpr(s.q[i].size(), noise);
  }
  for (double& x : s.spin) x = 5 * noise();
  return s;
}

}  // namespace flexboom::testing
