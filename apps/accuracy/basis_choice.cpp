// Which modes a body has that its own motion stiffens: those at rest, or those of that motion.

#include "apps/accuracy/basis_choice.hpp"

#include "apps/accuracy/error_budget.hpp"
#include "apps/simulate/steady_motion.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace flexboom {

namespace {

/// What a front moves converges as slowly with either. The modes of the motion are the ones that it vibrates in.
constexpr double slower = 2;

bool is_open(const BodyScene& b) {
  const bool has_plane = b.directions_given && b.directions != "all";
  const bool has_keys = b.basis_given || has_plane || b.clamp != "root" || !b.basis.corrections.empty();
  return !has_keys && b.basis.name == "clamped" && b.structure == "beam" && b.stiffening != "off";
}

bool stiffens(const SteadyMotion& m) { return !m.spin.isZero(0) || !m.acceleration.isZero(0); }

/// By the stiffness of its material.
double stiffening_of(const Run& run, const std::string& body) {
  for (size_t i = 0; i < run.bodies.size(); ++i)
    if (run.bodies[i].body.name == body) return run.motion.stiffening_effect[i].size;
  return 0;
}

double change(const Scene& scene, const Run& few, const Run& more) {
  return largest(compare_outputs(without_coordinates(few.outputs), without_coordinates(more.outputs), scene.outputs,
                                 floors_of(scene, more.bodies)));
}

/// NaN where it cannot fly so.
double change_by_more_modes(const Scene& scene, const std::function<Run(const Scene&, int modes)>& flown) {
  try {
    return change(scene, flown(scene, few_modes), flown(scene, more_modes));
  } catch (const std::runtime_error&) {
    return unknown;
  }
}

/// The motions of the bodies of which modes of the motion can be made. What does not move steadily has none.
Scene with_open_bodies_in_motion(const Scene& scene, const std::vector<size_t>& open) {
  Scene moving = scene;
  for (const size_t i : open)
    if (is_open(moving.bodies[i])) moving.bodies[i].basis.name = "prestressed";
  try {
    return with_steady_motions(std::move(moving));
  } catch (const std::runtime_error&) {
    return scene;
  }
}

}  // namespace

void take_modes_of_the_motion(Scene& scene, const std::vector<size_t>& open,
                              const std::function<Run(const Scene&, int modes)>& flown,
                              std::vector<std::string>& plan) {
  const Scene moving = with_open_bodies_in_motion(scene, open);
  std::vector<size_t> stiffened;
  std::ranges::copy_if(open, std::back_inserter(stiffened), [&](size_t i) {
    const BasisOptions& basis = moving.bodies[i].basis;
    return scene.bodies[i].basis.name == "clamped" && basis.motion && stiffens(*basis.motion);
  });
  if (stiffened.empty()) return;
  const Run few = flown(scene, few_modes);
  std::erase_if(stiffened, [&](size_t i) { return !(stiffening_of(few, scene.bodies[i].name) > 1); });
  if (stiffened.empty()) return;
  const double at_rest = change(scene, few, flown(scene, more_modes));
  Scene other = scene;
  std::vector<std::string> names;
  for (const size_t i : stiffened) {
    other.bodies[i].basis = moving.bodies[i].basis;
    names.push_back(scene.bodies[i].name);
  }
  const double in_motion = change_by_more_modes(other, flown);
  const bool is_better = in_motion < slower * at_rest;
  plan.push_back(
      fmt::format("basis of {}: \"{}\", for {} instead of {} modes change the outputs by {} with modes of "
                  "the steady motion, by {} with those at rest",
                  fmt::join(names, ", "), is_better ? "prestressed" : "clamped", more_modes, few_modes,
                  error_text(in_motion), error_text(at_rest)));
  if (is_better) scene = std::move(other);
}

}  // namespace flexboom
