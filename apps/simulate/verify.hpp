#pragma once

#include "apps/simulate/simulate.hpp"

#include <string>
#include <vector>

namespace flexboom {

/// Runs that share as little as possible with the one they are held against. One has another method, one the other
/// formulation, one twice the modes of each kind and six more at least, one elements four orders higher, one all
/// geometric stiffness, and one all of these at once. A run that fails is a check that says why.
std::vector<ReferenceCheck> reference_checks(const RunResult&, const RunHooks&);

}  // namespace flexboom
