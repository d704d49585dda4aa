#include "apps/simulate.hpp"

#include "apps/deflection.hpp"
#include "apps/error_budget.hpp"
#include "apps/multipliers_flight.hpp"
#include "apps/scene_orbit.hpp"
#include "apps/tree_flight.hpp"
#include "dynamics/rotation.hpp"
#include "fem/check.hpp"
#include "fem/stopwatch.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/// Where the mass centre of all bodies lies from the hub's origin, hub axes.
Vector3d mass_centre(const System& system, const State& s) {
  double m = system.hub().m;
  Vector3d moment = system.hub().mc0;
  for (size_t i = 0; i < system.appendages().size(); ++i) {
    const Appendage& a = system.appendages()[i];
    m += a.body.m;
    moment += a.body.m * a.hinge.point + system.boom_to_hub(static_cast<int>(i), s.angle[i]) * a.body.mc0;
  }
  return moment / m;
}

}  // namespace

Flyable make_system(const Scene& scene, const std::vector<PreparedBody>& bodies) {
  require(!scene.is_tree,
          fmt::format("scene {} has joints; only scenes of one hub with hinges can do this", scene.name));
  // A hub that does not move needs no mass.
  ReducedBody hub =
      scene.hub.fixed ? ReducedBody{} : rigid_body("hub", scene.hub.mass, Vector3d::Zero(), scene.hub.inertia);
  std::vector<Appendage> appendages;
  std::vector<double> angles;
  for (const PreparedBody& p : bodies) {
    const auto h = std::find_if(scene.hinges.begin(), scene.hinges.end(),
                                [&](const HingeScene& s) { return s.body == p.body.name; });
    require(h != scene.hinges.end(), fmt::format("body {} has no hinge", p.body.name));
    appendages.push_back({p.body, h->hinge});
    appendages.back().hinge.name = p.body.name;
    angles.push_back(h->start_angle);
  }
  std::optional<OrbitalField> field = field_of(scene);
  const bool in_field = field.has_value();
  System system(std::move(hub), std::move(appendages), scene.hub.fixed, std::move(field));
  State start = system.at_rest(angles);
  if (in_field) start.position = -mass_centre(system, start);  // the mass centre follows the orbit
  start.omega = scene.start_rate;
  start.velocity = scene.start_velocity;
  for (size_t i = 0; i < bodies.size(); ++i)
    for (const HingeScene& h : scene.hinges)
      if (h.body == bodies[i].body.name) start.rate[i] = h.start_rate;
  VectorXd y0 = system.pack(start);
  return {std::move(system), std::move(y0)};
}

namespace {

void add_vector(std::vector<std::string>& names, const std::string& stem) {
  for (const char* axis : {".x", ".y", ".z"}) names.push_back(stem + axis);
}

std::vector<std::string> output_names(const Scene& scene, const System& system) {
  std::vector<std::string> names = {"t"};
  for (const char* stem : {"hub.rotation", "hub.rate", "hub.position"}) add_vector(names, stem);
  if (scene.orbit)
    for (const char* name : {"lvlh.roll", "lvlh.pitch", "lvlh.yaw"}) names.emplace_back(name);
  for (const Appendage& a : system.appendages()) {
    const std::string& name = a.body.name;
    names.push_back(name + ".angle");
    names.push_back(name + ".rate");
    for (int k = 1; k <= a.body.n(); ++k) names.push_back(fmt::format("{}.q{}", name, k));
    add_vector(names, name + ".tip");
  }
  for (const char* name : {"energy.kinetic", "energy.elastic", "energy.dissipated"}) names.emplace_back(name);
  return names;
}

}  // namespace

