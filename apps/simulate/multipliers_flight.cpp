// Scenes in redundant coordinates: start, flight, and what results are made of in terms of the tree.

#include "apps/simulate/multipliers_flight.hpp"

#include "apps/simulate/stiffening_choice.hpp"
#include "apps/simulate/tree_flight.hpp"
#include "dynamics/simulation/formulations.hpp"
#include "fem/base/stopwatch.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

namespace flexboom {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/// Angles where the hinges start: a turn more is another stretch of their springs. `saved`: knows those of loops.
std::vector<double> start_angles(const Multibody& scene, const TreeState& start, const SavedState* saved) {
  std::vector<double> angles;
  auto of_tree = start.joints.begin();
  for (const Joint& j : scene.joints) {
    angles.push_back(saved ? saved->loop_angle(j.name, j.mechanism.rest) : j.mechanism.rest);
    if (j.closes_loop) continue;
    if (!of_tree->coordinate.empty()) angles.back() = of_tree->coordinate[0];
    ++of_tree;
  }
  return angles;
}

MultipliersOptions multipliers_options(const IntegratorOptions& o, std::vector<double> angles) {
  MultipliersOptions r{o};
  r.angles = std::move(angles);
  return r;
}

IntegrationSummary summary_of(const MultipliersSummary& s) {
  IntegrationSummary r;
  r.method = "ida";
  r.steps = s.steps, r.rhs_evaluations = s.residual_evaluations, r.jacobian_evaluations = s.factorisations;
  r.factorisations = s.factorisations, r.newton_iterations = s.newton_iterations;
  r.error_test_failures = s.error_test_failures, r.restarts = s.restarts;
  r.seconds = s.seconds;
  r.energy_balance = s.energy_balance, r.momentum_drift = s.momentum_drift, r.largest = s.largest;
  r.constraint_drift = std::max({s.position_drift, s.angle_drift, s.quaternion_drift});
  r.stops = s.stops;
  r.interrupted = s.interrupted;
  return r;
}

void set_energies(MultipliersOptions& o, const Multibody& scene, const TreeLayout& l, const VectorXd& y0) {
  o.dissipated = y0[l.dissipated_elsewhere];
  o.work = y0[l.work];
  auto of_tree = l.joints.begin();
  for (const Joint& j : scene.joints) {
    o.lost.emplace_back();
    if (j.closes_loop) continue;
    const TreeLayout::Joint& at = *of_tree++;
    const HingeMechanism& m = j.mechanism;
    if (j.law.given() || m.stiffness != 0 || m.damping != 0 || m.stop_stiffness != 0)
      o.lost.back() = {y0[at.dissipated]};
    else
      o.dissipated += y0[at.dissipated];
    for (int k = 0; at.losses >= 0 && k < static_cast<int>(law_losses.size()); ++k)
      o.lost.back().push_back(y0[at.losses + k]);
  }
}

TreeState without_loops(const Scene& scene, TreeState s) {
  std::vector<JointState> joints;
  for (size_t i = 0; i < scene.joints.size(); ++i)
    if (!scene.joints[i].closes_loop) joints.push_back(std::move(s.joints[i]));
  s.joints = std::move(joints);
  return s;
}

/// The inverse, with nothing of the joints that close loops.
TreeState with_loops(const Scene& scene, const TreeState& open) {
  TreeState s;
  auto next = open.joints.begin();
  for (const JointScene& j : scene.joints) s.joints.push_back(j.closes_loop ? JointState{} : *next++);
  return s;
}

/// The turns of universal joints nearest to those before.
void follow_turns(const TreeState& before, TreeState& s) {
  constexpr double turn = 2 * std::numbers::pi;
  for (size_t i = 0; i < s.joints.size(); ++i)
    for (size_t k = 0; s.joints[i].coordinate.size() == 2 && k < before.joints[i].coordinate.size(); ++k) {
      double& angle = s.joints[i].coordinate[k];
      angle += turn * std::round((before.joints[i].coordinate[k] - angle) / turn);
    }
}

/// Those of the rows that `states` does not have yet, after `start`.
void add_states(const Multipliers& system, const MultibodyTrajectory& flight, const TreeState& start,
                std::vector<TreeState>& states) {
  while (states.size() < flight.states.size()) {
    TreeState s = tree_state(system, flight.states[states.size()]);
    follow_turns(states.empty() ? start : states.back(), s);
    states.push_back(std::move(s));
  }
}

/// At every output of a short list, at some of a long one.
std::vector<LargestStiffening> largest_stiffening(const Multipliers& system, const MultibodyTrajectory& flight) {
  std::vector<LargestStiffening> largest(system.multibody().bodies.size());
  const size_t stride = flight.states.size() / looks_at_stiffening + 1;
  for (size_t row = 0; row < flight.states.size(); row += stride)
    observe(stiffening_effect(system, flight.time[row], flight.states[row]), flight.time[row], largest);
  for (const auto& [t, state] : flight.telling) observe_size(stiffening_effect(system, t, state), largest);
  return largest;
}

std::vector<std::string> warnings_of(const Scene& scene, const Multibody& bodies, const MultibodyTrajectory& flight,
                                     const std::vector<LargestStiffening>& effect,
                                     const std::vector<Stiffening>& stiffening) {
  std::vector<std::string> warnings = stiffening_warnings(
      bodies, effect, scene.duration, scene.tolerance, [&](int body) { return stiffening[static_cast<size_t>(body)]; });
  if (const auto& rows = flight.summary.redundant; !rows.empty())
    warnings.push_back(
        fmt::format("{} constraint rows follow from the others and are left out, so how these joints share such loads "
                    "is not determined: {}",
                    rows.size(), fmt::join(rows, "; ")));
  return warnings;
}

/// Where closing the loops bent a body. A displacement below the tolerance of the body's size is none.
void note_bent_starts(const Scene& scene, const Multibody& bodies, const TreeState& asked, const TreeState& first,
                      std::vector<std::string>& notes) {
  for (size_t b = 0; b < bodies.bodies.size(); ++b) {
    const ReducedBody& body = bodies.bodies[b];
    const auto moved = [&](const Marker& m) { return (m.S * (first.q[b] - asked.q[b])).norm(); };
    const auto most = std::ranges::max_element(body.markers, {}, moved);
    if (most != body.markers.end() && moved(*most) > scene.tolerance * std::sqrt(body.J0.trace() / body.m))
      notes.push_back(fmt::format("body {}: starts bent, its \"{}\" by {:.3g} m, so that the loops close", body.name,
                                  most->name, moved(*most)));
  }
}

/// Where closing the loops turned or moved what a joint without coordinates of its own carries.
void note_moved_start(const Scene& scene, const JointScene& joint, const JointState& asked, const JointState& first,
                      std::vector<std::string>& notes) {
  const auto note = [&](const std::string& what) {
    notes.push_back(fmt::format("joint {}: starts {}, so that the loops close", joint.name, what));
  };
  const double cosine = std::min(1.0, std::abs(asked.attitude.normalized().dot(first.attitude.normalized())));
  if (const double turn = 2 * std::acos(cosine); turn > scene.tolerance)
    note(fmt::format("turned by {:.3g} rad", turn));
  if (const double way = (first.position - asked.position).norm(); way > scene.tolerance)
    note(fmt::format("{:.3g} m away from where it was asked", way));
  const double turn_rate = std::max(asked.omega.norm(), first.omega.norm());
  const auto changed = [&](const Vector3d& a, const Vector3d& b) {  // a velocity against that of a turn a metre away
    return (a - b).norm() > scene.tolerance * std::max({a.norm(), b.norm(), turn_rate});
  };
  if (changed(asked.omega, first.omega))
    note(fmt::format("with ({:.6g}, {:.6g}, {:.6g}) rad/s, not ({:.6g}, {:.6g}, {:.6g})", first.omega.x(),
                     first.omega.y(), first.omega.z(), asked.omega.x(), asked.omega.y(), asked.omega.z()));
  if (changed(asked.velocity, first.velocity))
    note(fmt::format("with ({:.6g}, {:.6g}, {:.6g}) m/s, not ({:.6g}, {:.6g}, {:.6g})", first.velocity.x(),
                     first.velocity.y(), first.velocity.z(), asked.velocity.x(), asked.velocity.y(),
                     asked.velocity.z()));
}

/// Where closing the loops moved a joint away from the start or the rate it was given.
void note_moved_starts(const Scene& scene, const TreeState& asked, const TreeState& first,
                       std::vector<std::string>& notes) {
  double fastest = 0;
  for (const TreeState* state : {&asked, &first})
    for (const JointState& j : state->joints)
      for (const double rate : j.rate) fastest = std::max(fastest, std::abs(rate));
  for (size_t i = 0, of_tree = 0; i < scene.joints.size(); ++i) {
    const JointScene& j = scene.joints[i];
    if (j.closes_loop) continue;
    const JointState& wanted = asked.joints[of_tree++];
    const JointState& closed = first.joints[i];
    const JointType& type = joint_type(j.kind);
    if (type.turns || type.floats) note_moved_start(scene, j, wanted, closed, notes);
    const auto moved = [&](double a, double b, double size) { return std::abs(a - b) > scene.tolerance * size; };
    for (size_t k = 0; k < wanted.coordinate.size(); ++k)
      if (moved(closed.coordinate[k], wanted.coordinate[k], 1))
        notes.push_back(fmt::format("joint {}: starts at {:.6g}, not {:.6g}, so that the loops close", j.name,
                                    closed.coordinate[k], wanted.coordinate[k]));
    for (size_t k = 0; k < std::min(wanted.rate.size(), j.start_rate.size()); ++k)
      if (moved(closed.rate[k], wanted.rate[k], fastest))
        notes.push_back(fmt::format("joint {}: starts at a rate of {:.6g}, not {:.6g}, so that the loops stay closed",
                                    j.name, closed.rate[k], wanted.rate[k]));
  }
}

/// A flight and its states in terms of the tree.
struct FlownByMultipliers {
  const Scene& scene;
  const Multipliers& system;
  const Tree& tree;
  const MultibodyTrajectory& flight;
  const std::vector<TreeState>& states;

