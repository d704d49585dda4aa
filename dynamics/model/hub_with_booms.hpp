#pragma once

#include "dynamics/model/multibody.hpp"

#include <optional>
#include <vector>

namespace flexboom {

/// Hinge between a hub and a boom. At angle Theta the boom's x axis is cos(Theta) stowed + sin(Theta) outward. Its y
/// axis is the derivative of that by Theta (positive deflection). Its z axis is the hinge axis. The boom's BRF origin
/// is at `point`.
struct Hinge {
  std::string name{};                                  // empty: that of the boom
  Eigen::Vector3d point = Eigen::Vector3d::Zero();     // on the hub, hub BRF [m]
  Eigen::Vector3d stowed = Eigen::Vector3d::UnitY();   // unit, hub axes
  Eigen::Vector3d outward = Eigen::Vector3d::UnitX();  // unit, normal to stowed
  HingeMechanism mechanism;
};

/// A body on its hinge.
struct Appendage {
  ReducedBody body;  // BRF: x along the boom, y deflection in the hinge plane, z hinge axis, origin on the hinge
  Hinge hinge;
};

/// A hub that carries booms on hinges: body 0 is the hub on a free joint of its name, joint 0; then the booms and their
/// hinges. Without a hub the booms hang on the inertial frame.
/// @throws InputError when the directions of a hinge are not unit vectors normal to each other.
Multibody hub_with_booms(std::optional<ReducedBody> hub, std::vector<Appendage>,
                         std::optional<OrbitalField> field = {});

}  // namespace flexboom
