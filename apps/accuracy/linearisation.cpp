#include "apps/accuracy/linearisation.hpp"

#include "apps/accuracy/field_error.hpp"
#include "apps/accuracy/late_vibrations.hpp"
#include "apps/accuracy/variants.hpp"
#include "apps/model/prepared_body.hpp"
#include "apps/model/static_shapes.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace flexboom {

namespace {

/// With all geometric stiffness that the scene leaves to the program.
Scene with_stiffening_left_open(const Scene& scene, Scene flown) {
  for (size_t i = 0; i < scene.bodies.size(); ++i)
    if (scene.bodies[i].stiffening == "auto") flown.bodies[i].stiffening = "on";
  return flown;
}

/// Is any of it off?
bool any_open_stiffening(const Scene& scene, const Scene& flown) {
  for (size_t i = 0; i < scene.bodies.size(); ++i)
    if (scene.bodies[i].stiffening == "auto" && flown.bodies[i].stiffening == "off") return true;
  return false;
}

bool all_stiffening_is_on(const Scene& scene) {
  return std::ranges::all_of(scene.bodies, [](const BodyScene& b) { return !b.is_flexible() || b.stiffening == "on"; });
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

}  // namespace

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

}  // namespace flexboom
