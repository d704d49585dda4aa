#include "apps/base/toml_reader.hpp"
#include "apps/scene/scene.hpp"
#include "apps/scene/scene_keys.hpp"

#include "fem/base/check.hpp"
#include "scene_testing.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <string>
#include <variant>

namespace flexboom {
namespace {

bool same(const SectionShape& a, const SectionShape& b) {
  if (a.index() != b.index()) return false;
  const Section x = section_of(a, 0.3, {"cowper", 0}), y = section_of(b, 0.3, {"cowper", 0});
  return x.A == y.A && x.Iy == y.Iy && x.Iz == y.Iz && x.J == y.J && x.kappa_y == y.kappa_y && x.kappa_z == y.kappa_z;
}

void expect_same(const BeamGeometry& a, const BeamGeometry& b) {
  EXPECT_EQ(a.theory, b.theory);
  EXPECT_EQ(a.shear.name, b.shear.name);
  EXPECT_EQ(a.shear.value, b.shear.value);
  EXPECT_EQ(a.rotary_inertia, b.rotary_inertia);
  EXPECT_EQ(a.order, b.order);
  ASSERT_EQ(a.segments.size(), b.segments.size());
  for (size_t i = 0; i < a.segments.size(); ++i) {
    const BeamSegment &x = a.segments[i], &y = b.segments[i];
    EXPECT_TRUE(same(x.start, y.start) && same(x.end, y.end)) << "segment " << i;
    EXPECT_EQ(x.length, y.length);
    EXPECT_EQ(x.elements, y.elements);
    EXPECT_EQ(x.material.E, y.material.E);
    EXPECT_EQ(x.material.nu, y.material.nu);
    EXPECT_EQ(x.material.rho, y.material.rho);
  }
  ASSERT_EQ(a.attachments.size(), b.attachments.size());
  for (size_t i = 0; i < a.attachments.size(); ++i) {
    const RigidAttachment &x = a.attachments[i], &y = b.attachments[i];
    EXPECT_EQ(x.name, y.name);
    EXPECT_EQ(x.position, y.position);
    EXPECT_EQ(x.mass, y.mass);
    EXPECT_EQ(x.inertia, y.inertia);
    EXPECT_EQ(x.offset, y.offset);
  }
}

void expect_same(const BodyScene& a, const BodyScene& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.structure, b.structure);
  EXPECT_EQ(a.clamp, b.clamp);
  EXPECT_EQ(a.modes, b.modes);
  EXPECT_EQ(a.modes_auto, b.modes_auto);
  EXPECT_EQ(a.directions, b.directions);
  EXPECT_EQ(a.damping.name, b.damping.name);
  EXPECT_EQ(a.damping.value, b.damping.value);
  EXPECT_EQ(a.damping.alpha, b.damping.alpha);
  EXPECT_EQ(a.damping.beta, b.damping.beta);
  EXPECT_EQ(a.backend, b.backend);
  EXPECT_EQ(a.solid.element, b.solid.element);
  EXPECT_EQ(a.solid.accuracy, b.solid.accuracy);
  EXPECT_EQ(a.solid.slit, b.solid.slit);
  EXPECT_EQ(a.solid.grading.first_layer, b.solid.grading.first_layer);
  expect_same(a.geometry, b.geometry);
}

void expect_same(const HingeScene& a, const HingeScene& b) {
  EXPECT_EQ(a.body, b.body);
  EXPECT_EQ(a.hinge.name, b.hinge.name);
  EXPECT_EQ(a.hinge.point, b.hinge.point);
  EXPECT_EQ(a.hinge.stowed, b.hinge.stowed);
  EXPECT_EQ(a.hinge.outward, b.hinge.outward);
  const HingeMechanism &x = a.hinge.mechanism, &y = b.hinge.mechanism;
  EXPECT_EQ(x.stiffness, y.stiffness);
  EXPECT_EQ(x.rest, y.rest);
  EXPECT_EQ(x.damping, y.damping);
  EXPECT_EQ(x.stop_stiffness, y.stop_stiffness);
  EXPECT_EQ(x.threshold, y.threshold);
  EXPECT_EQ(a.start_angle, b.start_angle);
  EXPECT_EQ(a.start_rate, b.start_rate);
}

void expect_same_settings(const Scene& a, const Scene& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.duration, b.duration);
  EXPECT_EQ(a.output_step, b.output_step);
  EXPECT_EQ(a.vtu_step, b.vtu_step);
  EXPECT_EQ(a.tolerance, b.tolerance);
  EXPECT_EQ(a.outputs, b.outputs);
  EXPECT_EQ(a.error_budget, b.error_budget);
  EXPECT_EQ(a.integrator, b.integrator);
  EXPECT_EQ(a.integrator_tolerance, b.integrator_tolerance);
  EXPECT_EQ(a.formulation, b.formulation);
  EXPECT_EQ(a.settle, b.settle);
  EXPECT_EQ(a.rescale_at_events, b.rescale_at_events);
  EXPECT_EQ(a.hub.mass, b.hub.mass);
  EXPECT_EQ(a.hub.inertia, b.hub.inertia);
  EXPECT_EQ(a.hub.fixed, b.hub.fixed);
  EXPECT_EQ(a.hub.size, b.hub.size);
  EXPECT_EQ(a.start_rate, b.start_rate);
  EXPECT_EQ(a.start_velocity, b.start_velocity);
  ASSERT_EQ(a.orbit.has_value(), b.orbit.has_value());
  if (!a.orbit) return;
  EXPECT_EQ(a.orbit->altitude, b.orbit->altitude);
  EXPECT_EQ(a.orbit->inclination, b.orbit->inclination);
  EXPECT_EQ(a.orbit->gravity, b.orbit->gravity);
  EXPECT_EQ(a.orbit->J2, b.orbit->J2);
}

