// What a scene with modes = "auto" is simulated with.

#include "apps/accuracy/planner.hpp"
#include "apps/model/static_shapes.hpp"
#include "fem/base/check.hpp"
#include "tests/apps/run_testing.hpp"
#include "tests/apps/scene_testing.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

namespace flexboom {
namespace {

/// A boom on a satellite that is spun up about the axis; z bends it in its x-y plane alone, y in its x-z plane alone.
Scene spun_about(const std::string& axis, double tolerance, const std::string& modes = "\"auto\"") {
  return parse_scene(fmt::format(R"(format = "flexboom-scene-1"
name = "spun"
duration = 2.0
output_step = 0.02
accuracy = {{ tolerance = {}, outputs = ["fly.rotation", "boom.tip"] }}
[[bodies]]
name = "hub"
mass = 20.0
inertia = [0.6, 0.6, 0.6]
[[bodies]]
name = "boom"
modes = {}
damping = {{ rule = "modal", value = 0.01 }}
[[bodies.segments]]
shape = "round-bar"
diameter = 0.01
length = 1.5
material = {{ E = 67e9, nu = 0.33, rho = 2840.0 }}
[[joints]]
name = "fly"
kind = "free"
b = {{ body = "hub" }}
[[joints]]
name = "mount"
kind = "fixed"
a = {{ body = "hub", point = [0.1, 0.0, 0.0] }}
b = {{ body = "boom", marker = "root" }}
[[loads]]
name = "thruster"
at = {{ body = "hub" }}
torque = {}
)",
                                 tolerance, modes, axis == "z" ? "[0.0, 0.0, 0.05]" : "[0.0, 0.05, 0.0]"),
                     "spun.toml");
}

std::set<std::string> kinds_of(const RunResult& r) {
  std::set<std::string> kinds;
  for (const Coordinate& c : r.bodies.at(1).body.coordinates) kinds.insert(c.kind);
  return kinds;
}

TEST(Planner, LeavesOutWhatNothingMoves) {
  const RunResult about_z = run_scene(spun_about("z", 1e-4), {});
  EXPECT_EQ(kinds_of(about_z), std::set<std::string>{"bending_y"});
  EXPECT_TRUE(any_has(about_z.plan, "bending_z")) << "the reason";
  EXPECT_TRUE(any_has(about_z.plan, "that nothing moves"));
  EXPECT_EQ(kinds_of(run_scene(spun_about("y", 1e-4), {})), std::set<std::string>{"bending_z"});
}

// The reference has 24 modes and finer elements, and is a thousand times tighter.
TEST(Planner, WhatIsSaidToBeMetIsMet) {
  Scene full = spun_about("z", 1e-9, "24");
  full.bodies[1].directions = "all";
  full.bodies[1].stiffening = "on";
  full.bodies[1].geometry.order = 8;
  full.error_budget = false;
  const OutputTable reference = run_scene(full, {}).outputs;
  int before = 0;
  for (const double tolerance : {1e-2, 1e-3, 1e-4, 1e-5}) {
    const RunResult r = run_scene(spun_about("z", tolerance), {});
    ASSERT_TRUE(r.budget.within(tolerance)) << tolerance;
    EXPECT_LE(largest(compare_outputs(r.outputs, reference, r.scene.outputs)), tolerance);
    EXPECT_GE(r.bodies.at(1).body.n(), before);
    before = r.bodies.at(1).body.n();
  }
  EXPECT_GT(before, 1);
}

TEST(Planner, ARunGoesOnToBetterModelsUntilTheBudgetIsMet) {
  Scene scene = spun_about("z", 1e-6);
  scene.bodies[1].geometry.order = 1;  // elements that are too coarse
  scene.bodies[1].geometry.segments[0].elements = 8;
  const RunResult r = run_scene(scene, {});
  EXPECT_TRUE(any_has(r.plan, "finer elements"));
  EXPECT_GT(r.scene.bodies[1].geometry.order, 1);
  EXPECT_LT(r.budget.discretisation, 1e-2);
}

/// Wires on pivots that a slow push moves; they are stiff by their spin alone. Bodies get these keys.
Scene pushed_wires(const std::string& keys) {
  std::string text(builtin_scene("wire-spinner"));
  const auto with = [&text](const std::string& old, const std::string& now) {
    for (size_t at = 0; (at = text.find(old, at)) != std::string::npos; at += now.size())
      text.replace(at, old.size(), now);
  };
  with("duration = 60.0", "duration = 12.0");
  with("modes = 8\n", keys);
  with("elements = 8\n", "");
  with("start = [0.0, 0.02]", "start = [0.0, 0.0]"), with("start = [0.0, -0.02]", "start = [0.0, 0.0]");
  with("tolerance = 1e-6\nbudget = false", "tolerance = 1e-2\noutputs = [\"hub.rate\", \"east.angle1\"]");
  text += R"---(
[[loads]]
name = "thruster"
at = { body = "hub" }
torque = ["0.3 * exp(-(t - 5)^2 / 4)", "0", "0.5 * exp(-(t - 6)^2 / 4)"]
)---";
  return parse_scene(text, "pushed.toml");
}

