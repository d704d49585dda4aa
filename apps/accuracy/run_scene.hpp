#pragma once

#include "apps/accuracy/output_errors.hpp"
#include "apps/scene/scene.hpp"
#include "apps/simulate/simulate.hpp"

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace flexboom {

/// The flight that a scene asks for, after whatever flights that took.
struct RunResult : SimulatedMotion {
  Scene scene;
  ErrorBudget budget;
  std::vector<ReferenceCheck> checks;  // where the scene is to be verified
  std::vector<std::string> plan;       // what was chosen and why, one line each
  std::vector<std::string> warnings;
  double budget_seconds = 0;
};

/// Plan, flight, error budget, better plan, warnings. `so_far`: told of the run itself as RunHooks::checkpoint, not of
/// its repeats.
/// @throws InputError, NumericalError.
RunResult run_scene(const Scene&, const RunHooks&,
                    const std::function<void(const RunResult& so_far, size_t first)>& so_far = {});

}  // namespace flexboom
