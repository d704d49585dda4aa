// Flights in relative coordinates: from the scene to a tree, and how it flies.

#include "apps/simulate/tree_flight.hpp"

#include "apps/scene/scene_keys.hpp"
#include "apps/scene/scene_orbit.hpp"
#include "apps/simulate/drives.hpp"
#include "apps/simulate/stiffening_choice.hpp"
#include "dynamics/model/time_function.hpp"
#include "fem/base/check.hpp"
#include "fem/base/stopwatch.hpp"

#include <fmt/format.h>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

int index_of(const Scene& scene, const std::string& body) {
  for (size_t i = 0; i < scene.bodies.size(); ++i)
    if (scene.bodies[i].name == body) return static_cast<int>(i);
  throw InputError(fmt::format("there is no body \"{}\"", body));
}

Place place_of(const Scene& scene, const PlaceScene& p) {
  Place place{.body = -1, .marker = p.marker, .position = p.point, .axes = p.axes()};
  if (p.body.empty()) return place;
  place.body = index_of(scene, p.body);
  if (scene.bodies[static_cast<size_t>(place.body)].structure == "eq14" && p.marker == "root") place.marker.clear();
  return place;
}

/// A function of time of the scene, whose values must be numbers whenever an integrator asks. `of` says whose it is.
std::function<double(double)> finite(std::function<double(double)> f, std::string of) {
  return [f = std::move(f), of = std::move(of)](double t) {
    const double value = f(t);
    if (!std::isfinite(value))
      throw NumericalError(
          fmt::format("{} is {} at t = {:.9g} s: its function of time has no value there", of, value, t));
    return value;
  };
}

std::function<double(double)> function_of(const Scene& scene, const CourseScene& course, const std::string& of) {
  return finite(course_of(course, scene.duration).function.value, of);
}

std::function<double(double)> negative(const std::function<double(double)>& f) {
  return [f](double t) { return -f(t); };
}

/// The drive of a hinge or a slider: along z of both places, opposite on a.
void add_drive(const Scene& scene, const JointScene& j, Multibody& r) {
  const std::function<double(double)> f = function_of(scene, j.drive, fmt::format("joint {}: drive", j.name));
  for (const bool on_b : {true, false}) {
    const PlaceScene& at = on_b ? j.b : j.a;
    if (at.body.empty()) continue;
    Load load;
    load.name = "drive of " + j.name;
    load.at = place_of(scene, at);
    (j.kind == JointKind::hinge ? load.torque : load.force)[2] = on_b ? f : negative(f);
    r.loads.push_back(std::move(load));
  }
}

Joint joint_of(const Scene& scene, const JointScene& j) {
  Joint joint;
  joint.name = j.name;
  joint.kind = j.kind;
  joint.a = place_of(scene, j.a);
  joint.b = place_of(scene, j.b);
  joint.mechanism = j.mechanism, joint.law = j.law;
  joint.closes_loop = j.closes_loop;
  for (const CourseScene& c : j.motion) {
    const TimeFunction f = course_of(c, scene.duration).function;
    const std::string of = fmt::format("joint {}: motion", j.name);
    joint.prescribed.push_back(
        {finite(f.value, of), finite(f.rate, of + ", its rate,"), finite(f.acceleration, of + ", its acceleration,")});
  }
  return joint;
}

Load load_of(const Scene& scene, const LoadScene& l) {
  Load load;
  load.name = l.name;
  load.at = place_of(scene, l.at);
  load.inertial_axes = l.inertial_axes;
  const auto function = [&](const CourseScene& c, const char* what, size_t i) {
    return c.given() ? function_of(scene, c, fmt::format("load {}: {}[{}]", l.name, what, i)) : nullptr;
  };
  for (size_t i = 0; i < 3; ++i) {
    load.force[i] = function(l.force[i], "force", i);
    load.torque[i] = function(l.torque[i], "torque", i);
  }
  return load;
}

