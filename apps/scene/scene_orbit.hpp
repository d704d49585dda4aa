#pragma once

#include "apps/scene/scene.hpp"
#include "dynamics/environment/gravity.hpp"

#include <optional>

namespace flexboom {

/// The reference point's orbit, in the inertial axes of the scene: those of the LVLH frame at t = 0.
Orbit orbit_of(const Scene&);

/// The gravity of its planet, where the scene asks for it.
std::optional<OrbitalField> field_of(const Scene&);

/// Roll, pitch, yaw of a body against the LVLH frame [rad].
Eigen::Vector3d lvlh_angles(const Eigen::Vector4d& attitude, const Orbit&, double t);

}  // namespace flexboom
