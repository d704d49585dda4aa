#include "apps/accuracy/error_budget.hpp"

#include "apps/accuracy/field_error.hpp"
#include "apps/accuracy/late_vibrations.hpp"
#include "apps/accuracy/time_error.hpp"
#include "apps/accuracy/variants.hpp"
#include "apps/model/bounded_modes.hpp"
#include "apps/model/prepared_body.hpp"
#include "apps/model/static_shapes.hpp"
#include "apps/simulate/flights_ahead.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace flexboom {

namespace {

using Richer = std::optional<ReducedBody> RicherBodies::*;

bool has(const BodyScene& b, Richer richer) { return b.richer && ((*b.richer).*richer).has_value(); }

/// Does the model of any body leave elasticity or modes out? What is said to be rigid is.
bool any_elastic(const Scene& scene, std::string_view structure = "") {
  return std::ranges::any_of(scene.bodies, [&](const BodyScene& b) {
    return !b.rigid && b.structure != "rigid" && (structure.empty() || b.structure == structure);
  });
}

/// @throws InputError where a body from a file has no such richer one, though its model has more to say; `what`: in
/// words.
void require_richer(const Scene& scene, Richer richer, std::string_view what) {
  for (const BodyScene& b : scene.bodies) {
    const bool is_exact = richer == &RicherBodies::finer_elements && b.structure == "eq14";
    if (b.reduced && b.reduced->structure != "rigid" && !is_exact && !has(b, richer))
      throw InputError(fmt::format("body {} was reduced before, and its file has no {}", b.name, what));
  }
}

/// @throws InputError where a body from a file is loaded where the one with more modes has no static shapes.
void require_static_shapes(const Scene& scene) {
  for (const BodyScene& b : scene.bodies) {
    const std::vector<std::string> markers = loads_without_shapes(scene, b);
    if (!markers.empty())
      throw InputError(
          fmt::format("body {} is loaded at {}, where its file has no static shapes; reduce it again, with "
                      "--loads-at of four places at most",
                      b.name, fmt::join(markers, ", ")));
  }
}

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

/// Flies a scene again, and compares.
struct Repeats {
  RunHooks hooks;
  OutputFloors floors;

  /// Another flight at a bearable cost. @throws NumericalError where it was interrupted: a part of a run has no error.
  Run repeated(const Run& run, const Scene& other, int refine = 0) const {
    Run again = fly(other, hooks, refine, bearable_steps(run));
    if (again.motion.summary.interrupted) throw NumericalError("interrupted");
    return again;
  }

  std::vector<OutputDifference> difference(const OutputTable& a, const OutputTable& b, const Scene& scene) const {
    return compare_outputs(without_coordinates(a), without_coordinates(b), scene.outputs, floors);
  }
  std::vector<OutputDifference> difference(const Run& run, const Run& other, const Scene& scene) const {
    return difference(run.outputs, other.outputs, scene);
  }

  /// Differences of the outputs of another flight. Those that count must not be that flight's own errors of time, which
  /// contacts can make many tolerances. Where they are not far beyond the tolerance, the scene is flown again with a
  /// digit more, unless they are far larger than the error of time of the run, or borne as they are. `time_error` is
  /// that; NaN: nobody knows.
  std::vector<OutputDifference> change(
      const Run&, const Scene& other, double time_error, int refine = 0,
      const std::function<bool(const std::vector<OutputDifference>&)>& borne = {}) const;

  /// May differences be errors of time?
  bool may_be_of_time(double differences, double time_error) const {
    constexpr double counts = 1.0 / 3, beyond_doubt = 100, far_larger = 30;
    const double of_tolerance = differences / floors.tolerance;
    return of_tolerance > counts && of_tolerance < beyond_doubt && !(differences > far_larger * time_error);
  }
};

/// What a repeat has found.
struct Finding {
  std::vector<OutputDifference> differences{};
  double factor = 1;  // the error for each difference
};

using Part = double OutputErrors::*;

/// Rates of joints that do not float converge as 1 / n where a torque is there at once. It turns the root of a body as
/// fast as that part of it turns which has felt it: more modes, a smaller part.
bool is_rate_of_joint(const std::string& output, const std::vector<JointScene>& joints) {
  return std::ranges::any_of(joints, [&output](const JointScene& joint) {
    return !joint_type(joint.kind).floats && output.starts_with(joint.name + ".rate");
  });
}

/// What fills a budget.
struct Measuring {
  Repeats repeats;
  std::vector<std::string>& plan;
  ErrorBudget budget{};
  std::set<std::string> slow{};  // rates that converge as loads do
  double slow_per_change = 2;    // their truncation for what the modes beyond change