// Most warnings are about what was repaired; a scene that is written out has been repaired. Others say what is odd.
void expect_round_trip(const Scene& scene) {
  const std::string text = to_toml(scene);
  const Scene again = parse_scene(text, "again.toml");
  expect_same_settings(scene, again);
  ASSERT_EQ(scene.bodies.size(), again.bodies.size());
  for (size_t i = 0; i < scene.bodies.size(); ++i) expect_same(scene.bodies[i], again.bodies[i]);
  ASSERT_EQ(scene.hinges.size(), again.hinges.size());
  for (size_t i = 0; i < scene.hinges.size(); ++i) expect_same(scene.hinges[i], again.hinges[i]);
  for (const std::string& w : again.warnings)
    EXPECT_NE(std::ranges::find(scene.warnings, w), scene.warnings.end()) << w;
  EXPECT_EQ(text, to_toml(again));
}

TEST(Scene, EveryKeyIsRead) {
  const Scene scene = parse_scene(full_scene, "full.toml");
  const BodyScene& body = scene.bodies.at(0);
  EXPECT_EQ(scene.integrator, "adams");
  EXPECT_EQ(scene.integrator_tolerance, 1e-4);
  EXPECT_EQ(scene.settle, 1e-7);
  EXPECT_FALSE(scene.error_budget);
  EXPECT_TRUE(body.modes_auto);
  EXPECT_EQ(body.geometry.shear.name, "value");
  EXPECT_EQ(body.geometry.shear.value, 0.85);
  EXPECT_EQ(body.geometry.theory, BeamTheory::timoshenko);
  const auto& end = std::get<GeneralSection>(body.geometry.segments.at(1).end);
  EXPECT_EQ(end.A, 2e-5);
  EXPECT_EQ(end.Iz, 2e-10);  // as the start
  EXPECT_EQ(end.kappa_z, 0.7);
  EXPECT_EQ(body.geometry.attachments.at(0).position, body.geometry.length());
  EXPECT_EQ(scene.hinges.at(0).hinge.mechanism.stiffness, 0.3);
}

TEST(Scene, WrittenSceneReadsBackTheSame) {
  expect_round_trip(load_scene("sport"));
  expect_round_trip(parse_scene(full_scene, "full.toml"));
}

