// The keys of a scene: name, unit, meaning, value, range. Their defaults are those of the structs.

#include "apps/keys.hpp"
#include "apps/scene_checks.hpp"
#include "apps/scene_keys.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace flexboom {
namespace {

using namespace scene_checks;
using Eigen::Vector3d;
using toml_reader::Faults;

constexpr bool required = true;

void finite(Faults& faults, const std::string& path, const double& value, std::string_view) {
  check_finite(faults, path, value);
}
void finite(Faults& faults, const std::string& path, const Vector3d& value, std::string_view) {
  check_finite(faults, path, value);
}
void positive(Faults& faults, const std::string& path, const double& value, std::string_view unit) {
  check_positive(faults, path, value, unit);
}
void not_negative(Faults& faults, const std::string& path, const double& value, std::string_view unit) {
  check_not_negative(faults, path, value, unit);
}
void start(Faults& faults, const std::string& path, const double& value, std::string_view unit) {
  check_start(faults, path, value, unit);
}
void direction(Faults& faults, const std::string& path, const Vector3d& value, std::string_view) {
  check_unit(faults, path, value);
}
void box(Faults& faults, const std::string& path, const Vector3d& size, std::string_view unit) {
  for (const double side : size) check_not_negative(faults, path, side, unit);
}
void angle(Faults& faults, const std::string& path, const double& value, std::string_view) {
  if (!(std::abs(value) <= 2 * std::numbers::pi))
    faults.add(path, fmt::format("is {} rad; it must lie between -2 pi and 2 pi", value));
}
void definite(Faults& faults, const std::string& path, const Eigen::Matrix3d& value, std::string_view) {
  check_inertia(faults, path, value, false);
}
void semidefinite(Faults& faults, const std::string& path, const Eigen::Matrix3d& value, std::string_view) {
  check_inertia(faults, path, value, true);
}
void name(Faults& faults, const std::string& path, const std::string& value, std::string_view) {
  check_name(faults, path, value);
}
template <const auto& names>
void among(Faults& faults, const std::string& path, const std::string& value, std::string_view) {
  check_name_among(faults, path, value, names);
}

void tolerance(Faults& faults, const std::string& path, const double& value, std::string_view) {
  constexpr double least = 1e-14;  // some steps of round-off
  if (!(value >= least && value <= 0.1))
    faults.add(path,
               fmt::format("is {}; it must be {:g} or more, which is what double precision leaves, and at most 0.1",
                           value, least));
}
void settle(Faults& faults, const std::string& path, const double& value, std::string_view) {
  if (!(std::isfinite(value) && value < 1))
    faults.add(path, fmt::format("is {}; it must be below 1 (0: never, negative: the tolerance)", value));
}
void eccentricity(Faults& faults, const std::string& path, const double& value, std::string_view) {
  if (!(value >= 0 && value < 1)) faults.add(path, fmt::format("is {}; it must lie in [0, 1)", value));
}
void mass_that_flies(Faults& faults, const std::string& path, const double& value, std::string_view unit) {
  if (!(std::isfinite(value) && value > 0))
    return faults.add(path, fmt::format("is {} kg; it must be positive, or hub.fixed = true", value));
  check_positive(faults, path, value, unit);
}

}  // namespace

void settings_keys(Archive& a, Scene& s) {
  a.key({"name", "", "of the scene and of its results folder: letters, digits, `_` and `-`", required}, s.name, name);
  a.key({"duration", "s", "length of the flight"}, s.duration, positive);
  a.key({"output_step", "s", "step of `trajectory.csv`"}, s.output_step, positive);
  a.key({"vtu_step", "s", "step of the moving picture; 0: none"}, s.vtu_step, not_negative);
}

void accuracy_keys(Archive& a, Scene& s) {
  a.key({"tolerance", "", "relative error wanted in the outputs, 1e-14 to 0.1"}, s.tolerance, tolerance);
  a.key(
      {"outputs", "", "columns whose errors count, a vector being one: `\"hub.rotation\"`, `\"NAME.tip\"`; empty: all"},
      s.outputs);
  a.key({"budget", "", "whether the run is repeated to measure its errors"}, s.error_budget);
}

