#pragma once

#include "dynamics/system.hpp"
#include "dynamics/tree_integrator.hpp"

#include <optional>
#include <vector>

namespace flexboom {

/// A tree that is a hub with hinged booms, as the System that has the equations of this kind alone.
struct HubOfTree {
  System system;
  std::vector<int> joints;  // of the tree, per appendage
};

/// nullopt where the tree is anything else: another joint, place or hinge law, a force beside those of hinges and
/// orbit, geometric stiffness in the equations. @throws InputError as System.
std::optional<HubOfTree> hub_of(const Tree&);

/// As `integrate` of the tree, with every method. The hinges' dissipated energy counts as dissipated elsewhere.
TreeTrajectory integrate(const Tree&, const HubOfTree&, const Eigen::VectorXd& y0, const IntegratorOptions&,
                         const Checkpoint<TreeTrajectory>& = {});

}  // namespace flexboom
