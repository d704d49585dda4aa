// The keys of a scene: name, unit, meaning, value, range. Their defaults are those of the structs.

#include "apps/scene/keys.hpp"
#include "apps/scene/scene_checks.hpp"
#include "apps/scene/scene_keys.hpp"
#include "apps/scene/wanted_accuracy.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

namespace flexboom {
namespace {

using namespace scene_checks;
using Eigen::Vector3d;
using toml_reader::Faults;
using Use = Archive::Use;

constexpr std::array<std::string_view, 2> formulations = {"relative", "multipliers"};
constexpr std::array<std::string_view, 2> load_axes = {"body", "inertial"};
constexpr std::array<std::string_view, 2> orbit_gravities = {"none", "differential"};
constexpr std::array<std::string_view, 2> profiles = {"smooth", "trapezoid"};
constexpr std::array<std::string_view, 2> interpolations = {"cubic", "linear"};
constexpr std::array<std::string_view, 2> outsides = {"error", "hold"};

void angle(Faults& faults, const std::string& path, const double& value, std::string_view) {
  if (!(std::abs(value) <= 2 * std::numbers::pi))
    faults.add(path, fmt::format("is {} rad; it must lie between -2 pi and 2 pi", value));
}

void tolerance(Faults& faults, const std::string& path, const double& value, std::string_view) {
  constexpr double least = 1e-14;  // some steps of round-off
  if (!(value >= least && value <= 0.1))
    faults.add(path,
               fmt::format("is {}; it must be {:g} or more, which is what double precision leaves, and at most 0.1",
                           value, least));
}

void integrator_tolerance(Faults& faults, const std::string& path, const double& value, std::string_view unit) {
  if (value != 0) tolerance(faults, path, value, unit);
}

void settle(Faults& faults, const std::string& path, const double& value, std::string_view) {
  if (!(std::isfinite(value) && value < 1))
    faults.add(path,
               fmt::format("is {}; it must be below 1 (0: never, negative: a hundredth of the tolerance)", value));
}

void eccentricity(Faults& faults, const std::string& path, const double& value, std::string_view) {
  if (!(value >= 0 && value < 1)) faults.add(path, fmt::format("is {}; it must lie in [0, 1)", value));
}

void mass_of_a_free_hub(Faults& faults, const std::string& path, const double& value, std::string_view unit) {
  if (!(std::isfinite(value) && value > 0))
    return faults.add(path, fmt::format("is {} kg; it must be positive, or hub.fixed = true", value));
  positive(faults, path, value, unit);
}

void quaternion(Faults& faults, const std::string& path, const Eigen::Vector4d& value, std::string_view) {
  if (!(std::abs(value.norm() - 1) <= 1e-6))
    faults.add(path, fmt::format("has length {}; a unit quaternion [w, x, y, z] has 1", value.norm()));
}

void starts(Faults& faults, const std::string& path, const std::vector<double>& values, std::string_view) {
  for (const double value : values) start(faults, path, value, "");
}

void absolute_errors(Faults& faults, const std::string& path, const std::vector<std::string>& texts, std::string_view) {
  std::set<std::string> units;
  for (const std::string& text : texts) {
    try {
      const AbsoluteError error = absolute_error(text);
      require(units.insert(error.unit).second,
              fmt::format("is '{}', and another error in {} stands before it; leave one", text, error.unit));
    } catch (const InputError& e) {
      faults.add(path, e.what());
    }
  }
}

void accuracy_keys(Archive& a, Scene& s) {
  a.key({"tolerance", "", "relative error wanted in the outputs, 1e-14 to 0.1"}, s.tolerance, tolerance);
  a.key(
      {"outputs", "",
       R"(columns whose errors count, a vector being one: `"hub.rotation"`; with an accuracy of its own `"hub.rotation 1e-4"` or `"hub.rotation 1e-9 rad"`)",
       false, "all"},
      s.outputs);
  a.key({"absolute", "", R"(errors that do not count, with their unit: `["1e-9 rad", "1e-6 m"]`)", false, "none"},
        s.absolute, absolute_errors);
  a.key({"budget", "", "whether the run is repeated to measure its errors"}, s.error_budget);
}

void integrator_keys(Archive& a, Scene& s) {
  a.key({"method", "",
         "`\"exponential\"`, `\"bdf\"`, `\"adams\"`, `\"dirk\"` or `\"erk\"`; with multipliers `\"ida\"`; `\"auto\"`: "
         "chosen by the program, and the plan says why"},
        s.integrator);
  a.key({"tolerance", "", "relative error of the motion, no more than that of the outputs; 0: the same"},
        s.integrator_tolerance, integrator_tolerance);
  a.choice({"formulation", "", "coordinates"}, formulations, s.formulation);
  a.key({"settle", "",
         "fraction of its largest rate below which a hinge rests at its stop; 0: not by its rate, negative: a "
         "hundredth of the tolerance"},
        s.settle, settle);
  a.key({"rescale_at_events", "",
         "whether errors are relative to the motion since the last contact; not with multipliers"},
        s.rescale_at_events);
}

void orbit_keys(Archive& a, OrbitScene& o) {
  a.key({"altitude", "m", "of the perigee above the equatorial radius"}, o.altitude, positive);
  a.key({"eccentricity", "", "0 or more, below 1"}, o.eccentricity, eccentricity);
  a.key({"inclination", "rad", "of the orbit"}, o.inclination, angle);
  a.key({"node", "rad", "right ascension of the ascending node"}, o.node, angle);
  a.key({"perigee", "rad", "argument of the perigee, from the node"}, o.perigee, angle);
  a.key({"anomaly", "rad", "true anomaly at t = 0, from the perigee"}, o.anomaly, angle);
  a.choice({"gravity", "", "that of the Earth on every body less that on the reference point, or none"},
           orbit_gravities, o.gravity);
  a.key({"J2", "", "whether the orbit and the gravity have the Earth's oblateness"}, o.J2);
}

void hub_keys(Archive& a, HubScene& h) {
  a.key({"fixed", "", "whether the hub does not move; it then needs no mass"}, h.fixed);
  a.key({"mass", "kg", "of the hub", !h.fixed}, h.mass, h.fixed ? not_negative : mass_of_a_free_hub);
  a.key({"inertia", "kg m^2", "about the mass centre, which is the origin of the hub: 3 x 3 or the diagonal", !h.fixed},
        h.inertia, h.fixed ? semidefinite : definite);
  a.key({"size", "m", "of the box in pictures"}, h.size, box);
}

void initial_keys(Archive& a, Scene& s) {
  a.key({"rate", "rad/s", "angular velocity of the hub, hub axes"}, s.start_rate, finite);
  a.key({"velocity", "m/s", "of the hub, hub axes"}, s.start_velocity, finite);
}

// --- laws of hinges and sliders ---

void spring_table_keys(Archive& a, LawTable& t) {
  a.key({"at", "rad", "angles, ascending", required}, t.at);
  a.key({"load", "N m", "on b at each of them, linear between and beyond", required}, t.load);
}

void damper_table_keys(Archive& a, LawTable& t) {
  a.key({"rate", "rad/s", "ascending", required}, t.at);
  a.key({"load", "N m", "on b, at each of them: against the motion, so negative at positive rates; zero at rest",
         required},
        t.load);
}

void friction_keys(Archive& a, FrictionLaw& f) {
  a.key({"coulomb", "N m", "load in motion", required}, f.coulomb);
  if (a.reader()) f.breakaway = f.coulomb;
  a.key({"breakaway", "N m", "what holds at rest", false, "`coulomb`"}, f.breakaway);
}

void stop_keys(Archive& a, StopLaw& s) {
  a.key({"at", "rad", "where it is", required}, s.at);
  a.key({"stiffness", "N m/rad", "of a pad"}, s.stiffness);
  a.key({"damping", "N m s/rad", "of a pad"}, s.damping);
  a.key({"restitution", "", "of a rigid stop, 0 to 1", false, "a pad"}, s.restitution);
}

void latch_keys(Archive& a, LatchLaw& l) {
  a.key({"at", "rad", "where it locks", required}, l.at);
  a.key({"rate", "rad/s", "that it locks below", required}, l.rate);
}

void law_keys(Archive& a, JointLaw& l) {
  a.key({"preload", "N m", "constant load"}, l.preload);
  a.key({"backlash", "rad",
         "half width of the way about `rest` in which the linear spring has no load; needs `stiffness`"},
        l.backlash);
  a.table({"spring", "", "load over angle"}, l.spring, spring_table_keys, "Spring table", !l.spring.at.empty());
  a.table({"damper", "", "load over rate"}, l.damper, damper_table_keys, "Damper table", !l.damper.at.empty());
  a.table({"friction", "", "Coulomb friction with stiction"}, l.friction, friction_keys, "Friction");
  a.table({"lower_stop", "", "end of the way: a pad pushes and never pulls, a rigid stop has a restitution"},
          l.lower_stop, stop_keys, "Stop");
  a.table({"upper_stop", "", "the other end"}, l.upper_stop, stop_keys, "Stop");
  a.table({"latch", "", "locks the joint for good where it passes slowly enough"}, l.latch, latch_keys, "Latch");
}

void law_part(Archive& a, JointLaw& l) {
  a.part("Laws of a hinge or a slider", [&](Archive& part) { law_keys(part, l); });
}

/// P1 stands for stiffness * threshold.
void take_P1(KeyReader& reader, const std::optional<double>& P1, HingeMechanism& m) {
  const auto fault = [&](const char* key, const std::string& text) { reader.table().fault(key, text); };
  const bool has_stiffness = reader.has("stiffness");
  if (!P1 && !has_stiffness)
    fault("P1", "is missing; give P1 [N m] or stiffness = P1 / threshold [N m/rad], 0 for no spring");
  if (P1 && has_stiffness) fault("stiffness", "is given beside P1; stiffness = P1 / threshold, so give one of them");
  if (!P1) return;
  if (!(std::isfinite(*P1) && *P1 >= 0)) fault("P1", fmt::format("is {} N m; it must be zero or positive", *P1));
  if (m.threshold <= 0) fault("threshold", fmt::format("is {} rad; with P1 it must be positive", m.threshold));
  m.stiffness = m.threshold > 0 && *P1 >= 0 ? *P1 / m.threshold : 0;
}

void hinge_keys(Archive& a, HingeScene& h) {
  HingeMechanism& m = h.hinge.mechanism;
  std::optional<double> P1;
  a.key({"body", "", "name of the body that the hinge carries, and of the hinge", required}, h.body);
  a.key({"point", "m", "on the hub, hub axes", required}, h.hinge.point, finite);
  a.key({"stowed", "", "unit vector, hub axes: the boom at angle 0", required}, h.hinge.stowed, direction);
  a.key({"outward", "", "unit vector normal to it: the boom at pi/2", required}, h.hinge.outward, direction);
  a.key({"threshold", "rad", "angle of the stop", false, "pi/2"}, m.threshold, finite);
  a.key({"rest", "rad", "angle where the spring is free", false, "pi/2"}, m.rest, finite);
  a.key({"stiffness", "N m/rad", "of the spring", false, "give it or `P1`"}, m.stiffness, not_negative);
  a.key({"P1", "N m", "stands for `stiffness`, which is `P1` / `threshold`", false, "`stiffness`"}, P1);
  a.key({"P2", "N m s/rad", "damping"}, m.damping, not_negative);
  a.key({"P3", "N m/rad", "stiffness of the stop; 0: none"}, m.stop_stiffness, not_negative);
  if (KeyReader* reader = a.reader()) take_P1(*reader, P1, m), h.start_angle = m.rest;
  a.key({"start_angle", "rad", "at t = 0, up to 1e4", false, "`rest`"}, h.start_angle, start);
  a.key({"start_rate", "rad/s", "at t = 0, up to 1e4"}, h.start_rate, start);
  a.key({"loads", "", "whether the force and torque of the hinge are outputs"}, h.loads);
  law_part(a, h.law);
  if (!a.reader()) return;
  h.hinge.name = h.body;
  h.hinge.stowed = unit_direction(h.hinge.stowed);
  h.hinge.outward = normal_to(unit_direction(h.hinge.outward), h.hinge.stowed);
}

// --- joints and what acts on bodies ---

void joint_keys(Archive& a, JointScene& j) {
  static const std::vector<std::string_view> kinds = names_of(joint_types);
  HingeMechanism& m = j.mechanism;
  a.choice({"kind", "", "what the joint leaves free", required}, kinds, j.kind);
  a.key({"name", "", "may be that of a body", false, "the body of `b`"}, j.name, name);
  a.table({"a", "", "place on the body nearer to the inertial frame", false, "the inertial frame"}, j.a, place_keys,
          "Place");
  a.table({"b", "", "place on the body that the joint carries", required}, j.b, place_keys, "Place");
  a.key({"stiffness", "N m/rad, N/m", "of the spring of a hinge or a slider"}, m.stiffness, not_negative);
  a.key({"rest", "rad, m", "angle or length where that spring is free"}, m.rest, finite);
  a.key({"damping", "N m s/rad, N s/m", "of a hinge or a slider"}, m.damping, not_negative);
  a.key({"stop_stiffness", "N m/rad, N/m", "of the stop of a hinge or a slider; 0: none"}, m.stop_stiffness,
        not_negative);
  a.key({"threshold", "rad, m", "angle or length of that stop"}, m.threshold, finite);
  a.key({"drive", "N m, N", "torque or force of a motor in a hinge or a slider, function of time"}, j.drive);
  a.key(
      {"motion", "rad, m",
       "prescribed angle or length, function of time without jumps of its rate; two in an array for a universal joint"},
      j.motion);
  a.key({"start", "rad, m", "of a hinge or slider (number) or a universal joint (two in an array)", false,
         "`rest` of a spring, or 0"},
        j.start, starts);
  a.key({"start_rate", "rad/s, m/s", "the same", false, "0"}, j.start_rate, starts);
  a.key(
      {"start_attitude", "", "of a spherical or free joint: quaternion [w, x, y, z] from the axes of b to those of a"},
      j.start_attitude, quaternion);
  a.key({"start_omega", "rad/s", "of a spherical or free joint, axes of its place b"}, j.start_omega, finite);
  a.key({"start_position", "m", "of a free joint, axes of a"}, j.start_position, finite);
  a.key({"start_velocity", "m/s", "of a free joint, axes of a"}, j.start_velocity, finite);
  a.key({"loads", "", "whether its force and torque are outputs"}, j.loads);
  a.key(
      {"closes_loop", "", "whether it closes a loop instead of carrying a body; needs `formulation = \"multipliers\"`"},
      j.closes_loop);
  law_part(a, j.law);
  if (a.reader() && !a.reader()->has("name")) j.name = j.b.body;
}

void spring_keys(Archive& a, SpringScene& s) {
  a.key({"name", "", "of the spring", required}, s.name, name);
  a.table({"a", "", "place of one end", required}, s.a, place_keys, "Place");
  a.table({"b", "", "place of the other", required}, s.b, place_keys, "Place");
  a.key({"stiffness", "N/m", "along the line between the places"}, s.stiffness, not_negative);
  a.key({"free_length", "m", "where it pulls nothing"}, s.free_length, not_negative);
  a.key({"damping", "N s/m", "along that line"}, s.damping, not_negative);
}

void load_keys(Archive& a, LoadScene& l) {
  a.key({"name", "", "of the load", required}, l.name, name);
  a.table({"at", "", "place that it acts on", required}, l.at, place_keys, "Place");
  a.choice({"axes", "", "of the force and the torque, those of the place or inertial ones"}, load_axes,
           l.inertial_axes);
  a.key({"force", "N", "three functions of time", false, "zero"}, l.force);
  a.key({"torque", "N m", "three functions of time", false, "zero"}, l.torque);
}

void wheel_keys(Archive& a, WheelScene& w) {
  a.key({"name", "", "of the reaction wheel", required}, w.name, name);
  a.key({"body", "", "that carries it", required}, w.body);
  a.key({"axis", "", "unit vector, axes of the body"}, w.axis, direction);
  a.key({"inertia", "kg m^2", "of the rotor about its axis: no part of that of the body", required}, w.inertia,
        positive);
  a.key({"spin", "rad/s", "at t = 0, relative to the body"}, w.spin, finite);
  a.key({"torque", "N m", "on the rotor, function of time"}, w.torque);
  if (a.reader()) w.axis = unit_direction(w.axis);
}

void turn_keys(Archive& a, TurnScene& t) {
  a.key({"body", "", "that turns: free, with three wheels that have no `torque`", required}, t.body);
  a.key({"axis", "", "unit vector, axes of the body"}, t.axis, direction);
  turn_from_rest_keys(a, t.manoeuvre);
  a.key({"pause", "s", "from t = 0 or the end of the turn before"}, t.pause, not_negative);
  if (a.reader()) t.axis = unit_direction(t.axis);
}

/// Is there anything that a scene of [hub] and [[hinges]] alone cannot have? They are shorthand then.
bool beyond_a_hub(KeyReader& reader, const Scene& s) {
  return std::ranges::any_of(std::array{"joints", "springs", "loads", "wheels", "turns", "gravity"},
                             [&](const char* key) { return reader.has(key); }) ||
         std::ranges::any_of(s.hinges, [](const HingeScene& h) { return h.law.given(); }) ||
         std::ranges::any_of(s.bodies,
                             [](const BodyScene& b) { return b.rigid || !b.reduced_file.empty() || b.root_moves(); });
}

}  // namespace

void turn_from_rest_keys(Archive& a, Manoeuvre& m) {
  a.choice({"profile", "", "of the rate"}, profiles, m.profile);
  a.key({"angle", "rad", "of the turn from rest to rest", required}, m.angle);
  a.key({"peak_rate", "rad/s", "of the turn", required}, m.peak_rate);
  a.key({"peak_acceleration", "rad/s^2", "of the turn", required}, m.peak_acceleration);
}

void timed_turn_keys(Archive& a, Manoeuvre& m) {
  turn_from_rest_keys(a, m);
  a.key({"start", "s", "when it starts"}, m.start);
}

void time_table_keys(Archive& a, TimeTable& t) {
  a.choice({"interpolation", "", "between the times"}, interpolations, t.interpolation);
  a.choice({"outside", "", "what is before the first and after the last time"}, outsides, t.outside);
  a.key({"time", "s", "ascending", required}, t.time);
  a.key({"value", "", "one per time", required}, t.value);
}

void rigid_keys(Archive& a, RigidScene& r) {
  a.key({"mass", "kg", "of a rigid body", required}, r.mass, positive);
  a.key({"inertia", "kg m^2", "about its mass centre: 3 x 3 or the diagonal", required}, r.inertia, semidefinite);
  a.key({"centre", "m", "its mass centre"}, r.centre, finite);
  a.key({"size", "m", "of the box about the mass centre in pictures"}, r.size, box);
}

void place_keys(Archive& a, PlaceScene& p) {
  std::string body(p.body.empty() ? scene_keys::ground : std::string_view(p.body));
  const bool both = a.use() != Use::write;
  a.key({"body", "", "name of the body, or `\"ground\"`: the inertial frame"}, body);
  if (both || !p.marker.empty()) a.key({"marker", "", "of a flexible body", false, "`point`"}, p.marker);
  if (both || p.marker.empty())
    a.key({"point", "m", "in the axes of the body; of an elastic one it moves with the root alone"}, p.point, finite);
  a.key({"x", "", "unit vector, axes of the body: x of the place"}, p.x, direction);
  a.key({"z", "", "unit vector normal to it: z of the place"}, p.z, direction);
  KeyReader* reader = a.reader();
  if (!reader) return;
  p.body = body == scene_keys::ground ? "" : body;
  if (reader->has("marker") && reader->has("point"))
    reader->table().fault("point", "is given beside marker, which has its own; give one of them");
  p.z = unit_direction(p.z);
  p.x = normal_to(unit_direction(p.x), p.z);
}

void shorthand_keys(Archive& a, Scene& s) {
  a.table({"hub", "", "A rigid hub that hinges carry booms on.", required}, s.hub, hub_keys);
  a.table({"initial", "", "The start of the hub."}, s, initial_keys);
  if (!a.reader())
    a.tables({"hinges", "", "Hinges of the hub; each carries one body by its root."}, s.hinges, hinge_keys);
}

void scene_keys_of_file(Archive& a, Scene& s) {
  a.key({"name", "", "of the scene and of its results folder: letters, digits, `_` and `-`", required}, s.name, name);
  a.key({"duration", "s", "simulated time"}, s.duration, positive);
  a.key({"output_step", "s", "step of `trajectory.csv`"}, s.output_step, positive);
  a.key({"vtu_step", "s", "step of the moving picture; 0: none"}, s.vtu_step, not_negative);
  if (a.use() != Use::write || s.is_tree)
    a.key({"gravity", "m/s^2", "uniform, inertial axes; not beside that of `[orbit]`"}, s.gravity, finite);
  a.table({"accuracy", "", "What is wanted of the results."}, s, accuracy_keys);
  a.table({"integrator", "", "How the motion is simulated."}, s, integrator_keys);
  a.table({"orbit", "", "Orbit of the reference point. Without the table there is none."}, s.orbit, orbit_keys);
  a.tables({"bodies", "", "Bodies: booms of beams or solids."}, s.bodies, body_keys);
  a.tables({"joints", "", "Joints. Each body hangs on one."}, s.joints, joint_keys);
  a.tables(
      {"springs", "",
       "Line springs between two places. Ends that start at one point are a fault where `free_length` is not zero."},
      s.springs, spring_keys);
  a.tables({"loads", "", "Forces and torques."}, s.loads, load_keys);
  a.tables({"wheels", "", "Reaction wheels."}, s.wheels, wheel_keys);
  a.tables({"turns", "", "Turns from rest to rest by wheels, one after another."}, s.turns, turn_keys);
  if (KeyReader* reader = a.reader()) {
    a.tables({"hinges", "", ""}, s.hinges, hinge_keys);
    s.is_tree = beyond_a_hub(*reader, s);
    if (s.is_tree && !reader->has("hub") && !reader->has("hinges")) return;
  }
  if (a.reader() || !s.is_tree) shorthand_keys(a, s);
}

}  // namespace flexboom