void integrator_keys(Archive& a, Scene& s) {
  a.key({"method", "",
         "`\"exponential\"`, `\"bdf\"`, `\"adams\"`, `\"dirk\"`, `\"erk\"`, by multipliers `\"ida\"`; `\"auto\"`: the "
         "one that is "
         "fastest on a short pilot flight, by multipliers ida"},
        s.integrator);
  a.key({"formulation", "",
         "`\"relative\"` coordinates, or `\"multipliers\"`: redundant coordinates, for closed loops, too"},
        s.formulation, among<scene_keys::formulations>);
  a.key({"settle", "",
         "fraction of its largest rate below which a hinge rests at its stop; 0: never, negative: the tolerance"},
        s.settle, settle);
  a.key({"rescale_at_events", "", "errors relative to the motion since the last contact; not by multipliers"},
        s.rescale_at_events);
}

void orbit_keys(Archive& a, OrbitScene& o) {
  a.key({"altitude", "m", "of the perigee of the reference point, above the equatorial radius"}, o.altitude, positive);
  a.key({"eccentricity", "", "in [0, 1)"}, o.eccentricity, eccentricity);
  a.key({"inclination", "rad", "of the orbit; the inertial axes are those of the LVLH frame at t = 0"}, o.inclination,
        angle);
  a.key({"node", "rad", "right ascension of the ascending node"}, o.node, angle);
  a.key({"perigee", "rad", "argument of the perigee, from the node"}, o.perigee, angle);
  a.key({"anomaly", "rad", "true anomaly at t = 0, from the perigee"}, o.anomaly, angle);
  a.key({"gravity", "",
         "`\"differential\"`: that on every body less that on the reference point, where the mass centre starts; "
         "`\"none\"`: left out"},
        o.gravity, among<scene_keys::orbit_gravities>);
  a.key({"J2", "", "oblateness of the Earth, in the orbit and in the gravity"}, o.J2);
}

void hub_keys(Archive& a, HubScene& h) {
  a.key({"fixed", "", "whether the hub does not move at all; it needs no mass then"}, h.fixed);
  a.key({"mass", "kg", "of the hub", !h.fixed}, h.mass, h.fixed ? not_negative : mass_that_flies);
  a.key({"inertia", "kg m^2", "about the mass centre, which is its origin: 3 x 3 or the diagonal", !h.fixed}, h.inertia,
        h.fixed ? semidefinite : definite);
  a.key({"size", "m", "of the box in pictures"}, h.size, box);
}

void initial_keys(Archive& a, Scene& s) {
  a.key({"rate", "rad/s", "angular velocity of the hub, hub axes"}, s.start_rate, finite);
  a.key({"velocity", "m/s", "of the hub, hub axes"}, s.start_velocity, finite);
}

void hinge_keys(Archive& a, HingeScene& h) {
  HingeMechanism& m = h.hinge.mechanism;
  a.key({"body", "", "name of the body that the hinge carries, and of the hinge", required}, h.body);
  a.key({"point", "m", "on the hub, hub axes", required}, h.hinge.point, finite);
  a.key({"stowed", "", "unit vector, hub axes: the boom at angle 0", required}, h.hinge.stowed, direction);
  a.key({"outward", "", "unit vector normal to it: the boom at pi/2", required}, h.hinge.outward, direction);
  a.key({"threshold", "rad", "angle of the stop", false, "pi/2"}, m.threshold, finite);
  a.key({"rest", "rad", "angle where the spring is free", false, "pi/2"}, m.rest, finite);
  a.key({"stiffness", "N m/rad", "of the spring: `P1` / `threshold`", false, "give it or `P1`"}, m.stiffness,
        not_negative);
  a.key({"P2", "N m s/rad", "damping"}, m.damping, not_negative);
  a.key({"P3", "N m/rad", "stiffness of the stop; 0: none"}, m.stop_stiffness, not_negative);
  if (a.reads()) h.start_angle = m.rest;
  a.key({"start_angle", "rad", "at t = 0, up to 1e4", false, "`rest`"}, h.start_angle, start);
  a.key({"start_rate", "rad/s", "at t = 0, up to 1e4"}, h.start_rate, start);
  a.key({"loads", "", "whether the force and torque of the hinge are outputs"}, h.loads);
}

void rigid_keys(Archive& a, RigidScene& r) {
  a.key({"mass", "kg", "of a rigid body", required}, r.mass, positive);
  a.key({"inertia", "kg m^2", "about its mass centre: 3 x 3 or the diagonal", required}, r.inertia, semidefinite);
  a.key({"centre", "m", "its mass centre"}, r.centre, finite);
  a.key({"size", "m", "of the box about the mass centre in pictures"}, r.size, box);
}

