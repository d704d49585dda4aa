#pragma once

#include "dynamics/environment/gravity.hpp"
#include "dynamics/model/hinge.hpp"
#include "dynamics/model/joint_law.hpp"
#include "reduction/body/reduced_body.hpp"

#include <Eigen/Core>

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace flexboom {

/// Is the geometric stiffness of a body in the equations? `stiffening_effect` tells its size.
enum class Stiffening { off, on };

/// A place on a body where something is joined, pushed or measured. With a marker, it moves by S q with the flexible
/// body. It then turns by the rotation vector S_theta q (exponential map, BRF axes). Without a marker, it is fixed in
/// the BRF.
struct Place {
  int body = -1;                                       // index into Multibody::bodies; -1: the inertial frame
  std::string marker;                                  // name of a marker of the body; empty: `position`
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // BRF, undeformed [m]; not used with a marker
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // columns: the place's own axes in the undeformed BRF
};

/// What a joint leaves free between the axes of its two places, b relative to a.
/// "fixed": nothing. "hinge": rotation about the common z [rad]. "slider": translation along the common z [m].
/// "universal": rotation about z of a, then about y of b. "spherical": every rotation. "free": everything.
enum class JointKind { fixed, hinge, slider, universal, spherical, free };

/// A function of time with its first two derivatives.
struct TimeFunction {
  std::function<double(double)> value, rate, acceleration;
};

struct Joint {
  std::string name;
  JointKind kind = JointKind::hinge;
  Place a, b;                // a on the body nearer to the inertial frame
  HingeMechanism mechanism;  // of a hinge (about +z of a, on b) or a slider (along +z): spring, damper, stop
  std::vector<TimeFunction> prescribed;  // empty, or one per scalar: the motion is given, its torque is an output
  bool closes_loop = false;              // not part of the tree: enforced by multipliers
  JointLaw law{};                        // beside the mechanism, of a hinge or a slider
};

/// Spring and damper along the line between two places.
struct SpringDamper {
  std::string name;
  Place a, b;
  double stiffness = 0;    // [N/m]
  double free_length = 0;  // [m]
  double damping = 0;      // [N s/m]
};

/// A force or torque at a place, in the place's axes (follower) or in inertial axes. Three components each.
struct Load {
  std::string name;
  Place at;
  bool inertial_axes = false;
  std::array<std::function<double(double)>, 3> force, torque;  // [N], [N m]; empty functions are zero
};

/// A rotor whose mass and transverse inertia are already the body's. Only its spin is its own:
/// inertia (spin_dot + axis . alpha) = torque, reaction -torque on the body.
struct ReactionWheel {
  std::string name;
  int body = 0;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  // unit, BRF
  double inertia = 0;                               // about its axis [kg m^2]
  double spin = 0;                                  // relative to the body at t = 0 [rad/s]
  std::function<double(double)> torque;             // on the rotor [N m]
};

/// What a scene is made of. Bodies are rigid (n = 0) or flexible; joints with closes_loop = false make a tree rooted in
/// the inertial frame.
struct Multibody {
  std::vector<ReducedBody> bodies;
  std::vector<Joint> joints;
  std::vector<SpringDamper> springs;
  std::vector<Load> loads;
  std::vector<ReactionWheel> wheels;
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  // uniform, inertial axes [m/s^2]
  /// Instead: of a planet. Positions are from the reference point of the orbit, whose free fall is taken off.
  std::optional<OrbitalField> field{};
};

/// Where a place is in the undeformed BRF [m].
inline Eigen::Vector3d position_of(const Multibody& scene, const Place& place) {
  return place.marker.empty() ? place.position
                              : marker(scene.bodies[static_cast<std::size_t>(place.body)], place.marker).position;
}

}  // namespace flexboom