// Clamped modes of a wire are those of its material, which is next to nothing beside its tension.
TEST(Planner, WiresThatSpinGetTheModesOfTheirMotion) {
  const RunResult planned = run_scene(pushed_wires("modes = \"auto\"\n"), {});
  EXPECT_TRUE(any_has(planned.plan, "basis of east, north, west, south: \"prestressed\""));
  EXPECT_TRUE(planned.budget.within(1e-2));
  for (size_t i = 1; i < planned.bodies.size(); ++i) EXPECT_LE(planned.bodies[i].body.n(), 6);
  Scene full = pushed_wires("modes = 16\nbasis = \"prestressed\"\n");
  full.error_budget = false, full.tolerance = 1e-7;
  EXPECT_LE(largest(compare_outputs(planned.outputs, run_scene(full, {}).outputs, planned.scene.outputs)), 1e-2);

  Scene said = pushed_wires("modes = \"auto\"\nbasis = \"clamped\"\n");
  said.error_budget = false, said.duration = 1;
  const RunResult clamped = run_scene(said, {});
  EXPECT_FALSE(any_has(clamped.plan, "basis of"));
  EXPECT_EQ(clamped.scene.bodies[1].basis.name, "clamped");
}

// The load of a joint converges as 1 / n with the modes of a free body. Its static shapes stand for the rest: in what
// is planned, and in what shows the truncation of a body without them.
/// A torque sets in at once: what the mount carries then lacks the effective mass of the modes left out.
TEST(Planner, NoMoreModesAreTriedForAForceThatIsThereAtOnce) {
  Scene scene = spun_about("z", 1e-4);
  scene.outputs = {"boom.tip", "mount.force"};
  scene.joints.back().loads = true;
  const RunResult r = run_scene(scene, {});
  EXPECT_TRUE(any_has(r.plan, "in mount.force; more modes are not tried: it is there at the start"));
  EXPECT_FALSE(any_has(r.plan, "in mount.force; modes are chosen again"));
  EXPECT_EQ(r.budget.worst()->name, "mount.force");
  const auto tip = std::ranges::find(r.budget.outputs, "boom.tip", &OutputErrors::name);
  ASSERT_NE(tip, r.budget.outputs.end());
  EXPECT_LT(tip->total(), scene.tolerance);
}

TEST(Planner, BodiesUnderMeanAxesHaveStaticShapesOfTheirJoints) {
  const auto swung = [](const std::string& modes, double tolerance) {
    Scene scene = spun_about("z", tolerance, modes);
    scene.bodies[1].basis.name = "mean-axis", scene.bodies[1].directions = "all";
    scene.bodies[1].damping = {.name = "rayleigh", .beta = 1e-4};
    scene.joints[1].kind = JointKind::hinge, scene.joints[1].mechanism.stiffness = 5;
    return scene;
  };
  Scene full = swung("40", 1e-9);
  full.error_budget = false;
  full.bodies[1].basis.corrections = static_shapes_at("root");
  const OutputTable reference = run_scene(full, {}).outputs;
  const auto true_error = [&](const RunResult& r) {
    return largest(compare_outputs(r.outputs, reference, r.scene.outputs));
  };
  const RunResult planned = run_scene(swung("\"auto\"", 1e-3), {});
  EXPECT_TRUE(planned.budget.within(1e-3));
  EXPECT_LE(true_error(planned), 1e-3);
  EXPECT_TRUE(any_has(planned.plan, "of basis \"mean-axis\""));
  EXPECT_LE(planned.bodies[1].body.n(), 18);
  const RunResult without = run_scene(swung("18", 1e-4), {});
  const double ratio = without.budget.total() / true_error(without);
  EXPECT_GT(ratio, 0.5);
  EXPECT_LT(ratio, 30);
}

