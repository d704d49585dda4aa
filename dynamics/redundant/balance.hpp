#pragma once

// What a flight must keep. Internal to the redundant coordinates.

#include "dynamics/redundant/equations.hpp"

namespace flexboom::redundant {

/// Energies and momenta at y, those of wheels and of gravity too.
Balance balance_of(const Equations&, const Eigen::VectorXd& y, const JointMemory&);

/// Largest drifts of energy and, where nothing pushes, of the momenta over the outputs. `before`: of a flight that this
/// one goes on.
void set_drifts(const Multibody&, const MotionScales& before, MultibodyTrajectory&);

}  // namespace flexboom::redundant
