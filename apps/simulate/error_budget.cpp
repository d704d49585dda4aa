#include "apps/simulate/error_budget.hpp"

#include "apps/model/bounded_modes.hpp"
#include "apps/model/prepared_body.hpp"
#include "apps/model/static_shapes.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

namespace flexboom {

namespace {

using Richer = std::optional<ReducedBody> RicherBodies::*;

bool has(const BodyScene& b, Richer richer) { return b.richer && ((*b.richer).*richer).has_value(); }

std::map<std::string, int> kinds_of(const PreparedBody& p) {
  std::map<std::string, int> kinds;
  for (int k = 0; k < p.coordinates_of_modes(); ++k) ++kinds[p.body.coordinates[static_cast<size_t>(k)].kind];
  return kinds;
}

/// Where the modes of a body are among all that bend in either plane, twist or stretch it. `whole` is the body with all
/// shapes of its directions, `all` with those of all directions. The n-th of a kind here is the n-th of it there.
std::vector<int> places_of(const BodyScene& b, const PreparedBody& whole, const PreparedBody& all) {
  std::map<std::string, std::vector<int>> of_kind;
  for (const Coordinate& c : all.body.coordinates)
    of_kind[c.kind].push_back(static_cast<int>(&c - all.body.coordinates.data()) + 1);
  std::map<std::string, size_t> count;
  std::vector<int> places;
  for (int k = 1; k <= whole.body.n(); ++k) {
    const std::string& kind = whole.body.coordinates[static_cast<size_t>(k) - 1].kind;
    const size_t n = count[kind]++;
    const bool is_own = b.shapes.empty() || std::ranges::find(b.shapes, k) != b.shapes.end();
    if (is_own && n < of_kind[kind].size()) places.push_back(of_kind[kind][n]);
  }
  return places;
}

/// The lowest modes of all directions: the `highest` that is kept, and enough beyond those of each kind in `kinds`.
/// Those of beams go on until some stretch and some twist; where none do, static shapes stand for them.
/// What lies beyond `resolved` the elements do not know.
BodyScene with_modes_beyond(BodyScene b, int highest, int resolved, const ModesBeyond& more,
                            const std::map<std::string, int>& kinds, const std::filesystem::path& keep,
                            const RunHooks& hooks) {
  constexpr int most = 64;
  b.shapes.clear();
  b.directions = "all";
  for (int i = 1;; i *= 2) {
    const int wanted = std::max(highest, std::min(highest + 2 * i * more.of(0), resolved));
    b = with_modes(std::move(b), wanted, keep, hooks);
    const PreparedBody all = prepared(b, 0, keep, hooks);
    std::map<std::string, int> count = kinds_of(all);
    const bool enough =
        std::ranges::all_of(kinds, [&](const auto& k) { return count[k.first] >= k.second + more.of(k.second); });
    const std::vector<std::string> statics = static_shapes_beside(all.body, b.clamp);
    const bool has_more = b.modes == wanted && wanted < std::min(highest + most, resolved);
    if (has_more && (!enough || (b.structure == "beam" && !statics.empty()))) continue;
    return with_static_shapes(b, statics);
  }
}

/// Its own modes and the lowest beside them: half as many of kinds that it has not.
BodyScene with_more_of_each_kind(const BodyScene& b, const ModesBeyond& more, const std::filesystem::path& keep,
                                 const RunHooks& hooks) {
  const bool in_plane = b.directions != "all";
  BodyScene own = b;
  own.shapes.clear();
  const std::map<std::string, int> kinds = kinds_of(prepared(b, 0, keep, hooks));
  const PreparedBody whole = prepared(own, 0, keep, hooks);
  const int dofs = b.modes > 0 ? whole.dofs : prepared(with_modes(own, 2, keep, hooks), 0, keep, hooks).dofs;
  const int resolved = dofs > 0 ? dofs / 2 : std::numeric_limits<int>::max();  // a closed form has all
  BodyScene richer = with_modes_beyond(b, in_plane ? 2 * b.modes : b.modes, resolved, more, kinds, keep, hooks);
  const PreparedBody all = prepared(richer, 0, keep, hooks);
  const std::vector<int> places = places_of(b, whole, all);
  std::map<std::string, int> beside;
  for (int k = 1; k <= all.coordinates_of_modes(); ++k) {
    const std::string& kind = all.body.coordinates[static_cast<size_t>(k) - 1].kind;
    const auto own_kind = kinds.find(kind);
    const int of_kind = own_kind != kinds.end() ? more.of(own_kind->second)
                        : kinds.empty()         ? more.of(0)
                                                : more.of(0) / 2;
    if (std::ranges::find(places, k) != places.end() || ++beside[kind] <= of_kind) richer.shapes.push_back(k);
  }
  return richer;
}

}  // namespace

BodyScene with_modes(BodyScene b, int wanted, const std::filesystem::path& keep, const RunHooks& hooks) {
  b.shapes.clear();
  for (b.modes = wanted; b.modes > 2;) {
    try {
      prepared(b, 0, keep, hooks);
      break;
    } catch (const InputError&) {  // that is another fault where two modes have it, too
      b.modes -= 2;
    } catch (const NumericalError&) {  // nearly all modes of the elements: the last are beyond any solver
      b.modes -= std::max(2, b.modes / 4);
    }
  }
  b.modes = std::max(b.modes, std::min(wanted, 2));
  return b;
}

Scene with_more_modes(Scene scene, const ModesBeyond& more, const RunHooks& hooks) {
  for (BodyScene& b : scene.bodies) {
    if (has(b, &RicherBodies::more_modes)) {
      b.reduced = {b.richer, &*b.richer->more_modes};
      b.richer = nullptr;  // of those modes there is nothing finer
    }
    if (b.structure == "rigid" || !b.is_boom()) continue;
    if (b.basis.name == "clamped") {
      b = with_more_of_each_kind(b, more, scene.bodies_kept_in, hooks);
      b = with_static_shapes(b, static_shapes_of_loads(scene, b));
      continue;
    }
    const int per_plane = b.directions == "all" ? (b.modes + 1) / 2 : b.modes;
    b.modes = 2 * (per_plane + more.of(per_plane));
    b.directions = "all";
    b.shapes.clear();
  }
  return scene;
}

long bearable_steps(const Run& run) { return 20 * run.motion.summary.steps + 10000; }

Scene without_kinds(Scene scene, const StillKinds& still, const RunHooks& hooks) {
  for (BodyScene& b : scene.bodies) {
    const auto kinds = still.find(b.name);
    if (kinds == still.end() || kinds->second.empty()) continue;
    const PreparedBody p = prepared(b, 0, scene.bodies_kept_in, hooks);
    std::vector<int> moving;
    const auto modes = static_cast<size_t>(p.coordinates_of_modes());
    for (size_t k = 0; k < modes; ++k)
      if (!kinds->second.contains(p.body.coordinates[k].kind))
        moving.push_back(p.shapes.empty() ? static_cast<int>(k) + 1 : p.shapes[k]);
    if (moving.size() == modes) continue;
    b.shapes = std::move(moving);
    if (b.shapes.empty()) b.modes = 0;
  }
  return scene;
}

OutputTable without_coordinates(const OutputTable& table) {
  OutputTable r;
  std::vector<Eigen::Index> kept;
  for (size_t i = 0; i < table.names.size(); ++i) {
    if (is_coordinate(table.names[i])) continue;
    r.names.push_back(table.names[i]);
    kept.push_back(static_cast<Eigen::Index>(i));
  }
  r.values = table.values(Eigen::all, kept);
  return r;
}

Scene with_stiffening(Scene scene) {
  for (BodyScene& b : scene.bodies)
    if (!b.rigid && b.structure != "rigid") b.stiffening = "on";
  return scene;
}

Scene as_flown(Scene scene, const Run& run) {
  for (BodyScene& b : scene.bodies) {
    const auto body = std::ranges::find(run.bodies, b.name, [](const PreparedBody& p) { return p.body.name; });
    if (b.stiffening != "auto" || body == run.bodies.end()) continue;
    const auto index = static_cast<int>(body - run.bodies.begin());
    b.stiffening = run.tree->stiffening(index) == Stiffening::off ? "off" : "on";
  }
  return scene;
}

namespace {

/// Does the model of any body leave elasticity or modes out? What is said to be rigid is.
bool any_elastic(const Scene& scene, std::string_view structure = "") {
  return std::ranges::any_of(scene.bodies, [&](const BodyScene& b) {
    return !b.rigid && b.structure != "rigid" && (structure.empty() || b.structure == structure);
  });
}

/// The first body from a file that has no such richer one, though its model has more to say.
const BodyScene* any_without(const Scene& scene, Richer richer) {
  const auto found = std::ranges::find_if(scene.bodies, [&](const BodyScene& b) {
    const bool is_exact = richer == &RicherBodies::finer_elements && b.structure == "eq14";
    return b.reduced && b.reduced->structure != "rigid" && !is_exact && !has(b, richer);
  });
  return found == scene.bodies.end() ? nullptr : &*found;
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
    if (b.structure != "solid" || !b.is_boom()) continue;
    r.steps = 1;
    r.error_per_change = std::max(r.error_per_change, 1 / (1 - slowest_fall(b)));
    if (!is_bearable(mesh_of(b, r.steps)))
      throw InputError(fmt::format("the next finer elements of body {} are too many", b.name));
  }
  return r;
}

using Part = double OutputErrors::*;

/// What fills a budget.
struct Measuring {
  const RunHooks& hooks;
  std::vector<std::string>& plan;
  OutputFloors floors;
  ErrorBudget budget{};

