// What a run says of its motion: momenta, tips, functions of time that have no value.

#include "tests/apps/reduced_testing.hpp"
#include "tests/apps/run_testing.hpp"
#include "tests/apps/scene_testing.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace flexboom {
namespace {

/// Drift of the momenta in a short flight of this scene.
double drift(const std::string& text, const std::string& formulation = "relative") {
  Scene scene = parse_scene(text, "drift.toml");
  scene.formulation = formulation;
  scene.error_budget = false;
  scene.duration = 0.05;
  return run_scene(scene, {}).motion.summary.momentum_drift;
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

// What a joint does to its body has the motor in it: here that is all that turns or pushes it.
TEST(JointLoads, HaveTheDriveInThem) {
  for (const char* formulation : {"relative", "multipliers"})
    for (const char* kind : {"hinge", "slider"}) {
      Scene scene = parse_scene(fmt::format(R"toml(format = "flexboom-scene-1"
name = "motor"
duration = 1.0
output_step = 0.05
accuracy = {{ tolerance = 1e-9, budget = false }}
[[bodies]]
name = "arm"
mass = 2.0
inertia = [0.1, 0.2, 0.3]
centre = [0.5, 0, 0]
[[joints]]
name = "motor"
kind = "{}"
b = {{ body = "arm" }}
drive = "sin(3*t)"
loads = true
)toml",
                                            kind),
                                "motor.toml");
      scene.formulation = formulation;
      const RunResult r = run_scene(scene, {});
      const std::string load = kind == std::string("hinge") ? "motor.torque.z" : "motor.force.z";
      const Eigen::VectorXd drive = (3 * column(r, "t").array()).sin();
      EXPECT_LT((column(r, load) - drive).cwiseAbs().maxCoeff(), 1e-12) << formulation << " " << kind;
    }
}

// Loads of joints are made of accelerations, which methods of low order know worst.
TEST(JointLoads, KeepTenTolerancesWithoutABudgetByEveryMethod) {
  Scene scene = parse_scene(R"toml(format = "flexboom-scene-1"
name = "stop"
duration = 1.5
output_step = 0.005
accuracy = { tolerance = 1e-10, budget = false }
[[bodies]]
name = "hub"
mass = 20
inertia = [1, 1.2, 0.8]
[[bodies]]
name = "boom"
modes = 4
directions = "all"
stiffening = "on"
damping = { rule = "modal", value = 0.01 }
[[bodies.segments]]
shape = "tube"
diameter = 0.01
thickness = 0.001
length = 1.2
material = { E = 7e10, nu = 0.33, rho = 2700 }
[[joints]]
kind = "free"
b = { body = "hub" }
[[joints]]
name = "h"
kind = "hinge"
a = { body = "hub", point = [0.2, 0.1, 0.0] }
b = { body = "boom", marker = "root" }
stiffness = 1.0
rest = 0.5
damping = 0.02
stop_stiffness = 200
threshold = 0.3
start = -0.4
loads = true
)toml",
                            "stop.toml");
  const RunResult reference = run_scene(scene, {});
  scene.tolerance = 1e-7;
  for (const auto& [formulation, method] : {std::pair("relative", "bdf"),
                                            {"relative", "dirk"},
                                            {"relative", "adams"},
                                            {"relative", "exponential"},
                                            {"multipliers", "ida"}}) {
    scene.formulation = formulation, scene.integrator = method;
    const RunResult r = run_scene(scene, {});
    EXPECT_LT(largest(compare_outputs(r.outputs, reference.outputs, {"h.force", "h.torque"})), 1e-6) << method;
  }
}

std::vector<std::string> names_of_outputs(const Scene& given) {
  Scene scene = given;
  scene.error_budget = false;
  scene.duration = 0.02;
  return run_scene(scene, {}).outputs.names;
}

TEST(Tip, IsFoundWhateverItsSpelling) {
  const Scene plain = parse_scene(swing_on_joints, "plain.toml");
  const std::vector<std::string> names = names_of_outputs(plain);
  for (const char* name : {"tip", "TIP", "Tip", "END", "panel_edge"}) {
    EXPECT_EQ(names_of_outputs(with_reduced(swing_on_joints, called(name))), names) << name;
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

// A function of time that has no value names itself, wherever it is and whoever asks. This one has values at the times
// that a reader looks at, multiples of 1 / 64 of the duration.
// Between the times at which a function is looked at before the run.
TEST(FunctionOfTime, WithoutAValueIsNamed) {
  const struct {
    const char *more, *words;
  } cases[] = {
      {"drive = \"t + 0*log(cos(128679.63509103794*t))\"\n", "joint hinge: drive is "},
      {"motion = \"t + 0*log(cos(128679.63509103794*t))\"\n", "joint hinge: motion is "},
      {"[[loads]]\nname = \"push\"\nat = { body = \"hub\" }\nforce = [0, \"t + 0*log(cos(128679.63509103794*t))\", "
       "0]\n",
       "load push: force[1] is "},
      {"[[loads]]\nname = \"push\"\nat = { body = \"hub\" }\ntorque = [0, 0, \"t + "
       "0*log(cos(128679.63509103794*t))\"]\n",
       "load push: torque[2] is "},
      {"[[wheels]]\nname = \"spin\"\nbody = \"hub\"\ninertia = 1e-3\ntorque = \"t + "
       "0*log(cos(128679.63509103794*t))\"\n",
       "wheel spin: torque is "},
  };
  const std::string without_start = with(swing_on_joints, "start = 0.07\n", "");  // a motion has its own
  for (const char* formulation : {"relative", "multipliers"})
    for (const auto& c : cases) try {
        drift(without_start + c.more, formulation);
        ADD_FAILURE() << c.more;
      } catch (const NumericalError& e) {
        EXPECT_NE(std::string(e.what()).find(c.words), std::string::npos) << formulation << ": " << e.what();
        EXPECT_NE(std::string(e.what()).find("at t = 0.0"), std::string::npos) << e.what();
      }
}

}  // namespace
}  // namespace flexboom