ReactionWheel wheel_of(const Scene& scene, const WheelScene& w) {
  ReactionWheel wheel;
  wheel.name = w.name;
  wheel.body = index_of(scene, w.body);
  wheel.axis = w.axis;
  wheel.inertia = w.inertia;
  wheel.spin = w.spin;
  wheel.torque = [](double) { return 0.0; };
  if (w.torque.given()) wheel.torque = function_of(scene, w.torque, fmt::format("wheel {}: torque", w.name));
  return wheel;
}

/// Inertia of all bodies about their mass centre at the start, axes of `body` [kg m^2]. It is the angular momentum of
/// unit rates, less what the rotors have about their own axes.
Matrix3d inertia_at_start(const Scene& scene, const Tree& tree, int body) {
  TreeState s = start_state(scene, tree);
  Place place;
  place.body = body;
  const Matrix3d attitude = tree.motion(0, tree.pack(s), place).axes;
  const auto carrier = std::ranges::find(scene.joints, scene.bodies[static_cast<size_t>(body)].name,
                                         [](const JointScene& j) { return j.b.body; });
  JointState& joint = s.joints[static_cast<size_t>(carrier - scene.joints.begin())];
  Matrix3d J;
  for (int i = 0; i < 3; ++i) {
    joint.omega = carrier->b.axes().row(i);
    J.col(i) = attitude.transpose() * tree.balance(0, tree.pack(s)).angular_momentum;
  }
  for (const ReactionWheel& w : tree.scene().wheels)
    if (w.body == body) J -= w.inertia * w.axis * w.axis.transpose();
  return (J + J.transpose()) / 2;
}

/// Gives the three free wheels of the turning body the torques of the turns.
void add_turns(const Scene& scene, Multibody& r) {
  if (scene.turns.empty()) return;
  const int body = index_of(scene, scene.turns.front().body);
  Matrix3d axes;
  std::vector<ReactionWheel*> wheels;
  for (size_t i = 0; i < r.wheels.size(); ++i) {
    if (r.wheels[i].body != body || scene.wheels[i].torque.given()) continue;
    axes.col(std::ssize(wheels)) = r.wheels[i].axis;
    wheels.push_back(&r.wheels[i]);
  }
  const Matrix3d J = inertia_at_start(scene, Tree(r), body), share = axes.inverse();
  const auto torque = std::make_shared<const WheelTorques>(wheel_torques(J, turns_of(scene.turns)));
  Eigen::Index number = 0;
  for (ReactionWheel* wheel : wheels) {
    wheel->torque = [torque, row = Eigen::RowVector3d(share.row(number++))](double t) {
      double sum = 0;
      for (int k = 0; k < 3; ++k) sum += row[k] * torque->torque[static_cast<size_t>(k)].function.value(t);
      return sum;
    };
  }
}

}  // namespace

Multibody make_multibody(const Scene& scene, const std::vector<PreparedBody>& bodies) {
  Multibody r;
  r.gravity = scene.gravity;
  r.field = field_of(scene);
  for (const PreparedBody& p : bodies) r.bodies.push_back(p.body);
  for (const JointScene& j : scene.joints) {
    r.joints.push_back(joint_of(scene, j));
    if (j.drive.given()) add_drive(scene, j, r);
  }
  for (const SpringScene& s : scene.springs)
    r.springs.push_back({s.name, place_of(scene, s.a), place_of(scene, s.b), s.stiffness, s.free_length, s.damping});
  for (const LoadScene& l : scene.loads) r.loads.push_back(load_of(scene, l));
  for (const WheelScene& w : scene.wheels) r.wheels.push_back(wheel_of(scene, w));
  add_turns(scene, r);
  return r;
}

Scene without_loops(Scene scene) {
  std::erase_if(scene.joints, [](const JointScene& j) { return j.closes_loop; });
  return scene;
}

TreeState start_state(const Scene& scene, const Tree& tree) {
  TreeState s = tree.at_rest();
  for (size_t i = 0; i < scene.joints.size(); ++i) {
    const JointScene& j = scene.joints[i];
    JointState& state = s.joints[i];
    if (!j.start.empty()) state.coordinate = j.start;
    if (!j.start_rate.empty()) state.rate = j.start_rate;
    state.attitude = j.start_attitude.normalized();
    state.omega = j.start_omega;
    state.position = j.start_position;
    state.velocity = j.start_velocity;
  }
  return s;
}

