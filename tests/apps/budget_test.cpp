// What the error budget says, and what it must not say.

#include "apps/accuracy/error_budget.hpp"
#include "apps/accuracy/time_error.hpp"
#include "apps/accuracy/variants.hpp"
#include "apps/results/results.hpp"
#include "tests/apps/reduced_testing.hpp"
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

using Budget = InBothFormulations;
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
    EXPECT_NEAR(r.budget.truncation, 1.25, 0.1);  // all of the tip, and a quarter for what is left out still
    const OutputErrors& tip = r.budget.outputs.front();
    // Let go at once, a bar stretches to twice its length under its weight, rho g L^2 / 2 E; one shape alone falls
    // short.
    const double weight = 2700 * 9.81 * 10 * 10 / (2 * 70e9);
    EXPECT_GT(tip.scale, weight);
    EXPECT_LT(tip.scale, 2.2 * weight);
  }
}

// Weight along a bar that may only bend in the hinge plane: what would help is said.
// A slider moves a boom along its own axis. Modes that stretch it come after many that bend it.
TEST(BudgetOfATree, CountsTheStretchOfWholeBases) {
  const std::string text = R"toml(format = "flexboom-scene-1"
name = "x"
duration = 0.3
output_step = 0.005
[accuracy]
tolerance = 0.02
outputs = ["j.force"]
[[bodies]]
name = "boom"
directions = "all"
stiffening = "on"
basis = "craig-bampton"
modes = 6
[[bodies.segments]]
shape = "round-bar"
diameter = 0.02
length = 1.0
material = { E = 700000000.0, nu = 0.3, rho = 1500 }
[[joints]]
name = "j"
kind = "slider"
loads = true
motion = { profile = "trapezoid", angle = 0.05, peak_rate = 0.2, peak_acceleration = 2.0, start = 0.1 }
b = { body = "boom", marker = "root", x = [0, 0, 1.0], z = [1.0, 0, 0] }
)toml";
  Scene fine = parse_scene(with(text, "craig-bampton", "clamped"), "slide.toml");
  fine.bodies[0].modes = 48;
  fine.bodies[0].geometry.order = 8;
  fine.error_budget = false;
  const RunResult exact = run_scene(fine, {});
  for (const char* basis : {"craig-bampton", "mean-axis", "prestressed"}) {
    const RunResult coarse = run_scene(parse_scene(with(text, "craig-bampton", basis), "slide.toml"), {});
    const double error = largest(compare_outputs(coarse.outputs, exact.outputs, fine.outputs));
    EXPECT_GT(error, 0.4) << basis;
    EXPECT_GT(coarse.budget.truncation, error) << basis;
    EXPECT_LT(coarse.budget.truncation, 3 * error) << basis;
    EXPECT_FALSE(coarse.budget.within(fine.tolerance)) << basis;
  }
}

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
  EXPECT_GE(one.budget.truncation, error);
  EXPECT_LE(one.budget.truncation, 1.6 * error);  // modes beyond the next four take a sixth of it back
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

// A spring lets a light boom go. Its root turns as fast as that part of it which has felt the spring.
TEST(BudgetOfATree, CountsWhatManyModesDoToTheRateOfAJoint) {
  Scene scene = parse_scene(R"toml(format = "flexboom-scene-1"
name = "snap"
duration = 0.06
output_step = 0.002
[accuracy]
tolerance = 1e-2
outputs = ["hinge.rate"]
[[bodies]]
name = "arm"
modes = 14
directions = "all"
stiffening = "on"
damping = { rule = "modal", value = 0.002 }
corrections = ["mid.Fy", "mid.Fz", "mid.My", "mid.Mz", "mid.Mx", "mid.Fx"]
[[bodies.segments]]
shape = "round-bar"
diameter = 0.012
length = 0.54
material = { E = 7e9, nu = 0.33, rho = 2700 }
[[bodies.attachments]]
name = "mid"
position = 0.27
mass = 0.5
[[bodies]]
name = "boom"
modes = 14
directions = "all"
stiffening = "on"
[[bodies.segments]]
shape = "round-bar"
diameter = 0.012
length = 0.5
material = { E = 70e9, nu = 0.33, rho = 2700 }
[[joints]]
name = "clamp"
kind = "fixed"
b = { body = "arm", marker = "root" }
[[joints]]
name = "hinge"
kind = "hinge"
a = { body = "arm", marker = "mid", x = [1,0,0], z = [0, 0, 1] }
b = { body = "boom", marker = "root" }
start = 0
stiffness = 50
rest = 0.2
damping = 0.5
)toml",
                            "snap.toml");
  const RunResult few = run_scene(scene, {});
  for (BodyScene& b : scene.bodies) b.modes = 40;
  scene.error_budget = false;
  const RunResult many = run_scene(scene, {});
  const double error = largest(compare_outputs(few.outputs, many.outputs, scene.outputs));
  EXPECT_GT(few.budget.truncation, error);  // what four modes more of each kind change, by 1.25: 0.85 of it
  EXPECT_LT(few.budget.truncation, 3 * error);
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
  EXPECT_GT(r.motion.summary.energy_balance, 10 * scene.tolerance);
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

