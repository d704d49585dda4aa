// What the error budget says, and what it must not say; warnings of what a theory cannot hold.

#include "apps/commands/commands.hpp"
#include "apps/results/results.hpp"
#include "apps/simulate/error_budget.hpp"
#include "reduction/body_file/body_file.hpp"
#include "tests/apps/run_testing.hpp"
#include "tests/apps/scene_testing.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

namespace flexboom {
namespace {

/// A scene with joints whose boom was reduced before; `change` makes the file's body another one.
Scene with_reduced(const std::string& text, const std::function<void(ReducedBody&)>& change = {}) {
  Scene scene = parse_scene(text, "reduced.toml");
  BodyScene& boom = scene.bodies.at(0);
  ReducedBody body = prepare_body(boom).body;
  if (change) change(body);
  const std::filesystem::path file =
      std::filesystem::path(testing::TempDir()) / ("boom." + std::to_string(::getpid()) + ".h5");
  write_body_file(file, body);
  BodyScene reduced;
  reduced.name = boom.name;
  reduced.structure = body.structure;
  reduced.modes = 0;
  reduced.stiffening = "auto";
  reduced.reduced = std::make_shared<const ReducedBody>(read_body_file(file));
  reduced.reduced_file = file;
  std::filesystem::remove(file);
  boom = reduced;
  return scene;
}

class Budget : public testing::TestWithParam<std::string> {
 protected:
  RunResult run(Scene scene) const {
    scene.formulation = GetParam();
    return run_scene(scene, {});
  }
};
INSTANTIATE_TEST_SUITE_P(Formulations, Budget, testing::Values("relative", "multipliers"),
                         [](const auto& row) { return row.param; });

TEST_P(Budget, OfABodyFromAFileIsNotKnown) {
  Scene scene = with_reduced(swing_on_joints);
  scene.tolerance = 1e-3;
  scene.duration = 0.1;
  const RunResult r = run(scene);
  EXPECT_TRUE(r.budget.measured);
  EXPECT_TRUE(std::isnan(r.budget.truncation));
  EXPECT_TRUE(std::isnan(r.budget.discretisation));
  EXPECT_FALSE(std::isnan(r.budget.time));
  const nlohmann::ordered_json summary = summary_json(r, 0);
  const nlohmann::ordered_json written = nlohmann::ordered_json::parse(summary.dump());
  for (const char* part : {"truncation", "discretisation", "total"})
    EXPECT_TRUE(written["error_budget"][part].is_null()) << part;
  EXPECT_EQ(written["accuracy_met"], false);
  EXPECT_TRUE(any_has(r.warnings, "truncation not measured: body boom was reduced before"));
}

// A boom of which no mode is kept bends all the same.
TEST_P(Budget, OfABoomWithoutModesCountsThem) {
  for (const std::string& text : {swing_on_hinge, swing_on_joints}) {
    Scene scene = parse_scene(with(text, "modes = 1", "modes = 0"), "stiff.toml");
    scene.tolerance = 1e-6;
    scene.duration = 0.1;
    EXPECT_GT(run(scene).budget.truncation, 1e-6);
  }
}

TEST_P(Budget, OfRigidBodiesIsThatOfTime) {
  Scene scene = load_scene("tumbling");
  scene.duration = 1;
  scene.error_budget = true;
  const RunResult r = run(scene);
  EXPECT_EQ(r.budget.truncation + r.budget.discretisation + r.budget.linearisation, 0);
  EXPECT_EQ(r.budget.total(), r.budget.time);
}

TEST_P(Budget, NotAskedForIsNotMet) {
  Scene scene = load_scene("tumbling");
  scene.duration = 0.1;
  scene.error_budget = false;
  const nlohmann::ordered_json summary = nlohmann::ordered_json::parse(summary_json(run(scene), 0).dump());
  EXPECT_EQ(summary["accuracy_met"], false);
  for (const auto& [part, value] : summary["error_budget"].items()) EXPECT_TRUE(value.is_null()) << part;
}

/// A bar that is fixed to the ground or hangs on a pin there, with its weight along (x, y, 0).
Scene held_bar(const std::string& joint, double x, double y, double diameter, double length, int modes) {
  return parse_scene(fmt::format(R"(format = "flexboom-scene-1"
name = "bar"
duration = 0.5
output_step = 0.005
gravity = [{}, {}, 0]
accuracy = {{ tolerance = 1e-5 }}
[[bodies]]
name = "bar"
modes = {}
stiffening = "on"
directions = "all"
damping = {{ rule = "modal", value = 0.02 }}
[[bodies.segments]]
shape = "round-bar"
diameter = {}
length = {}
material = {{ E = 70e9, nu = 0.33, rho = 2700 }}
[[joints]]
name = "pin"
kind = "{}"
b = {{ body = "bar", marker = "root" }}
loads = true
)",
                                 x, y, modes, diameter, length, joint),
                     "bar.toml");
}

// The first mode that stretches a slender bar is beyond 20 that bend it, that of a wire beyond 100: what hangs still
// gets longer.
TEST_P(Budget, CountsTheStretchOfASlenderBar) {
  for (const double diameter : {0.02, 0.0005}) {
    SCOPED_TRACE(diameter);
    Scene scene = held_bar("fixed", 9.81, 0, diameter, 10, 6);
    scene.outputs = {"bar.tip"};
    const RunResult r = run(scene);
    EXPECT_NEAR(r.budget.truncation, 1, 0.1);
    const OutputErrors& tip = r.budget.outputs.front();
    // Let go at once, a bar stretches to twice its length under its weight, rho g L^2 / 2 E; one shape alone falls
    // short.
    const double weight = 2700 * 9.81 * 10 * 10 / (2 * 70e9);
    EXPECT_GT(tip.scale, weight);
    EXPECT_LT(tip.scale, 2.2 * weight);
  }
}

// Weight along a bar that may only bend in the hinge plane: what would help is said.
TEST(BudgetOfATree, NamesTheDirectionsThatAreLeftOut) {
  Scene scene = held_bar("fixed", 9.81, 0, 0.02, 10, 6);
  const auto is_helped = [](const RunResult& r) {
    return any_has(r.warnings, "directions = \"all\" takes the others in");
  };
  EXPECT_FALSE(is_helped(run_scene(scene, {})));
  scene.bodies[0].directions = "hinge-plane";
  EXPECT_TRUE(is_helped(run_scene(scene, {})));
}

// The closed form has as many modes as one likes.
TEST(BudgetOfAHub, CountsTheModesThatEq14LeavesOut) {
  Scene scene = load_scene("sport");
  scene.duration = 0.3;
  scene.tolerance = 1e-4;
  scene.outputs = {"sip.tip"};
  for (BodyScene& b : scene.bodies) b.structure = "eq14", b.modes = 1, b.modes_auto = false;
  const RunResult one = run_scene(scene, {});
  for (BodyScene& b : scene.bodies) b.modes = 10;
  scene.error_budget = false, scene.tolerance = 1e-8;
  const double error = largest(compare_outputs(one.outputs, run_scene(scene, {}).outputs, scene.outputs));
  EXPECT_NEAR(one.budget.truncation, error, 0.3 * error);  // modes beyond the next four take a sixth of it back
}

// The load of a pin converges as 1 / n: the next four modes show a part of what all others do.
TEST(BudgetOfATree, CountsWhatManyModesDoToTheLoadOfAJoint) {
  Scene scene = held_bar("hinge", 0, -9.81, 0.006, 1.2, 7);
  scene.bodies[0].directions = "hinge-plane";
  scene.outputs = {"pin.force"};
  scene.tolerance = 1e-4;
  const RunResult few = run_scene(scene, {});
  scene.bodies[0].modes = 42;
  scene.bodies[0].geometry.order = 8;
  scene.error_budget = false;
  const RunResult many = run_scene(scene, {});
  const double error = largest(compare_outputs(few.outputs, many.outputs, scene.outputs));
  EXPECT_GT(few.budget.truncation, 0.7 * error);  // of four modes more alone: 0.44
  EXPECT_LT(few.budget.truncation, 4 * error);
}

// A stiff boom that rings undamped: the method by multipliers damps it far faster than asked, and says so.
TEST(NoBudget, AnUnbalancedMotionIsWarnedOf) {
  Scene scene =
      read_scene(std::filesystem::path(FLEXBOOM_TEST_DATA) / "verification" / "stiffened" / "ringing_boom.toml");
  scene.duration = 0.2;
  scene.error_budget = false;
  const auto is_warned_of = [](const RunResult& r) {
    return std::ranges::any_of(r.warnings, [](const std::string& w) { return w.starts_with("energy balance "); });
  };
  EXPECT_FALSE(is_warned_of(run_scene(scene, {})));
  scene.formulation = "multipliers";
  const RunResult r = run_scene(scene, {});
  EXPECT_GT(r.trajectory.summary.energy_balance, 10 * scene.tolerance);
  EXPECT_TRUE(is_warned_of(r));
}

// A boom whose hub spins: what the hub's equations leave out adds up over the flight, beyond (Omega / omega_1)^2.
TEST(BudgetOfAHub, CountsWhatGeometricStiffnessChanges) {
  const std::string soft =
      with(with(swing_on_hinge, "stiffness = 1\nP2 = 0.02", "stiffness = 5\nP2 = 0"), "E = 70e9", "E = 7e9");
  Scene hub = parse_scene(with(soft, "[hub]", "[initial]\nrate = [0, 0, 3]\n[hub]"), "hub.toml");
  Scene tree = parse_scene(
      with(with(with(with(with(swing_on_joints, "E = 70e9", "E = 7e9"), "modes = 1", "modes = 1\nstiffening = \"on\""),
                     "b = { body = \"hub\" }", "b = { body = \"hub\" }\nstart_omega = [0, 0, 3]"),
                "point = [0.05, 0, 0] }", "point = [0.05, 0, 0], x = [0, 1, 0], z = [0, 0, -1] }"),
           "name = \"hinge\"", "name = \"boom\"\nrest = 1.5707963267948966"),
      "tree.toml");
  tree.joints.back().mechanism.stiffness = 5;
  tree.joints.back().mechanism.damping = 0;
  tree.joints.back().start = {1.5};
  hub.tolerance = tree.tolerance = 1e-6;
  hub.duration = tree.duration = 2;
  hub.bodies[0].damping = tree.bodies[0].damping = {};
  hub.bodies[0].stiffening = "off";
  tree.error_budget = false;
  const RunResult r = run_scene(hub, {}), truth = run_scene(tree, {});
  const double change = largest(compare_outputs(r.outputs, truth.outputs, {"boom.angle", "boom.tip"}));
  EXPECT_GT(change, 1e-3);
  EXPECT_GE(r.budget.linearisation, change);
  EXPECT_LE(r.budget.linearisation, 100 * change);
}

TEST(BudgetOfATree, CountsWhatGeometricStiffnessChanges) {
  Scene scene = parse_scene(with(swing_on_joints, "modes = 1", "modes = 1\nstiffening = \"off\""), "off.toml");
  scene.tolerance = 1e-7;
  const RunResult off = run_scene(scene, {});
  scene.bodies[0].stiffening = "on";
  const RunResult on = run_scene(scene, {});
  EXPECT_GT(off.budget.linearisation, on.budget.linearisation);
  EXPECT_GT(on.budget.linearisation, 0);  // of the order of the deflection squared
  EXPECT_LT(on.budget.linearisation, 1e-3);
}

/// The stiffness of a body may hardly change where a load at its root does: what counts is the outputs.
TEST(BudgetOfATree, GeometricStiffnessThatCountsIsInTheRunThatIsKept) {
  Scene scene = load_scene("flexible-appendage");
  scene.duration = 5;
  scene.tolerance = 1e-4;
  scene.error_budget = true;
  const RunResult left_open = run_scene(scene, {});
  EXPECT_EQ(left_open.tree->stiffening(1), Stiffening::on);
  EXPECT_LT(left_open.budget.time, 1e-6);  // no part of what stiffness changes
  EXPECT_LT(left_open.budget.linearisation, 1e-4);
  for (BodyScene& b : scene.bodies)
    if (!b.stiffening.empty()) b.stiffening = "off";
  const RunResult off = run_scene(scene, {});
  EXPECT_EQ(off.tree->stiffening(1), Stiffening::off);
  EXPECT_GT(off.budget.linearisation, 1e-3);
  EXPECT_LT(off.budget.time, 1e-6);
}

/// A repeat that fails costs its part of the budget, not the run: the tighter one where the tolerance nears round-off.
TEST(BudgetOfAnyScene, OutlivesARepeatThatFails) {
  for (Scene scene : {load_scene("sport"), parse_scene(swing_on_joints, "joints.toml")}) {
    SCOPED_TRACE(scene.name);
    scene.duration = 0.05;
    scene.integrator = "adams";
    bool failed = false;
    for (double tolerance = 1e-11; tolerance > 5e-15 && !failed; tolerance /= 10) try {
        scene.tolerance = tolerance;
        const RunResult r = run_scene(scene, {});
        failed = std::isnan(r.budget.time);
        EXPECT_EQ(r.trajectory.time.back(), 0.05);
        EXPECT_EQ(std::isnan(r.budget.total()), failed);
        EXPECT_EQ(any_has(r.warnings, "time not measured: "), failed);
      } catch (const NumericalError&) {
        break;  // nor does the run itself get there
      }
    EXPECT_TRUE(failed);
  }
}

// --- momenta ---

/// Drift of the momenta in a short flight of this scene.
double drift(const std::string& text, const std::string& formulation = "relative") {
  Scene scene = parse_scene(text, "drift.toml");
  scene.formulation = formulation;
  scene.error_budget = false;
  scene.duration = 0.05;
  return run_scene(scene, {}).trajectory.summary.momentum_drift;
}

TEST(MomentumDrift, IsUnknownWhereSomethingPushesOrHolds) {
  for (const char* formulation : {"relative", "multipliers"}) {
    EXPECT_LT(drift(swing_on_hinge, formulation), 1e-6);
    EXPECT_LT(drift(swing_on_joints, formulation), 1e-6);
    EXPECT_TRUE(std::isnan(drift(with(swing_on_hinge, "mass = 8.5", "mass = 8.5\nfixed = true"), formulation)));
    for (const char* more :
         {"drive = \"0.1*sin(t)\"\n", "[[loads]]\nname = \"push\"\nat = { body = \"hub\" }\nforce = [1, 0, 0]\n",
          "[[springs]]\nname = \"tether\"\na = { body = \"ground\", point = [1, 0, 0] }\nb = { body = \"hub\" }\n"
          "stiffness = 1\n"})
      EXPECT_TRUE(std::isnan(drift(swing_on_joints + more, formulation))) << more;
    EXPECT_TRUE(std::isnan(
        drift(with(swing_on_joints, "duration = 0.5", "duration = 0.5\ngravity = [0, 0, -1]"), formulation)));
    EXPECT_TRUE(std::isnan(drift(with(swing_on_joints, "kind = \"free\"", "kind = \"spherical\""), formulation)));
    for (const std::string& text : {swing_on_hinge, swing_on_joints})
      EXPECT_TRUE(std::isnan(drift(text + "[orbit]\ngravity = \"differential\"\n", formulation))) << text;
  }
  EXPECT_LT(drift(swing_on_hinge + "[orbit]\naltitude = 4e5\n"), 1e-6);
}

// --- tips ---

std::vector<std::string> outputs_of(const Scene& given) {
  Scene scene = given;
  scene.error_budget = false;
  scene.duration = 0.02;
  return run_scene(scene, {}).outputs.names;
}

/// The marker "tip" under another name.
std::function<void(ReducedBody&)> called(const std::string& name) {
  return [name](ReducedBody& body) {
    for (Marker& m : body.markers)
      if (m.name == "tip") m.name = name;
    for (MarkerStiffness& m : body.Kg.markers)
      if (m.marker == "tip") m.marker = name;
  };
}

/// Two bases have other coordinates by the same names.
TEST(Budget, CoordinatesOfOtherBasesAreNotCompared) {
  OutputTable table;
  table.names = {"t", "boom.q1", "boom.q2", "boom.tip.y"};
  table.values = Eigen::MatrixXd::Ones(2, 4);
  const OutputTable kept = without_coordinates(table);
  EXPECT_EQ(kept.names, (std::vector<std::string>{"t", "boom.tip.y"}));
  EXPECT_EQ(kept.values.cols(), 2);
}

// Four wires that swing alike keep their hub at rest: what round-off makes of its velocity is weighed by the speed of
// the wires.
TEST(Budget, WhatSymmetryKeepsAtRestIsNoError) {
  Scene scene = scene_named("wire-spinner");
  scene.error_budget = true;
  scene.tolerance = 1e-3;
  scene.duration = 20;
  const RunResult r = run_scene(scene, {});
  const auto hub = std::ranges::find(r.budget.outputs, "hub.velocity", &OutputErrors::name);
  ASSERT_NE(hub, r.budget.outputs.end());
  EXPECT_LT(hub->size, 1e-10);
  EXPECT_LT(hub->total(), 1e-3);
  EXPECT_LT(r.budget.time, 1e-3);
  EXPECT_EQ(r.scene.integrator_tolerance, 0) << "no digit more helps";
}

TEST(Tip, IsFoundWhateverItsSpelling) {
  const Scene plain = parse_scene(swing_on_joints, "plain.toml");
  const std::vector<std::string> names = outputs_of(plain);
  for (const char* name : {"tip", "TIP", "Tip", "END", "panel_edge"}) {
    EXPECT_EQ(outputs_of(with_reduced(swing_on_joints, called(name))), names) << name;
    Scene named = with_reduced(swing_on_joints, called(name));
    named.outputs = {"boom.tip"};
    EXPECT_NO_THROW(validate(named)) << name;
  }
  Scene a = plain, b = with_reduced(swing_on_joints, called("TIP"));
  a.error_budget = b.error_budget = false;
  const RunResult x = run_scene(a, {}), y = run_scene(b, {});
  EXPECT_GT(column(x, "boom.tip.y").cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ(column(y, "boom.tip.y").cwiseAbs().maxCoeff(), column(x, "boom.tip.y").cwiseAbs().maxCoeff());
}

// Two places that move and none called tip: the column is not there, and the plan says why.
TEST(Tip, IsAbsentWhereNoMarkerIsOne) {
  Scene scene = with_reduced(swing_on_joints, [](ReducedBody& body) {
    called("edge")(body);
    Marker other = *std::ranges::find(body.markers, std::string("edge"), &Marker::name);
    other.name = "corner";
    body.markers.push_back(other);
  });
  scene.error_budget = false;
  scene.duration = 0.02;
  const RunResult r = run_scene(scene, {});
  EXPECT_EQ(std::ranges::count(r.outputs.names, "boom.tip.y"), 0);
  EXPECT_EQ(std::ranges::count(r.outputs.names, "boom.q1"), 1);
  EXPECT_TRUE(any_has(r.plan, "no output boom.tip")) << fmt::format("{}", fmt::join(r.plan, "\n"));
  scene.outputs = {"boom.tip"};
  try {
    validate(scene);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("no marker that is its tip"), std::string::npos) << e.what();
  }
}

TEST(Tip, MarkersOfPlacesCompareWithoutCase) {
  const Scene scene = parse_scene(with(swing_on_joints, "marker = \"root\"", "marker = \"ROOT\""), "case.toml");
  EXPECT_EQ(scene.joints.back().b.marker, "root");
}

// --- warnings ---

TEST_P(Budget, LargeDeflectionsAreNamed) {
  for (const std::string& text : {swing_on_hinge, swing_on_joints}) {
    const std::string soft = with(text, "E = 70e9", "E = 70e6");
    Scene scene = parse_scene(soft, "soft.toml");
    scene.error_budget = false;
    scene.duration = 0.3;
    if (scene.is_tree)
      scene.joints.back().start_rate = {20};
    else
      scene.hinges[0].start_rate = 20;
    const RunResult large = run(scene);
    EXPECT_TRUE(any_has(large.warnings, "body boom: it bends by ")) << text;
    EXPECT_TRUE(any_has(large.warnings, " m at t = "));
    EXPECT_TRUE(any_has(large.warnings, "% of its length"));
    Scene stiff = parse_scene(text, "stiff.toml");
    stiff.error_budget = false;
    stiff.duration = 0.1;
    const RunResult small = run(stiff);
    EXPECT_FALSE(any_has(small.warnings, "it bends by "));
  }
}

/// A boom pressed along its axis beyond and below Euler's load, pi^2 E I / (4 L^2).
TEST_P(Budget, BucklingIsNamed) {
  const BodyScene boom = parse_scene(swing_on_joints, "boom.toml").bodies.at(0);
  const BeamSegment& segment = boom.geometry.segments.at(0);
  const double I = section_of(segment.start, segment.material.nu, boom.geometry.shear).Iz;
  const double euler = std::pow(M_PI / (2 * segment.length), 2) * segment.material.E * I;
  for (const double share : {0.5, 2.0}) {
    Scene scene = parse_scene(
        fmt::format("{}[[loads]]\nname = \"press\"\nat = {{ body = \"boom\", marker = \"tip\" }}\nforce = [{}, 0, 0]\n",
                    swing_on_joints, -share * euler),
        "pressed.toml");
    scene.joints.back().kind = JointKind::fixed;
    scene.joints.back().mechanism = {}, scene.joints.back().start.clear();
    scene.joints.front().kind = JointKind::fixed;
    scene.bodies[0].stiffening = "on";
    scene.error_budget = false;
    scene.duration = 0.01;
    const RunResult r = run(scene);
    EXPECT_EQ(any_has(r.warnings, "it buckles"), share > 1) << fmt::format("{}", fmt::join(r.warnings, "\n"));
    EXPECT_EQ(any_has(r.warnings, "body boom: at t = "), share > 1);
  }
}

TEST(Warnings, OfSpringsAndStartsBeyondTheStop) {
  const std::string hinge = with(swing_on_hinge, "P3 = 0", "P3 = 20\nthreshold = 1.2");
  EXPECT_TRUE(any_has(parse_scene(hinge, "x.toml").warnings, "hinge boom: starts at 1.5 rad, beyond the stop"));
  EXPECT_TRUE(any_has(parse_scene(hinge, "x.toml").warnings, "hinge boom: the spring is at rest at 1.5708 rad"));
  const std::string joint = swing_on_joints + "stop_stiffness = 10\nthreshold = 0.05\nrest = 0.06\n";
  EXPECT_TRUE(any_has(parse_scene(joint, "x.toml").warnings, "joint hinge: starts at 0.07 rad, beyond the stop"));
  EXPECT_TRUE(any_has(parse_scene(joint, "x.toml").warnings, "joint hinge: the spring is at rest at 0.06 rad"));
  for (const std::string& text : {swing_on_hinge, swing_on_joints})
    EXPECT_TRUE(parse_scene(text, "x.toml").warnings.empty());
  for (const std::string& name : builtin_scene_names())
    EXPECT_FALSE(any_has(load_scene(name).warnings, "beyond the stop")) << name;
}

// What a file says of itself is read where it is used.
TEST(Warnings, OfABodyWhoseFileFailsItsOwnChecks) {
  const auto failed = [](ReducedBody& body) { body.certificate = {{"mass", 1.0, 2.0, 0.5, false}}; };
  const auto passed = [](ReducedBody& body) { body.certificate = {{"mass", 1.0, 1.0, 0.0, true}}; };
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("check." + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  for (const bool good : {true, false}) {
    Scene scene = with_reduced(swing_on_joints, good ? std::function<void(ReducedBody&)>(passed) : failed);
    scene.bodies[0].reduced_file = folder / "boom.h5";
    write_body_file(scene.bodies[0].reduced_file, *scene.bodies[0].reduced);
    std::ofstream(folder / "scene.toml") << to_toml(scene);
    CommonOptions quiet;
    quiet.quiet = true;
    EXPECT_EQ(check_command((folder / "scene.toml").string(), quiet), good ? exit_ok : exit_check_failed);
    EXPECT_EQ(any_has(read_scene(folder / "scene.toml").warnings, "fails its own check \"mass\""), !good);
  }
  std::filesystem::remove_all(folder);
}

// A function of time that has no value names itself, wherever it is and whoever asks.
TEST(FunctionOfTime, WithoutAValueIsNamed) {
  const struct {
    const char *more, *words;
  } cases[] = {
      {"drive = \"log(0.01 - t)\"\n", "joint hinge: drive is "},
      {"motion = \"log(0.01 - t)\"\n", "joint hinge: motion is "},
      {"[[loads]]\nname = \"push\"\nat = { body = \"hub\" }\nforce = [0, \"sqrt(0.01 - t)\", 0]\n",
       "load push: force[1] is "},
      {"[[loads]]\nname = \"push\"\nat = { body = \"hub\" }\ntorque = [0, 0, \"1/(t - 0.01) + log(0.01 - t)\"]\n",
       "load push: torque[2] is "},
      {"[[wheels]]\nname = \"spin\"\nbody = \"hub\"\ninertia = 1e-3\ntorque = \"log(0.01 - t)\"\n",
       "wheel spin: torque is "},
  };
  const std::string without_start = with(swing_on_joints, "start = 0.07\n", "");  // a motion has its own
  for (const char* formulation : {"relative", "multipliers"})
    for (const auto& c : cases) try {
        drift(without_start + c.more, formulation);
        ADD_FAILURE() << c.more;
      } catch (const NumericalError& e) {
        EXPECT_NE(std::string(e.what()).find(c.words), std::string::npos) << formulation << ": " << e.what();
        EXPECT_NE(std::string(e.what()).find("at t = 0.01"), std::string::npos) << e.what();
      }
}

// What is 1e-4 of a panel's stiffness makes its phase drift by 6e-3 in a minute, where nothing damps it: without a
// budget nobody would see that.
TEST(WithoutBudget, StiffnessThatDriftsIsNotLeftOut) {
  Scene scene = load_scene("flexible-appendage");
  scene.error_budget = false, scene.tolerance = 1e-4;
  const RunResult run = run_scene(scene, {});
  EXPECT_EQ(run.tree->stiffening(1), Stiffening::on);
  scene.tolerance = 1e-8;
  EXPECT_LT(
      largest(compare_outputs(run.outputs, run_scene(with_stiffening(scene), {}).outputs, {}, floors_of(scene, {}))),
      10 * run.scene.tolerance);
}

// The booms of SPORT are stiffened by up to 9e-6 of their stiffness. The foreshortening of their tips is 5e-4 of the
// displacement; the tips have it with and without that stiffness.
TEST(WithoutBudget, AHubWithHingesHasTheStiffnessThatItsToleranceAsksFor) {
  Scene scene = load_scene("sport");
  scene.error_budget = false, scene.tolerance = 1e-9;
  const RunResult reference = run_scene(with_stiffening(scene), {});
  const auto error = [&](const RunResult& r) {
    return largest(compare_outputs(r.outputs, reference.outputs, {}, floors_of(r.scene, r.bodies)));
  };
  for (const auto& [tolerance, expected] : {std::pair{1e-3, Stiffening::off}, {1e-7, Stiffening::on}}) {
    scene.tolerance = tolerance;
    const RunResult run = run_scene(scene, {});
    EXPECT_EQ(run.tree->stiffening(3), expected) << tolerance;
    EXPECT_LT(error(run), 10 * tolerance);
  }
  for (BodyScene& b : scene.bodies) b.stiffening = "off";
  const double without = error(run_scene(scene, {}));
  EXPECT_GT(without, 10 * scene.tolerance);
  EXPECT_LT(without, 1e-5);
}

// The next modes may happen to do little: of the rates after a blow, the seventh mode of SPORT changes 6e-6, the eighth
// 1e-4. Reference: 40 modes, both planes.
TEST(BudgetOfAHub, TruncationIsWhatManyMoreModesChange) {
  Scene scene = load_scene("sport");
  scene.tolerance = 1e-7, scene.error_budget = false, scene.duration = 1;
  Scene full = scene;
  for (BodyScene& b : full.bodies) b.modes = 40, b.directions = "all";
  const OutputTable reference = without_coordinates(run_scene(full, {}).outputs);
  scene.error_budget = true;
  for (const int modes : {1, 3, 6}) {
    for (BodyScene& b : scene.bodies) b.modes = modes;
    const RunResult r = run_scene(scene, {});
    for (const OutputDifference& d :
         compare_outputs(without_coordinates(r.outputs), reference, {}, floors_of(scene, r.bodies))) {
      const auto o = std::ranges::find(r.budget.outputs, d.name, &OutputErrors::name);
      ASSERT_NE(o, r.budget.outputs.end());
      EXPECT_GT(o->truncation + 10 * scene.tolerance, d.error / 2) << d.name << ", " << modes;
      EXPECT_LT(o->truncation, 3 * d.error + 10 * scene.tolerance) << d.name << ", " << modes;
    }
  }
}

// The modes of the hinge plane have other numbers among those of all directions.
TEST(BudgetOfAHub, MoreModesHoldTheOwnOnes) {
  Scene scene = load_scene("sport");
  BodyScene& boom = scene.bodies[0];
  boom.modes = 6, boom.shapes = {6};
  for (const auto& [directions, kind] : {std::pair{"hinge-plane", "bending_y"}, {"all", "bending_z"}}) {
    boom.directions = directions;
    const BodyScene richer = with_more_modes(scene, {}, {}).bodies[0];
    const ReducedBody own = prepare_body(boom).body, all = prepare_body(richer).body;
    ASSERT_EQ(own.coordinates[0].kind, kind);
    const double square = own.Ke(0, 0) / own.Me(0, 0);
    int of_kind = 0, alike = 0;
    for (int k = 0; k < all.n(); ++k) {
      if (all.coordinates[static_cast<size_t>(k)].kind != kind) continue;
      ++of_kind;
      if (std::abs(all.Ke(k, k) / all.Me(k, k) / square - 1) < 1e-9) ++alike;
    }
    EXPECT_EQ(alike, 1) << directions;
    EXPECT_EQ(of_kind, 5) << directions;
  }
}

}  // namespace
}  // namespace flexboom
