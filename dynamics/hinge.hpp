#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <numbers>
#include <string>

namespace flexboom {

/// Spring hinge with a one-sided stop that does not latch (eqs. 16-19). Torque on the boom along +Theta, its opposite
/// on the hub:
///
///     tau = -stiffness (Theta - rest) - damping Theta_dot - [Theta > threshold] stop_stiffness (Theta - threshold)
struct HingeMechanism {
  double stiffness = 0;                     // P1 / Thr [N m/rad]
  double rest = std::numbers::pi / 2;       // angle at which the spring is free [rad]
  double damping = 0;                       // P2 [N m s/rad]
  double stop_stiffness = 0;                // P3 [N m/rad]; 0: no stop
  double threshold = std::numbers::pi / 2;  // Thr [rad]

  bool operator==(const HingeMechanism&) const = default;
};

/// Energy [J] in spring and stop; gap: Theta - threshold [rad].
inline double energy(const HingeMechanism& m, double gap) {
  const double stretch = gap + m.threshold - m.rest, depth = std::max(0.0, gap);
  return 0.5 * m.stiffness * stretch * stretch + 0.5 * m.stop_stiffness * depth * depth;
}

/// Hinge between the hub and a boom. At angle Theta the boom's x axis is cos(Theta) stowed + sin(Theta) outward, its y
/// axis the derivative of that (positive deflection), its z axis the hinge axis; the boom's BRF origin is at `point`.
struct Hinge {
  std::string name;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();     // on the hub, hub BRF [m]
  Eigen::Vector3d stowed = Eigen::Vector3d::UnitY();   // unit, hub axes
  Eigen::Vector3d outward = Eigen::Vector3d::UnitX();  // unit, normal to stowed
  HingeMechanism mechanism;
};

}  // namespace flexboom