  VectorXd y(size_t row) const {
    VectorXd y = tree.pack(without_loops(scene, states[row]));
    double elsewhere = flight.states[row].dissipated;
    auto of_tree = tree.layout().joints.begin();
    for (size_t i = 0; i < scene.joints.size(); ++i) {
      if (scene.joints[i].closes_loop) continue;
      const TreeLayout::Joint& at = *of_tree++;
      const std::vector<double>& lost = flight.states[row].lost[i];
      for (size_t k = 0; k < lost.size(); ++k) {
        y[k == 0 ? at.dissipated : at.losses + static_cast<int>(k) - 1] = lost[k];
        elsewhere -= lost[k];
      }
    }
    y[tree.layout().dissipated_elsewhere] = elsewhere;
    y[tree.layout().work] = flight.states[row].work;
    return y;
  }
};

/// What results are made of: the rows from `first` on that come before `last`, and where the flight is.
void set_flown(const FlownByMultipliers& f, size_t first, size_t last, const std::vector<Stiffening>& stiffening,
               Run& r) {
  r.motion.time.clear(), r.motion.y.clear(), r.motion.balance.clear();
  for (size_t row = first; row < last; ++row) {
    r.motion.time.push_back(f.flight.time[row]);
    r.motion.y.push_back(f.y(row));
    r.motion.balance.push_back(f.flight.balance[row]);
  }
  r.outputs = output_table(f.scene, f.tree, last - first, [&](size_t i, Moment& now) {
    const size_t row = first + i;
    now = {f.flight.time[row], f.states[row], joint_loads(f.system, f.flight.states[row]), r.motion.balance[i]};
  });
  r.motion.warnings = warnings_of(f.scene, f.system.multibody(), f.flight, r.motion.stiffening_effect, stiffening);
  const Balance& at_end = f.flight.balance.back();
  r.ledger = EnergyOfRun{at_end.kinetic, at_end.potential, at_end.work, at_end.ledger};
  r.motion.events = f.flight.events;
  r.motion.summary = summary_of(f.flight.summary);
  r.end = end_of(r, f.scene, f.flight.time.back(), f.y(f.states.size() - 1), r.motion.summary);
  for (size_t i = 0; i < f.scene.joints.size(); ++i)
    if (f.scene.joints[i].closes_loop && f.scene.joints[i].kind == JointKind::hinge)
      r.end.loops[f.scene.joints[i].name] = f.states.back().joints[i].coordinate[0];
}

/// Beside damped fast modes under a motion without events, BDF of high order takes steps of their size. What ends steps
/// now and then keeps it from that: a slider-crank takes 80 times fewer.
void end_steps_at_outputs(IntegratorOptions& o) {
  const OutputTimes outputs(o);
  for (size_t count = 1; std::isfinite(outputs.after(count)); ++count) o.step_ends.push_back(outputs.after(count));
  std::ranges::sort(o.step_ends);
}

}  // namespace