  bool stopped() const { return hooks.interrupt != nullptr && hooks.interrupt->load(); }

  void missing(std::string_view part, std::string_view why) {
    budget.missing.push_back(fmt::format("{} not measured: {}", part, why));
  }

  /// Enters what a repeat has changed in each output, `factor` times, and `more` of the largest value of each. Returns
  /// the largest.
  double enter(Part part, const std::vector<OutputDifference>& differences, double more = 0, double factor = 1) {
    double most = 0;
    for (OutputErrors& o : budget.outputs) {
      const auto d = std::ranges::find(differences, o.name, &OutputDifference::name);
      const double error = d == differences.end() ? 0 : factor * d->error, before = worst_part(o);
      if (d != differences.end()) o.scale = std::max(o.scale, d->scale), o.size = std::max(o.size, d->size);
      o.*part = error + (o.scale > 0 ? more * o.size / o.scale : 0);
      if (error > before) o.when = d->time;
      most = std::max(most, o.*part);
    }
    return most;
  }

  /// What `repeat` says; the run that is repeated outlives its failure.
  template <class Repeat>
  double measured(std::string_view part, const Repeat& repeat) {
    try {
      return repeat();
    } catch (const std::runtime_error& e) {
      missing(part, e.what());
      return unknown;
    }
  }