void damping_keys(Archive& a, DampingRule& d) {
  const bool by_value = a.reads() && (d.name == "modal" || d.name == "loss-factor");
  a.key({"value", "", "of `\"modal\"` the damping ratio of every mode, of `\"loss-factor\"` twice that", by_value},
        d.value, not_negative);
  a.key({"alpha", "1/s", "of `\"rayleigh\"`: damping alpha Me + beta Ke"}, d.alpha, not_negative);
  a.key({"beta", "s", "of `\"rayleigh\"`"}, d.beta, not_negative);
}

void solid_keys(Archive& a, SolidOptions& o) {
  a.key({"element", "",
         "`\"hex\"`, or `\"hex8\"`, `\"hex8-reduced\"`, `\"hex20\"`, `\"hex20-reduced\"`, `\"hex27\"`, `\"tet4\"`, "
         "`\"tet10\"`"},
        o.element);
  a.key(
      {"accuracy", "",
       "relative error wanted in the first ten frequencies of a clamped boom, 1e-8 or more; chooses what is left open"},
      o.accuracy);
  a.key({"order", "", "of `\"hex\"`, 1 to 8; 0: chosen"}, o.order);
  a.key({"slit", "m", "width of a slit along every tube, at +y, on the midline of the wall; 0: closed"}, o.slit);
}

void grading_keys(Archive& a, SolidGrading& g) {
  a.key({"sectors", "", "elements per quarter of a circle or shorter side", false, "chosen"}, g.sectors);
  a.key({"rings", "", "elements through the section or the wall", false, "chosen"}, g.rings);
  a.key({"long_elements", "", "elements along the boom, beside the graded ends", false, "chosen"}, g.long_elements);
  a.key({"end_layers", "", "layers that grow away from clamps and steps", false, "chosen"}, g.end_layers);
  a.key({"first_layer", "half depths", "thickness of the first of them", false, "chosen"}, g.first_layer);
  a.key({"growth", "", "ratio of one layer to the next", false, "chosen"}, g.growth);
  a.key({"corner_levels", "", "refinements toward the singular rims of clamps and steps", false, "chosen"},
        g.corner_levels);
  a.key({"factor", "", "ratio of one refinement to the next", false, "chosen"}, g.factor);
}

void joint_keys(Archive& a, JointScene& j) {
  HingeMechanism& m = j.mechanism;
  a.key({"name", "", "may be that of a body", false, "the body of `b`"}, j.name, name);
  a.key({"a", "", "place on the body nearer to the inertial frame", false, "`\"ground\"`"}, j.a);
  a.key({"b", "", "place on the body that the joint carries", required}, j.b);
  a.key({"stiffness", "N m/rad, N/m", "of the spring of a hinge or a slider"}, m.stiffness, not_negative);
  a.key({"rest", "rad, m", "angle or length where that spring is free"}, m.rest, finite);
  a.key({"damping", "N m s/rad, N s/m", "of a hinge or a slider"}, m.damping, not_negative);
  a.key({"stop_stiffness", "N m/rad, N/m", "of the stop of a hinge or a slider; 0: none"}, m.stop_stiffness,
        not_negative);
  a.key({"threshold", "rad, m", "angle or length of that stop"}, m.threshold, finite);
  a.key({"drive", "N m, N", "torque or force of a motor in a hinge or a slider, function of time"}, j.drive);
  a.key({"motion", "rad, m", "prescribed angle or length, function of time; two in an array for a universal joint"},
        j.motion);
  a.key({"start", "rad, m", "of a hinge or slider (number) or a universal joint (two in an array)", false,
         "`rest` of a spring, or 0"},
        j.start);
  a.key({"start_rate", "rad/s, m/s", "the same", false, "0"}, j.start_rate);
  a.key(
      {"start_attitude", "", "of a spherical or free joint: quaternion [w, x, y, z] from the axes of b to those of a"},
      j.start_attitude);
  a.key({"start_omega", "rad/s", "of a spherical or free joint, axes of b"}, j.start_omega, finite);
  a.key({"start_position", "m", "of a free joint, axes of a"}, j.start_position, finite);
  a.key({"start_velocity", "m/s", "of a free joint, axes of a"}, j.start_velocity, finite);
  a.key({"loads", "", "whether its force and torque are outputs"}, j.loads);
  a.key({"closes_loop", "",
         "whether it closes a loop instead of carrying a body; needs `formulation = \"multipliers\"`. It has no start: "
         "the "
         "others' say where the bodies are, which then move as little as needed until it closes"},
        j.closes_loop);
}

