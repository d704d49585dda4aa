#pragma once

#include "dynamics/hub_equations.hpp"

namespace flexboom {

/// @throws InputError when a free hub, with everything that hangs on it in its place at the stops, has no inertia to
/// speak of in some direction: its acceleration would be noise. `p`: size of the state's p.
void check_hub_inertia(const equations::Model&, int p);

}  // namespace flexboom
