#pragma once

#include "dynamics/model/multibody.hpp"

#include <array>
#include <string_view>

namespace flexboom {

/// One freedom of a joint: a unit motion of place b relative to place a, in the axes of b (translations first).
enum class Freedom : int { x, y, z, turn_x, turn_y, turn_z, turn_z_of_a };

/// A row of the table of joints.
struct JointType {
  JointKind kind;
  std::string_view name;
  int scalars;  // coordinates whose rates are their derivatives: angles [rad], lengths [m]; they belong to the first
                // freedoms
  bool turns;   // relative attitude as a quaternion, its rate the relative angular velocity in the axes of b
  bool floats;  // relative position and velocity in the axes of a
  int freedoms;
  std::array<Freedom, 6> freedom;
};

inline constexpr std::array<JointType, 6> joint_types = {{
    {JointKind::fixed, "fixed", 0, false, false, 0, {}},
    {JointKind::hinge, "hinge", 1, false, false, 1, {Freedom::turn_z}},
    {JointKind::slider, "slider", 1, false, false, 1, {Freedom::z}},
    {JointKind::universal, "universal", 2, false, false, 2, {Freedom::turn_z_of_a, Freedom::turn_y}},
    {JointKind::spherical, "spherical", 0, true, false, 3, {Freedom::turn_x, Freedom::turn_y, Freedom::turn_z}},
    {JointKind::free,
     "free",
     0,
     true,
     true,
     6,
     {Freedom::x, Freedom::y, Freedom::z, Freedom::turn_x, Freedom::turn_y, Freedom::turn_z}},
}};

constexpr const JointType& joint_type(JointKind kind) { return joint_types[static_cast<size_t>(kind)]; }

}  // namespace flexboom
