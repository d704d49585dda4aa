#pragma once

#include "apps/simulate/simulate.hpp"

#include <string>
#include <vector>

namespace flexboom {

/// Runs that share as little as possible with the one they are held against: another method, the other formulation, six
/// more modes in each plane, elements four orders higher, all geometric stiffness; and all of these at once. A run that
/// fails is a check that says why.
std::vector<ReferenceCheck> reference_checks(const RunResult&, const RunHooks&);

}  // namespace flexboom
