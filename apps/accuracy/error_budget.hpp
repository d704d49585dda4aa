#pragma once

#include "apps/accuracy/modes_beyond.hpp"
#include "apps/accuracy/output_errors.hpp"
#include "apps/simulate/simulate.hpp"

#include <string>
#include <vector>

namespace flexboom {

/// Repeats a run with a tighter integrator, more modes in and out of the hinge plane, and a finer mesh. Compares the
/// outputs wanted. Where the integrator has to be tighter, or geometric stiffness to be on, that run takes the place of
/// `run`. The scene then says so. What is known not to move is no part of more modes, unless geometric stiffness is
/// switched on. Geometric stiffness couples kinds of modes that are independent without it. Where the scene asks for
/// multipliers or a method of its own, repeats are those of by_cheapest_means. Errors of time are then differences from
/// by_cheapest_means.
/// Where a repeat fails, its part is unknown, and the budget says why. @throws InputError, NumericalError as run_once.
ErrorBudget measure_budget(Scene&, Run& run, const RunHooks&, std::vector<std::string>& plan,
                           const StillKinds& still = {});

}  // namespace flexboom
