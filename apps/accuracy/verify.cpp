#include "apps/accuracy/verify.hpp"

#include "apps/accuracy/error_budget.hpp"
#include "apps/accuracy/variants.hpp"
#include "apps/simulate/flights_ahead.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace flexboom {

namespace {

/// A method of another family than the one that was used.
std::string other_method(const std::string& used) {
  if (used == "ida") return "auto";  // in relative coordinates
  return used == "exponential" || used == "dirk" ? "bdf" : "dirk";
}

Scene by_another_method(Scene scene, const std::string& used) {
  scene.integrator = other_method(used);
  if (used == "ida") scene.formulation = "relative";
  return scene;
}

Scene in_the_other_formulation(Scene scene) {
  scene.formulation = scene.formulation == "multipliers" ? "relative" : "multipliers";
  scene.integrator = "auto";
  scene.rescale_at_events = false;  // only relative coordinates have it
  return scene;
}

struct Reference {
  std::string what;
  Scene scene;
  int refine = 0;
  bool other_basis = false;
};

/// What the motion does to modes beyond, where the run can be flown once more from its start.
ShakenModes shaken_by(const RunResult& run, const ModesBeyond& beyond, const Reach& of_drives, const RunHooks& hooks) {
  if (run.scene.from) return {};
  try {
    return shaken_modes(run.scene, run, beyond, of_drives, hooks);
  } catch (const std::runtime_error&) {  // the run that is verified outlives a failure
    return {};
  }
}

std::vector<Reference> references(const Scene& scene, const RunResult& run, const RunHooks& hooks) {
  constexpr int more_orders = 4;
  const Scene cheap = by_cheapest_means(scene).value_or(scene);
  const std::string& used = run.motion.summary.method;
  const ModesBeyond beyond{.least = 6, .as_many = true};
  const Reach of_drives = reach_of_drives(cheap, beyond, DriveSpectra(cheap), hooks);
  const ShakenModes shaken = shaken_by(run, beyond, of_drives, hooks);
  const Scene modes =
      with_more_modes(cheap, beyond, with_shaken(of_drives, shaken, counting_effect * run.scene.tolerance), hooks);
  return {{"time: another method", by_another_method(scene, used)},
          {"time: the other formulation", in_the_other_formulation(scene)},
          {"truncation: twice the modes of each kind, six more at least", modes, 0, true},
          {"discretisation: elements of four orders more", cheap, more_orders, true},
          {"linearisation: all geometric stiffness", with_stiffening(cheap), 0, true},
          {"all at once", by_another_method(with_stiffening(modes), used), more_orders, true}};
}

}  // namespace

std::vector<ReferenceCheck> reference_checks(const RunResult& r, const RunHooks& hooks) {
  Scene scene = r.scene;
  scene.tolerance = std::max(1e-12, std::min(scene.step_tolerance() / 100, 1e-9));  // its own error of time is none
  scene.integrator_tolerance = 0;
  OutputFloors floors = floors_of(r.scene, r.bodies);
  RunHooks quiet;
  quiet.interrupt = hooks.interrupt, quiet.bodies = hooks.bodies, quiet.ahead = hooks.ahead;
  std::vector<ReferenceCheck> checks;
  const std::vector<Reference> all = references(scene, r, quiet);
  for (const Reference& reference : all) {
    if (hooks.stopped()) break;
    if (const Reference* next = &reference + 1; next != all.data() + all.size())
      fly_ahead(next->scene, quiet, next->refine);
    ReferenceCheck check;
    check.what = reference.what;
    try {
      const Run run = fly(reference.scene, quiet, reference.refine);
      if (run.motion.summary.interrupted) break;
      check.method = run.motion.summary.method;
      const auto of = [&](const OutputTable& table) {
        return reference.other_basis ? without_coordinates(table) : table;
      };
      check.differences = compare_outputs(of(r.outputs), of(run.outputs), scene.outputs, floors);
    } catch (const std::runtime_error& e) {
      check.missing = e.what();
    }
    checks.push_back(std::move(check));
  }
  return checks;
}

}  // namespace flexboom
