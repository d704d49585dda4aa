#include "apps/scene/scene.hpp"
#include "apps/scene/scene_keys.hpp"
#include "apps/scene/tree_scene.hpp"
#include "fem/booms/beam_limits.hpp"
#include "fem/mesh/mesh.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace flexboom {

namespace {

using Warnings = std::vector<std::string>;

/// What a body from a file is made of, away from its markers, nobody knows.
void warn_of_points(const Scene& scene, Warnings& warnings) {
  const auto look = [&](const std::string& of, const PlaceScene& place) {
    if (!place.marker.empty() || place.point.isZero(0)) return;
    const auto body = std::ranges::find(scene.bodies, place.body, &BodyScene::name);
    if (body == scene.bodies.end() || !body->reduced || body->reduced->n() == 0) return;
    warnings.push_back(
        fmt::format("{}: a point of body {} moves with its frame alone, whatever bends there; a marker bends with it",
                    of, body->name));
  };
  for (const JointScene& j : scene.joints) look("joint " + j.name, j.a), look("joint " + j.name, j.b);
  for (const SpringScene& s : scene.springs) look("spring " + s.name, s.a), look("spring " + s.name, s.b);
  for (const LoadScene& l : scene.loads) look("load " + l.name, l.at);
}

/// What is given and does nothing, for what it belongs to is not there.
void warn_of_idle_keys(const Scene& scene, Warnings& warnings) {
  const auto idle = [&](const std::string& of, std::string_view keys, std::string_view why) {
    warnings.push_back(fmt::format("{}: {} nothing, {}", of, keys, why));
  };
  for (const BodyScene& b : scene.bodies) {
    if (!b.is_boom() || b.structure == "beam" || b.structure == "rigid") continue;
    const BeamGeometry usual, &g = b.geometry;
    std::vector<std::string_view> keys;
    if (g.theory != usual.theory) keys.emplace_back("theory");
    if (g.shear.name != usual.shear.name) keys.emplace_back("shear");
    if (g.rotary_inertia != usual.rotary_inertia) keys.emplace_back("rotary_inertia");
    if (g.order != usual.order) keys.emplace_back("order");
    if (keys.empty()) continue;
    idle("body " + b.name, fmt::format("{} {}", fmt::join(keys, ", "), keys.size() > 1 ? "do" : "does"),
         fmt::format("structure is \"{}\" and has no beams", b.structure));
  }
  bool has_stop = false;
  const auto look_at = [&](const std::string& of, const HingeMechanism& m, const JointLaw& law,
                           const HingeMechanism& usual) {
    has_stop = has_stop || m.stop_stiffness > 0 || law.upper_stop || law.lower_stop;
    if (m.threshold != usual.threshold && !(m.stop_stiffness > 0))
      idle(of, "threshold does", "without stop_stiffness there is no stop");
    if (m.rest != usual.rest && !(m.stiffness > 0)) idle(of, "rest does", "without stiffness there is no spring");
  };
  for (const HingeScene& h : scene.hinges) look_at("hinge " + h.body, h.hinge.mechanism, h.law, {});
  for (const JointScene& j : scene.joints) {
    if (joint_type(j.kind).scalars == 1) look_at("joint " + j.name, j.mechanism, j.law, {.rest = 0, .threshold = 0});
    if (j.kind == JointKind::free && j.loads) idle("joint " + j.name, "loads does", "a free joint bears none");
  }
  if (scene.settle != Scene{}.settle && !has_stop) idle("integrator", "settle does", "no joint has a stop");
  for (const SpringScene& s : scene.springs)
    if (s.stiffness == 0 && s.damping == 0) idle("spring " + s.name, "it does", "stiffness and damping are 0");
  for (const LoadScene& l : scene.loads)
    if (std::ranges::none_of(l.force, &CourseScene::given) && std::ranges::none_of(l.torque, &CourseScene::given))
      idle("load " + l.name, "it does", "force and torque are missing");
}

/// A cubic through points that a ramp joins swings far beyond them.
void warn_of_overshoot(const std::string& of, const CourseScene& course, Warnings& warnings) {
  if (!course.table || course.table->interpolation != "cubic") return;
  constexpr int looks = 16;          // between two times
  constexpr double bearable = 0.25;  // of the range of the values
  const TimeTable& table = *course.table;
  const TimeCourse cubic = time_table(table);
  const auto [least, most] = std::ranges::minmax(table.value);
  double worst = 0, when = 0;
  for (size_t i = 0; i + 1 < table.time.size(); ++i)
    for (int k = 1; k < looks; ++k) {
      const double t = std::lerp(table.time[i], table.time[i + 1], static_cast<double>(k) / looks);
      const double value = cubic.function.value(t), beyond = std::max(value - most, least - value);
      if (beyond > worst) worst = beyond, when = t;
    }
  if (worst > bearable * (most - least) + 1e-9 * std::max(std::abs(least), std::abs(most)))
    warnings.push_back(
        fmt::format("{}: its cubic is {:.3g} at t = {:.4g} s, beyond its values of {:g} to {:g}; interpolation = "
                    "\"linear\" or more times keep it within",
                    of, cubic.function.value(when), when, least, most));
}

void warn_of_overshoots(const Scene& scene, Warnings& warnings) {
  for (const JointScene& j : scene.joints) {
    warn_of_overshoot("drive of joint " + j.name, j.drive, warnings);
    for (const CourseScene& c : j.motion) warn_of_overshoot("motion of joint " + j.name, c, warnings);
  }
  for (const LoadScene& l : scene.loads)
    for (const auto& three : {l.force, l.torque})
      for (const CourseScene& c : three) warn_of_overshoot("load " + l.name, c, warnings);
  for (const WheelScene& w : scene.wheels) warn_of_overshoot("torque of wheel " + w.name, w.torque, warnings);
}

/// Springs that press on stops, starts beyond them, angles that may be in degrees. `start`: none of a joint that closes
/// a loop.
void warn_of_mechanism(const std::string& of, const HingeMechanism& m, const JointLaw& law, std::optional<double> start,
                       std::string_view unit, Warnings& warnings) {
  constexpr double turns = 4 * std::numbers::pi;  // of a hinge, whose springs and stops count them
  for (const auto& [what, value] :
       {std::pair("starts", start.value_or(0)), std::pair("has the rest of its spring", m.rest)})
    if (unit == "rad" && std::abs(value) > turns)
      warnings.push_back(fmt::format("{}: {} at {:g} rad, {:.1f} turns; angles are in rad", of, what, value,
                                     std::abs(value) / (2 * std::numbers::pi)));
  std::vector<std::pair<double, int>> pads;  // where, and on which side
  if (m.stop_stiffness > 0) pads.emplace_back(m.threshold, 1);
  if (law.upper_stop && !law.upper_stop->restitution) pads.emplace_back(law.upper_stop->at, 1);
  if (law.lower_stop && !law.lower_stop->restitution) pads.emplace_back(law.lower_stop->at, -1);
  for (const auto& [at, side] : pads) {
    if (m.stiffness > 0 && side * (m.rest - at) > 0)
      warnings.push_back(
          fmt::format("{}: the spring is at rest at {:g} {}, beyond the stop at {:g} {}: it presses on it", of, m.rest,
                      unit, at, unit));
    if (start && side * (*start - at) > 0)
      warnings.push_back(
          fmt::format("{}: starts at {:g} {}, beyond the stop at {:g} {}: the stop is pressed in by {:g} {}", of,
                      *start, unit, at, unit, side * (*start - at), unit));
  }
}

void warn_of_mechanisms(const Scene& scene, Warnings& warnings) {
  for (const HingeScene& h : scene.hinges)
    warn_of_mechanism("hinge " + h.body, h.hinge.mechanism, {}, h.start_angle, "rad", warnings);
  for (const JointScene& j : scene.joints)
    if (joint_type(j.kind).scalars == 1) {
      std::optional<double> start;
      if (!j.closes_loop) start = j.start.empty() ? j.mechanism.rest : j.start[0];
      warn_of_mechanism("joint " + j.name, j.mechanism, j.law, start, j.kind == JointKind::slider ? "m" : "rad",
                        warnings);
    }
}

}  // namespace

