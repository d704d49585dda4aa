#pragma once

#include "apps/simulate/simulate.hpp"

#include <string>
#include <vector>

namespace flexboom {

/// Repeats a run with a tighter tolerance, more modes in and out of the hinge plane, and a finer mesh, and compares the
/// outputs wanted. When the tighter run differs by more than the tolerance it takes the place of `run`, and `plan` says
/// so.
/// @throws InputError, NumericalError as run_scene.
ErrorBudget measure_budget(const Scene&, Run& run, const RunHooks&, std::vector<std::string>& plan);

/// Two more modes in each plane, so many times, and both planes: what bends out of the hinge plane is left out, too.
Scene with_more_modes(Scene, int times = 1);

/// All geometric stiffness.
Scene with_stiffening(Scene);

/// Without the columns of elastic coordinates: those of another basis have other meanings.
OutputTable without_coordinates(const OutputTable&);

/// What the outputs of a scene with these bodies must bear.
OutputFloors floors_of(const Scene&, const std::vector<PreparedBody>&);

}  // namespace flexboom
