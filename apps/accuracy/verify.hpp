#pragma once

#include "apps/accuracy/run_scene.hpp"

#include <string>
#include <vector>

namespace flexboom {

/// Runs that share as little as possible with the one they are held against. One has another method. One has the other
/// formulation. One has twice the modes of each kind, and six more at least. One has elements four orders higher. One
/// has all geometric stiffness. The last has another method, more modes, higher elements and all geometric stiffness at
/// once. A run that fails is a check that says why.
std::vector<ReferenceCheck> reference_checks(const RunResult&, const RunHooks&);

}  // namespace flexboom
