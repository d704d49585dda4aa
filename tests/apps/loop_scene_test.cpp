// Scenes by multipliers: closed loops, what is refused, and the same results as in relative coordinates.

#include "tests/apps/run_testing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// A planar four-bar of spatial hinges: crank 1 m, coupler 3 m, rocker 2.5 m, ground 3 m. The last hinge closes it.
const char* const four_bar = R"toml(format = "flexboom-scene-1"
name = "four-bar"
duration = 3
output_step = 0.05
accuracy = { tolerance = 1e-9, budget = false }
integrator = { formulation = "multipliers" }
[[bodies]]
name = "crank"
mass = 1
centre = [0.5, 0, 0]
inertia = [1e-3, 0.0833, 0.0833]
[[bodies]]
name = "coupler"
mass = 2
centre = [1.5, 0, 0]
inertia = [1e-3, 1.5, 1.5]
[[bodies]]
name = "rocker"
mass = 1.5
centre = [1.25, 0, 0]
inertia = [1e-3, 0.78, 0.78]
[[joints]]
name = "drive"
kind = "hinge"
b = { body = "crank" }
motion = "0.6 + 2*t"
[[joints]]
name = "knee"
kind = "hinge"
a = { body = "crank", point = [1, 0, 0] }
b = { body = "coupler" }
[[joints]]
name = "pivot"
kind = "hinge"
a = { point = [3, 0, 0] }
b = { body = "rocker" }
start = 1.3
[[joints]]
name = "pin"
kind = "hinge"
a = { body = "coupler", point = [3, 0, 0] }
b = { body = "rocker", point = [2.5, 0, 0] }
closes_loop = true
)toml";

std::string with(std::string text, const std::string& old, const std::string& replacement) {
  const size_t at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  return text.replace(at, old.size(), replacement);
}

RunResult run(const std::string& text) { return run_scene(parse_scene(text, "scene.toml"), {}); }

