#include "apps/accuracy/run_scene.hpp"

#include "apps/accuracy/error_budget.hpp"
#include "apps/accuracy/field_error.hpp"
#include "apps/accuracy/planner.hpp"
#include "apps/accuracy/time_error.hpp"
#include "apps/accuracy/variants.hpp"
#include "apps/accuracy/verify.hpp"
#include "apps/model/reduction.hpp"
#include "apps/model/static_shapes.hpp"
#include "apps/simulate/flights_ahead.hpp"
#include "apps/simulate/steady_motion.hpp"
#include "apps/simulate/tree_flight.hpp"
#include "fem/base/stopwatch.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>
#include <utility>

namespace flexboom {

namespace {

std::string damping_text(const DampingRule& d) {
  if (d.name == "none") return "no structural damping";
  if (d.name == "rayleigh")
    return fmt::format("structural damping 'rayleigh', alpha {:g} 1/s, beta {:g} s", d.alpha, d.beta);
  return fmt::format("structural damping '{}', value {:g}", d.name, d.value);
}

std::string why_method(const Scene& scene, const IntegrationSummary& s) {
  if (scene.integrator != "auto") return "as asked";
  return s.why_method.empty() ? "chosen" : "chosen: " + s.why_method;
}

void describe(const Scene& scene, const Run& run, std::vector<std::string>& plan) {
  for (size_t i = 0; i < run.bodies.size(); ++i) {
    const BodyScene& b = scene.bodies[i];
    if (!b.is_boom()) continue;
    const PreparedBody& p = run.bodies[i];
    const std::string model =
        !p.kept.empty() && p.elements == 0 ? fmt::format("{} unknowns, kept in {}", p.dofs, p.kept.string())
        : p.body.structure == "eq14"       ? "eq. 14, Euler-Bernoulli line mass, closed form"
        : b.structure == "solid"
            ? fmt::format("{} solid elements, {} unknowns", p.elements, p.dofs)
            : fmt::format("{} beam elements, order {}, {} unknowns", p.elements, b.geometry.order, p.dofs);
    const int modes = p.coordinates_of_modes(), others = p.body.n() - modes;
    plan.push_back(fmt::format("{}: {}; {} modes{}", b.name, model, modes,
                               others > 0 ? fmt::format(" and {} static shapes", others) : ""));
    plan.push_back(fmt::format("{}: {}", b.name, damping_text(b.damping)));
  }
  for (const JointScene& j : scene.joints)
    if (j.mechanism.stop_stiffness > 0)
      plan.push_back(fmt::format("stop of {0}: {1:g} {2}/{3} without damping of its own; damping {4:g} {2} s/{3}",
                                 j.name, j.mechanism.stop_stiffness, j.kind == JointKind::slider ? "N" : "N m",
                                 j.kind == JointKind::slider ? "m" : "rad", j.mechanism.damping));
  plan.push_back(
      fmt::format("integrator: {} ({}), tolerance {:.1e}; damping of the method itself shows in energy_balance",
                  run.motion.summary.method, why_method(scene, run.motion.summary), scene.step_tolerance()));
  plan.emplace_back(scene.formulation == "multipliers" ? "formulation: redundant coordinates, joints by multipliers"
                                                       : "formulation: relative coordinates");
  describe_model(scene, run, plan);
  if (const FieldError field = field_error(scene, run.bodies); field.share > 0)
    plan.push_back(
        fmt::format("orbit: gravity is linear within a body: its next term has {:.0e} of the gradient, and the "
                    "system drifts by {:.0e} m in {:g} s, which counts where its position is asked for",
                    field.share, field.position, scene.duration));
  if (scene.orbit)
    plan.push_back(fmt::format("orbit: rate {:.6e} rad/s{}; differential gravity {}, {:.1e} 1/s^2", scene.orbit->rate(),
                               scene.orbit->J2 ? ", with J2" : "",
                               scene.orbit->gravity == "none" ? "left out" : "on every body",
                               3 * std::pow(scene.orbit->rate(), 2)));
}

/// Errors that no budget measures still show in what the motion conserves. Energies are none of the outputs that a
/// budget measures: their powers may vibrate faster than the steps of an exact method need to follow.
void warn_of_the_balance(const IntegrationSummary& s, RunResult& r) {
  const double allowed = bearable_balance(r.scene.tolerance);
  if (!(s.energy_balance > allowed || s.momentum_drift > allowed)) return;
  const std::string_view consequence =
      r.budget.measured ? "energies may be off by as much, though the error budget of the outputs is what it says; a "
                          "smaller tolerance helps"
                        : "outputs may be off by as much; a smaller tolerance helps, and an error budget measures them";
  r.warnings.push_back(
      fmt::format("{}: more than the {:.1e} that go with the tolerance, so {}", balances(s), allowed, consequence));
}

/// Node sets of a body where joints, springs and loads act, and for which it has no static shape.
std::vector<std::string> loaded_without_shapes(const Scene& scene, const BodyScene& b) {
  std::vector<std::string> places;
  if (!b.is_boom() || !b.is_flexible() || b.structure == "eq14" || b.basis.name != "clamped") return places;
  const auto place_of = [](const std::string& shape) { return shape.substr(0, shape.rfind('.')); };
  std::set<std::string> shaped;
  for (const std::string& shape : b.basis.corrections) shaped.insert(place_of(shape));
  for (const std::string& shape : static_shapes_of_loads(scene, b))
    if (shaped.insert(place_of(shape)).second) places.push_back(place_of(shape));
  return places;
}

/// Modes that bend out of the hinge plane, twist and stretch are left out where the scene says so. What a load bends
/// where it acts takes many modes, or one static shape. A jump of a load reaches a joint as a wave, and no number of
/// modes has its front.
std::string help_with_truncation(const RunResult& r) {
  constexpr double of_fronts = 0.1;
  const OutputErrors* worst = r.budget.worst();
  if (worst == nullptr || !(worst->truncation > r.scene.tolerance / 2)) return "";
  std::vector<std::string> names;
  for (const BodyScene& b : r.scene.bodies)
    if (b.is_boom() && b.is_flexible() && b.structure != "eq14" && b.directions != "all") names.push_back(b.name);
  if (!names.empty())
    return fmt::format("; {} {} modes of the hinge plane alone, and directions = \"all\" takes the others in",
                       fmt::join(names, ", "), names.size() == 1 ? "has" : "have");
  for (const BodyScene& b : r.scene.bodies)
    if (const std::vector<std::string> places = loaded_without_shapes(r.scene, b); !places.empty())
      return fmt::format(
          "; body {} has no static shapes of what acts at {}: corrections = [\"{}.Fy\", ...] or modes = "
          "\"auto\" takes them in",
          b.name, fmt::join(places, ", "), places.front());
  if (!is_load(worst->name) || !(worst->truncation > of_fronts)) return "";
  return "; where a load or a motion sets in at once, loads of joints follow within the time of a wave through the "
         "body, and no number of modes resolves that: let it rise over some periods of the body, or name other outputs";
}

/// What a user must not overlook.
void add_warnings(const Run& run, RunResult& r) {
  constexpr double small = 0.1;  // of its length: beyond, shapes are no longer those of a straight body
  for (size_t i = 0; i < run.bending.size(); ++i)
    if (const Bending& b = run.bending[i]; b.of_length > small)
      r.warnings.push_back(
          fmt::format("body {}: it bends by {:.3g} m at t = {:.6g} s, {:.0f} % of its length: the theory "
                      "of small deflections no longer holds",
                      run.bodies[i].body.name, b.size, b.time, 100 * b.of_length));
  r.warnings.insert(r.warnings.end(), run.motion.warnings.begin(), run.motion.warnings.end());
  for (const PreparedBody& p : run.bodies)  // which the budget says, where it is measured
    if (std::string lack = loads_without_stiffness(r.scene, p.body); !lack.empty() && !r.budget.measured)
      r.warnings.push_back(std::move(lack));
  for (size_t i = 0; i < run.bodies.size(); ++i) {
    const auto body = std::ranges::find(r.scene.bodies, run.bodies[i].body.name, &BodyScene::name);
    if (body == r.scene.bodies.end() || !body->is_boom() || body->structure != "beam") continue;
    if (const std::string doubt = doubt_of_modes(body->geometry, run.bodies[i].body); !doubt.empty())
      r.warnings.push_back(fmt::format("body {}: {}", body->name, doubt));
  }
  constexpr Eigen::Index few = 5;
  if (const Eigen::Index rows = run.outputs.values.rows(); r.budget.measured && rows < few)
    r.warnings.push_back(
        fmt::format("outputs have {} rows, and errors are measured at them alone; a smaller "
                    "output_step shows what is between",
                    rows));
  warn_of_the_balance(run.motion.summary, r);
  if (!r.budget.measured || r.budget.within(r.scene.tolerance)) return;
  const std::string why =
      r.budget.missing.empty()
          ? fmt::format("the errors add up to {:.1e}{}", r.budget.total(),
                        r.budget.worst() ? fmt::format(" in {}", description(*r.budget.worst())) : "")
          : fmt::format("{}", fmt::join(r.budget.missing, "; "));
  r.warnings.push_back(fmt::format("the accuracy wanted, {:.1e}, was not reached or not proven: {}{}",
                                   r.scene.tolerance, why, help_with_truncation(r)));
}

/// What was flown and what is odd about it.
void add_words(const Run& run, RunResult& r) {
  if (r.scene.from)
    r.plan.push_back(fmt::format("start: goes on from {} at t = {:g} s; counts and errors are those since then",
                                 r.scene.from->file().string(), r.scene.from->time()));
  describe(with_joints(r.scene), run, r.plan);
  r.warnings.insert(r.warnings.end(), r.scene.warnings.begin(), r.scene.warnings.end());
}

}  // namespace

RunResult run_scene(const Scene& given, const RunHooks& asked,
                    const std::function<void(const RunResult& so_far, size_t first)>& so_far) {
  PreparedBodies made;
  RunHooks hooks = asked;
  if (hooks.bodies == nullptr) hooks.bodies = &made;
  RunResult r;
  r.scene = given;
  validate(r.scene);
  r.scene = with_steady_motions(r.scene);
  FlightsAhead ahead;
  hooks.ahead = &ahead;
  Planner planner(r.scene);
  planner.choose(r.scene, hooks, r.plan);
  RunHooks of_run = hooks;
  if (so_far)
    of_run.checkpoint = [&](Run run, size_t first) {
      RunResult part = r;
      add_words(run, part);
      part.warnings.insert(part.warnings.end(), run.motion.warnings.begin(), run.motion.warnings.end());
      static_cast<SimulatedMotion&>(part) = std::move(run);
      part.motion.summary.interrupted = false;  // not yet
      so_far(part, first);
    };
  Run run = run_once(r.scene, of_run);
  std::vector<std::string> words;  // of the budget
  std::string warning;
  // The repeats cost many times the run; a long one is not repeated, unless there are cheaper means.
  constexpr long worth_repeating = 2'000'000;
  const bool repeat = run.motion.summary.rhs_evaluations <= worth_repeating || by_cheapest_means(r.scene);
  if (r.scene.error_budget && !repeat)
    warning = fmt::format("the error budget was not measured: its repeats would cost many times {} evaluations",
                          run.motion.summary.rhs_evaluations);
  const auto tell_before_the_repeats = [&] {  // which may take long
    if (of_run.checkpoint) of_run.checkpoint(run, 0);
  };
  if (r.scene.error_budget && repeat && !run.motion.summary.interrupted) {
    const Stopwatch start;
    tell_before_the_repeats();
    r.budget = measure_budget(r.scene, run, hooks, words, planner.still());
    for (RunResult whole = r; planner.improve(r.scene, r.budget, hooks, r.plan); whole = r) {
      Run better = run_once(r.scene, of_run);
      if (better.motion.summary.interrupted) {  // a part of a run is worth less than a whole one
        r = std::move(whole);
        break;
      }
      run = std::move(better);
      tell_before_the_repeats();
      words.clear();
      r.budget = measure_budget(r.scene, run, hooks, words, planner.still());
    }
    r.budget_seconds = start.seconds();
  } else if (repeat && !run.motion.summary.interrupted) {
    warning = settle_pointing(r.scene, run, hooks, words);
  }
  add_words(run, r);
  r.plan.insert(r.plan.end(), words.begin(), words.end());
  if (!warning.empty()) r.warnings.push_back(warning);
  add_warnings(run, r);
  static_cast<SimulatedMotion&>(r) = std::move(run);
  if (r.scene.verify && !r.motion.summary.interrupted) r.checks = reference_checks(r, hooks);
  return r;
}

}  // namespace flexboom