/// Paths of the keys of a file without the numbers of arrays; values by their whole paths.
void flatten(const toml_reader::Value& value, const std::string& path, const std::string& of_any,
             std::set<std::string>& keys, std::map<std::string, std::string>& values) {
  using Kind = toml_reader::Value::Kind;
  if (value.kind == Kind::table)
    for (const auto& [name, below] : value.entries) {
      keys.insert(of_any.empty() ? name : of_any + "." + name);
      flatten(below, path.empty() ? name : path + "." + name, of_any.empty() ? name : of_any + "." + name, keys,
              values);
    }
  for (size_t i = 0; i < value.items.size(); ++i)
    flatten(value.items[i], path + "[" + std::to_string(i) + "]", of_any + "[]", keys, values);
  if (value.kind == Kind::number || value.kind == Kind::integer) values[path] = fmt::format("{}", value.number);
  if (value.kind == Kind::text) values[path] = value.text;
  if (value.kind == Kind::boolean) values[path] = value.boolean ? "true" : "false";
}

// Rounded by hand, or "tip" for a distance.
bool is_written_otherwise(const std::string& path) {
  return path == "bodies[0].attachments[0].position" || path.find(".a.x[") != std::string::npos;
}

std::string with_basis(const std::string& basis, const std::string& keys) {
  return with(full_scene, "modes = \"auto\"", "modes = 3\nbasis = \"" + basis + "\"\n" + keys);
}

// The readers say what they look for, so a new key that is not written turns this red.
TEST(Scene, EveryKeyThatIsReadIsWritten) {
  // Places and functions of time that are written in other ways.
  const std::string others =
      with(with(with(with(full_tree, "a = { body = \"ball\" }", "a = { body = \"arm\", marker = \"tip\" }"),
                     "b = { body = \"ground\", point = [1, 1, 1] }", "b = { body = \"arm\", marker = \"head\" }"),
                "at = { body = \"arm\", marker = \"tip\" }", "at = { body = \"hub\", point = [0, 0, 0.1] }"),
           "torque = { time = [0, 1, 2], value = [0, 0.1, 0], interpolation = \"linear\" }",
           "torque = { angle = 1, peak_rate = 1, peak_acceleration = 1 }");
  const std::string laws(builtin_scene("latching-panel"));
  const std::string tables =
      with(with(with(laws, "friction = ", "lower_stop = { at = -0.5, restitution = 0.5 }\nfriction = "),
                "preload = 0.3 ", "spring = { at = [-1.0, 1.0], load = [1.0, -1.0] } "),
           "damping = 0.05 ", "damper = { rate = [-1.0, 0.0, 1.0], load = [1.0, 0.0, -1.0] } ");
  const std::string pads =
      with(with(laws, "friction = { coulomb = 0.05, breakaway = 0.08 }",
                "lower_stop = { at = -0.5, stiffness = 5.0, damping = 0.1 }\nstiffness = 1.0\nbacklash = 0.01"),
           "restitution = 0.3 }", "stiffness = 5.0, damping = 0.1 }");
  std::set<std::string> known, written;
  for (const std::string& text :
       {std::string(full_scene), with_basis("hinge", "hinge_stiffness = [0.3, 11.3]\nhinge_axis = [0, 0, 2]"),
        with_basis("craig-bampton",
                   "interfaces = [\"root\", \"head:distributing\"]\nreference = \"root\"\northonormal = true\n"
                   "corrections = [\"tip.Fz\"]"),
        with_basis("prestressed",
                   "prestress = { spin = [0, 0.5, 2], acceleration = [1, 0, 0], turns = [\"z\", \"0,0.6,0.8\"] }"),
        std::string(full_tree), others, laws, tables, pads, std::string(builtin_scene("sport-calibration")),
        std::string(builtin_scene("slider-crank"))}) {
    known.merge(keys_known(text, "."));
    std::set<std::string> given;
    std::map<std::string, std::string> before, after;
    flatten(toml_reader::parse(text, "given.toml"), "", "", given, before);
    const std::string out = to_toml(parse_scene(text, "given.toml"));
    flatten(toml_reader::parse(out, "written.toml"), "", "", written, after);
    for (const auto& [path, value] : before)
      if (after.contains(path) && !is_written_otherwise(path)) {
        EXPECT_EQ(after[path], value) << path;
      }
  }
  const std::set<std::string> otherwise = {
      "bodies[].file",   // its content is written; of reduced bodies elsewhere
      "hinges[].P1",     // as stiffness
      "joints[].motion"  // of two freedoms, an array
  };
  // A hinge with a law is written as a joint.
  const std::set<std::string> of_laws = {"backlash",   "damper",  "friction", "latch",
                                         "lower_stop", "preload", "spring",   "upper_stop"};
  const auto is_law = [&](const std::string& key) {
    return key.starts_with("hinges[].") && of_laws.contains(key.substr(std::string("hinges[].").size()));
  };
  for (const std::string& key : known)
    EXPECT_TRUE(written.contains(key) || otherwise.contains(key) || is_law(key)) << key << " is read but not written";
  for (const char* key : {"bodies[].solid.grading.factor", "joints[].closes_loop", "turns[].pause", "loads[].axes"})
    EXPECT_TRUE(known.contains(key)) << key;
}

