#pragma once

// Where positions are counted from. Internal to the redundant coordinates.

#include "dynamics/redundant/equations.hpp"

#include <Eigen/Core>

#include <vector>

namespace flexboom::redundant {

/// An inertial frame that moves as the mass of all bodies does at the start, from its middle. Positions in it stay
/// small, so that constraints keep their digits however far the bodies go. Where something is held in the outer frame
/// both are the same.
class FlightFrame {
 public:
  FlightFrame(const Equations&, const std::vector<BodyState>& start, double t);

  /// A start in the outer frame, seen from this one.
  std::vector<BodyState> seen(std::vector<BodyState>) const;

  /// A moment seen from this frame, in the outer one: places, velocities, energies, momenta, and the work of loads.
  void leave(double t, MultibodyState&, Balance&) const;

  /// What is left open of positions in the outer frame [m].
  double round_off() const { return 1e-15 * origin_.norm(); }

 private:
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero(), velocity_ = origin_, gravity_ = origin_;
  double start_, mass_ = 0;
  bool loaded_;
};

}  // namespace flexboom::redundant
