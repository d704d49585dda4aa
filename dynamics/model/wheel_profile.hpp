#pragma once

#include "dynamics/model/time_function.hpp"

#include <Eigen/Core>

#include <array>
#include <vector>

namespace flexboom {

/// A turn about an axis of the body.
struct WheelTurn {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  // unit, body axes
  Manoeuvre manoeuvre;
};

/// Torques of three reaction wheels along x, y and z of the body.
struct WheelTorques {
  std::array<TimeCourse, 3> torque;  // on the rotors [N m]; their corners are those of all turns
  double end = 0;                    // of the last turn [s]
};

/// What turns a rigid body one turn after another, from rest with wheels at rest. J: its inertia about the mass centre,
/// body axes, less what the rotors have about their own axes. The momentum of body and wheels stays zero, so the rotors
/// take -J phi_dot axis, and gyroscopic torques cancel whatever the axis.
/// @throws InputError for turns that overlap, an axis that is not unit, or an inertia that is not symmetric.
WheelTorques wheel_torques(const Eigen::Matrix3d& J, const std::vector<WheelTurn>&);

/// Where the turns want the body to be: quaternion (w, x, y, z), body -> its attitude before the first.
Eigen::Vector4d commanded_attitude(const std::vector<WheelTurn>&, double t);

}  // namespace flexboom
