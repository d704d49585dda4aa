#pragma once

#include "dynamics/redundant/multipliers.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace flexboom::testing {

/// A slender uniform bar along x with its BRF at one end.
inline ReducedBody bar(const std::string& name, double mass, double length) {
  const double J = mass * length * length / 3;
  return rigid_body(name, mass, {mass * length / 2, 0, 0}, Eigen::Vector3d(1e-3 * J, J, J).asDiagonal());
}

inline Place at(int body, const Eigen::Vector3d& position = Eigen::Vector3d::Zero(),
                const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity()) {
  return {body, "", position, axes};
}
inline Place at_marker(int body, const std::string& marker) {
  Place p;
  p.body = body, p.marker = marker;
  return p;
}

inline HingeMechanism no_mechanism() { return {0, 0, 0, 0, 0}; }

inline Joint joint(const std::string& name, JointKind kind, const Place& a, const Place& b,
                   const HingeMechanism& mechanism = no_mechanism()) {
  return {name, kind, a, b, mechanism, {}, false};
}

/// A function that is a polynomial of t.
inline TimeFunction polynomial(double c0, double c1, double c2 = 0) {
  return {[=](double t) { return c0 + t * (c1 + t * c2); }, [=](double t) { return c1 + 2 * c2 * t; },
          [=](double) { return 2 * c2; }};
}

inline MultipliersOptions options(double tolerance, double duration, double output_step) {
  MultipliersOptions o;
  o.tolerance = tolerance, o.duration = duration, o.output_step = output_step;
  return o;
}

}  // namespace flexboom::testing
