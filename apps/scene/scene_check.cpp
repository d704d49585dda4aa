#include "apps/base/deflection.hpp"
#include "apps/scene/keys.hpp"
#include "apps/scene/scene.hpp"
#include "apps/scene/scene_checks.hpp"
#include "apps/scene/scene_keys.hpp"
#include "apps/scene/scene_law.hpp"
#include "apps/scene/wanted_accuracy.hpp"
#include "dynamics/methods/integrator.hpp"
#include "fem/base/check.hpp"
#include "fem/mesh/mesh.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

// Comparisons of a value that stands alone are written so that NaN fails them. Comparisons of two values are written so
// that NaN passes them. So the fault is reported once, at the value that is NaN.

namespace flexboom {

using Eigen::Vector3d;
using toml_reader::Faults;

namespace {

using namespace scene_checks;

constexpr double max_rows = 1e6;  // of trajectory.csv

// After a fault in a name, what refers to bodies by name is not looked at.
bool body_names_known(const Faults& faults, const Scene& scene) {
  if (scene.bodies.empty()) return faults.clean("bodies");
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    if (!faults.clean(fmt::format("bodies[{}].name", i))) return false;
  }
  return true;
}

void check_times(Faults& faults, const Scene& scene) {
  const auto check_rows = [&](const char* key, double step) {
    if (step > 0 && scene.duration / step > max_rows) {
      faults.add(key, fmt::format("is {} s: {:.3g} rows in {} s; at most {:g} are written, so make it longer", step,
                                  scene.duration / step, scene.duration, max_rows));
    }
  };
  check_rows("output_step", scene.output_step);
  check_rows("vtu_step", scene.vtu_step);
}

void check_accuracy(Faults& faults, const Scene& scene) {
  if (scene.tolerance > 0 && scene.integrator_tolerance > scene.tolerance)
    faults.add("integrator.tolerance",
               fmt::format("is {:g}, looser than the accuracy wanted, {:g}; make it no more than that, or leave it out",
                           scene.integrator_tolerance, scene.tolerance));
  const std::vector<std::string> known = outputs_of(with_joints(scene));
  const std::vector<std::string_view> names(known.begin(), known.end());
  if (!body_names_known(faults, scene)) return;
  std::set<std::string> before;
  for (const std::string& text : scene.outputs) {
    WantedOutput wanted;
    try {
      wanted = wanted_output(text);
    } catch (const InputError& e) {
      faults.add("accuracy.outputs", e.what());
      continue;
    }
    if (!before.insert(wanted.name).second)
      faults.add("accuracy.outputs", fmt::format("names {} twice; leave one", toml_reader::in_quotes(wanted.name)));
    constexpr double loosest = 0.1;  // as that of the scene
    if (wanted.unit.empty() && wanted.accuracy > loosest)
      faults.add("accuracy.outputs", fmt::format("is '{}', and an accuracy is at most {:g}", text, loosest));
    if (wanted.accuracy > 0 && wanted.unit.empty() && wanted.accuracy < scene.tolerance)
      faults.add("accuracy.outputs",
                 fmt::format("is '{}', tighter than tolerance, {:g}; tolerance is the tightest that is relative", text,
                             scene.tolerance));
    const std::string& output = wanted.name;
    const auto without = std::ranges::find_if(scene.bodies, [&](const BodyScene& b) {
      return b.reduced && b.reduced->n() > 0 && output == b.name + ".tip" && !tip_of(*b.reduced);
    });
    if (without == scene.bodies.end())
      check_name_among(faults, "accuracy.outputs", output, names);
    else
      faults.add("accuracy.outputs",
                 fmt::format("names {}, but {}", toml_reader::in_quotes(output), no_tip(*without->reduced)));
  }
}

void check_integrator(Faults& faults, const Scene& scene) {
  const bool redundant = scene.formulation == "multipliers";
  std::vector<std::string_view> methods = {"auto"};
  if (redundant) methods.emplace_back("ida");
  for (const IntegratorMethod& m : integrator_methods())
    if (!redundant) methods.push_back(m.name);
  check_name_among(faults, "integrator.method", scene.integrator, methods);
  if (redundant && scene.rescale_at_events)
    faults.add("integrator.rescale_at_events",
               "is true, which \"multipliers\" cannot follow; formulation = \"relative\" can");
  const bool has_laws = std::ranges::any_of(scene.joints, [](const JointScene& j) { return j.law.given(); });
  if (has_laws && scene.integrator == "exponential")
    faults.add("integrator.method",
               "is \"exponential\", which simulates no laws of joints; \"auto\", \"adams\", "
               "\"bdf\", \"dirk\" and \"erk\" do");
}

void check_hub(Faults& faults, const Scene& scene) {
  if (!scene.hub.fixed) return;
  if (scene.bodies.empty()) faults.add("hub.fixed", "is true and there is no body: nothing moves");
  const auto at_rest = [&](const char* path, const Vector3d& v) {
    if (v.allFinite() && !v.isZero(0)) faults.add(path, "is not zero but hub.fixed is true; drop one of them");
  };
  at_rest("initial.rate", scene.start_rate);
  at_rest("initial.velocity", scene.start_velocity);
}

void check_directions(Faults& faults, const std::string& path, const Hinge& hinge) {
  const double cosine = hinge.stowed.dot(hinge.outward);
  if (std::abs(cosine) > round_off && faults.clean(join(path, "stowed"))) {
    faults.add(join(path, "outward"),
               fmt::format("is not normal to stowed: the angle between them is {:.6g} rad; it must be pi/2",
                           std::acos(cosine)));
  }
}

void check_hinge(Faults& faults, const std::string& path, const HingeScene& hinge) {
  check_directions(faults, path, hinge.hinge);
  Joint with_law;
  with_law.mechanism = hinge.hinge.mechanism, with_law.law = hinge.law;
  check_law(faults, path, with_law, hinge.start_angle);
}

void check_body_names(Faults& faults, const Scene& scene) {
  std::set<std::string> taken = {"hub", "lvlh", "energy"};  // first words of other columns
  if (scene.is_tree) taken = {"energy", "lvlh", std::string(scene_keys::ground)};
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    const std::string& name = scene.bodies[i].name;
    if (!taken.insert(name).second) {
      faults.add(fmt::format("bodies[{}].name", i),
                 fmt::format("{} is taken; choose another", toml_reader::in_quotes(name)));
    }
  }
}

