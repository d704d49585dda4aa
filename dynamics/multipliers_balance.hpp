#pragma once

// What a flight must keep. Internal to the redundant coordinates.

#include "dynamics/multipliers_equations.hpp"

namespace flexboom::redundant {

/// Energies and momenta at y, those of wheels and of gravity too.
Balance balance_of(const Equations&, const Eigen::VectorXd& y, const JointMemory&);

/// Does something join bodies to the inertial frame?
bool is_held(const Multibody&);

/// Does nothing from outside push the bodies?
bool is_isolated(const Multibody&);

/// Largest drifts of energy and, where nothing pushes, of the momenta over the outputs.
void set_drifts(const Multibody&, MultibodyTrajectory&);

}  // namespace flexboom::redundant
