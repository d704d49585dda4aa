#pragma once

#include "apps/sweep/runner.hpp"

#include <cstddef>
#include <functional>
#include <vector>

namespace flexboom {

/// Does the runs in so many forked processes. `done` is told of each outcome in this process, in the order in which
/// runs end. A process that dies makes its run a crashed one, and another takes its place. The processes end with this
/// one, however it ends. False: SIGINT, SIGTERM or SIGHUP came; runs that had not ended are not told of.
/// @throws what `done` throws, std::system_error where the system gives no process or pipe.
bool run_in_processes(const std::vector<size_t>& runs, size_t jobs, const std::function<RunOutcome(size_t)>& work,
                      const std::function<void(const RunOutcome&)>& done);

}  // namespace flexboom