OutputTable output_table(const Scene& scene, const Flyable& f, const Trajectory& motion) {
  const System& system = f.system;
  OutputTable table{output_names(scene, system), {}};
  const auto rows = static_cast<Eigen::Index>(motion.time.size());
  table.values.resize(rows, static_cast<Eigen::Index>(table.names.size()));
  const State start = system.unpack(f.y0);
  Eigen::Vector4d back = start.attitude;
  back.tail<3>() *= -1;
  std::optional<Orbit> orbit;
  if (scene.orbit) orbit = orbit_of(scene);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const auto i = static_cast<size_t>(row);
    const State s = system.unpack(motion.y[i]);
    Eigen::Index column = 0;
    const auto put = [&](double value) { table.values(row, column++) = value; };
    const auto put_vector = [&](const Vector3d& v) { put(v.x()), put(v.y()), put(v.z()); };
    const Vector3d rotation = rotation_vector(quaternion_product(back, s.attitude));
    put(motion.time[i]);
    put_vector(rotation);
    put_vector(s.omega);
    put_vector(s.position - start.position);
    if (orbit) put_vector(lvlh_angles(quaternion_product(back, s.attitude), *orbit, motion.time[i]));
    for (size_t b = 0; b < system.appendages().size(); ++b) {
      put(s.angle[b]);
      put(s.rate[b]);
      for (const double q : s.q[b]) put(q);
      const ReducedBody& body = system.appendages()[b].body;
      const Marker* tip = tip_of(body);
      put_vector(tip ? displacement(body, *tip, s.q[b], Stiffening::off) : Vector3d::Zero());
    }
    put(motion.balance[i].kinetic);
    put(motion.balance[i].elastic);
    put(s.dissipated);
  }
  return table;
}

namespace {

/// "sip.q2" -> "sip.q", "hub.rotation.x" -> "hub.rotation", "sip.angle" -> "sip.angle".
std::string output_of_column(const std::string& column) {
  const auto dot = column.rfind('.');
  if (dot == std::string::npos) return column;
  const std::string last = column.substr(dot + 1);
  if (last == "x" || last == "y" || last == "z") return column.substr(0, dot);
  if (last.size() > 1 && last[0] == 'q' && std::isdigit(static_cast<unsigned char>(last[1])))
    return column.substr(0, dot) + ".q";
  return column;
}

bool is_wanted(const std::string& output, const std::vector<std::string>& wanted) {
  if (output == "t" || output.starts_with("energy.") || output.starts_with("lvlh.")) return false;
  return wanted.empty() || std::find(wanted.begin(), wanted.end(), output) != wanted.end();
}

/// Angle of the rotation that leads from one rotation vector to another: their difference jumps where the angle passes
/// pi.
double angle_between(const Vector3d& a, const Vector3d& b) {
  const auto quaternion = [](const Vector3d& r) {
    const double angle = r.norm();
    Eigen::Vector4d q;
    q << std::cos(angle / 2), (angle > 0 ? std::sin(angle / 2) / angle : 0.5) * r;
    return q;
  };
  return rotation_vector(quaternion_product(quaternion(-a), quaternion(b))).norm();
}

}  // namespace

std::vector<OutputDifference> compare_outputs(const OutputTable& a, const OutputTable& b,
                                              const std::vector<std::string>& wanted) {
  const Eigen::Index rows = std::min(a.values.rows(), b.values.rows());
  std::vector<std::string> order;
  std::map<std::string, std::vector<std::pair<Eigen::Index, Eigen::Index>>> columns;
  for (size_t i = 0; i < a.names.size(); ++i) {
    const auto j = std::find(b.names.begin(), b.names.end(), a.names[i]);
    const std::string output = output_of_column(a.names[i]);
    if (j == b.names.end() || !is_wanted(output, wanted)) continue;
    if (!columns.contains(output)) order.push_back(output);
    columns[output].emplace_back(static_cast<Eigen::Index>(i), j - b.names.begin());
  }
  std::vector<OutputDifference> result;
  for (const std::string& output : order) {
    double difference = 0, size = 0;
    for (Eigen::Index row = 0; row < rows; ++row) {
      VectorXd u(columns[output].size()), v(columns[output].size());
      for (size_t k = 0; k < columns[output].size(); ++k) {
        u[static_cast<Eigen::Index>(k)] = a.values(row, columns[output][k].first);
        v[static_cast<Eigen::Index>(k)] = b.values(row, columns[output][k].second);
      }
      difference = std::max(difference, output == "hub.rotation" ? angle_between(u, v) : (u - v).norm());
      size = std::max(size, v.norm());
    }
    result.push_back({output, size > 0 ? difference / size : difference});
  }
  return result;
}

