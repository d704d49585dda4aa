#include "dynamics/model/wheel_profile.hpp"

#include "dynamics/numerics/rotation.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <utility>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/// Torque per unit of angular acceleration, and the course of the angle.
struct Part {
  Vector3d torque;
  TimeCourse angle;
};

}  // namespace

WheelTorques wheel_torques(const Matrix3d& J, const std::vector<WheelTurn>& turns) {
  require(J.isApprox(J.transpose(), 1e-9) && J.trace() > 0,
          "wheel profile: the inertia must be symmetric and positive");
  std::vector<Part> parts;
  WheelTorques r;
  std::vector<double> corners;
  for (const WheelTurn& turn : turns) {
    require(std::abs(turn.axis.norm() - 1) < 1e-9, "wheel profile: the axis must be a unit vector");
    require(parts.empty() || turn.manoeuvre.start >= r.end,
            fmt::format("wheel profile: a turn starts at {:g} s, before the last one ends at {:g} s",
                        turn.manoeuvre.start, r.end));
    parts.push_back({-J * turn.axis, rest_to_rest(turn.manoeuvre)});
    for (const double t : parts.back().angle.corners)
      if (corners.empty() || t > corners.back()) corners.push_back(t);
    r.end = corners.back();
  }
  const auto shared = std::make_shared<const std::vector<Part>>(std::move(parts));
  for (int axis = 0; axis < 3; ++axis) {
    TimeCourse& c = r.torque[static_cast<size_t>(axis)];
    c.corners = corners;
    c.function.value = [shared, axis](double t) {
      double torque = 0;
      for (const Part& p : *shared) torque += p.torque[axis] * p.angle.function.acceleration(t);
      return torque;
    };
  }
  return r;
}

Eigen::Vector4d commanded_attitude(const std::vector<WheelTurn>& turns, double t) {
  Eigen::Vector4d attitude(1, 0, 0, 0);
  for (const WheelTurn& turn : turns) {
    if (t <= turn.manoeuvre.start) break;
    const double half = rest_to_rest(turn.manoeuvre).function.value(t) / 2;
    Eigen::Vector4d step;
    step << std::cos(half), std::sin(half) * turn.axis;
    attitude = quaternion_product(attitude, step);
  }
  return attitude;
}

}  // namespace flexboom
