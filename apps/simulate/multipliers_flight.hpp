#pragma once

#include "apps/simulate/simulate.hpp"

#include <vector>

/// Scenes flown in redundant coordinates, formulation = "multipliers".
namespace flexboom {

/// As fly_tree, loops included. The start values of the
/// joints say where the bodies are; then they move as little as needed until the loops close.
/// @throws InputError naming a joint that cannot be closed; NumericalError naming one that locks.
Run fly_by_multipliers(const Scene&, std::vector<PreparedBody>, const RunHooks&, long max_steps);

}  // namespace flexboom