TEST(Planner, AnOutputWithALooserAccuracyTakesFewerModes) {
  const auto flown = [](const std::string& tip) {
    Scene scene = spun_about("z", 1e-5);
    scene.outputs = {"fly.rotation", "boom.tip" + tip};
    return run_scene(scene, {});
  };
  const RunResult strict = flown(""), loose = flown(" 1e-2"), absolute = flown(" 1e-2 m");
  EXPECT_LT(loose.bodies.at(1).body.n(), strict.bodies.at(1).body.n());
  EXPECT_TRUE(strict.budget.within(1e-5));
  EXPECT_TRUE(loose.budget.within(1e-5));
  EXPECT_LE(absolute.bodies.at(1).body.n(), loose.bodies.at(1).body.n());
  for (const RunResult* r : {&loose, &absolute}) {
    const OutputTable &few = r->outputs, &many = strict.outputs;
    EXPECT_LE(largest(compare_outputs(few, many, {"fly.rotation"})), 1e-5);
    EXPECT_GT(largest(compare_outputs(few, many, {"boom.tip"})), 1e-5);
  }
  EXPECT_LE(largest(compare_outputs(loose.outputs, strict.outputs, {"boom.tip"})), 1e-2);
}

// The panel's root is beside the mass centre, so its reaction rolls the hub. Torsion then moves mass, but not the axis.
TEST(Planner, TorsionThatTheRootExcitesIsKept) {
  Scene scene = load_scene("flexible-appendage");
  scene.bodies[1].modes_auto = true;
  scene.tolerance = 1e-3;
  scene.duration = 20;  // after 60 s frequencies that depend on the amplitude are worth 1.7e-3
  const RunResult r = run_scene(scene, {});
  EXPECT_GT(std::ranges::count(r.bodies[1].body.coordinates, "torsion", &Coordinate::kind), 0);
  EXPECT_TRUE(r.budget.within(1e-3));
}

TEST(Planner, WithoutABudgetCandidatesAreEnoughWhereFewerAre) {
  Scene easy = spun_about("z", 1e-2), hard = spun_about("z", 1e-12);
  easy.error_budget = hard.error_budget = false;
  const RunResult r = run_scene(easy, {});
  EXPECT_FALSE(any_has(r.plan, "chosen again"));
  EXPECT_FALSE(any_has(r.warnings, "may be too few"));
  const RunResult all = run_scene(hard, {});
  EXPECT_TRUE(any_has(all.plan, "chosen again, from 24"));
  EXPECT_TRUE(any_has(all.plan, "no more of bending_z"));
  EXPECT_TRUE(any_has(all.warnings, "the modes may be too few for 1.0e-12"));
}

// What symmetry keeps still is no part of what more modes would change, so a budget without it is the same.
TEST(Planner, WhatNothingMovesIsNoPartOfTheTruncation) {
  Scene scene = spun_about("z", 1e-4, "2");
  scene.bodies[1].directions = "all";
  std::vector<std::string> plan;
  flexboom::Run one = run_once(scene, {}), other = one;
  const double all = measure_budget(scene, one, {}, plan).truncation;
  const double moving = measure_budget(scene, other, {}, plan, {{"boom", {"bending_z", "torsion"}}}).truncation;
  EXPECT_GT(all, 1e-6);
  EXPECT_NEAR(moving, all, 1e-3 * all);
  const double none = measure_budget(scene, other, {}, plan, {{"boom", {"bending_y"}}}).truncation;
  EXPECT_GT(std::abs(none - all), 0.1 * all) << "a kind that moves is missed";
}

// A torque along a bar twists it. Geometric stiffness makes it shorter then, which moves the hub by its axial mode: a
// kind that nothing moves without. A scene that leaves the stiffness open has it, and the modes, or says what is
// missing.
/// A bar on a boom that a torque twists: without geometric stiffness nothing moves the hub along.
Scene twisted(const std::string& modes) {
  Scene scene = spun_about("z", 1e-3, modes);
  scene.duration = 0.5, scene.output_step = 0.005, scene.outputs = {"fly.velocity"};
  BodyScene& boom = scene.bodies[1];
  boom.directions = "all", boom.directions_given = true;
  boom.geometry.attachments.push_back(
      {.name = "bar", .position = 0.9, .mass = 0.01, .inertia = Eigen::Vector3d(1e-4, 5e-5, 5e-5).asDiagonal()});
  scene.loads[0].at = {.body = "boom", .marker = "bar"};
  scene.loads[0].torque = {};
  scene.loads[0].torque[0].expression = "1e-2*(t<0.2)";
  return scene;
}

