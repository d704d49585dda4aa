#pragma once

#include <algorithm>
#include <numbers>

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

}  // namespace flexboom