/// A strip of 3 m on a free hub, cut into some strips on fixed joints: these turn by large angles.
Scene strips_on_a_hub(int count) {
  std::string text = R"toml(format = "flexboom-scene-1"
name = "strips"
duration = 4.0
output_step = 0.02
[accuracy]
tolerance = 1e-5
outputs = ["hub.rate", "c0.torque"]
[[bodies]]
name = "hub"
mass = 2.0
inertia = [0.3, 0.3, 0.3]
[[wheels]]
name = "w"
body = "hub"
axis = [0.0, 0.0, 1.0]
inertia = 0.01
torque = "-0.2*sin(pi*t)*(t<1)"
[[joints]]
kind = "free"
b = { body = "hub" }
)toml";
  for (int k = 0; k < count; ++k) {
    const std::string place =
        k == 0 ? R"(body = "hub", point = [0.1, 0.0, 0.0])" : fmt::format(R"(body = "c{}", marker = "tip")", k - 1);
    text += fmt::format(R"(
[[bodies]]
name = "c{0}"
damping = {{ rule = "rayleigh", alpha = 0.0, beta = 2e-3 }}
modes = 4
stiffening = "on"
corrections = ["tip.Fx", "tip.Fy", "tip.Mz"]
[[bodies.segments]]
shape = "rectangle"
height = 0.003
width = 0.03
length = {1}
material = {{ E = 70e9, nu = 0.33, rho = 2700.0 }}
[[joints]]
name = "c{0}"
kind = "fixed"
a = {{ {2} }}
b = {{ body = "c{0}", marker = "root" }}
loads = true
)",
                        k, 3.0 / count, place);
  }
  return parse_scene(text, "strips.toml");
}

TEST(BudgetOfATree, VibrationsOfLargeAmplitudeAreLate) {
  Scene one = strips_on_a_hub(1), chain = strips_on_a_hub(6);
  chain.error_budget = false;
  const RunResult r = run_scene(one, {}), truth = run_scene(chain, {});
  const auto differences = compare_outputs(r.outputs, truth.outputs, one.outputs);
  ASSERT_EQ(differences.size(), 2U);
  for (const OutputDifference& d : differences) {
    const auto said = std::ranges::find(r.budget.outputs, d.name, &OutputErrors::name);
    ASSERT_NE(said, r.budget.outputs.end());
    EXPECT_GT(d.error, 5e-3) << d.name;
    EXPECT_GE(said->linearisation, d.error) << d.name;
    EXPECT_LE(said->linearisation, 3 * d.error) << d.name;
  }
}

// A torque of 40 Hz moves the hub by little, so steps right for the outputs do not follow its power.
TEST(BudgetOfATree, EnergiesBalanceWhereOutputsNeedNoSteps) {
  Scene scene = parse_scene(R"toml(format = "flexboom-scene-1"
name = "jitter"
duration = 2.0
output_step = 0.005
accuracy = { tolerance = 1e-2, budget = false }
[[loads]]
name = "jitter"
at = { body = "hub" }
torque = ["0", "0", "0.5*sin(2*pi*40*t)"]
[[bodies]]
name = "hub"
mass = 50.0
inertia = [4.0, 5.0, 6.0]
[[bodies]]
name = "panel"
modes = 5
damping = { rule = "modal", value = 0.002 }
[[bodies.segments]]
shape = "rectangle"
height = 0.01
width = 0.5
length = 2.0
material = { E = 2e10, nu = 0.3, rho = 400.0 }
[[joints]]
kind = "free"
b = { body = "hub" }
[[joints]]
kind = "fixed"
a = { body = "hub", point = [0.3, 0.0, 0.0] }
b = { body = "panel", marker = "root" }
)toml",
                            "jitter.toml");
  EXPECT_GT(run_scene(scene, {}).motion.summary.energy_balance, bearable_balance(scene.tolerance));
  scene.error_budget = true;
  const RunResult r = run_scene(scene, {});
  EXPECT_LE(r.motion.summary.energy_balance, bearable_balance(scene.tolerance));
  EXPECT_LT(r.scene.integrator_tolerance, scene.tolerance);
}

