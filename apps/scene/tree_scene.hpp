#pragma once

#include "dynamics/model/hinge.hpp"
#include "dynamics/model/joint.hpp"
#include "dynamics/model/joint_law.hpp"
#include "dynamics/model/time_function.hpp"
#include "dynamics/model/wheel_profile.hpp"

#include <Eigen/Core>

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// What a file says of a scene with [[joints]]: any tree of bodies (`Multibody`), its names not yet looked up.
namespace flexboom {

/// A function of time: an expression of t, or a table, or a turn from rest to rest.
struct CourseScene {
  std::string expression;  // empty: none
  std::optional<TimeTable> table;
  std::optional<Manoeuvre> manoeuvre;

  bool given() const { return !expression.empty() || table || manoeuvre; }
};

/// A function of time that can be asked at any time from 0 to `duration`.
/// @throws InputError as the makers of TimeCourse, or when a table does not reach that far.
TimeCourse course_of(const CourseScene&, double duration);

struct PlaceScene {
  std::string body;                        // empty: the inertial frame
  std::string marker;                      // empty: `point`
  Eigen::Vector3d point{0, 0, 0};          // BRF [m]
  Eigen::Vector3d x{1, 0, 0}, z{0, 0, 1};  // axes of the place in the BRF, unit, normal to each other
  Eigen::Matrix3d axes() const;            // columns x, z x x, z
};

struct JointScene {
  std::string name;
  JointKind kind = JointKind::hinge;
  PlaceScene a, b;
  HingeMechanism mechanism{.rest = 0, .threshold = 0};
  JointLaw law;
  CourseScene drive;                      // torque [N m] or force [N] along the freedom of a hinge or a slider, on b
  std::vector<CourseScene> motion;        // prescribed, one per freedom
  std::vector<double> start, start_rate;  // one per freedom [rad, rad/s] or [m, m/s]; empty: rest
  Eigen::Vector4d start_attitude{1, 0, 0, 0};                        // (w, x, y, z), axes of b -> axes of a
  Eigen::Vector3d start_omega{0, 0, 0};                              // axes of b [rad/s]
  Eigen::Vector3d start_position{0, 0, 0}, start_velocity{0, 0, 0};  // axes of a [m], [m/s]
  bool loads = false;                                                // are forces and torques outputs?
  bool closes_loop = false;
};

/// What the outputs of angles and lengths, and of their rates, are called behind the name of the joint: ".angle".
struct ScalarOutputs {
  std::span<const std::string_view> values, rates;
};
ScalarOutputs scalar_outputs(JointKind);

struct SpringScene {
  std::string name;
  PlaceScene a, b;
  double stiffness = 0, free_length = 0, damping = 0;  // [N/m], [m], [N s/m]
};

struct LoadScene {
  std::string name;
  PlaceScene at;
  bool inertial_axes = false;
  std::array<CourseScene, 3> force, torque;  // [N], [N m]
};

struct WheelScene {
  std::string name, body;
  Eigen::Vector3d axis{0, 0, 1};  // unit, BRF
  double inertia = 0, spin = 0;   // [kg m^2], [rad/s]
  CourseScene torque;             // on the rotor [N m]
};

/// A turn of the whole scene by the reaction wheels of a body, from rest to rest.
struct TurnScene {
  std::string body;
  Eigen::Vector3d axis{0, 0, 1};  // unit, BRF
  Manoeuvre manoeuvre;            // its start is not used
  double pause = 0;               // from t = 0 or the end of the turn before [s]
};

/// The turns one after another. @throws InputError as rest_to_rest.
std::vector<WheelTurn> turns_of(const std::vector<TurnScene>&);

}  // namespace flexboom