double largest(const std::vector<OutputDifference>& differences) {
  double r = 0;
  for (const OutputDifference& d : differences) r = std::max(r, d.error);
  return r;
}

IntegratorOptions integrator_options(const Scene& scene, const RunHooks& hooks, std::string_view chosen,
                                     long max_steps) {
  IntegratorOptions o;
  o.method = scene.integrator == "auto" ? chosen : scene.integrator;
  o.tolerance = scene.tolerance;
  if (scene.from) o.start = scene.from->time(), o.largest = scene.from->largest();
  o.duration = scene.duration;
  o.output_step = scene.output_step;
  o.settle = scene.settle;
  o.rescale_at_events = scene.rescale_at_events;
  o.interrupt = hooks.interrupt;
  o.progress = hooks.progress;
  o.checkpoint_every = hooks.checkpoint_every;
  if (max_steps > 0) o.max_steps = max_steps;
  return o;
}

FlightState end_of(const std::vector<PreparedBody>& bodies, double time, const VectorXd& y,
                   const MotionScales& largest) {
  FlightState end;
  end.time = time;
  end.y = y;
  end.largest = largest;
  for (const PreparedBody& p : bodies) end.modes[p.body.name] = p.body.n();
  return end;
}

namespace {

std::vector<std::string> hinge_names(const System& system) {
  std::vector<std::string> names;
  for (const Appendage& a : system.appendages()) names.push_back(a.body.name);
  return names;
}

FlightState end_of(const Flyable& f, const std::vector<PreparedBody>& bodies, const Trajectory& flight) {
  FlightState end = end_of(bodies, flight.time.back(), flight.y.back(), flight.summary.largest);
  end.names = state_names(f.system);
  const std::vector<StopHistory>& stops = flight.summary.stops;
  for (size_t i = 0; i < stops.size(); ++i) end.stops[f.system.appendages()[i].body.name] = stops[i];
  return end;
}

}  // namespace

