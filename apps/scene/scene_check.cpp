#include "apps/base/deflection.hpp"
#include "apps/scene/keys.hpp"
#include "apps/scene/scene.hpp"
#include "apps/scene/scene_checks.hpp"
#include "apps/scene/scene_keys.hpp"
#include "apps/scene/scene_law.hpp"
#include "apps/scene/wanted_accuracy.hpp"
#include "dynamics/methods/integrator.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>
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
      wanted = wanted_output(text, known);
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
  std::vector<std::string_view> of_relative = {"auto"}, of_redundant = {"auto", "ida"};
  for (const IntegratorMethod& m : integrator_methods()) of_relative.push_back(m.name);
  const auto& [methods, others] = redundant ? std::tie(of_redundant, of_relative) : std::tie(of_relative, of_redundant);
  const auto has = [&](const auto& names) { return std::ranges::find(names, scene.integrator) != names.end(); };
  if (!has(methods))
    faults.add("integrator.method",
               toml_reader::not_among(scene.integrator, methods) +
                   (has(others) ? fmt::format(R"(; "{}" takes formulation = "{}")", scene.integrator,
                                              redundant ? "relative" : "multipliers")
                                : ""));
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