Warnings doubts_of_beams(const BodyScene& b, bool in_plane) {
  Warnings doubts;
  if (!b.is_boom() || b.structure == "solid") return doubts;
  if (b.solid.slit > 0)
    doubts.push_back(fmt::format("its slit is one of structure = \"solid\"; a {} has none", b.structure));
  if (b.structure == "rigid") return doubts;
  if (std::string doubt = beam_doubt(b.geometry, in_plane); !doubt.empty()) doubts.push_back(std::move(doubt));
  return doubts;
}

void warn_of_body(const BodyScene& b, Warnings& warnings) {
  const bool in_plane = b.directions != "all" && (b.directions_given || !b.modes_auto);
  for (const std::string& doubt : doubts_of_beams(b, in_plane))
    warnings.push_back(fmt::format("body {}: {}", b.name, doubt));
  for (const BeamSegment& segment : b.geometry.segments)
    if (const std::string odd = suspicion(segment.material); b.is_boom() && !odd.empty())
      warnings.push_back(fmt::format("body {}: {}", b.name, odd));
  const double ratio = b.damping.name == "loss-factor" ? b.damping.value / 2 : b.damping.value;
  if (ratio > 1)  // of critical damping
    warnings.push_back(
        fmt::format("body {}: its damping ratio is {:g}, with which nothing vibrates; 5 % is 0.05", b.name, ratio));
  if (!b.reduced) return;
  if (const std::string& doubts = b.reduced->provenance.doubts; !doubts.empty())
    warnings.push_back(fmt::format("body {}: its file {}: {}", b.name, b.reduced_file.string(), doubts));
  for (const BodyCheck& c : b.reduced->certificate)
    if (!c.passed)
      warnings.push_back(
          fmt::format("body {}: its file {} fails its own check \"{}\": {:.6g}, not {:.6g}; make it anew", b.name,
                      b.reduced_file.string(), c.name, c.value, c.reference));
}

void warn_of_oddities(const Scene& scene, std::vector<std::string>& warnings) {
  warn_of_points(scene, warnings);
  warn_of_idle_keys(scene, warnings);
  warn_of_overshoots(scene, warnings);
  constexpr double thick = 1e5;  // [m] of the atmosphere, in which no orbit lasts
  if (scene.orbit && scene.orbit->altitude < thick)
    warnings.push_back(
        fmt::format("orbit.altitude: {:g} m is inside the atmosphere; it is in m", scene.orbit->altitude));
  warn_of_mechanisms(scene, warnings);
  for (const BodyScene& b : scene.bodies) warn_of_body(b, warnings);
}

}  // namespace flexboom