Run fly_by_multipliers(const Scene& scene, std::vector<PreparedBody> bodies, const RunHooks& hooks, long max_steps) {
  const Stopwatch start;
  Multibody all = make_multibody(scene, bodies);
  const Scene open = without_loops(scene);
  const Multibody opened = make_multibody(open, bodies);
  Run r;
  r.bodies = std::move(bodies);
  IntegratorOptions options = integrator_options(scene, hooks, "ida", max_steps);
  set_corners(scene, options);
  std::vector<Stiffening> stiffening = first_stiffening(open, all, Tree(opened), options.telling_times);
  if (!options.step_ends.empty()) end_steps_at_outputs(options);
  if (scene.from) options.stops = scene.from->stops(joint_names(scene));
  r.prepare_seconds = start.seconds();

  const Stopwatch flight_time;
  std::unique_ptr<const Multipliers> system;
  TreeState asked;
  MultibodyTrajectory flight;
  std::vector<TreeState> states;
  size_t told = 0;
  std::vector<LargestStiffening> effect;  // of the flight so far
  Checkpoint<MultibodyTrajectory> checkpoint;
  if (hooks.checkpoint)
    checkpoint = [&](const MultibodyTrajectory& so_far, size_t outputs) {
      effect = largest_stiffening(*system, so_far);
      if (will_be_revised(scene, opened, effect, stiffening)) return;
      add_states(*system, so_far, with_loops(scene, asked), states);
      Run part = r;
      part.motion.stiffening_effect = effect;
      set_flown({scene, *system, *r.tree, so_far, states}, told, outputs, stiffening, part);
      states.resize(outputs);
      part.integrate_seconds = flight_time.seconds();
      hooks.checkpoint(std::move(part), std::exchange(told, outputs));
    };
  const auto fly = [&] {
    states.clear(), told = 0;
    r.tree = std::make_shared<const Tree>(opened, stiffening);
    VectorXd y0 = first_state(open, *r.tree);
    r.tree->impose(options.start, y0);
    asked = r.tree->unpack(y0);
    for (size_t i = 0; i < all.wheels.size(); ++i) all.wheels[i].spin = asked.spin[i];
    system = std::make_unique<const Multipliers>(all, stiffening);
    const std::vector<BodyState> closed = close_joints(*system, body_states(*r.tree, options.start, y0), options.start);
    MultipliersOptions of_flight =
        multipliers_options(options, start_angles(system->multibody(), asked, scene.from.get()));
    set_energies(of_flight, all, r.tree->layout(), y0);
    flight = integrate_multipliers(*system, closed, of_flight, checkpoint);
    effect = largest_stiffening(*system, flight);
    const auto range = [&](size_t joint) {
      const auto coordinate = [joint](const MultibodyState& s) { return s.coordinate[joint]; };
      const auto [lowest, highest] = std::ranges::minmax_element(flight.states, {}, coordinate);
      return std::pair(coordinate(*lowest), coordinate(*highest));
    };
    return Flown{flight.summary.interrupted, least_motion(all, range)};
  };
  fly_until_settled(scene, opened, effect, stiffening, fly);
  r.motion.stiffening_effect = effect;
  add_states(*system, flight, with_loops(scene, asked), states);
  set_flown({scene, *system, *r.tree, flight, states}, 0, states.size(), stiffening, r);
  note_unseen_stiffening(all, stiffening, r.motion.stiffening_effect, r.motion.warnings);
  note_moved_starts(scene, asked, states.front(), r.notes);
  note_bent_starts(scene, system->multibody(), asked, states.front(), r.notes);
  r.integrate_seconds = flight_time.seconds();
  return r;
}

}  // namespace flexboom