/// The error of a kind that the program tells by its exit code.
template <class Error>
std::string error_of(const std::string& text) {
  try {
    run(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(LoopScene, FourBarFliesAndNamesItsRedundantRows) {
  const RunResult r = run(four_bar);
  ASSERT_EQ(r.warnings.size(), 1u);
  EXPECT_EQ(r.warnings[0].find("3 constraint rows"), 0u) << r.warnings[0];
  EXPECT_NE(r.warnings[0].find("joint \"pin\": tilt about x"), std::string::npos) << r.warnings[0];
  EXPECT_TRUE(std::any_of(r.plan.begin(), r.plan.end(), [](const std::string& line) {
    return line == "joint pivot: starts at 1.52277, not 1.3, so that the loops close";
  }));
  EXPECT_LT(r.motion.summary.constraint_drift, 1e-12);
  EXPECT_LT(r.motion.summary.energy_balance, 1e-7);
  // The rocker by triangles: from the crank's tip to the pivot, then coupler and rocker on it (upper branch).
  const VectorXd t = column(r, "t"), pivot = column(r, "pivot.angle");
  for (Index i = 0; i < t.size(); ++i) {
    const double x = 3 - std::cos(0.6 + 2 * t[i]), y = -std::sin(0.6 + 2 * t[i]), e = std::hypot(x, y);
    const double along = (e * e + 9 - 6.25) / (2 * e), up = std::sqrt(9 - along * along);
    const double rocker = std::atan2((along * y + up * x) / e - y, (along * x - up * y) / e - x);
    EXPECT_NEAR(std::remainder(pivot[i] - rocker, 2 * std::numbers::pi), 0, 1e-11) << i;
  }
}

/// A tube clamped at its root. Its tip slides across, on a rail in the inertial frame.
constexpr const char* guided = R"toml(
format = "flexboom-scene-1"
name = "guided"
duration = 0.3
output_step = 0.005
accuracy = { tolerance = 1e-4, budget = false }
integrator = { formulation = "multipliers" }
[[bodies]]
name = "tube"
modes = 2
corrections = ["tip.Fx", "tip.Fy", "tip.Mz"]
damping = { rule = "modal", value = 0.1 }
[[bodies.segments]]
shape = "tube"
diameter = 0.02
thickness = 0.001
length = 2.0
material = { E = 70e9, nu = 0.33, rho = 2700 }
[[joints]]
name = "wall"
kind = "fixed"
loads = true
b = { body = "tube", marker = "root" }
[[joints]]
name = "rail"
kind = "slider"
a = { point = [2.0, 0.0, 0.0], x = [1.0, 0.0, 0.0], z = [0.0, 1.0, 0.0] }
b = { body = "tube", marker = "tip", x = [1.0, 0.0, 0.0], z = [0.0, 1.0, 0.0] }
closes_loop = true
[[loads]]
name = "push"
at = { body = "tube", marker = "tip" }
axes = "inertial"
force = ["0", "6*sin(6*t)", "0"]
)toml";

// Bent, the tube would get shorter by 0.6 w^2 / L, and the rail does not let it. Nothing but that pulls it.
TEST(LoopScene, WhatALoopKeepsFromGettingShorterIsPulled) {
  const RunResult r = run(guided);
  const VectorXd w = column(r, "tube.tip.y"), pull = column(r, "wall.force.x");
  Index at = 0;
  const double most = w.cwiseAbs().maxCoeff(&at);
  const double EA = 70e9 * std::numbers::pi * 0.019 * 0.001;
  EXPECT_GT(most, 0.01);
  EXPECT_NEAR(std::abs(pull[at]) / (EA * 0.6 * most * most / 4), 1, 0.1);  // the shape is that of a static bend nearly
}

// Two tubes at right angles, a stiff spring between their tips: no joint closes a loop, and yet the one pulls the
// other.
TEST(LoopScene, SpringsBetweenTipsHoldBodiesAtBothEnds) {
  const std::string across = R"toml(
[[bodies]]
name = "mast"
modes = 2
corrections = ["tip.Fx", "tip.Fy"]
damping = { rule = "modal", value = 0.1 }
[[bodies.segments]]
shape = "tube"
diameter = 0.02
thickness = 0.001
length = 2.0
material = { E = 70e9, nu = 0.33, rho = 2700 }
[[joints]]
name = "ground"
kind = "fixed"
a = { point = [2.0, -2.0, 0.0], x = [0.0, 1.0, 0.0] }
b = { body = "mast", marker = "root" }
[[springs]]
name = "tie"
a = { body = "tube", marker = "tip" }
b = { body = "mast", marker = "tip" }
free_length = 0.0
stiffness = 1e5
)toml";
  std::string text = with(guided, "integrator = { formulation = \"multipliers\" }\n", "");
  text = text.substr(0, text.find("[[joints]]\nname = \"rail\"")) + text.substr(text.find("[[loads]]")) + across;
  const RunResult r = run(text);
  for (const char* body : {"tube", "mast"})
    EXPECT_TRUE(std::ranges::any_of(r.plan, [&](const std::string& line) {
      return line.starts_with(std::string(body) + ": geometric stiffness on (stiffening = \"auto\")");
    })) << body;
}

// A closed loop with beams that can bend: what the start does not close, their bending does.
TEST(LoopScene, StartsThatBendABodyAreTold) {
  const RunResult r = run(with(guided, "point = [2.0, 0.0, 0.0]", "point = [1.999, 0.0, 0.0]"));
  EXPECT_TRUE(std::ranges::any_of(r.plan, [](const std::string& line) {
    return line.starts_with("body tube: starts bent, its \"tip\" by 0.001 m, so that the loops close");
  }));
}

// The angle of the hinge that closes the loop is no state of the tree: the file says which turn it is in.
TEST(LoopScene, FourBarIsTheSameRunInTwoFlights) {
  const std::string sprung = with(four_bar, "closes_loop = true", "closes_loop = true\nstiffness = 2");
  const RunResult whole = run(sprung), first = run(with(sprung, "duration = 3", "duration = 1.2"));
  const RunResult later = run_scene(going_on(parse_scene(sprung, "scene.toml"), first), {});
  for (const char* name : {"pivot.angle", "pin.angle", "pin.rate", "energy.elastic", "energy.work"}) {
    const VectorXd a = column(whole, name).tail(30), b = column(later, name).tail(30);
    EXPECT_LT((a - b).cwiseAbs().maxCoeff() / a.cwiseAbs().maxCoeff(), 1e-6) << name;
  }
}

TEST(LoopScene, LockingLoopIsANumericalErrorThatNamesTheJoint) {
  std::string text = with(four_bar, "centre = [0.5, 0, 0]", "centre = [1, 0, 0]");
  text = with(with(text, "a = { body = \"crank\", point = [1, 0, 0] }", "a = { body = \"crank\", point = [2, 0, 0] }"),
              "a = { point = [3, 0, 0] }", "a = { point = [2, 0, 0] }");
  text = with(with(text, "point = [3, 0, 0] }", "point = [1.5, 0, 0] }"), "point = [2.5, 0, 0]", "point = [1.5, 0, 0]");
  text = with(with(text, "0.6 + 2*t", "0.5 + t"), "1e-9", "1e-7");
  text = with(with(text, "b = { body = \"coupler\" }", "b = { body = \"coupler\" }\nstart = -0.6"), "start = 1.3",
              "start = 0.6");
  const std::string error = error_of<NumericalError>(text);
  EXPECT_NE(error.find("joint \"pin\" locks at t = 1.1"), std::string::npos) << error;
}

TEST(LoopScene, LoopThatCannotCloseIsAnInputErrorThatNamesTheJoint) {
  const std::string error = error_of<InputError>(with(four_bar, "point = [2.5, 0, 0]", "point = [0.5, 0, 0]"));
  EXPECT_NE(error.find("joint \"pin\""), std::string::npos) << error;
  EXPECT_NE(error.find("does not close"), std::string::npos) << error;
}

TEST(LoopScene, WhatMultipliersCannotDoIsRefusedWithItsPlace) {
  const struct {
    const char *old, *replacement, *words;
  } cases[] = {
      {"formulation = \"multipliers\"", "formulation = \"relative\"", "joints[3].closes_loop: is true: a loop needs"},
      {"formulation = \"multipliers\"", "formulation = \"multiplier\"", "did you mean \"multipliers\"?"},
      {"formulation = ", "method = \"bdf\", formulation = ",
       "integrator.method: is \"bdf\"; it must be \"auto\" or \"ida\""},
      {"formulation = ", "rescale_at_events = true, formulation = ", "integrator.rescale_at_events: is true"},
      {"mass = 2", "mass = 2\nstiffening = \"on\"", "stiffening: "},
      {"closes_loop = true", "closes_loop = true\nstart = 1", "the start of the joint follows from the others"},
      {"b = { body = \"rocker\", point", "b = { body = \"coupler\", point", "a joint is between two bodies"},
  };
  for (const auto& c : cases) {
    const std::string fault = error_of<InputError>(with(four_bar, c.old, c.replacement));
    EXPECT_EQ(fault.find("scene.toml:"), 0u) << fault;
    EXPECT_NE(fault.find(c.words), std::string::npos) << c.replacement << "\n" << fault;
  }
  Scene sport = load_scene("sport");
  sport.formulation = "multipliers";
  sport.orbit->gravity = "differential";
  EXPECT_NO_THROW(validate(sport));
  sport.rescale_at_events = true;
  EXPECT_THROW(validate(sport), InputError);
}

/// Every kind of joint, its motion, drive, stop and loads; spring, load, wheel, gravity.
const char* const every_kind = R"toml(format = "flexboom-scene-1"
name = "everything"
duration = 0.5
gravity = [0, 0, -9.81]
accuracy = { tolerance = 1e-8, budget = false }
[[bodies]]
name = "hub"
mass = 8.5
inertia = [0.1, 0.12, 0.05]
centre = [0, 0, 0.1]
[[bodies]]
name = "arm"
stiffening = "on"
modes = 2
damping = { rule = "modal", value = 0.02 }
[[bodies.segments]]
shape = "tube"
diameter = 0.02
thickness = 0.001
length = 0.5
material = { E = 7e10, nu = 0.3, rho = 2700 }
[[bodies]]
name = "hook"
mass = 1
inertia = [1e-2, 1e-2, 1e-2]
[[bodies]]
name = "ball"
mass = 1
inertia = [1e-2, 1e-2, 1e-2]
[[bodies]]
name = "stone"
mass = 0.5
inertia = [1e-2, 2e-2, 3e-2]
[[joints]]
name = "lift"
kind = "slider"
a = { point = [1, 0, 0], x = [0, 1, 0], z = [1, 0, 0] }
b = { body = "hub" }
stiffness = 100
rest = 0.1
damping = 2
stop_stiffness = 1e4
threshold = 0.06
drive = "2*sin(t)"
start = 0.05
start_rate = 0.1
loads = true
[[joints]]
name = "shoulder"
kind = "hinge"
a = { body = "hub", point = [0, 0, 0.2], x = [0.6, 0.8, 0] }
b = { body = "arm", marker = "root" }
motion = { profile = "trapezoid", angle = 1.5, peak_rate = 5, peak_acceleration = 50 }
loads = true
[[joints]]
name = "wrist"
kind = "universal"
a = { body = "arm", marker = "tip" }
b = { body = "hook" }
start = [0.3, -0.4]
start_rate = [1, 2]
loads = true
[[joints]]
name = "string"
kind = "spherical"
a = { body = "hub", point = [0, 0.3, 0] }
b = { body = "ball", point = [0, 0, 0.2] }
start_attitude = [0.6, 0.8, 0, 0]
start_omega = [0.1, 0.2, 0.3]
loads = true
[[joints]]
name = "flight"
kind = "free"
a = { point = [0, 0, 1], x = [0, 1, 0] }
b = { body = "stone", point = [0.1, 0, 0] }
start_attitude = [0.6, 0, 0.8, 0]
start_omega = [1, 2, 3]
start_position = [0.1, 0.2, 0.3]
start_velocity = [0, 1, 0]
[[springs]]
name = "tether"
a = { body = "ball" }
b = { body = "ground", point = [1, 1, 1] }
stiffness = 3
free_length = 0.1
damping = 0.2
[[loads]]
name = "push"
at = { body = "arm", marker = "tip" }
force = [0, "exp(-t)", 1.5]
[[wheels]]
name = "wheel"
body = "hub"
axis = [0, 1, 0]
inertia = 0.01
spin = 100
torque = "0.1*t"
)toml";