TEST(Basis, TakesTheStiffnessOfTheHingeThatCarriesTheBody) {
  const std::string text = with(swing_on_joints, "modes = 1", "modes = 1\nbasis = \"hinge\"");
  const std::string turned =
      "b = { body = \"boom\", marker = \"root\", z = [0, 1, 0] }\nstop_stiffness = 5\nthreshold = 0.5";
  const Scene scene = parse_scene(with(text, "b = { body = \"boom\", marker = \"root\" }", turned), "joints.toml");
  EXPECT_EQ(scene.bodies[0].basis.hinge_stiffness, (std::vector<double>{1, 6}));
  EXPECT_EQ(scene.bodies[0].basis.hinge_axis, Eigen::Vector3d(0, 1, 0));
  expect_round_trip(scene);
  const Scene hub = parse_scene(with(swing_on_hinge, "modes = 1", "modes = 1\nbasis = \"hinge\""), "hub.toml");
  EXPECT_EQ(hub.bodies[0].basis.hinge_stiffness, std::vector<double>{1});
  EXPECT_FALSE(hub.is_tree);
}

TEST(Basis, WhoseRootMovesIsCarriedAtItsRoot) {
  const Scene hub = parse_scene(with(swing_on_hinge, "modes = 1", "modes = 1\nbasis = \"mean-axis\""), "hub.toml");
  ASSERT_TRUE(hub.is_tree);
  EXPECT_EQ(hub.joints.back().b.marker, "root");
  expect_round_trip(hub);
}

// As those of decks, which write them in capitals.
TEST(Basis, NodeSetsCompareWithoutCase) {
  const auto read = [](const std::string& keys) {
    return to_toml(parse_scene(with(swing_on_joints, "modes = 1", "modes = 1\n" + keys), "sets.toml"));
  };
  const std::string basis = "basis = \"craig-bampton\"\n";
  EXPECT_EQ(read(basis + "interfaces = [\"ROOT\", \"Tip:distributing\"]\nreference = \"ROOT\"\n"),
            read(basis + "interfaces = [\"root\", \"tip:distributing\"]\nreference = \"root\"\n"));
  EXPECT_EQ(read("corrections = [\"TIP.Fy\"]\n"), read("corrections = [\"tip.Fy\"]\n"));
  EXPECT_EQ(read("clamp = \"TIP\"\n"), read("clamp = \"tip\"\n"));
}