  /// The truncation of an output for what modes beyond change. A motion converges like 1 / n^2 or faster, so that as
  /// many modes more change three quarters of the error or more. A jump of an acceleration rings all modes of a body,
  /// and a load of its joint converges like their effective mass: as 1 / n. As many modes more change half of it then.
  double truncation_per_change(const std::string& output) const {
    return is_load(output) ? 2 : slow.contains(output) ? slow_per_change : 1.25;
  }

  /// Would these truncations keep the tolerance with the other parts, though the repeat has an error of time of its
  /// own?
  bool are_borne(const std::vector<OutputDifference>& changes) const {
    return std::ranges::all_of(budget.outputs, [&](const OutputErrors& o) {
      const auto d = std::ranges::find(changes, o.name, &OutputDifference::name);
      if (d == changes.end()) return true;
      return o.known() + truncation_per_change(o.name) * (d->error + o.time) <= repeats.floors.tolerance;
    });
  }

  void missing(std::string_view part, std::string_view why) {
    budget.missing.push_back(fmt::format("{} not measured: {}", part, why));
  }

  /// Enters what a repeat has changed in each output, and `more` of it, in its unit. Returns the largest.
  double enter(Part part, const Finding& finding, const std::function<double(const OutputErrors&)>& more = {}) {
    double most = 0;
    for (OutputErrors& o : budget.outputs) {
      const auto d = std::ranges::find(finding.differences, o.name, &OutputDifference::name);
      const bool is_known = d != finding.differences.end();
      const double error = is_known ? finding.factor * d->error : 0, before = o.largest_part().second;
      if (is_known) o.scale = std::max(o.scale, d->scale), o.size = std::max(o.size, d->size);
      o.*part = error + (o.scale > 0 && more ? more(o) / o.scale : 0);
      if (error > before) o.when = d->time;
      most = std::max(most, o.*part);
    }
    return most;
  }
};

std::vector<OutputDifference> Repeats::change(
    const Run& run, const Scene& other, double time_error, int refine,
    const std::function<bool(const std::vector<OutputDifference>&)>& borne) const {
  std::vector<OutputDifference> differences = difference(run, repeated(run, other, refine), other);
  if (!may_be_of_time(largest(differences), time_error) || hooks.stopped()) return differences;
  if (borne && borne(differences)) return differences;
  return difference(run, repeated(run, with_a_digit_more(other), refine), other);
}

/// The modes left out, and whether they are flown with fewer digits than the run.
struct Beyond {
  Scene scene;
  bool has_few_digits = false;
  std::optional<Scene> kept{};  // the run with the elements of that scene, where it has finer ones
};

/// Where tones make modes go on, elements are finer.
std::optional<Scene> with_elements_of(const Scene& richer, const ErrorBudget& budget, Scene flown) {
  bool any = false;
  for (size_t i = 0; i < flown.bodies.size(); ++i) {
    BodyScene& b = flown.bodies[i];
    if (b.structure != "beam" || !budget.reach.contains(b.name)) continue;
    b.geometry = richer.bodies[i].geometry;
    any = true;
  }
  return any ? std::optional(std::move(flown)) : std::nullopt;
}

/// Loads converge slowly.
ModesBeyond number_beyond(const ErrorBudget& budget) {
  return {.as_many = std::ranges::any_of(budget.outputs, is_load, &OutputErrors::name)};
}

/// Nothing where no body is elastic. The modes are flown with few digits first: more only where the answer would drown
/// in the error of time integration. Those among `shaken` are taken in whose effect is more than the least.
/// @throws InputError where the scene has no more modes.
std::optional<Beyond> modes_beyond(const Scene& scene, const Scene& flown, const StillKinds& still, ErrorBudget& budget,
                                   const RunHooks& hooks, const ShakenModes& shaken = {}, double least = 0) {
  require_richer(scene, &RicherBodies::more_modes, "more modes");
  require_static_shapes(scene);
  if (!any_elastic(scene)) return {};
  if (scene.from) throw InputError("a saved state knows nothing of modes beyond its own");
  const DriveSpectra drives(flown);
  const ModesBeyond beyond = number_beyond(budget);
  budget.reach = with_shaken(reach_of_drives(flown, beyond, drives, hooks), shaken, least);
  Scene more = with_more_modes(flown, beyond, budget.reach, hooks);
  require_drives_shown(more, drives, hooks);
  require_reached(more, budget.reach, hooks);
  Beyond r{without_kinds(std::move(more), still, hooks)};
  r.kept = with_elements_of(r.scene, budget, flown);
  constexpr double few_digits = 1e-5;
  r.has_few_digits = flown.tolerance < few_digits;
  if (r.has_few_digits) r.scene.tolerance = few_digits, r.scene.integrator_tolerance = 0;
  return r;
}

/// Of the body where they are most.
double modes_by_modes_beyond(const Scene& flown, const Scene& richer) {
  const auto modes = [](const BodyScene& b) {
    return b.reduced ? b.reduced->n() : b.shapes.empty() ? b.modes : static_cast<int>(std::ssize(b.shapes));
  };
  double most = 0;
  for (size_t i = 0; i < flown.bodies.size(); ++i) {
    const int all = modes(richer.bodies[i]), beyond = all - modes(flown.bodies[i]);
    if (beyond > 0) most = std::max(most, static_cast<double>(all) / beyond);
  }
  return most;
}

/// What modes beyond those of a run change, and what still more would.
Finding truncation_of(std::optional<Beyond> beyond, const Run& run, const Scene& flown, const Measuring& m) {
  if (!beyond) return {};
  const Repeats& repeats = m.repeats;
  const double time_error = m.budget.time;
  const auto borne = [&m](const std::vector<OutputDifference>& changes) { return m.are_borne(changes); };
  Scene& more = beyond->scene;
  std::optional<Run> with_finer_elements;
  if (beyond->kept) with_finer_elements = repeats.repeated(run, *beyond->kept);
  const Run& kept = with_finer_elements ? *with_finer_elements : run;
  // A digit more may be wanted as well.
  if (!beyond->has_few_digits && repeats.may_be_of_time(repeats.floors.tolerance, time_error))
    fly_ahead(with_a_digit_more(more), repeats.hooks, 0, bearable_steps(run));
  Finding r{repeats.change(kept, more, beyond->has_few_digits ? unknown : time_error, 0, borne)};
  give_up_ahead(repeats.hooks);
  const double noise = time_error > flown.step_tolerance() ? time_error / flown.step_tolerance() : 1;
  if (beyond->has_few_digits && largest(r.differences) <= 10 * noise * more.tolerance) {
    more.tolerance = flown.tolerance, more.integrator_tolerance = flown.integrator_tolerance;
    r.differences = repeats.change(kept, more, time_error, 0, borne);
  }
  for (OutputDifference& d : r.differences) d.error *= m.truncation_per_change(d.name);
  return r;
}

/// What finer elements change. @throws InputError where the scene has none.
Finding discretisation_of(const Scene& scene, const Run& run, const Scene& flown, const Measuring& m) {
  require_richer(scene, &RicherBodies::finer_elements, "finer elements");
  if (!any_elastic(scene, "beam") && !any_elastic(scene, "solid")) return {};
  const Finer next = finer_elements(flown);
  return {m.repeats.change(run, flown, m.budget.time, next.steps), next.error_per_change};
}

/// All that the scene leaves to the program.
Scene with_stiffening_left_open(const Scene& scene, Scene flown) {
  for (size_t i = 0; i < scene.bodies.size(); ++i)
    if (scene.bodies[i].stiffening == "auto") flown.bodies[i].stiffening = "on";
  return flown;
}

/// Is there any that is off?
bool any_open_stiffening(const Scene& scene, const Scene& flown) {
  for (size_t i = 0; i < scene.bodies.size(); ++i)
    if (scene.bodies[i].stiffening == "auto" && flown.bodies[i].stiffening == "off") return true;
  return false;
}

bool all_stiffening_is_on(const Scene& scene) {
  return std::ranges::all_of(
      scene.bodies, [](const BodyScene& b) { return b.rigid || b.structure == "rigid" || b.stiffening == "on"; });
}

bool leaves_stiffening_out(const Run& run) {
  for (size_t i = 0; i < run.bodies.size(); ++i)
    if (run.bodies[i].body.n() > 0 && run.tree->stiffening(static_cast<int>(i)) == Stiffening::off) return true;
  return false;
}

/// A body of which nobody knows what geometric stiffness would do; nullptr: there is none.
const ReducedBody* any_without_stiffness(const Run& run, const Scene& scene) {
  const std::vector<BodyScene> bodies = with_joints(scene).bodies;
  for (size_t i = 0; i < run.bodies.size(); ++i) {
    const ReducedBody& body = run.bodies[i].body;
    if (body.n() > 0 && body.Kg.spin.empty() && (body.structure == "eq14" || !bodies[i].is_boom())) return &body;
  }
  return nullptr;
}

/// Adds errors of the same outputs; the time is that of the larger one.
void add(std::vector<OutputDifference>& sum, const std::vector<OutputDifference>& more) {
  if (sum.empty()) {
    sum = more;
    return;
  }
  for (OutputDifference& d : sum) {
    const auto other = std::ranges::find(more, d.name, &OutputDifference::name);
    if (other == more.end()) continue;
    if (other->error > d.error) d.time = other->time;
    d.error += other->error;
  }
}

/// Of the error of time: other parts come beside it.
Settling settling_of(const Scene& scene) { return {scene.tolerance / 3, 2, bearable_balance(scene.tolerance)}; }

/// What gravity beyond its gradient changes by way of the motion, which it makes run ahead or behind: measured with a
/// stronger gradient. Nothing where that is far below the tolerance.
std::vector<OutputDifference> of_field(const FieldError& field, const Run& run, const Scene& flown,
                                       const Repeats& repeats) {
  constexpr double stronger = 10, counts = 1e-2;  // times the share, and of the tolerance
  const double grown = field.share * std::max(1.0, field.turns * field.turns);
  if (!(grown > counts * repeats.floors.tolerance)) return {};
  Scene other = flown;
  other.gravity_strength = 1 + stronger * field.share;
  std::vector<OutputDifference> differences = repeats.difference(run, repeats.repeated(run, other), flown);
  for (OutputDifference& d : differences) d.error /= stronger;
  return differences;
}

/// What geometric stiffness changes where it is left out, and what is left out even with it. The latter is the square
/// of the deflection, and vibrations whose frequency depends on it. Where geometric stiffness changes too much and the
/// scene leaves it open, the scene has it from then on. A run with it then takes the place of `run`.
double linearisation_error(Scene& scene, Scene& flown, Run& run, Measuring& m) {
  if (const ReducedBody* body = any_without_stiffness(run, flown)) {
    m.missing("linearisation", fmt::format("body {} has no geometric stiffness", body->name));
    return unknown;
  }
  for (const PreparedBody& p : run.bodies)
    if (const std::string lack = loads_without_stiffness(scene, p.body); !lack.empty()) {
      m.missing("linearisation", lack);
      return unknown;
    }
  std::vector<OutputDifference> differences;
  Run stiffened;
  if (leaves_stiffening_out(run)) {
    stiffened = m.repeats.repeated(run, with_stiffening(flown));
    differences = m.repeats.difference(run, stiffened, flown);
  }
  const double bearable = scene.tolerance / 3;
  if (largest(differences) > bearable && any_open_stiffening(scene, flown)) {
    Scene with_it = with_stiffening_left_open(scene, flown);
    if (!all_stiffening_is_on(with_it)) stiffened = run_once(with_it, m.repeats.hooks);
    if (stiffened.motion.summary.interrupted) throw NumericalError("interrupted");
    flown = std::move(with_it);
    scene = with_stiffening_left_open(scene, scene);
    m.budget.has_stiffened = true;
    run = std::move(stiffened);
    m.plan.push_back(fmt::format("geometric stiffness changes the outputs by {:.1e}: the run that is kept has it",
                                 largest(differences)));
    differences.clear();
    if (leaves_stiffening_out(run)) differences = m.repeats.change(run, with_stiffening(flown), unknown);
  }
  add(differences, m.repeats.difference(run.outputs, with_late_vibrations(run, flown), flown));
  double deflection = 0;
  for (const Bending& b : run.bending) deflection = std::max(deflection, b.of_length);
  const std::vector<std::string> given = prescribed_outputs(scene);
  const FieldError field = field_error(scene, run.bodies);
  add(differences, of_field(field, run, flown, m.repeats));
  const auto left_out = [&](const OutputErrors& o) {
    if (std::ranges::find(given, o.name) != given.end()) return 0.0;
    const double drift = !names_output(scene.outputs, o.name) ? 0
                         : o.name.ends_with(".position")      ? field.position
                         : o.name.ends_with(".velocity")      ? field.velocity
                                                              : 0;
    return (deflection * deflection + field.share) * o.size + drift;
  };
  return m.enter(&OutputErrors::linearisation, {differences}, left_out);
}

}  // namespace