namespace {

Run fly_hub(const Scene& scene, std::vector<PreparedBody> bodies, const RunHooks& hooks, long max_steps) {
  const Stopwatch start;
  Run r;
  r.bodies = std::move(bodies);
  const Flyable f = make_system(scene, r.bodies);
  const bool redundant = scene.formulation == "multipliers";
  IntegratorOptions options = integrator_options(scene, hooks, redundant ? "ida" : "exponential", max_steps);
  VectorXd y = f.y0;
  if (scene.from) {
    y = scene.from->values(state_names(f.system));
    options.stops = scene.from->stops(hinge_names(f.system));
  }
  r.prepare_seconds = start.seconds();
  const Stopwatch watch;
  Checkpoint<Trajectory> checkpoint;
  size_t told = 0;
  if (hooks.checkpoint)
    checkpoint = [&](const Trajectory& so_far, size_t outputs) {
      Run part = r;
      part.motion = rows_of(so_far, told, outputs);
      part.outputs = output_table(scene, f, part.motion);
      part.end = end_of(f, r.bodies, so_far);
      part.integrate_seconds = watch.seconds();
      hooks.checkpoint(std::move(part), std::exchange(told, outputs));
    };
  r.motion = redundant ? integrate_by_multipliers(f.system, y, options, checkpoint)
                       : integrate(f.system, y, options, checkpoint);
  r.integrate_seconds = watch.seconds();
  r.outputs = output_table(scene, f, r.motion);
  r.end = end_of(f, r.bodies, r.motion);
  return r;
}

/// Does a boom of a hub turn so fast that its geometric stiffness may be as large as its own?
bool spins_fast(const Run& run) {
  constexpr double fast = 0.3;  // (Omega / omega_1)^2
  const Eigen::MatrixXd& rows = run.outputs.values;
  const auto hub = std::ranges::find(run.outputs.names, "hub.rate.x") - run.outputs.names.begin();
  return std::ranges::any_of(run.bodies, [&](const PreparedBody& p) {
    if (p.body.n() == 0) return false;
    const auto rate = std::ranges::find(run.outputs.names, p.body.name + ".rate") - run.outputs.names.begin();
    const double spin = (rows.middleCols<3>(hub).rowwise().norm() + rows.col(rate).cwiseAbs()).maxCoeff();
    return spin * spin * p.body.Me(0, 0) > fast * p.body.Ke(0, 0);
  });
}

/// The equations of a hub have no geometric stiffness; where it may matter its size is looked at.
std::vector<std::string> softening_warnings(Scene scene, const Run& run) {
  std::vector<PreparedBody> bodies;
  for (BodyScene& b : scene.bodies) {
    if (b.structure == "beam") b.stiffening = "on";
    bodies.push_back(prepare_body(b));
  }
  const Flyable f = make_system(scene, bodies);
  Multibody names;
  for (const PreparedBody& p : bodies) names.bodies.push_back(p.body);
  return stiffening_warnings(names, stiffening_of_hub(f.system, run.motion), scene.tolerance,
                             [](int) { return Stiffening::off; });
}

/// Over the outputs, of long lists over some.
std::vector<Bending> bending_of(const Run& run) {
  std::vector<Bending> bending;
  const Eigen::Index stride = run.outputs.values.rows() / 20000 + 1;
  for (const PreparedBody& p : run.bodies) {
    Bending& most = bending.emplace_back();
    if (p.body.n() == 0) continue;
    const Deflection deflection(p.body);
    const auto first = std::ranges::find(run.outputs.names, p.body.name + ".q1") - run.outputs.names.begin();
    for (Eigen::Index row = 0; row < run.outputs.values.rows(); row += stride) {
      const double size = deflection.largest(run.outputs.values.row(row).segment(first, p.body.n()).transpose());
      if (size > most.size) most = {size, size / deflection.length(), run.outputs.values(row, 0)};
    }
  }
  return bending;
}

}  // namespace

Run run_once(const Scene& scene, const RunHooks& hooks, int refine, long max_steps) {
  const Stopwatch start;
  std::vector<PreparedBody> bodies;
  for (const BodyScene& b : scene.bodies) bodies.push_back(prepare_body(b, refine, scene.bodies_kept_in));
  const double seconds = start.seconds();
  const auto fly = !scene.is_tree ? fly_hub : scene.formulation == "multipliers" ? fly_by_multipliers : fly_tree;
  Run r = fly(scene, std::move(bodies), hooks, max_steps);
  r.prepare_seconds += seconds;
  r.bending = bending_of(r);
  return r;
}

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
        !p.kept.empty()              ? fmt::format("{} unknowns, kept in {}", p.dofs, p.kept.string())
        : p.body.structure == "eq14" ? "eq. 14, Euler-Bernoulli line mass, closed form"
        : b.structure == "solid"
            ? fmt::format("{} solid elements, {} unknowns", p.elements, p.dofs)
            : fmt::format("{} beam elements, order {}, {} unknowns", p.elements, b.geometry.order, p.dofs);
    plan.push_back(fmt::format("{}: {}; {} modes", b.name, model, p.body.n()));
    plan.push_back(fmt::format("{}: {}", b.name, damping_text(b.damping)));
  }
  for (const HingeScene& h : scene.hinges)
    plan.push_back(fmt::format("hinge {}: damping {:g} N m s/rad, stop {:g} N m/rad without damping of its own", h.body,
                               h.hinge.mechanism.damping, h.hinge.mechanism.stop_stiffness));
  plan.push_back(
      fmt::format("integrator: {} ({}), tolerance {:.1e}; damping of the method itself shows in energy_balance",
                  run.motion.summary.method, why_method(scene, run.motion.summary), scene.tolerance));
  plan.push_back(scene.formulation == "multipliers" ? "formulation: redundant coordinates, joints by multipliers"
                                                    : "formulation: relative coordinates");
  if (scene.is_tree) return describe_tree(scene, run, plan);
  plan.emplace_back("geometric stiffness: left out, what that may change is error_budget.linearisation");
  if (scene.orbit)
    plan.push_back(fmt::format("orbit: rate {:.6e} rad/s{}; differential gravity {}, {:.1e} 1/s^2", scene.orbit->rate(),
                               scene.orbit->J2 ? ", with J2" : "",
                               scene.orbit->gravity == "none" ? "left out" : "on every body",
                               3 * std::pow(scene.orbit->rate(), 2)));
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
  r.warnings.insert(r.warnings.end(), run.warnings.begin(), run.warnings.end());
  if (!r.scene.is_tree && spins_fast(run)) {
    const std::vector<std::string> more = softening_warnings(r.scene, run);
    r.warnings.insert(r.warnings.end(), more.begin(), more.end());
  }
  if (!r.budget.measured || r.budget.within(r.scene.tolerance)) return;
  const std::string why = r.budget.missing.empty() ? fmt::format("the errors add up to {:.1e}", r.budget.total())
                                                   : fmt::format("{}", fmt::join(r.budget.missing, "; "));
  r.warnings.push_back(
      fmt::format("the accuracy wanted, {:.1e}, was not reached or not proven: {}", r.scene.tolerance, why));
}

}  // namespace

