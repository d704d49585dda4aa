#include "apps/simulate/stiffening_choice.hpp"

#include "apps/simulate/tree_flight.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace flexboom {

using Eigen::VectorXd;

namespace {

bool has_stiffening(const ReducedBody& b) { return b.n() > 0 && !b.Kg.spin.empty(); }

/// Per body: does it lie between the two ends of a spring or of a joint that closes a loop? Such an end holds the body
/// from getting shorter where it bends. So no load tells of its geometric stiffness before that is in the equations.
std::vector<char> held_at_both_ends(const Multibody& bodies) {
  std::vector<int> parent(bodies.bodies.size(), -1);
  for (const Joint& j : bodies.joints)
    if (!j.closes_loop) parent[static_cast<size_t>(j.b.body)] = j.a.body;
  std::vector<char> held(bodies.bodies.size(), 0);
  const auto hold_between = [&](int a, int b) {
    std::vector<int> above;  // a and what carries it
    for (; a >= 0; a = parent[static_cast<size_t>(a)]) above.push_back(a);
    for (; b >= 0; b = parent[static_cast<size_t>(b)]) {
      held[static_cast<size_t>(b)] = 1;
      const auto common = std::ranges::find(above, b);
      if (common == above.end()) continue;
      above.erase(common, above.end());
      break;
    }
    for (const int body : above) held[static_cast<size_t>(body)] = 1;
  };
  for (const Joint& j : bodies.joints)
    if (j.closes_loop) hold_between(j.a.body, j.b.body);
  for (const SpringDamper& s : bodies.springs) hold_between(s.a.body, s.b.body);
  return held;
}

/// A blow of a rigid stop is in no look: it has no duration.
bool has_blows(const Multibody& bodies) {
  return std::ranges::any_of(bodies.joints, [](const Joint& j) {
    const auto is_rigid = [](const std::optional<StopLaw>& stop) { return stop && stop->restitution; };
    return is_rigid(j.law.upper_stop) || is_rigid(j.law.lower_stop);
  });
}

}  // namespace

std::vector<Stiffening> first_stiffening(const Scene& scene, const Multibody& whole, const Tree& plain,
                                         std::span<const double> times) {
  const Multibody& bodies = plain.scene();
  std::vector<Stiffening> none(bodies.bodies.size(), Stiffening::off);
  if (std::ranges::none_of(bodies.bodies, has_stiffening)) return none;
  std::vector<Stiffening> choice =
      stiffening_where_it_counts(plain, first_state(scene, plain), scene.duration, scene.tolerance, times);
  std::vector<char> held = held_at_both_ends(whole);
  if (has_blows(whole)) held.assign(held.size(), 1);
  for (size_t i = 0; i < choice.size(); ++i) {
    if (held[i]) choice[i] = Stiffening::on;
    if (scene.bodies[i].stiffening == "on" && bodies.bodies[i].n() > 0) choice[i] = Stiffening::on;
    if (scene.bodies[i].stiffening == "off" || !has_stiffening(bodies.bodies[i])) choice[i] = Stiffening::off;
  }
  return choice;
}

double least_motion(const Multibody& bodies, const std::function<std::pair<double, double>(size_t joint)>& range) {
  double least = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < bodies.joints.size(); ++i) {
    const Joint& j = bodies.joints[i];
    const bool is_free = j.kind == JointKind::hinge || j.kind == JointKind::slider;
    if (!is_free || !j.prescribed.empty() || j.closes_loop) continue;
    const ReducedBody& carried = bodies.bodies[static_cast<size_t>(j.b.body)];
    const double length = std::sqrt(carried.J0.trace() / carried.m);
    constexpr double round_off = 1e-12;  // of the length
    const auto [lowest, highest] = range(i);
    const double way = (highest - lowest) * (j.kind == JointKind::hinge ? length : 1);
    least = std::min(least, std::max(way, round_off * length));
  }
  return least;
}

bool revise_stiffening(const Scene& scene, const Multibody& bodies, const std::vector<LargestStiffening>& effect,
                       std::vector<Stiffening>& choice, double least_motion) {
  bool changed = false;
  for (size_t i = 0; i < choice.size(); ++i) {
    const bool changes =
        change_without_stiffening(bodies.bodies[i], effect[i].size, scene.duration) > scene.tolerance ||
        effect[i].shortening > scene.tolerance * least_motion;
    const bool wanted = scene.bodies[i].stiffening == "auto" && has_stiffening(bodies.bodies[i]) && changes;
    if (!wanted || choice[i] == Stiffening::on) continue;
    choice[i] = Stiffening::on;
    changed = true;
  }
  return changed;
}

bool will_be_revised(const Scene& scene, const Multibody& bodies, const std::vector<LargestStiffening>& effect,
                     std::vector<Stiffening> choice) {
  return revise_stiffening(scene, bodies, effect, choice);
}

void note_unseen_stiffening(const Multibody& whole, const std::vector<Stiffening>& choice,
                            std::vector<LargestStiffening>& effect, std::vector<std::string>& warnings) {
  const std::vector<char> held = held_at_both_ends(whole);
  for (size_t i = 0; i < choice.size(); ++i) {
    const ReducedBody& body = whole.bodies[i];
    if (!held[i] || choice[i] == Stiffening::on || !has_stiffening(body)) continue;
    effect[i].size = std::numeric_limits<double>::quiet_NaN();
    warnings.push_back(fmt::format(
        "body {}: a joint that closes a loop or a spring holds it at both ends, and without geometric stiffness that "
        "stretches it by no load as it bends; what this changes is not known, and stiffening = \"auto\" has it",
        body.name));
  }
}

void fly_until_settled(const Scene& scene, const Multibody& bodies, std::vector<LargestStiffening>& effect,
                       std::vector<Stiffening>& choice, const std::function<Flown()>& fly) {
  for (bool again = true; again;) {
    effect.assign(choice.size(), {});
    try {
      const Flown flown = fly();
      again = !flown.interrupted && revise_stiffening(scene, bodies, effect, choice, flown.least_motion);
    } catch (const NumericalError&) {
      if (!revise_stiffening(scene, bodies, effect, choice)) throw;
    }
  }
}

}  // namespace flexboom
