#include "apps/error_budget.hpp"

#include "fem/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace flexboom {

namespace {

/// Geometric stiffness of spin is left out of Ke: its size against it, (Omega / omega_1)^2 of the body's first mode, at
/// worst over the run.
double linearisation_estimate(const Run& run) {
  double worst = 0;
  for (size_t b = 0; b < run.bodies.size(); ++b) {
    const ReducedBody& body = run.bodies[b].body;
    if (body.n() == 0) continue;
    const double omega_1 = std::sqrt(body.Ke(0, 0) / body.Me(0, 0));
    double spin = 0;
    const auto rate =
        std::find(run.outputs.names.begin(), run.outputs.names.end(), body.name + ".rate") - run.outputs.names.begin();
    for (Eigen::Index row = 0; row < run.outputs.values.rows(); ++row) {
      const double w = run.outputs.values.row(row).segment<3>(4).norm() + std::abs(run.outputs.values(row, rate));
      spin = std::max(spin, w);
    }
    worst = std::max(worst, spin * spin / (omega_1 * omega_1));
  }
  return worst;
}

bool any_elastic(const Scene& scene, const char* structure) {
  return std::any_of(scene.bodies.begin(), scene.bodies.end(), [&](const BodyScene& b) {
    return b.modes > 0 && b.structure != "rigid" && (structure == nullptr || b.structure == structure);
  });
}

bool asked_to_stop(const RunHooks& hooks) { return hooks.interrupt != nullptr && hooks.interrupt->load(); }

/// Two more modes in each plane, and both planes: what bends out of the hinge plane counts as left out, too.
Scene with_more_modes(Scene scene) {
  for (BodyScene& b : scene.bodies) {
    if (b.structure == "rigid" || b.modes == 0 || !b.is_boom()) continue;
    b.modes = b.directions == "all" ? b.modes + 4 : 2 * (b.modes + 2);
    b.directions = "all";
  }
  return scene;
}

/// Without the columns of elastic coordinates: those of another basis have other meanings.
OutputTable without_coordinates(const OutputTable& table) {
  OutputTable r{table.names, table.values};
  for (std::string& name : r.names)
    if (name.find(".q") != std::string::npos) name += " (of this basis)";
  return r;
}

/// Repeats the run ten times tighter until the difference is within the tolerance; the tighter run then takes its
/// place. Returns the difference. `flown` is the scene of the run that was kept.
double settle_time_error(const Scene& scene, Scene& flown, Run& run, const RunHooks& hooks,
                         std::vector<std::string>& plan) {
  constexpr int most = 3;
  for (int i = 1;; ++i) {
    Scene tight = flown;
    tight.tolerance /= 10;
    Run finer = run_once(tight, hooks);
    const double error = largest(compare_outputs(run.outputs, finer.outputs, scene.outputs));
    if (error <= scene.tolerance || i == most || asked_to_stop(hooks) || tight.tolerance < 1e-13) return error;
    run = std::move(finer);
    flown = tight;
    plan.push_back(fmt::format(
        "time integration: changed by {:.1e} at a tenth of the tolerance, so that run is the one kept (integrator "
        "tolerance {:.0e})",
        error, tight.tolerance));
  }
}

/// Difference of the outputs of another flight, or NaN with the reason in `plan` when it can not be flown at a bearable
/// cost.
double change(const Run& run, const Scene& other, int refine, const char* what, const RunHooks& hooks,
              std::vector<std::string>& plan) {
  const long bearable = 20 * run.motion.summary.steps + 10000;
  try {
    const OutputTable repeated = without_coordinates(run_once(other, hooks, refine, bearable).outputs);
    return largest(compare_outputs(without_coordinates(run.outputs), repeated, other.outputs));
  } catch (const std::runtime_error& e) {
    plan.push_back(fmt::format("error budget: {} not measured: {}", what, e.what()));
    return std::numeric_limits<double>::quiet_NaN();
  }
}

/// The modes left out, first with few digits: more only where the answer would drown in the error of time integration.
double truncation_error(const Run& run, const Scene& flown, const RunHooks& hooks, std::vector<std::string>& plan) {
  Scene more = with_more_modes(flown);
  more.tolerance = std::max(flown.tolerance, 1e-5);
  const double error = change(run, more, 0, "truncation", hooks, plan);
  if (more.tolerance == flown.tolerance || !(error <= 10 * more.tolerance)) return error;
  more.tolerance = flown.tolerance;
  return change(run, more, 0, "truncation", hooks, plan);
}

}  // namespace

ErrorBudget measure_budget(const Scene& scene, Run& run, const RunHooks& hooks, std::vector<std::string>& plan) {
  ErrorBudget budget;
  Scene flown = scene;
  budget.time = settle_time_error(scene, flown, run, hooks, plan);
  if (any_elastic(scene, nullptr) && !asked_to_stop(hooks)) {
    if (scene.from) {
      budget.truncation = std::numeric_limits<double>::quiet_NaN();
      plan.emplace_back("error budget: truncation not measured: a saved state knows nothing of modes beyond its own");
    } else {
      budget.truncation = truncation_error(run, flown, hooks, plan);
    }
  }
  if (any_elastic(scene, "beam") && !asked_to_stop(hooks))
    budget.discretisation = change(run, flown, 2, "discretisation", hooks, plan);
  budget.linearisation = scene.is_tree ? run.stiffening_left_out : linearisation_estimate(run);
  budget.measured = !asked_to_stop(hooks);
  return budget;
}

void choose_modes(Scene& scene, const RunHooks& hooks, std::vector<std::string>& plan) {
  constexpr int most = 4;
  std::vector<size_t> automatic;
  for (size_t i = 0; i < scene.bodies.size(); ++i)
    if (std::exchange(scene.bodies[i].modes_auto, false) && scene.bodies[i].structure != "rigid")
      automatic.push_back(i);
  if (automatic.empty()) return;
  const auto set_modes = [&](int n) {
    for (const size_t i : automatic) scene.bodies[i].modes = scene.bodies[i].directions == "all" ? 2 * n : n;
  };
  const auto with_modes = [&](int n) {
    set_modes(n);
    Scene sketch = scene;  // a choice needs no more digits than this
    sketch.tolerance = std::max(scene.tolerance, 1e-5);
    return without_coordinates(run_once(sketch, hooks).outputs);
  };
  OutputTable fewer = with_modes(1);
  for (int n = 1; n < most; ++n) {
    OutputTable more = with_modes(n + 1);
    if (asked_to_stop(hooks)) return;
    const double error = largest(compare_outputs(fewer, more, scene.outputs));
    if (error <= scene.tolerance) {
      set_modes(n);
      plan.push_back(
          fmt::format("modes: {} per plane: one more changes the outputs by {:.2e}, within the tolerance", n, error));
      return;
    }
    plan.push_back(fmt::format("modes: {} per plane are not enough: one more changes the outputs by {:.2e}", n, error));
    fewer = std::move(more);
  }
  plan.push_back(fmt::format("modes: {} per plane, the most that are tried", most));
}

}  // namespace flexboom
