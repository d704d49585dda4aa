// Scenes with joints: what is read, written back and refused.

#include "apps/accuracy/run_scene.hpp"
#include "apps/results/results.hpp"
#include "apps/scene/scene.hpp"
#include "tests/apps/run_testing.hpp"
#include "tests/apps/scene_testing.hpp"

#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "reduction/body_file/body_file.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>

namespace flexboom {
namespace {

std::string fault_of(const std::string& text) {
  try {
    parse_scene(text, "scene.toml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(TreeScene, IsReadAndWrittenBack) {
  const Scene scene = parse_scene(full_tree, "scene.toml");
  ASSERT_TRUE(scene.is_tree);
  ASSERT_EQ(scene.joints.size(), 5u);
  EXPECT_EQ(scene.joints[0].name, "lift");
  EXPECT_EQ(scene.joints[0].kind, JointKind::slider);
  EXPECT_EQ(scene.joints[0].mechanism.threshold, 0.2);
  EXPECT_EQ(scene.joints[0].drive.expression, "2*sin(t)");
  EXPECT_NEAR(scene.joints[1].a.x.norm(), 1, 1e-15);  // rounded by hand
  EXPECT_EQ(scene.joints[1].motion[0].manoeuvre->angle, 1.5);
  EXPECT_EQ(scene.joints[2].motion[1].expression, "0.2");
  EXPECT_TRUE(scene.springs[0].b.body.empty());
  EXPECT_EQ(scene.loads[0].force[1].expression, "exp(-t)");
  EXPECT_FALSE(scene.loads[0].force[0].given());
  EXPECT_EQ(scene.wheels[0].torque.table->value[1], 0.1);
  const std::string text = to_toml(scene);
  EXPECT_EQ(to_toml(parse_scene(text, "scene.toml")), text);
}

TEST(TreeScene, Flies) {
  Scene scene = parse_scene(full_tree, "scene.toml");
  scene.duration = 0.5;
  scene.wheels[0].torque = {};
  const RunResult r = run_scene(scene, {});
  EXPECT_LT(r.motion.summary.energy_balance, 1e-3);
  EXPECT_GT(r.outputs.values.rows(), 10);
  EXPECT_TRUE(r.outputs.values.allFinite());
  const auto has = [&](const char* name) {
    return std::find(r.outputs.names.begin(), r.outputs.names.end(), name) != r.outputs.names.end();
  };
  for (const char* name :
       {"lift.length", "lift.rate", "lift.force.x", "shoulder.angle", "wrist.angle2", "string.rotation.x",
        "string.rate.z", "arm.q2", "arm.tip.y", "wheel.spin", "energy.work", "energy.potential"})
    EXPECT_TRUE(has(name)) << name;
  EXPECT_FALSE(has("lift.drive"));  // it is given
}

// The worked example of meshes/README.md.
TEST(TreeScene, WingSatelliteMovesTheSameInBothFormulations) {
  Scene scene = load_scene("wing-satellite");
  scene.duration = 5.2;  // both panels reach their stops
  scene.tolerance = 1e-7;
  scene.error_budget = false;
  const RunResult relative = run_scene(scene, {});
  scene.formulation = "multipliers";
  const RunResult multipliers = run_scene(scene, {});
  const auto &one = relative.motion.events, &two = multipliers.motion.events;
  ASSERT_EQ(one.size(), 4u);  // outer, inner, outer lets go, outer again
  ASSERT_EQ(two.size(), one.size());
  for (size_t i = 0; i < one.size(); ++i) EXPECT_NEAR(one[i].time, two[i].time, 1e-6);
  for (const char* name :
       {"hub.rotation.x", "hub.rotation.z", "inner.angle", "outer.angle", "boom.tip.y", "wheel.spin"}) {
    const Eigen::VectorXd a = column(relative, name), b = column(multipliers, name);
    EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-6 * a.cwiseAbs().maxCoeff()) << name;
  }
  EXPECT_GT(column(relative, "hub.rotation.z").tail(1)[0], 0.05);  // the wing opens the other way
  EXPECT_LT(relative.motion.summary.energy_balance, 1e-8);
}

TEST(TreeScene, TakesBodiesReducedBefore) {
  const Scene plain = load_scene("flexible-appendage");
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "flexboom-tree-scene.h5";
  PreparedBody panel = prepare_body(plain.bodies[1]);
  write_body_file(file, panel.body);
  Scene scene = plain;
  scene.bodies[1] = {};
  scene.bodies[1].name = "panel";
  scene.bodies[1].stiffening = "auto";
  scene.bodies[1].modes = 0;
  scene.bodies[1].reduced = std::make_shared<const ReducedBody>(read_body_file(file));
  scene.bodies[1].structure = "beam";
  scene.bodies[1].reduced_file = file;
  const Scene again = parse_scene(to_toml(scene), "scene.toml");
  EXPECT_EQ(to_toml(again), to_toml(scene));
  const auto end = [](Scene s) {
    s.duration = 1;
    s.error_budget = false;
    const RunResult r = run_scene(s, {});
    return Eigen::VectorXd(r.outputs.values.row(r.outputs.values.rows() - 1));
  };
  EXPECT_EQ(end(again), end(plain));  // every bit of the file comes back
  std::filesystem::remove(file);
}

/// The scene with its one body taken from "boom.h5" beside it.
std::string from_file(std::string text) {
  const size_t body = text.find("[[bodies]]"), end = text.find("[hub]");
  return text.replace(body, end - body, "[[bodies]]\nname = \"boom\"\nfile = \"boom.h5\"\n");
}

// A hinge carries a reduced body as one of [[joints]] does.
TEST(TreeScene, HingesCarryBodiesReducedBefore) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("hinged." + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const std::filesystem::path file = folder / "boom.h5";
  Scene plain = parse_scene(swing_on_hinge, "scene.toml");
  write_body_file(file, prepare_body(plain.bodies[0]).body);
  Scene reduced = parse_scene(from_file(swing_on_hinge), "scene.toml", folder);
  plain.error_budget = reduced.error_budget = false;
  plain.tolerance = reduced.tolerance = 1e-8;
  const RunResult a = run_scene(plain, {}), b = run_scene(reduced, {});
  for (const char* name : {"boom.angle", "boom.tip.y", "boom.q1"}) {
    const double size = column(a, name).cwiseAbs().maxCoeff();
    EXPECT_GT(size, 0) << name;
    EXPECT_LT((column(a, name) - column(b, name)).cwiseAbs().maxCoeff(), 1e-4 * size) << name;  // stiffening
  }

  std::string bytes = file_bytes(file);
  bytes[bytes.size() / 2] ^= 1;
  for (const std::string& damaged : {bytes, bytes.substr(0, bytes.size() / 2), std::string("no body")}) {
    write_file(file, damaged);
    std::string fault;
    try {
      parse_scene(from_file(swing_on_hinge), "scene.toml", folder);
    } catch (const InputError& error) {
      fault = error.what();
    }
    EXPECT_TRUE(fault.starts_with("scene.toml:")) << fault;
    EXPECT_NE(fault.find("boom.h5"), std::string::npos) << fault;
    EXPECT_EQ(fault.find("the line has"), std::string::npos) << fault;
  }
  std::filesystem::remove_all(folder);
}

// "none" beside a file is not the damping of the file.
TEST(TreeScene, DampingBesideAReducedBodyReplacesThatOfItsFile) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("damped." + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  Scene plain = parse_scene(swing_on_hinge, "scene.toml");
  plain.bodies[0].damping = {.name = "modal", .value = 0.05};
  write_body_file(folder / "boom.h5", prepare_body(plain.bodies[0]).body);
  const auto lost = [&](const std::string& damping) {
    const std::string text = from_file(swing_on_hinge);
    const size_t end = text.find("[hub]");
    Scene scene = parse_scene(text.substr(0, end) + damping + text.substr(end), "scene.toml", folder);
    scene = parse_scene(to_toml(scene), "again.toml", folder);
    scene.error_budget = false;
    return summary_json(run_scene(scene, {}), 0)["energy"]["lost"]["structure"].get<double>();
  };
  const double of_file = lost(""), of_more = lost("damping = { rule = \"modal\", value = 0.1 }\n");
  EXPECT_GT(of_file, 0);
  EXPECT_GT(of_more, 1.2 * of_file);
  EXPECT_EQ(lost("damping = { rule = \"none\" }\n"), 0);
  std::filesystem::remove_all(folder);
}

// What a hinge lacks beside joints is a hub, and a body hangs on a hinge or on a joint.
TEST(TreeScene, HingesBesideJointsNeedAHubAndABodyOfTheirOwn) {
  const std::string hinge =
      "[[hinges]]\nbody = \"boom\"\npoint = [0.05, 0, 0]\nstowed = [0, 1, 0]\noutward = [1, 0, 0]\nstiffness = 1\n";
  const std::string without = fault_of(swing_on_joints + hinge);
  EXPECT_NE(without.find("hub: is missing"), std::string::npos) << without;
  EXPECT_EQ(without.find("point"), std::string::npos) << without;
  const std::string other = with(with(swing_on_joints, "name = \"hub\"\nmass", "name = \"bus\"\nmass"),
                                 "b = { body = \"hub\" }", "b = { body = \"bus\" }");
  const std::string hub = "[hub]\nmass = 1\ninertia = [1, 1, 1]\n";
  const std::string twice = fault_of(with(with(other, "name = \"hub\"\nkind", "name = \"bus\"\nkind"),
                                          "a = { body = \"hub\"", "a = { body = \"bus\"") +
                                     hub + hinge);
  EXPECT_NE(twice.find("\"boom\" hangs on joint \"hinge\" already"), std::string::npos) << twice;
  EXPECT_EQ(twice.find("point"), std::string::npos) << twice;
  const std::string two_hubs = fault_of(swing_on_joints + "[hub]\nfixed = true\n" + hinge);
  EXPECT_NE(two_hubs.find("bodies[1].name: \"hub\" is the body of [hub]; choose another"), std::string::npos)
      << two_hubs;
}

TEST(TreeScene, TurnsAreReadCheckedAndWrittenBack) {
  const std::string good = builtin_scene("sport-calibration");
  EXPECT_EQ(fault_of(good), "");
  const std::string written = to_toml(parse_scene(good, "scene.toml"));
  EXPECT_EQ(to_toml(parse_scene(written, "scene.toml")), written);
  EXPECT_EQ(parse_scene(written, "scene.toml").turns.size(), 6u);
  const struct {
    const char *old, *replacement, *words;
  } cases[] = {
      {"profile = \"trapezoid\"", "profile = \"trapezium\"",
       "turns[0].profile: is \"trapezium\"; did you mean \"trapezoid\"?"},
      {"peak_rate = 0.1", "peak_rate = 0.0", "turns[0]: manoeuvre: peak rate"},
      {"pause = 10.0", "pause = -10.0", "turns[0].pause: is -10 s"},
      {"pause = 10.0", "paus = 10.0", "turns[0].paus: unknown key; did you mean \"pause\"?"},
      {"kind = \"free\"", "kind = \"spherical\"", "turns[0].body: \"sport\" can not turn"},
      {"inertia = 2e-5", "inertia = 2e-5\ntorque = 0", "has 2 wheels without a torque of their own"},
      {"inertia = 2e-5", "inertia = 2e-5\nspin = 1", "turns: start from rest, but wheel \""},
      {"[[turns]]\nbody = \"sport\"", "[[turns]]\nbody = \"sprt\"", "turns[0].body: is \"sprt\"; did you mean"},
  };
  for (const auto& c : cases) {
    std::string bad = good;
    const size_t at = bad.find(c.old);
    ASSERT_NE(at, std::string::npos) << c.old;
    bad.replace(at, std::string(c.old).size(), c.replacement);
    EXPECT_NE(fault_of(bad).find(c.words), std::string::npos) << c.replacement << "\n" << fault_of(bad);
  }
}

TEST(TreeScene, AWheelIsFixedToMaterial) {
  const std::string wheel =
      "[[wheels]]\nname = \"wheel\"\nbody = \"boom\"\naxis = [0, 0, 1]\ninertia = 1e-3\ntorque = \"sin(t)\"\n";
  EXPECT_EQ(fault_of(swing_on_joints + wheel), "");
  const std::string moves = with(swing_on_joints, "modes = 1", "modes = 1\nbasis = \"mean-axis\"") + wheel;
  EXPECT_NE(fault_of(moves).find("wheels[0].body: is \"boom\", and a wheel is fixed to the frame"), std::string::npos);
}

TEST(TreeScene, FaultsNameTheirPlaceAndWhatWouldBeRight) {
  const std::string good = full_tree;
  EXPECT_EQ(fault_of(good), "");
  // Zero but for round-off at each of the first looks: no pole, however steep between them.
  EXPECT_EQ(fault_of(with(good, "\"2*sin(t)\"", "\"sin(2*pi*4096*t)\"")), "");
  EXPECT_EQ(fault_of(with(good, "\"2*sin(t)\"", "\"1/((t - 0.5)^2 + 1e-9)\"")), "");
  // Corners of an acceleration are none of its poles.
  EXPECT_EQ(fault_of(with(good, "\"0.1*t^2\", 0.2", "\"0.1*max(t - 0.2, 0)^2\", 0.2")), "");
  EXPECT_EQ(fault_of(with(good, "\"0.1*t^2\", 0.2", "\"0.1*abs(t - 0.2)^3\", 0.2")), "");
  const struct {
    const char *old, *replacement, *words;
  } cases[] = {
      {"\"2*sin(t)\"", "\"1/t\"", "drive: is infinite at t = 0 s; it must have a finite value all through the run"},
      {"\"t*(t<1)\"", "\"sqrt(t - 0.5)\"", "is not a number at t = 0 s; it must have a finite value"},
      {"\"0.1*t^2\", 0.2", "\"0.1*min(t, 0.3)\", 0.2",
       "motion: has a rate that jumps from 0.1 to 0 at t = 0.3 s, which takes an impulse; round the corner"},
      {"\"0.1*t^2\", 0.2", "\"0.1*sqrt(abs(t - 0.2))\", 0.2",
       "motion: has an acceleration without a bound at t = 0.2 s"},
      {"\"0.1*t^2\", 0.2", "\"0.1*abs(t - 0.2)^1.2\", 0.2", "motion: has an acceleration without a bound at t = 0.2 s"},
      {"\"0.1*t^2\", 0.2", "\"0.1*abs(t - 0.2)^1.5\", 0.2", "motion: has an acceleration without a bound at t = 0.2 s"},
      {"\"0.1*t^2\", 0.2", "\"0.1*(t > 0.2)\", 0.2", "motion: jumps by 0.1 at t = 0.2 s; a joint cannot"},
      {"\"2*sin(t)\"", "\"tan(3.7*t)\"", "drive: grows without end near t = 1.273618"},
      {"\"2*sin(t)\"", "\"tan(pi*t)\"", "drive: grows without end near t = 0.5 s"},  // a time that is looked at
      {"\"2*sin(t)\"", "\"1/sin(pi*(t + 0.5))\"", "drive: grows without end near t = 0.5 s"},
      {"\"2*sin(t)\"", "\"1/(t - 0.2501234567)^2\"", "drive: grows without end near t = 0.25012345"},
      {"name = \"lift\"", "name = \"lvlh\"", "joints[0].name: \"lvlh\" is taken; choose another"},
      {"kind = \"slider\"", "kind = \"slide\"", "joints[0].kind: is \"slide\"; did you mean \"slider\"?"},
      {"a = { body = \"hub\", point = [0, 0, 0.2]", "a = { body = \"hup\", point = [0, 0, 0.2]",
       "joints[1].a.body: is \"hup\"; did you mean \"hub\"?"},
      {"a = { body = \"arm\", marker = \"head\" }", "a = { body = \"arm\", marker = \"heat\" }",
       "joints[3].a.marker: is \"heat\"; did you mean \"head\"?"},
      {"drive = \"2*sin(t)\"", "drive = \"2*sinn(t)\"", "joints[0].drive: "},
      {"drive = ", "driv = ", "joints[0].driv: unknown key; did you mean \"drive\"?"},
      {"a = { body = \"hub\", point = [0, 0, 0.2]", "a = { body = \"hook\", point = [0, 0, 0.2]",
       "in a circle of joints"},
      {"b = { body = \"ball\", point = [0, 0, 0.2] }", "b = { body = \"hook\" }", "hangs on joint \"wrist\" already"},
      {"start_attitude = [0.6, 0.8, 0, 0]", "start_attitude = [0.6, 0.9, 0, 0]", "has length"},
      {"start_omega = [0.1, 0.2, 0.3]", "start_position = [0.1, 0.2, 0.3]", "a spherical joint has none"},
      {"motion = [\"0.1*t^2\", 0.2]", "motion = \"0.1*t^2\"", "a universal joint needs 2"},
      {"z = [1, 0, 0] }", "z = [0, 1, 0] }", "joints[0].a.x: is not normal to z"},
      {"value = [0, 0.1, 0]", "value = [0, 0.1]", "wheels[0].torque: "},
      {"time = [0, 1, 2]", "time = [0, 1, 1.5]", "the table reaches from 0 s to 1.5 s"},
      {"loads = true", "closes_loop = true", "formulation = \"multipliers\""},
      {"method = \"bdf\"", "method = \"ida\"",
       "integrator.method: is \"ida\"; it must be \"auto\", \"exponential\", \"bdf\", \"adams\", \"dirk\" or \"erk\"; "
       "\"ida\" takes formulation = \"multipliers\""},
      {"\"lift.length\"", "\"lift.length 1e-3 rad\"",
       "accuracy.outputs: is 'lift.length 1e-3 rad', but lift.length is in m"},
      {"\"lift.length\"", "\"lift.length 1e-12\"", "accuracy.outputs: is 'lift.length 1e-12', tighter than tolerance"},
      {"\"lift.length\"", "\"lift.lenght\"", "accuracy.outputs: is \"lift.lenght\"; did you mean \"lift.length\"?"},
      {"gravity = [0, 0, -9.81]", "gravity = [0, 0, -9.81]\norbit = { gravity = \"differential\" }",
       "gravity: is uniform, and orbit.gravity is that of the Earth"},
      {"gravity = [0, 0, -9.81]", "orbit = { eccentricity = 1 }", "orbit.eccentricity: is 1; it must lie in [0, 1)"},
      {"mass = 8.5", "mass = -8.5", "bodies[0].mass: is -8.5 kg"},
      {"stiffening = \"on\"", "stiffening = \"on\"\nstructure = \"eq14\"", "has none; use \"beam\""},
      {"\"2*sin(t)\"", "\"0 < t < 1\"", "is 0 or 1 and is compared again; write (a < t) * (t < b)"},
      {"\"0.1*t^2\", 0.2", "\"0.1*(t > 0)\", 0.2", "motion: jumps by 0.1 at t = 0 s; a joint cannot"},
      {"start_attitude = [0.6, 0.8, 0, 0]", "start_attitude = [0.6, 0.8, 0, 0]\nrest = 0.1",
       "rest: a spherical joint has none"},
      {"\"lift.length\"", "\"lift.length 5\"", "accuracy.outputs: is 'lift.length 5', and an accuracy is at most 0.1"},
      {"at = { body = \"arm\", marker = \"tip\" }", "at = { body = \"arm\", point = [0.1, 0, 0] }",
       "loads[0].at.point: is 0.1 m along the boom, and a point moves with the root alone; give a marker, \"root\""},
      {"b = { body = \"ground\", point = [1, 1, 1] }", "b = { body = \"ball\", point = [1, 1, 1] }",
       "springs[0].b: is fixed to a"},
      {"\"lift.length\"", "\"lift.length\", \"lift.length 1e-3\"", "accuracy.outputs: names \"lift.length\" twice"},
      {"stiffness = 3\n", "stiffness = -3\n", "springs[0].stiffness: is -3 N/m"},
      {"b = { body = \"hub\" }", "b = { }", "joints[0].b: has no body"},
  };
  for (const auto& c : cases) {
    const std::string fault = fault_of(with(good, c.old, c.replacement));
    EXPECT_NE(fault.find(c.words), std::string::npos) << c.replacement << "\n" << fault;
    EXPECT_EQ(fault.find("scene.toml:"), 0u) << fault;
  }
}

TEST(TreeScene, ABodyHasInertiaWhereItsJointTurnsIt) {
  const std::string scene = R"(format = "flexboom-scene-1"
name = "pendulum"
duration = 1.0
[[bodies]]
name = "bob"
mass = 2.0
inertia = [0, 0, 0]
[[joints]]
kind = "hinge"
b = { body = "bob", point = [0, 0.5, 0] }
)";
  EXPECT_NO_THROW(validate(parse_scene(scene, "scene.toml")));
  for (const auto& [kind, point] : {std::pair{"hinge", "[0, 0, 0]"},
                                    {"hinge", "[0, 0, 1]"},
                                    {"spherical", "[0, 0.5, 0]"},
                                    {"universal", "[0, 0.5, 0]"}}) {
    const std::string fault = fault_of(with(with(scene, "hinge", kind), "[0, 0.5, 0]", point));
    EXPECT_EQ(fault.find("scene.toml:"), 0u) << fault;
    EXPECT_NE(fault.find("joints[0]: turns body \"bob\" about an axis through its mass"), std::string::npos) << kind;
  }
}

TEST(TreeScene, EveryFaultIsReportedInOneGo) {
  const std::string fault = fault_of(
      with(with(with(full_tree, "damping = 2\n", "damping = -2\n"), "sin(t)", "sin(x)"), "spin = 100", "spinn = 100"));
  EXPECT_EQ(std::count(fault.begin(), fault.end(), '\n'), 2) << fault;
}

// Any change of a byte or a line gives a scene or an InputError that names the file.
TEST(TreeScene, MutationsAreAcceptedOrInputErrors) {
  std::mt19937 random(5);
  const std::string good = full_tree;
  for (int i = 0; i < 400; ++i) {
    std::string text = good;
    const size_t at = random() % text.size();
    if (i % 3 == 0) text[at] = static_cast<char>(random() % 128);
    if (i % 3 == 1) text.erase(at, 1 + random() % 20);
    if (i % 3 == 2) text.insert(at, text.substr(random() % text.size(), random() % 30));
    try {
      parse_scene(text, "scene.toml");
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find("scene.toml:"), 0u) << error.what();
    }
  }
}

TEST(TreeScene, BuiltinScenesAreWithoutFaults) {
  for (const std::string& name : builtin_scene_names()) {
    const Scene scene = load_scene(name);
    const std::string text = to_toml(scene);
    EXPECT_EQ(to_toml(parse_scene(text, "scene.toml")), text) << name;
    EXPECT_EQ(scene.name, name);
  }
}

}  // namespace
}  // namespace flexboom