TEST(Basis, ThatCannotServeIsAnErrorInWords) {
  const auto fault = [](const std::string& text) {
    try {
      parse_scene(text, "scene.toml");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const auto of = [&](const std::string& keys) {
    return fault(with(swing_on_hinge, "modes = 1", "modes = 1\n" + keys));
  };
  EXPECT_NE(of("basis = \"clampd\"").find("bodies[0].basis: is \"clampd\"; did you mean \"clamped\"?"),
            std::string::npos);
  EXPECT_NE(of("interfaces = [\"tip\"]").find("interfaces: belongs to basis = \"craig-bampton\""), std::string::npos);
  EXPECT_NE(of("hinge_stiffness = 3").find("belongs to basis = \"hinge\""), std::string::npos);
  EXPECT_NE(of("basis = \"mean-axis\"\nstructure = \"eq14\"").find("needs finite elements"), std::string::npos);
  EXPECT_NE(of("basis = \"craig-bampton\"\nreference = \"\"").find("the motion of the whole body"), std::string::npos);
  EXPECT_NE(of("basis = \"craig-bampton\"\nreference = \"tp\"").find("did you mean \"tip\""), std::string::npos);
  EXPECT_NE(of("basis = \"mean-axis\"\nclamp = \"tip\"").find("is not held by a clamp"), std::string::npos);
  EXPECT_NE(of("basis = \"hinge\"\nhinge_stiffness = -1").find("zero or positive"), std::string::npos);
  EXPECT_NE(of("prestress = { spin = [0, 0, 1] }").find("belongs to basis = \"prestressed\""), std::string::npos);
  EXPECT_NE(of("basis = \"prestressed\"\nprestress = { turns = [\"w\"] }").find("has \"w\"; an axis"),
            std::string::npos);
  EXPECT_NE(of("basis = \"prestressed\"\nclamp = \"tip\"").find("held at its root"), std::string::npos);
  EXPECT_NE(of("corrections = [\"tip\"]").find("must be a node set and a direction"), std::string::npos);
  EXPECT_NE(of("corrections = [\"tip.ux\"]").find("a load is Fx"), std::string::npos);
  const std::string tree = with(swing_on_joints, "modes = 1", "modes = 1\nbasis = \"mean-axis\"");
  EXPECT_NE(
      fault(with(tree, "marker = \"root\" }", "point = [0.1, 0, 0] }")).find("which no material of this body follows"),
      std::string::npos);
  EXPECT_NE(
      fault(with(with(tree, "mean-axis", "hinge"), "kind = \"hinge\"", "kind = \"slider\"")).find("no hinge carries"),
      std::string::npos);
}

TEST(Scene, RandomNumbersSurviveTheRoundTripBitForBit) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0.1, 1);
  for (int i = 0; i < 20; ++i) {
    Scene scene = load_scene("sport");
    scene.duration = std::pow(10, 4 * unit(random));
    for (HingeScene& hinge : scene.hinges) {
      hinge.hinge.stowed = Eigen::Vector3d::NullaryExpr([&] { return unit(random); }).normalized();
      hinge.hinge.outward = hinge.hinge.stowed.unitOrthogonal();
      hinge.hinge.mechanism.stiffness = unit(random) * 1e-7;
      hinge.start_angle = unit(random) * 1.5;
    }
    expect_round_trip(scene);
  }
}

TEST(Scene, HubAloneIsAScene) {
  const Scene scene =
      parse_scene("format = \"flexboom-scene-1\"\nname = \"hub\"\n[hub]\nmass = 1\ninertia = [1, 1, 1]\n", "hub.toml");
  EXPECT_TRUE(scene.bodies.empty());
  EXPECT_EQ(scene.duration, 10);
  expect_round_trip(scene);
}

TEST(Scene, FixedHubNeedsNoMass) {
  const Scene scene = parse_scene(R"(format = "flexboom-scene-1"
name = "hub"
hub = { fixed = true }
[[bodies]]
name = "rod"
segments = [{ shape = "round-bar", diameter = 0.005, length = 0.295, material = { E = 67e9, nu = 0.33, rho = 2840 } }]
[[hinges]]
body = "rod"
point = [0, 0, 0]
stowed = [0, 1, 0]
outward = [1, 0, 0]
P1 = 0.35
)",
                                  "hub.toml");
  EXPECT_TRUE(scene.hub.fixed);
  expect_round_trip(scene);
}

TEST(Scene, BodyFromAFileTakesOverridesButNoGeometry) {
  const std::string entry = R"(format = "flexboom-scene-1"
name = "with_file"
hub = { fixed = true }
[[bodies]]
file = "boom4.toml"
name = "probe"
modes = 3
)";
  const std::string hinge =
      "[[hinges]]\nbody = \"probe\"\npoint = [0, 0, 0]\nstowed = [1, 0, 0]\noutward = [0, 1, 0]\nP1 = 0\n";
  const Scene scene = parse_scene(entry + hinge, "scene.toml", meshes);
  EXPECT_EQ(scene.bodies.at(0).name, "probe");
  EXPECT_EQ(scene.bodies.at(0).modes, 3);
  EXPECT_EQ(scene.bodies.at(0).geometry.order, 8);
  expect_round_trip(scene);
  try {
    parse_scene(entry + "order = 3\n" + hinge, "scene.toml", meshes);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("scene.toml:8:1: bodies[0].order: unknown key"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace flexboom