TEST(BudgetOfATree, MotionsThatAreGivenHaveNoErrorOfTheory) {
  Scene scene = load_scene("spin-up");
  scene.duration = 5, scene.tolerance = 1e-2, scene.error_budget = true;
  const RunResult r = run_scene(scene, {});
  for (const char* name : {"shaft.angle", "shaft.rate", "shaft.drive"}) {
    const auto said = std::ranges::find(r.budget.outputs, name, &OutputErrors::name);
    ASSERT_NE(said, r.budget.outputs.end());
    EXPECT_EQ(said->linearisation == 0, !is_load(name)) << name;
  }
}

/// The stiffness of a body may hardly change where a load at its root does: what counts is the outputs.
TEST(BudgetOfATree, GeometricStiffnessThatCountsIsInTheRunThatIsKept) {
  Scene scene = load_scene("flexible-appendage");
  scene.duration = 5;
  scene.tolerance = 1e-4;
  scene.error_budget = true;
  const RunResult left_open = run_scene(scene, {});
  EXPECT_EQ(left_open.tree->stiffening(1), Stiffening::on);
  EXPECT_LT(left_open.budget.time, 1e-5);           // no part of what stiffness changes
  EXPECT_LT(left_open.budget.linearisation, 2e-4);  // vibrations that are late
  for (BodyScene& b : scene.bodies)
    if (!b.stiffening.empty()) b.stiffening = "off";
  const RunResult off = run_scene(scene, {});
  EXPECT_EQ(off.tree->stiffening(1), Stiffening::off);
  EXPECT_GT(off.budget.linearisation, 1e-3);
  EXPECT_LT(off.budget.time, 1e-5);
}

/// Multipliers and methods that stiff modes hold up: repeats with more modes are those of a cheaper run of the model.
TEST(BudgetOfATree, OfCostlyMeansIsThatOfTheCheapest) {
  Scene scene = parse_scene(swing_on_joints, "joints.toml");
  scene.tolerance = 1e-5;
  const RunResult cheap = run_scene(scene, {});
  Scene truth = scene;
  truth.tolerance = 1e-10;
  truth.error_budget = false;
  const RunResult reference = run_scene(truth, {});
  for (const auto& [formulation, method] :
       {std::pair{"multipliers", "auto"}, {"relative", "bdf"}, {"relative", "erk"}}) {
    SCOPED_TRACE(fmt::format("{} {}", formulation, method));
    scene.formulation = formulation, scene.integrator = method;
    const RunResult r = run_scene(scene, {});
    EXPECT_EQ(r.scene.formulation, formulation);
    EXPECT_EQ(r.scene.integrator, method);
    EXPECT_TRUE(r.budget.missing.empty());
    EXPECT_TRUE(std::ranges::any_of(r.plan, [](const std::string& line) {
      return line.starts_with("error budget: repeats are those of a run in relative coordinates by exponential");
    }));
    for (const auto part : {&ErrorParts::truncation, &ErrorParts::linearisation})
      EXPECT_NEAR(r.budget.*part, cheap.budget.*part, 0.02 * cheap.budget.*part + 1e-9);
    const double error = largest(compare_outputs(r.outputs, reference.outputs, scene.outputs));
    EXPECT_GT(error, 1e-8);  // of the method itself
    EXPECT_GT(r.budget.time, 0.9 * error);
    EXPECT_LT(r.budget.time, 3 * error);
  }
}

/// A repeat that fails costs its part of the budget, not the run: the tighter one where the tolerance nears round-off.
TEST(BudgetOfAnyScene, OutlivesARepeatThatFails) {
  for (Scene scene : {load_scene("sport"), parse_scene(swing_on_joints, "joints.toml")}) {
    SCOPED_TRACE(scene.name);
    scene.duration = 0.05;
    scene.integrator = "dirk";
    bool failed = false;
    for (double tolerance = 1e-11; tolerance > 5e-15 && !failed; tolerance /= 10) try {
        scene.tolerance = tolerance;
        const RunResult r = run_scene(scene, {});
        failed = std::isnan(r.budget.time);
        EXPECT_EQ(r.motion.time.back(), 0.05);
        EXPECT_EQ(std::isnan(r.budget.total()), failed);
        EXPECT_EQ(any_has(r.warnings, "time not measured: "), failed);
      } catch (const NumericalError&) {
        break;  // nor does the run itself get there
      }
    EXPECT_TRUE(failed);
  }
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
    const BodyScene richer = with_more_modes(scene, {}, {}, {}).bodies[0];
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