Vector3d mass_centre(const Tree& tree, const TreeState& state) {
  const VectorXd y = tree.pack(state);
  Vector3d moment = Vector3d::Zero();
  double mass = 0;
  for (size_t i = 0; i < tree.scene().bodies.size(); ++i) {
    const ReducedBody& body = tree.scene().bodies[i];
    const PlaceMotionInSpace origin = tree.motion(0, y, Place{.body = static_cast<int>(i), .marker = {}});
    mass += body.m;
    moment += body.m * origin.position + origin.axes * body.mc0;
  }
  return moment / mass;
}

namespace {

/// @throws InputError where a pressed spring pushes nowhere.
void check_springs(const Tree& tree, const VectorXd& y) {
  for (const SpringDamper& spring : tree.scene().springs) {
    const double length = (tree.motion(0, y, spring.b).position - tree.motion(0, y, spring.a).position).norm();
    require(length > 1e-12 * spring.free_length || spring.stiffness * spring.free_length == 0,
            fmt::format("spring \"{}\": both ends start at the same point, where a free length of {:g} m has no "
                        "direction; place them apart",
                        spring.name, spring.free_length));
  }
}

}  // namespace

VectorXd first_state(const Scene& scene, const Tree& tree) {
  if (scene.from) return scene.from->values(state_names(tree));
  TreeState start = start_state(scene, tree);
  if (tree.scene().field) {  // the mass centre follows the orbit
    const Vector3d centre = mass_centre(tree, start);
    for (size_t i = 0; i < scene.joints.size(); ++i)
      if (scene.joints[i].a.body.empty()) start.joints[i].position -= scene.joints[i].a.axes().transpose() * centre;
  }
  VectorXd y = tree.pack(start);
  check_springs(tree, y);
  return y;
}

std::vector<std::string> joint_names(const Scene& scene) {
  std::vector<std::string> names;
  for (const JointScene& j : scene.joints) names.push_back(j.name);
  return names;
}

FlightState end_of(const Run& run, const Scene& scene, double time, const VectorXd& y,
                   const IntegrationSummary& summary) {
  const std::vector<StopHistory>& stops = summary.stops;
  FlightState end = end_of(run.bodies, time, y, summary.largest);
  end.names = state_names(*run.tree);
  for (size_t i = 0; i < stops.size(); ++i)
    if (scene.joints[i].mechanism.stop_stiffness > 0 || scene.joints[i].law.given())
      end.stops[scene.joints[i].name] = stops[i];
  return end;
}

void set_corners(const Scene& scene, IntegratorOptions& o) {
  const auto add_corners = [&](const std::vector<double>& corners) {
    const double round_off = 2e-14 * scene.duration;
    for (const double t : corners)
      if (t > round_off && t < scene.duration - round_off) o.corners.push_back(t);
  };
  for (const WheelTurn& t : turns_of(scene.turns)) add_corners(rest_to_rest(t.manoeuvre).corners);
  const std::vector<Drive> drives = drives_of(scene);
  const int samples = samples_of(scene, drives);
  std::vector<std::function<double(double)>> functions;
  for (const Drive& d : drives) {
    add_corners(corners_of(d, scene.duration, samples));
    if (!d.given->manoeuvre) functions.push_back(d.felt());
  }
  constexpr double of_tolerance = 1e-3;
  o.step_ends = smooth_pieces(functions, scene.duration, samples, of_tolerance * scene.step_tolerance());
  o.telling_times = times_of_extremes(drives, scene.duration, samples);
  std::ranges::sort(o.corners);
  o.corners.erase(std::unique(o.corners.begin(), o.corners.end()), o.corners.end());
}

