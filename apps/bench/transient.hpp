#pragma once

#include <functional>
#include <string>
#include <vector>

namespace flexboom {

/// One flight of one scene by one method.
struct TransientBench {
  std::string scene;  // "sport", ...
  std::string method;
  double tolerance = 0;  // asked for
  double reference = 0;  // the tolerance of the reference
  double seconds = 0;    // of the integration, the least of up to five within half a second
  double error = 0;      // largest of all outputs (max over time of the difference over max of the output)
  double hub_error = 0;  // of hub.rotation; NaN where there is none
  double energy = 0;     // energy balance
  double simulated = 0;  // [s]
  long steps = 0, evaluations = 0, events = 0;
  std::string failure;  // why there is nothing above
};

/// Work against precision: every method at tolerances 1e-2 to 1e-9. The scenes are those named (paths or built-in).
/// Without names they are SPORT with 2 and with 8 modes per boom, without damping, and tumbling. The reference of a
/// method is a run of another method. Its tolerance is 1e-11, or the next at which that method does not fail. The other
/// method is bdf, or adams where nothing is damped. The reference of that one is exponential, or adams where joints
/// have laws. "ida" is the formulation by multipliers. A method ends where its next tolerance would take longer than
/// `longest` seconds, or comes near that of the reference. A scene that closes a loop has one method, which is its own
/// reference. Calls `seen` after each row.
std::vector<TransientBench> bench_transient(const std::vector<std::string>& scenes, double longest,
                                            const std::function<void(const TransientBench&)>& seen);

}  // namespace flexboom
