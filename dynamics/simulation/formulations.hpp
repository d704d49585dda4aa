#pragma once

#include "dynamics/redundant/multipliers.hpp"
#include "dynamics/relative/tree.hpp"

#include <Eigen/Core>

#include <vector>

namespace flexboom {

/// What a motion by Tree is in redundant coordinates, and the other way: the tree is that of the joints that close no
/// loop.

/// The bodies where the tree has them.
std::vector<BodyState> body_states(const Tree&, double t, const Eigen::Ref<const Eigen::VectorXd>& y);

/// All joints, loops too. Angles of universal joints lie in (-pi, pi]: turns are not counted.
TreeState tree_state(const Multipliers&, const MultibodyState&);

/// As Tree::joint_loads, for all joints. Where constraint rows were left out, the others carry their load.
std::vector<JointLoad> joint_loads(const Multipliers&, const MultibodyState&);

/// As Tree::stiffening_effect.
std::vector<StiffeningEffect> stiffening_effect(const Multipliers&, double t, const MultibodyState&);

}  // namespace flexboom