// Hinges name bodies that exist, each once.
void check_hinge_bodies(Faults& faults, const Scene& scene) {
  std::vector<std::string_view> names;
  for (const BodyScene& body : scene.bodies) names.push_back(body.name);
  std::set<std::string> hinged;
  for (size_t i = 0; i < scene.hinges.size(); ++i) {
    const std::string path = fmt::format("hinges[{}].body", i);
    const std::string& body = scene.hinges[i].body;
    if (names.empty()) {
      faults.add(path,
                 fmt::format("is {}, but the scene has no bodies; give [[bodies]]", toml_reader::in_quotes(body)));
    } else {
      check_name_among(faults, path, body, names);
    }
    if (!hinged.insert(body).second) {
      faults.add(path, fmt::format("{} has a hinge already; each body takes one", toml_reader::in_quotes(body)));
    }
  }
}

// Each body hangs on a hinge. Silent after a fault in what a hinge says of its body, which would be
// repeated here.
void check_connections(Faults& faults, const Scene& scene) {
  if (!body_names_known(faults, scene)) return;
  check_hinge_bodies(faults, scene);
  if (scene.hinges.empty() && !faults.clean("hinges")) return;
  std::set<std::string> hinged;
  for (size_t i = 0; i < scene.hinges.size(); ++i) {
    if (!faults.clean(fmt::format("hinges[{}].body", i))) return;
    hinged.insert(scene.hinges[i].body);
  }
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    const BodyScene& body = scene.bodies[i];
    const std::string path = fmt::format("bodies[{}]", i);
    if (!hinged.contains(body.name)) {
      faults.add(path, fmt::format(R"("{0}" has no hinge; give [[hinges]] with body = "{0}")", body.name));
    }
  }
}

}  // namespace