void spring_keys(Archive& a, SpringScene& s) {
  a.key({"name", "", "of the spring", required}, s.name, name);
  a.key({"a", "", "place of one end", required}, s.a);
  a.key({"b", "", "place of the other", required}, s.b);
  a.key({"stiffness", "N/m", "along the line between the places"}, s.stiffness, not_negative);
  a.key({"free_length", "m", "where it pulls nothing"}, s.free_length, not_negative);
  a.key({"damping", "N s/m", "along that line"}, s.damping, not_negative);
}

void load_keys(Archive& a, LoadScene& l) {
  a.key({"name", "", "of the load", required}, l.name, name);
  a.key({"at", "", "place that it acts on", required}, l.at);
  a.key({"force", "N", "three functions of time", false, "zero"}, l.force);
  a.key({"torque", "N m", "three functions of time", false, "zero"}, l.torque);
}

void wheel_keys(Archive& a, WheelScene& w) {
  a.key({"name", "", "of the reaction wheel", required}, w.name, name);
  a.key({"body", "", "that carries it", required}, w.body);
  a.key({"axis", "", "unit vector, axes of the body"}, w.axis, direction);
  a.key({"inertia", "kg m^2", "of the rotor about its axis", required}, w.inertia, positive);
  a.key({"spin", "rad/s", "at t = 0, relative to the body"}, w.spin, finite);
  a.key({"torque", "N m", "on the rotor, function of time"}, w.torque);
}

void turn_keys(Archive& a, TurnScene& t) {
  Manoeuvre& m = t.manoeuvre;
  a.key({"body", "", "that turns, free, with three wheels that have no `torque`", required}, t.body);
  a.key({"axis", "", "unit vector, axes of the body"}, t.axis, direction);
  a.key({"profile", "", "`\"smooth\"` or `\"trapezoid\"`"}, m.profile);
  a.key({"angle", "rad", "of the turn from rest to rest", required}, m.angle);
  a.key({"peak_rate", "rad/s", "of the turn", required}, m.peak_rate);
  a.key({"peak_acceleration", "rad/s^2", "of the turn", required}, m.peak_acceleration);
  a.key({"pause", "s", "from t = 0 or the end of the turn before"}, t.pause, not_negative);
}

namespace {

template <class T>
std::string table_of(std::string_view title, Keys<T> keys, T value = {}) {
  KeyTable table;
  keys(table, value);
  return fmt::format("{}:\n{}\n", title, std::move(table).text());
}

}  // namespace

std::string key_tables() {
  return table_of<Scene>("The top level", settings_keys) + table_of<Scene>("`[accuracy]`", accuracy_keys) +
         table_of<Scene>("`[integrator]`", integrator_keys) +
         table_of<OrbitScene>("`[orbit]`; without the table there is none", orbit_keys) +
         table_of<HubScene>("`[hub]`", hub_keys) + table_of<Scene>("`[initial]`, the start of the hub", initial_keys) +
         table_of<HingeScene>("`[[hinges]]`, one per body on the hub; `P1` [N m] may stand for `stiffness`",
                              hinge_keys) +
         table_of<JointScene>(
             "`[[joints]]`. `kind` is `\"fixed\"`, `\"hinge\"` (about the common z), `\"slider\"` (along it), "
             "`\"universal\"` (about z of a, then y of b), `\"spherical\"` or `\"free\"`",
             joint_keys) +
         table_of<SpringScene>("`[[springs]]`", spring_keys) +
         table_of<LoadScene>("`[[loads]]`. `axes` is `\"body\"`, those of the place (default), or `\"inertial\"`",
                             load_keys) +
         table_of<WheelScene>("`[[wheels]]`", wheel_keys) +
         table_of<TurnScene>(
             "`[[turns]]`, one after another; the wheels get what turns the whole scene as if it were "
             "rigid as at the start",
             turn_keys) +
         table_of<RigidScene>("Rigid `[[bodies]]`, beside `name`", rigid_keys) +
         table_of<DampingRule>("`damping`. `rule` is `\"modal\"`, `\"loss-factor\"`, `\"rayleigh\"` or `\"none\"`",
                               damping_keys) +
         table_of<SolidOptions>("`[bodies.solid]`, how `structure = \"solid\"` is meshed", solid_keys) +
         table_of<SolidGrading>("`[bodies.solid.grading]`", grading_keys);
}

}  // namespace flexboom