namespace {

/// Of a run, from repeats of it. `digits`: what is said of those that its integrator gets.
ErrorBudget budget_by_repeats(Scene& scene, Run& run, const RunHooks& hooks, std::vector<std::string>& plan,
                              std::vector<std::string>& digits, const StillKinds& still) {
  Measuring m{{hooks, floors_of(scene, run.bodies)}, plan};
  ErrorBudget& budget = m.budget;
  Scene flown = as_flown(scene, run);
  const std::vector<JointScene> joints = with_joints(scene).joints;
  for (const OutputDifference& d : compare_outputs(run.outputs, run.outputs, scene.outputs, m.repeats.floors)) {
    budget.outputs.push_back({});
    OutputErrors& o = budget.outputs.back();
    o.name = d.name, o.scale = d.scale, o.size = d.size;
    if (is_rate_of_joint(o.name, joints)) m.slow.insert(o.name);
  }
  const auto measured = [&m, &hooks](std::string_view part, const auto& repeat) {
    if (hooks.stopped()) return unknown;
    try {  // the run that is repeated outlives a failure
      return repeat();
    } catch (const std::runtime_error& e) {
      m.missing(part, e.what());
      return unknown;
    }
  };
  std::optional<Beyond> beyond;
  std::string beyond_what;
  bool has_beyond = true;
  const auto still_now = [&] { return budget.has_stiffened ? StillKinds{} : still; };
  // The longest of the repeats: it is flown while others are, and anew where these change the run.
  const auto look_beyond = [&] {
    if (!has_beyond || std::exchange(beyond_what, to_toml(flown)) == beyond_what) return;
    give_up_ahead(hooks);
    const double found = measured("truncation", [&] {
      beyond = modes_beyond(scene, flown, still_now(), budget, hooks);
      if (!beyond) return 0.0;
      m.slow_per_change = std::max(2.0, modes_by_modes_beyond(flown, beyond->scene));
      fly_ahead(beyond->scene, hooks, 0, bearable_steps(run));
      return 0.0;
    });
    has_beyond = !std::isnan(found);
  };
  look_beyond();
  budget.linearisation = measured("linearisation", [&] { return linearisation_error(scene, flown, run, m); });
  look_beyond();
  budget.time = measured("time", [&] {
    const Settling asked = settling_of(scene);
    constexpr double of_tighter = 1.15;  // a flight with a digit more has a tenth of the error left
    return m.enter(&OutputErrors::time,
                   {settle_time_error(flown, run, m.repeats.floors, asked, hooks, digits), of_tighter});
  });
  scene.integrator_tolerance = flown.integrator_tolerance;
  look_beyond();
  budget.discretisation = measured("discretisation", [&] {
    return m.enter(&OutputErrors::discretisation, discretisation_of(scene, run, flown, m));
  });
  if (has_beyond)
    budget.truncation = measured("truncation", [&] {
      constexpr double of_truncation = 1.0 / 3;
      ShakenModes shaken;  // found while the modes beyond are flown
      if (beyond)
        shaken = shaken_modes(flown, number_beyond(budget), budget.reach, MotionSpectra(flown, run, hooks), hooks);
      Finding found = truncation_of(beyond, run, flown, m);
      const double least = std::max(counting_effect * scene.tolerance, of_truncation * largest(found.differences));
      if (any_counts(shaken, least)) {
        beyond = modes_beyond(scene, flown, still_now(), budget, hooks, shaken, least);
        m.slow_per_change = std::max(2.0, modes_by_modes_beyond(flown, beyond->scene));
        found = truncation_of(beyond, run, flown, m);
      }
      return m.enter(&OutputErrors::truncation, found);
    });
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