namespace {

/// Over a flight.
double least_motion(const Tree& tree, const std::vector<VectorXd>& y) {
  return least_motion(tree.scene(), [&](size_t joint) {
    const int scalar = tree.layout().joints[joint].scalar;
    const auto [lowest, highest] =
        std::ranges::minmax_element(y, {}, [scalar](const VectorXd& row) { return row[scalar]; });
    return std::pair((*lowest)[scalar], (*highest)[scalar]);
  });
}

EnergyOfRun ledger_of(const Balance& b) { return {b.kinetic, b.potential, b.work, b.ledger}; }

/// What results are made of.
void set_flown(const Scene& scene, TreeTrajectory flight, Run& r) {
  r.outputs = output_table(scene, *r.tree, flight);
  if (!flight.balance.empty()) r.ledger = ledger_of(flight.balance.back());
  r.motion = std::move(flight);
}

}  // namespace

namespace {

/// Of a motion on its way: its events and summary, and the rows from `first` on that come before `last`.
TreeTrajectory rows_of(const TreeTrajectory& all, size_t first, size_t last) {
  const auto part = [&](const auto& rows) {
    const auto begin = rows.begin() + static_cast<std::ptrdiff_t>(std::min(first, rows.size()));
    return std::decay_t<decltype(rows)>(begin, rows.begin() + static_cast<std::ptrdiff_t>(std::min(last, rows.size())));
  };
  TreeTrajectory r;
  r.time = part(all.time), r.y = part(all.y), r.balance = part(all.balance), r.laws = part(all.laws);
  r.events = all.events, r.summary = all.summary;
  r.stiffening_effect = all.stiffening_effect, r.warnings = all.warnings;
  return r;
}

}  // namespace

Run fly_tree(const Scene& scene, std::vector<PreparedBody> bodies, const RunHooks& hooks, long max_steps) {
  const Stopwatch start;
  const Multibody multibody = make_multibody(scene, bodies);
  const auto plain = std::make_shared<const Tree>(multibody);
  IntegratorOptions options = integrator_options(scene, hooks, "auto", max_steps);
  set_corners(scene, options);
  if (scene.from) options.stops = scene.from->stops(joint_names(scene));
  std::vector<Stiffening> stiffening = first_stiffening(scene, multibody, *plain, options.telling_times);
  Run r;
  r.bodies = std::move(bodies);
  r.prepare_seconds = start.seconds();
  const Stopwatch flight_time;
  size_t told = 0;
  std::vector<LargestStiffening> effect;  // of the flight so far
  Checkpoint<TreeTrajectory> checkpoint;
  if (hooks.checkpoint)
    checkpoint = [&](const TreeTrajectory& so_far, size_t outputs) {
      if (outputs < told) told = 0;  // another method has begun anew
      if (will_be_revised(scene, multibody, effect, stiffening)) return;
      Run part = r;
      set_flown(scene, rows_of(so_far, told, outputs), part);
      part.end = end_of(part, scene, so_far.time.back(), so_far.y.back(), so_far.summary);
      part.integrate_seconds = flight_time.seconds();
      hooks.checkpoint(std::move(part), std::exchange(told, outputs));
    };
  int ended = 0;
  const auto look = [&](const std::vector<LargestStiffening>& reached) {
    constexpr int most_ended = 2;  // a later flight goes on, and shows of all bodies what counts
    effect = reached;
    if (ended == most_ended || !will_be_revised(scene, multibody, effect, stiffening)) return;
    ++ended;
    throw NumericalError("geometric stiffness counts: the flight without it is of no use");
  };
  TreeTrajectory flight;
  const auto fly = [&] {
    told = 0;
    const bool is_plain = std::ranges::count(stiffening, Stiffening::on) == 0;
    r.tree = is_plain ? plain : std::make_shared<const Tree>(multibody, stiffening);
    flight = integrate(*r.tree, first_state(scene, *r.tree), options, checkpoint, look);
    return Flown{flight.summary.interrupted, least_motion(*r.tree, flight.y)};
  };
  fly_until_settled(scene, multibody, effect, stiffening, fly);
  r.end = end_of(r, scene, flight.time.back(), flight.y.back(), flight.summary);
  set_flown(scene, std::move(flight), r);
  note_unseen_stiffening(multibody, stiffening, r.motion.stiffening_effect, r.motion.warnings);
  r.integrate_seconds = flight_time.seconds();
  return r;
}

}  // namespace flexboom
