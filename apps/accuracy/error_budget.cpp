#include "apps/accuracy/error_budget.hpp"

#include "apps/accuracy/linearisation.hpp"
#include "apps/accuracy/time_error.hpp"
#include "apps/accuracy/truncation.hpp"
#include "apps/accuracy/variants.hpp"
#include "apps/model/bounded_modes.hpp"
#include "apps/simulate/flights_ahead.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace flexboom {

namespace {

/// How a discretisation is compared: elements so many steps finer, and the error at most for each change by them.
struct Finer {
  int steps = 2;
  double error_per_change = 1;
};

/// Elements of bodies from files, and of solids, are one step away: two would cost too much.
Finer finer_elements(const Scene& scene) {
  Finer r;
  for (const BodyScene& b : scene.bodies) {
    if (has(b, &RicherBodies::finer_elements))
      r.error_per_change = std::max(r.error_per_change, b.richer->error_per_change);
    const bool is_solid = b.is_boom() && b.structure == "solid";
    if (is_solid || (b.is_boom() && b.structure == "beam" && tapers_steeply(b.geometry)))
      r.error_per_change = std::max(r.error_per_change, 1 / (1 - slowest_fall(b)));
    if (!is_solid) continue;
    r.steps = 1;
    if (!is_bearable(mesh_of(b, r.steps)))
      throw InputError(fmt::format("the next finer elements of body {} are too many", b.name));
  }
  return r;
}

/// What finer elements change. @throws InputError where the scene has none.
Finding discretisation_of(const Scene& scene, const Run& run, const Scene& flown, const Measuring& m) {
  require_richer(scene, &RicherBodies::finer_elements, "finer elements");
  if (!any_elastic(scene, "beam") && !any_elastic(scene, "solid")) return {};
  const Finer next = finer_elements(flown);
  return {m.repeats.change(run, flown, m.budget.time, next.steps), next.error_per_change};
}

/// What the error of time may be: a third of the tolerance, for other parts come beside it.
Settling settling_of(const Scene& scene) { return {scene.tolerance / 3, 2, bearable_balance(scene.tolerance)}; }

/// Of a run, from repeats of it. `digits`: what is said of those that its integrator gets.
ErrorBudget budget_by_repeats(Scene& scene, Run& run, const RunHooks& hooks, std::vector<std::string>& plan,
                              std::vector<std::string>& digits, const StillKinds& still) {
  Measuring m{{hooks, floors_of(scene, run.bodies)}, plan};
  ErrorBudget& budget = m.budget;
  Scene flown = as_flown(scene, run);
  for (const OutputDifference& d : compare_outputs(run.outputs, run.outputs, scene.outputs, m.repeats.floors)) {
    budget.outputs.push_back({});
    OutputErrors& o = budget.outputs.back();
    o.name = d.name, o.scale = d.scale, o.size = d.size;
  }
  Truncation truncation(m, scene, flown, run, still);
  truncation.look();
  budget.linearisation = m.measured("linearisation", [&] { return linearisation_error(scene, flown, run, m); });
  truncation.look();
  budget.time = m.measured("time", [&] {
    const Settling asked = settling_of(scene);
    constexpr double of_tighter = 1.15;  // a flight with a digit more has a tenth of the error left
    return m.enter(&OutputErrors::time,
                   {settle_time_error(flown, run, m.repeats.floors, asked, hooks, digits), of_tighter});
  });
  scene.integrator_tolerance = flown.integrator_tolerance;
  truncation.look();
  budget.discretisation = m.measured("discretisation", [&] {
    return m.enter(&OutputErrors::discretisation, discretisation_of(scene, run, flown, m));
  });
  truncation.measure();
  budget.measured = !hooks.stopped();
  for (const std::string& line : budget.missing) plan.push_back("error budget: " + line);
  return budget;
}

/// From repeats of another run of its model, by the cheapest means. Its errors of time are differences from that run,
/// and those that it has itself. Nothing: there is no other run.
std::optional<ErrorBudget> budget_by_another(Scene& scene, Run& run, const RunHooks& hooks,
                                             std::vector<std::string>& plan, const StillKinds& still) {
  std::optional<Scene> cheap = by_cheapest_means(scene);
  if (!cheap) return {};
  Run other;
  try {
    other = fly(as_flown(*cheap, run), hooks, 0, bearable_steps(run));
  } catch (const std::runtime_error&) {  // the run that is measured outlives a failure
    return {};
  }
  if (other.motion.summary.interrupted) return {};
  plan.push_back(fmt::format("error budget: repeats are those of a run in relative coordinates by {}, which cost less",
                             other.motion.summary.method));
  std::vector<std::string> of_the_other;  // its digits are nobody's concern
  Measuring m{
      {hooks, floors_of(scene, run.bodies)}, plan, budget_by_repeats(*cheap, other, hooks, plan, of_the_other, still)};
  if (!m.budget.measured) return m.budget;
  try {
    if (m.budget.has_stiffened) {
      Scene with_it = scene;
      for (size_t i = 0; i < scene.bodies.size(); ++i) with_it.bodies[i].stiffening = cheap->bodies[i].stiffening;
      Run stiffened = run_once(with_it, hooks);
      if (stiffened.motion.summary.interrupted) throw NumericalError("interrupted");
      run = std::move(stiffened), scene = std::move(with_it);
    }
    Scene flown = as_flown(scene, run);
    Settling asked = settling_of(scene);
    asked.bearable = std::max(asked.bearable, 2 * m.budget.time);  // of the other: no step here mends that
    const Finding found{settle_time_error(flown, run, m.repeats.floors, asked, hooks, plan, &other)};
    scene.integrator_tolerance = flown.integrator_tolerance;
    const double most = m.enter(&OutputErrors::time, found,
                                [](const OutputErrors& of_other) { return of_other.time * of_other.scale; });
    if (!std::isnan(m.budget.time)) m.budget.time = most;
  } catch (const std::runtime_error& e) {
    m.missing("time", e.what());
    m.budget.time = unknown;
    for (OutputErrors& o : m.budget.outputs) o.time = unknown;
  }
  m.budget.measured = !hooks.stopped();
  return m.budget;
}

}  // namespace

ErrorBudget measure_budget(Scene& scene, Run& run, const RunHooks& hooks, std::vector<std::string>& plan,
                           const StillKinds& still) {
  if (std::optional<ErrorBudget> budget = budget_by_another(scene, run, hooks, plan, still)) return *budget;
  return budget_by_repeats(scene, run, hooks, plan, plan, still);
}

}  // namespace flexboom
