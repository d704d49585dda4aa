#include "apps/accuracy/time_error.hpp"

#include "apps/accuracy/variants.hpp"
#include "apps/simulate/flights_ahead.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace flexboom {

double bearable_balance(double tolerance) { return std::min(10 * tolerance, broken_balance); }

std::vector<OutputDifference> settle_time_error(Scene& flown, Run& run, const OutputFloors& floors, Settling asked,
                                                const RunHooks& hooks, std::vector<std::string>& plan,
                                                const Run* reference) {
  for (double before = std::numeric_limits<double>::infinity();;) {
    const Scene tight = with_a_digit_more(flown);
    const auto finer = [&] { return fly(tight, hooks, 0, bearable_steps(run)); };
    Run next = reference == nullptr ? finer() : Run{};
    const OutputTable& truth = reference == nullptr ? next.outputs : reference->outputs;
    std::vector<OutputDifference> differences = compare_outputs(run.outputs, truth, flown.outputs, floors);
    const double error = largest(differences);
    if (!(error < std::exchange(before, error) / 5)) --asked.digits;
    const double balance = run.motion.summary.energy_balance;
    const bool is_settled = error <= asked.bearable && !(balance > asked.balance);
    if (is_settled || asked.digits <= 0 || hooks.stopped() || tight.step_tolerance() < least_tolerance)
      return differences;
    const std::string energies = error <= asked.bearable ? fmt::format("energy balance {:.1e}, ", balance) : "";
    const std::string against =
        reference == nullptr
            ? fmt::format("changed by {:.1e} at a tenth of the tolerance {:.0e}", error, flown.step_tolerance())
            : fmt::format("differs by {:.1e} from relative coordinates by {}", error, reference->motion.summary.method);
    if (reference != nullptr) try {
        next = finer();
      } catch (const NumericalError&) {
        return differences;  // those of the run are known
      }
    if (next.motion.summary.interrupted) throw NumericalError("interrupted");
    plan.push_back(
        fmt::format("time integration: {}{}; the integrator gets {:.0e}", energies, against, tight.step_tolerance()));
    run = std::move(next);
    flown = tight;
  }
}

std::vector<std::string> wanted_pointings(const Scene& scene) {
  std::vector<std::string> outputs = scene.outputs;
  if (outputs.empty() && !scene.turns.empty()) return {scene.turns.front().body + ".pointing"};
  std::erase_if(outputs, [](const std::string& text) { return !is_pointing(wanted_output(text).name); });
  return outputs;
}

std::string settle_pointing(Scene& scene, Run& run, const RunHooks& hooks, std::vector<std::string>& plan) {
  Scene flown = as_flown(scene, run);
  flown.outputs = wanted_pointings(scene);
  if (flown.outputs.empty()) return "";
  constexpr double promised = 10;
  constexpr std::string_view of_high_order[] = {"exponential", "adams", "erk"};
  const bool is_cheap = std::ranges::find(of_high_order, run.motion.summary.method) != std::end(of_high_order);
  const Settling asked{promised * scene.tolerance / 3, is_cheap ? 2 : 0};
  std::string warning;
  try {
    for (const OutputDifference& d : settle_time_error(flown, run, floors_of(scene, run.bodies), asked, hooks, plan))
      if (d.error > asked.bearable)
        warning = fmt::format("{} is off by {:.1e} or more, by a repeat with a digit more: a smaller tolerance helps",
                              d.name, d.error);
  } catch (const std::runtime_error& e) {  // the run that is repeated outlives a failure
    warning =
        fmt::format("{} may be off by more than ten times the tolerance: {}", fmt::join(flown.outputs, ", "), e.what());
  }
  scene.integrator_tolerance = flown.integrator_tolerance;
  return warning;
}

}  // namespace flexboom
