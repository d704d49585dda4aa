// What functions of time and loads do to a body, against its momentum and energy.

#include "run_testing.hpp"

#include <fmt/format.h>

#include <string>

namespace flexboom {
namespace {

/// A free body of 2 kg m^2 under a torque, for 20 s, with an output each second.
RunResult turned_by(const std::string& torque, const std::string& method, const std::string& formulation) {
  Scene scene = parse_scene(fmt::format(R"(format = "flexboom-scene-1"
name = "turned"
duration = 20.0
output_step = 1.0
accuracy = {{ tolerance = 1e-9, budget = false }}
[[bodies]]
name = "hub"
mass = 20.0
inertia = [2.0, 2.0, 2.0]
[[joints]]
name = "fly"
kind = "free"
b = {{ body = "hub" }}
[[loads]]
name = "thruster"
at = {{ body = "hub" }}
torque = [0.0, 0.0, {}]
)",
                                        torque),
                            "turned.toml");
  scene.integrator = method, scene.formulation = formulation;
  return run_scene(scene, {});
}

struct Course {
  std::string name, torque;
  double impulse;  // over all of the time [N m s]
};

class TimeCourses : public ::testing::TestWithParam<Course> {};

TEST_P(TimeCourses, NoMethodOverlooksWhatTheyDo) {
  const Course& course = GetParam();
  const auto expect = [&](const std::string& method, const std::string& formulation) {
    const RunResult r = turned_by(course.torque, method, formulation);
    const Eigen::VectorXd rate = column(r, "fly.rate.z");
    EXPECT_NEAR(rate[rate.size() - 1], course.impulse / 2, 1e-8 * course.impulse) << method << ", " << formulation;
    EXPECT_LT(r.motion.summary.steps, 60'000) << method;
  };
  for (const char* method : {"exponential", "adams", "bdf", "dirk", "erk"}) expect(method, "relative");
  expect("auto", "multipliers");
}

// A jump at both ends; one that is on at its first moment; a thousandth of the time between outputs; a smooth one that
// no output sees; a table; a square wave; corners without jumps.
INSTANTIATE_TEST_SUITE_P(
    All, TimeCourses,
    ::testing::Values(
        Course{"Pulse", R"t("0.5*(t > 5.2)*(t < 5.3)")t", 0.05},
        Course{"ClosedPulse", R"t("0.5*(t >= 5.25)*(t <= 5.5)")t", 0.125},
        Course{"ShortPulse", R"t("if(t > 5.2 && t < 5.201, 50, 0)")t", 0.05},
        Course{"SmoothPulse", R"t("exp(-((t - 5.25)/0.03)^2)")t", 0.03 * 1.7724538509055159},
        Course{"Table", R"t({ time = [0, 5.2, 5.3, 5.4, 20], value = [0, 0, 1, 0, 0], interpolation = "linear" })t",
               0.1},
        Course{"SquareWave", R"t("0.1*(sin(pi*t) > 0)")t", 1},
        Course{"Rectified", R"t("abs(sin(pi*t))")t", 40 / 3.1415926535897931}),
    [](const auto& i) { return i.param.name; });

// A load on a stub that rings at some kHz and above, undamped: its power rings, too, and its work must not need steps
// that follow.
TEST(WorkOfLoads, NeedsNoStepsThatFollowWhatRings) {
  Scene scene = parse_scene(R"(format = "flexboom-scene-1"
name = "stub"
duration = 1.0
output_step = 0.01
accuracy = { tolerance = 1e-3, budget = false }
[[bodies]]
name = "hub"
mass = 20.0
inertia = [1.0, 1.0, 1.0]
[[bodies]]
name = "stub"
directions = "all"
modes = 6
[[bodies.segments]]
shape = "round-bar"
diameter = 0.001
length = 0.01
material = { E = 70e9, nu = 0.33, rho = 2700 }
[[joints]]
name = "fly"
kind = "free"
b = { body = "hub" }
[[joints]]
name = "mount"
kind = "fixed"
a = { body = "hub", point = [0.1, 0.0, 0.0] }
b = { body = "stub", marker = "root" }
[[loads]]
name = "push"
at = { body = "stub", marker = "tip" }
force = ["(t > 0.25)*(t < 0.75)*2e-3", "1e-3", "5e-4*t"]
)",
                            "stub.toml");
  scene.integrator = "exponential";
  const RunResult r = run_scene(scene, {});
  EXPECT_LT(r.motion.summary.steps, 200);
  EXPECT_LT(r.motion.summary.energy_balance, scene.tolerance);
  scene.integrator = "dirk";
  const RunResult other = run_scene(scene, {});
  const auto work = [](const RunResult& run) { return column(run, "energy.work").tail(1)[0]; };
  EXPECT_NEAR(work(r), work(other), 2e-3 * work(other));
}

}  // namespace
}  // namespace flexboom