void check_shorthand(const Scene& scene, Faults& faults) {
  check_keys(faults, "", scene, shorthand_keys);
  check_hub(faults, scene);
  for (size_t i = 0; i < scene.bodies.size(); ++i)
    if (scene.bodies[i].name == "hub")
      faults.add(fmt::format("bodies[{}].name", i), "\"hub\" is the body of [hub]; choose another");
  for (size_t i = 0; i < scene.hinges.size(); ++i) check_hinge(faults, fmt::format("hinges[{}]", i), scene.hinges[i]);
  if (body_names_known(faults, scene)) check_hinge_bodies(faults, scene);
}

void check_scene(const Scene& scene, Faults& faults) {
  check_keys(faults, "", scene, scene_keys_of_file);
  check_times(faults, scene);
  check_integrator(faults, scene);
  if (!scene.is_tree) check_hub(faults, scene);
  const bool in_field = scene.orbit && scene.orbit->gravity != "none";
  if (in_field && scene.hub.fixed)
    faults.add("orbit.gravity", "acts on bodies in orbit, but hub.fixed is true; drop one of them");
  if (in_field && !scene.gravity.isZero(0))
    faults.add("gravity", "is uniform, and orbit.gravity is that of the Earth; drop one of them");
  for (const JointScene& j : scene.joints)
    if (in_field && j.a.body.empty() && j.kind != JointKind::free)
      faults.add("orbit.gravity",
                 fmt::format("acts on bodies in orbit, but joint {} holds one in the frame of the orbit", j.name));
  for (size_t i = 0; i < scene.bodies.size(); ++i) check_body(scene.bodies[i], fmt::format("bodies[{}]", i), faults);
  for (size_t i = 0; i < scene.hinges.size(); ++i) check_hinge(faults, fmt::format("hinges[{}]", i), scene.hinges[i]);
  check_body_names(faults, scene);
  for (size_t i = 0; i < scene.bodies.size(); ++i)
    if (const BasisOptions& basis = scene.bodies[i].basis; basis.name == "hinge" && basis.hinge_stiffness.empty())
      faults.add(fmt::format("bodies[{}].hinge_stiffness", i),
                 "is missing: no hinge carries the body whose stiffness could be taken; give it [N m/rad]");
  check_accuracy(faults, scene);
  scene.is_tree ? check_tree(scene, faults) : check_connections(faults, scene);
}