TEST(Planner, GeometricStiffnessCouplesKindsOfModes) {
  const Scene scene = twisted("\"auto\"");
  const RunResult r = run_scene(scene, {});
  EXPECT_EQ(r.scene.bodies[1].stiffening, "on") << "a plan that is kept has it";
  EXPECT_TRUE(kinds_of(r).contains("axial"));
  Scene full = scene;
  full.tolerance = 1e-8, full.error_budget = false;
  full.bodies[1].modes_auto = false, full.bodies[1].modes = 90, full.bodies[1].stiffening = "on";
  const double error = largest(compare_outputs(r.outputs, run_scene(full, {}).outputs, scene.outputs, {}));
  EXPECT_GT(r.budget.total(), error);
  EXPECT_LT(r.budget.total(), 3 * error) << error;
}

/// Repeats in relative coordinates find that stiffness counts: the run by multipliers that is kept has it.
TEST(Planner, GeometricStiffnessIsSwitchedOnByMultipliersToo) {
  Scene scene = twisted("18");
  scene.duration = 0.1, scene.formulation = "multipliers";
  const RunResult r = run_scene(scene, {});
  EXPECT_EQ(r.motion.summary.method, "ida");
  EXPECT_TRUE(r.budget.has_stiffened);
  EXPECT_EQ(r.scene.bodies[1].stiffening, "on");
  EXPECT_EQ(r.tree->stiffening(1), Stiffening::on);
  EXPECT_LT(r.budget.time, 1e-3) << "no part of what stiffness changes";
}

TEST(Planner, ThePlanIsPartOfTheSceneThatWasRun) {
  const RunResult r = run_scene(spun_about("z", 1e-3), {});
  EXPECT_FALSE(r.scene.bodies[1].modes_auto);
  ASSERT_FALSE(r.scene.bodies[1].shapes.empty());
  Scene again = parse_scene(to_toml(r.scene), "again.toml");
  EXPECT_EQ(again.bodies[1].shapes, r.scene.bodies[1].shapes);
  const RunResult other = run_scene(again, {});
  EXPECT_EQ(other.outputs.values, r.outputs.values);
  EXPECT_EQ(other.budget.time, r.budget.time);  // measured by a flight that the choice has made, or by one of its own
  EXPECT_GT(r.budget.time, 0);
}

TEST(Planner, TheFormulationChangesNoChoice) {
  Scene scene = spun_about("z", 1e-3);
  scene.error_budget = false;
  const RunResult relative = run_scene(scene, {});
  scene.formulation = "multipliers";
  const RunResult by_multipliers = run_scene(scene, {});
  EXPECT_EQ(by_multipliers.scene.formulation, "multipliers");
  EXPECT_EQ(by_multipliers.motion.summary.method, "ida");
  EXPECT_EQ(by_multipliers.scene.bodies[1].shapes, relative.scene.bodies[1].shapes);
}

TEST(Planner, PlansWhatSaysNothingOfModes) {
  std::string text = to_toml(spun_about("z", 1e-3));
  const std::string key = "modes = \"auto\"";
  ASSERT_NE(text.find(key), std::string::npos);
  text.erase(text.find(key), key.size());
  const RunResult r = run_scene(parse_scene(text, "silent.toml"), {});
  EXPECT_EQ(r.scene.bodies[1].shapes, run_scene(spun_about("z", 1e-3), {}).scene.bodies[1].shapes);
  EXPECT_FALSE(r.scene.bodies[1].shapes.empty());
}

TEST(Shapes, AreSomeOfTheModes) {
  Scene scene = spun_about("z", 1e-4, "6\nshapes = [1, 4]");
  const ReducedBody some = prepare_body(scene.bodies[1]).body;
  scene.bodies[1].shapes.clear();
  const ReducedBody all = prepare_body(scene.bodies[1]).body;
  ASSERT_EQ(some.n(), 2);
  EXPECT_EQ(some.Ke(1, 1), all.Ke(3, 3));
  EXPECT_EQ(some.De(1, 1), all.De(3, 3));
}

TEST(Shapes, AreCheckedAgainstTheModes) {
  const auto fault = [](const std::string& modes) -> std::string {
    try {
      validate(spun_about("z", 1e-4, modes));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(fault("3\nshapes = [1, 4]").find("shapes: has 4, but modes = 3"), std::string::npos);
  EXPECT_NE(fault("3\nshapes = [2, 1]").find("shapes: has 1; it must be ascending"), std::string::npos);
  EXPECT_NE(fault("\"auto\"\nshapes = [1]")
                .find("shapes: are some of the modes; their number must stand in \"modes\" beside it"),
            std::string::npos);
}

}  // namespace
}  // namespace flexboom