namespace {

/// What was flown and what is odd about it.
void add_words(const Run& run, RunResult& r) {
  if (r.scene.from)
    r.plan.push_back(fmt::format("start: goes on from {} at t = {:g} s; counts and errors are those since then",
                                 r.scene.from->file().string(), r.scene.from->time()));
  describe(r.scene, run, r.plan);
  r.warnings = r.scene.warnings;
}

void take(Run run, RunResult& r) {
  r.bodies = std::move(run.bodies);
  r.tree = std::move(run.tree);
  r.trajectory = std::move(run.motion);
  r.outputs = std::move(run.outputs);
  r.end = std::move(run.end);
  r.ledger = run.ledger;
  r.prepare_seconds = run.prepare_seconds;
  r.integrate_seconds = run.integrate_seconds;
}

}  // namespace

bool is_balanced(const IntegrationSummary& s) {
  constexpr double broken = 0.01;  // far above any tolerance that is accepted for a step
  return s.energy_balance <= broken && !(s.momentum_drift > broken);  // which may be unknown
}

RunResult run_scene(const Scene& given, const RunHooks& hooks,
                    const std::function<void(const RunResult& so_far, size_t first)>& so_far) {
  RunResult r;
  r.scene = given;
  validate(r.scene);
  choose_modes(r.scene, hooks, r.plan);
  RunHooks of_run = hooks;
  if (so_far)
    of_run.checkpoint = [&](Run run, size_t first) {
      RunResult part = r;
      add_words(run, part);
      part.warnings.insert(part.warnings.end(), run.warnings.begin(), run.warnings.end());
      take(std::move(run), part);
      part.trajectory.summary.interrupted = false;  // not yet
      so_far(part, first);
    };
  Run run = run_once(r.scene, of_run);
  add_words(run, r);
  // The repeats cost many times the run; a long one is not repeated.
  constexpr long worth_repeating = 2'000'000;
  const bool repeat = run.motion.summary.rhs_evaluations <= worth_repeating;
  if (r.scene.error_budget && !repeat)
    r.plan.push_back(fmt::format("error budget: not measured, its repeats would cost many times {} evaluations",
                                 run.motion.summary.rhs_evaluations));
  if (r.scene.error_budget && repeat && !run.motion.summary.interrupted) {
    const Stopwatch start;
    r.budget = measure_budget(r.scene, run, hooks, r.plan);
    r.budget_seconds = start.seconds();
  }
  add_warnings(run, r);
  take(std::move(run), r);
  return r;
}

}  // namespace flexboom