namespace {

/// What a body from a file is made of, away from its markers, nobody knows.
void warn_of_points(const Scene& scene, std::vector<std::string>& warnings) {
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
void warn_of_idle_keys(const Scene& scene, std::vector<std::string>& warnings) {
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
  for (const JointScene& j : scene.joints) {
    const bool has_mechanism = joint_type(j.kind).scalars == 1;
    if (has_mechanism && j.mechanism.threshold != 0 && !(j.mechanism.stop_stiffness > 0))
      idle("joint " + j.name, "threshold does", "without stop_stiffness there is no stop");
    if (has_mechanism && j.mechanism.rest != 0 && !(j.mechanism.stiffness > 0))
      idle("joint " + j.name, "rest does", "without stiffness there is no spring");
    if (j.kind == JointKind::free && j.loads) idle("joint " + j.name, "loads does", "a free joint bears none");
  }
  for (const SpringScene& s : scene.springs)
    if (s.stiffness == 0 && s.damping == 0) idle("spring " + s.name, "it does", "stiffness and damping are 0");
  for (const LoadScene& l : scene.loads)
    if (std::ranges::none_of(l.force, &CourseScene::given) && std::ranges::none_of(l.torque, &CourseScene::given))
      idle("load " + l.name, "it does", "force and torque are missing");
}

/// A cubic through points that a ramp joins swings far beyond them.
void warn_of_overshoot(const std::string& of, const CourseScene& course, std::vector<std::string>& warnings) {
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

}  // namespace

void warn_of_oddities(const Scene& scene, std::vector<std::string>& warnings) {
  warn_of_points(scene, warnings);
  warn_of_idle_keys(scene, warnings);
  for (const JointScene& j : scene.joints) {
    warn_of_overshoot("drive of joint " + j.name, j.drive, warnings);
    for (const CourseScene& c : j.motion) warn_of_overshoot("motion of joint " + j.name, c, warnings);
  }
  for (const LoadScene& l : scene.loads)
    for (const auto& three : {l.force, l.torque})
      for (const CourseScene& c : three) warn_of_overshoot("load " + l.name, c, warnings);
  for (const WheelScene& w : scene.wheels) warn_of_overshoot("torque of wheel " + w.name, w.torque, warnings);
  constexpr double thick = 1e5;  // [m] of the atmosphere, in which no orbit lasts
  if (scene.orbit && scene.orbit->altitude < thick)
    warnings.push_back(
        fmt::format("orbit.altitude: {:g} m is inside the atmosphere; it is in m", scene.orbit->altitude));
  const auto look = [&](const std::string& of, const HingeMechanism& m, const JointLaw& law, double start,
                        std::string_view unit) {
    constexpr double turns = 4 * std::numbers::pi;  // of a hinge, whose springs and stops count them
    for (const auto& [what, value] : {std::pair("starts", start), std::pair("has the rest of its spring", m.rest)})
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
            fmt::format("{}: the spring is at rest at {:g} {}, beyond the stop at {:g} {}: it presses on it", of,
                        m.rest, unit, at, unit));
      if (side * (start - at) > 0)
        warnings.push_back(
            fmt::format("{}: starts at {:g} {}, beyond the stop at {:g} {}: the stop is pressed in by {:g} {}", of,
                        start, unit, at, unit, side * (start - at), unit));
    }
  };
  for (const HingeScene& h : scene.hinges) look("hinge " + h.body, h.hinge.mechanism, {}, h.start_angle, "rad");
  for (const JointScene& j : scene.joints)
    if (joint_type(j.kind).scalars == 1)
      look("joint " + j.name, j.mechanism, j.law, j.start.empty() ? j.mechanism.rest : j.start[0],
           j.kind == JointKind::slider ? "m" : "rad");
  for (const BodyScene& b : scene.bodies) {
    if (b.is_boom() && b.structure != "solid" && b.solid.slit > 0)
      warnings.push_back(
          fmt::format("body {}: its slit is one of structure = \"solid\"; a {} has none", b.name, b.structure));
    for (const BeamSegment& segment : b.geometry.segments)
      if (const std::string odd = suspicion(segment.material); b.is_boom() && !odd.empty())
        warnings.push_back(fmt::format("body {}: {}", b.name, odd));
    const double ratio = b.damping.name == "loss-factor" ? b.damping.value / 2 : b.damping.value;
    if (ratio > 1)  // of critical damping
      warnings.push_back(
          fmt::format("body {}: its damping ratio is {:g}, with which nothing vibrates; 5 % is 0.05", b.name, ratio));
  }
  for (const BodyScene& b : scene.bodies)
    if (b.reduced)
      for (const BodyCheck& c : b.reduced->certificate)
        if (!c.passed)
          warnings.push_back(
              fmt::format("body {}: its file {} fails its own check \"{}\": {:.6g}, not {:.6g}; make it anew", b.name,
                          b.reduced_file.string(), c.name, c.value, c.reference));
}

void ask_for_loads(Scene& scene) {
  for (HingeScene& h : scene.hinges) h.loads = true;
  for (JointScene& j : scene.joints) j.loads = j.kind != JointKind::free;
}

void validate(const Scene& scene) {
  Faults faults;
  check_scene(scene, faults);
  faults.throw_if_any();
}

}  // namespace flexboom