 private:
  static double worst_part(const OutputErrors& o) {
    double r = 0;
    for (const double error : {o.discretisation, o.truncation, o.time, o.linearisation})
      if (error > r) r = error;
    return r;
  }
};

constexpr double least_tolerance = 1e-13;  // of a flight in comparison: below is round-off

/// A digit more from the integrator.
Scene with_a_digit_more(Scene scene) {
  scene.integrator_tolerance = scene.step_tolerance() / 10;
  return scene;
}

/// Another flight at a bearable cost.
Run repeated(const Run& run, const Scene& other, int refine, const Measuring& m) {
  return run_once(other, m.hooks, refine, bearable_steps(run));
}

std::vector<OutputDifference> difference(const Run& run, const Run& other, const Scene& scene, const Measuring& m) {
  return compare_outputs(without_coordinates(run.outputs), without_coordinates(other.outputs), scene.outputs, m.floors);
}

/// Differences of the outputs of another flight. Those that count must not be its own errors of time, which contacts
/// can make many tolerances: it is flown again with a digit more, where they are not far beyond that.
std::vector<OutputDifference> change(const Run& run, Scene other, int refine, const Measuring& m) {
  constexpr double counts = 1.0 / 3, beyond_doubt = 100;  // times the tolerance
  std::vector<OutputDifference> differences = difference(run, repeated(run, other, refine, m), other, m);
  const double most = largest(differences) / m.floors.tolerance;
  if (!(most > counts && most < beyond_doubt) || m.stopped()) return differences;
  return difference(run, repeated(run, with_a_digit_more(other), refine, m), other, m);
}

/// The modes left out, first with few digits: more only where the answer would drown in the error of time integration.
/// A jump of an acceleration rings all modes of a body, and a load of its joint converges like their effective mass: as
/// 1 / n. What as many modes more change is then half of the error.
double truncation_error(const Run& run, const Scene& flown, const StillKinds& still, Measuring& m) {
  const bool loads = std::ranges::any_of(m.budget.outputs, is_load, &OutputErrors::name);
  Scene more = without_kinds(with_more_modes(flown, {.as_many = loads}, m.hooks), still, m.hooks);
  constexpr double few_digits = 1e-5;
  const bool has_many = flown.integrator_tolerance == 0 && flown.tolerance < few_digits;
  if (has_many) more.tolerance = few_digits;
  std::vector<OutputDifference> differences = change(run, more, 0, m);
  if (has_many && largest(differences) <= 10 * few_digits) {
    more.tolerance = flown.tolerance;
    differences = change(run, more, 0, m);
  }
  for (OutputDifference& d : differences)
    if (is_load(d.name)) d.error *= 2;
  return m.enter(&OutputErrors::truncation, differences);
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

/// What geometric stiffness changes where it is left out, and what then is left out still: of the order of the
/// deflection squared. Where it changes too much and the scene leaves it open, a run with it takes the place of `run`.
double linearisation_error(const Scene& scene, Scene& flown, Run& run, Measuring& m) {
  if (const ReducedBody* body = any_without_stiffness(run, flown)) {
    m.missing("linearisation", fmt::format("body {} has no geometric stiffness", body->name));
    return unknown;
  }
  std::vector<OutputDifference> differences;
  Run stiffened;
  if (leaves_stiffening_out(run)) {
    stiffened = repeated(run, with_stiffening(flown), 0, m);
    differences = difference(run, stiffened, flown, m);
  }
  const double bearable = scene.tolerance / 3;
  if (largest(differences) > bearable && any_open_stiffening(scene, flown)) {
    flown = with_stiffening_left_open(scene, std::move(flown));
    run = all_stiffening_is_on(flown) ? std::move(stiffened) : run_once(flown, m.hooks);
    m.plan.push_back(fmt::format("geometric stiffness changes the outputs by {:.1e}: the run that is kept has it",
                                 largest(differences)));
    differences.clear();
    if (leaves_stiffening_out(run)) differences = change(run, with_stiffening(flown), 0, m);
  }
  double deflection = 0;
  for (const Bending& b : run.bending) deflection = std::max(deflection, b.of_length);
  return m.enter(&OutputErrors::linearisation, differences, deflection * deflection);
}

}  // namespace

OutputFloors floors_of(const Scene& scene, const std::vector<PreparedBody>& bodies) {
  OutputFloors floors{scene.tolerance};
  for (const PreparedBody& p : bodies)  // the largest radius of gyration: what lengths of the scene are like
    floors.length = std::max(floors.length, std::sqrt(p.body.J0.trace() / p.body.m));
  for (const std::string& text : scene.absolute) floors.absolute.push_back(absolute_error(text));
  return floors;
}

std::vector<OutputDifference> settle_time_error(Scene& flown, Run& run, const OutputFloors& floors, int digits,
                                                const RunHooks& hooks, std::vector<std::string>& plan) {
  for (;; --digits) {
    const Scene tight = with_a_digit_more(flown);
    Run finer = run_once(tight, hooks, 0, bearable_steps(run));
    std::vector<OutputDifference> differences = compare_outputs(run.outputs, finer.outputs, flown.outputs, floors);
    const double error = largest(differences);
    const bool is_stopped = hooks.interrupt != nullptr && hooks.interrupt->load();
    if (error <= flown.tolerance / 3 || digits == 0 || is_stopped || tight.step_tolerance() < least_tolerance)
      return differences;
    plan.push_back(fmt::format(
        "time integration: changed by {:.1e} at a tenth of the tolerance {:.0e}; the integrator gets {:.0e}", error,
        flown.step_tolerance(), tight.step_tolerance()));
    run = std::move(finer);
    flown = tight;
  }
}

ErrorBudget measure_budget(Scene& scene, Run& run, const RunHooks& hooks, std::vector<std::string>& plan,
                           const StillKinds& still) {
  Measuring m{hooks, plan, floors_of(scene, run.bodies)};
  ErrorBudget& budget = m.budget;
  Scene flown = as_flown(scene, run);
  for (const OutputDifference& d : compare_outputs(run.outputs, run.outputs, scene.outputs, m.floors)) {
    budget.outputs.push_back({});
    OutputErrors& o = budget.outputs.back();
    o.name = d.name, o.scale = d.scale, o.size = d.size;
  }
  budget.linearisation = m.measured("linearisation", [&] { return linearisation_error(scene, flown, run, m); });
  const auto is_missing = [&](std::string_view part, Richer richer, std::string_view what) {
    const BodyScene* b = any_without(scene, richer);
    if (b != nullptr) m.missing(part, fmt::format("body {} was reduced before, and its file has no {}", b->name, what));
    return b != nullptr;
  };
  if (!m.stopped())
    budget.time = m.measured("time", [&] {
      constexpr int digits = 2;
      return m.enter(&OutputErrors::time, settle_time_error(flown, run, m.floors, digits, m.hooks, m.plan));
    });
  scene.integrator_tolerance = flown.integrator_tolerance;
  const auto none = [&m](Part part) { return m.enter(part, {}); };
  const bool elastic = any_elastic(scene);
  if (!m.stopped() && !is_missing("truncation", &RicherBodies::more_modes, "more modes")) {
    if (scene.from && elastic)
      m.missing("truncation", "a saved state knows nothing of modes beyond its own");
    else if (elastic)
      budget.truncation = m.measured("truncation", [&] { return truncation_error(run, flown, still, m); });
    else
      budget.truncation = none(&OutputErrors::truncation);
  }
  if (!m.stopped() && !is_missing("discretisation", &RicherBodies::finer_elements, "finer elements")) {
    const auto finer = [&] {
      const Finer next = finer_elements(flown);
      return m.enter(&OutputErrors::discretisation, change(run, flown, next.steps, m), 0, next.error_per_change);
    };
    if (any_elastic(scene, "beam") || any_elastic(scene, "solid"))
      budget.discretisation = m.measured("discretisation", finer);
    else
      budget.discretisation = none(&OutputErrors::discretisation);
  }
  budget.measured = !m.stopped();
  for (const std::string& line : budget.missing) plan.push_back("error budget: " + line);
  return budget;
}

}  // namespace flexboom