TEST(LoopScene, EveryKindOfJointFliesAsInRelativeCoordinates) {
  const RunResult relative = run(every_kind);
  const RunResult redundant =
      run(with(every_kind, "duration", "integrator = { formulation = \"multipliers\" }\nduration"));
  ASSERT_EQ(redundant.outputs.names, relative.outputs.names);
  ASSERT_EQ(redundant.outputs.values.rows(), relative.outputs.values.rows());
  for (const OutputDifference& d : compare_outputs(redundant.outputs, relative.outputs, {}))
    EXPECT_LT(d.error, 1e-6) << d.name;  // loads follow the accelerations
  const double energy = column(relative, "energy.kinetic").maxCoeff();
  for (const char* name : {"energy.kinetic", "energy.elastic", "energy.potential", "energy.dissipated", "energy.work"})
    EXPECT_LT((column(redundant, name) - column(relative, name)).cwiseAbs().maxCoeff(), 1e-7 * energy) << name;
  ASSERT_GT(redundant.motion.events.size(), 0u);
  ASSERT_EQ(redundant.motion.events.size(), relative.motion.events.size());
  for (size_t i = 0; i < redundant.motion.events.size(); ++i)
    EXPECT_NEAR(redundant.motion.events[i].time, relative.motion.events[i].time, 1e-7);
}

}  // namespace
}  // namespace flexboom
