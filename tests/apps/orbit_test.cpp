#include "apps/accuracy/run_scene.hpp"
#include "apps/scene/scene.hpp"
#include "dynamics/numerics/rotation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Vector3d;

/// A rigid hub that turns with the LVLH frame, leaning from it by its products of inertia alone.
Scene hub_in_orbit(const char* gravity) {
  Scene scene = parse_scene(R"(format = "flexboom-scene-1"
name = "hub"
duration = 2000
output_step = 20
accuracy = { tolerance = 1e-10, budget = false }
orbit = { altitude = 4e5, inclination = 0.9 }
hub = { mass = 8.5, inertia = [[0.10, 0, 0.005], [0, 0.14, 0], [0.005, 0, 0.06]] }
)",
                            "hub");
  scene.orbit->gravity = gravity;
  scene.start_rate = Vector3d(0, -scene.orbit->rate(), 0);
  return scene;
}

OutputTable fly(const Scene& scene) { return run_once(scene, {}).outputs; }

double largest(const OutputTable& table, const std::string& name) {
  const auto column = std::ranges::find(table.names, name) - table.names.begin();
  return table.values.col(column).cwiseAbs().maxCoeff();
}

// About its axis of largest inertia, which is normal to the orbit, a body spins on for ever.
TEST(Orbit, WithoutGravityAHubThatTurnsWithTheFrameStaysInIt) {
  const OutputTable table = fly(hub_in_orbit("none"));
  for (const char* name : {"lvlh.roll", "lvlh.pitch", "lvlh.yaw"}) EXPECT_LT(largest(table, name), 1e-10) << name;
}

// Libration in the plane of the orbit about the principal axes, from rest at `lean` from them.
TEST(Orbit, GravityTurnsALeaningHubToTheVertical) {
  const Scene scene = hub_in_orbit("differential");
  const double difference = std::hypot(0.10 - 0.06, 2 * 0.005);  // of the principal moments in the plane
  const double w = scene.orbit->rate() * std::sqrt(3 * difference / 0.14);
  const double lean = std::atan2(2 * 0.005, 0.10 - 0.06) / 2;
  const double expected = lean * (1 - std::cos(w * scene.duration));
  // The period of a libration of 0.12 rad is longer by 4 x 0.12^2 / 16 of itself.
  EXPECT_NEAR(largest(fly(scene), "lvlh.pitch"), expected, 0.01 * expected);
}

// The hub turns by two radians; its lean is a millionth of that, and steps know nothing of it.
TEST(Orbit, SmallAnglesAgainstTheFrameKeepTheirTolerance) {
  Scene scene = hub_in_orbit("differential");
  scene.hub.inertia(0, 2) = scene.hub.inertia(2, 0) = 1e-7;
  scene.outputs = {"lvlh.pitch"};
  scene.integrator = "erk";
  scene.tolerance = 1e-11;
  const OutputTable exact = run_scene(scene, {}).outputs;
  for (const double tolerance : {1e-2, 1e-3, 1e-4}) {
    scene.tolerance = tolerance;
    const auto error = [&](const OutputTable& table) {
      return compare_outputs(table, exact, scene.outputs).at(0).error;
    };
    const double by_steps = error(fly(scene)), settled = error(run_scene(scene, {}).outputs);
    EXPECT_GT(by_steps, 10 * tolerance);
    EXPECT_LT(settled, 10 * tolerance);
    std::printf("lvlh.pitch: %.1e off by steps alone, %.1e settled\n", by_steps, settled);
  }
  scene.error_budget = true;
  const RunResult r = run_scene(scene, {});
  EXPECT_LT(r.budget.time, r.scene.tolerance);
  EXPECT_LT(compare_outputs(r.outputs, exact, scene.outputs).at(0).error, 2 * r.budget.time);
}

/// A body of a hundred metres, whole or of two that are fixed to each other.
Scene long_body_in_orbit(bool split, double duration) {
  const char* const whole = R"(mass = 1000.0
inertia = [4e6, 6e6, 3e6]
)";
  const char* const parts = R"(mass = 700.0
centre = [-19.285714285714285, 0.0, 0.0]
inertia = [3.5e6, 4532142.857142857, 1582142.8571428573]
[[bodies]]
name = "part"
mass = 300.0
inertia = [5e5, 6e5, 5.5e5]
[[joints]]
name = "weld"
kind = "fixed"
a = { body = "hub", point = [45.0, 0.0, 0.0] }
b = { body = "part" }
)";
  Scene scene = parse_scene(std::string(R"(format = "flexboom-scene-1"
name = "long"
output_step = 20.0
accuracy = { tolerance = 1e-6, outputs = ["hub.rotation", "lvlh.pitch", "hub.position"] }
orbit = { altitude = 5e5, inclination = 1.2, gravity = "differential" }
[[joints]]
kind = "free"
b = { body = "hub" }
start_omega = [0.0003, -0.0011, 0.0002]
[[bodies]]
name = "hub"
)") + (split ? parts : whole),
                            "long");
  scene.duration = duration;
  return scene;
}

// Gravity is linear within a body, so a body of two parts knows more of it. The budget has the difference. It grows
// from orbit to orbit, as phases do.
TEST(Orbit, WhatGravityWithinABodyLeavesOutIsInTheBudget) {
  const std::pair<double, const char*> flights[] = {{6000, "relative"}, {6000, "multipliers"}, {60000, "relative"}};
  for (const auto& [duration, formulation] : flights) {
    Scene one = long_body_in_orbit(false, duration), two = long_body_in_orbit(true, duration);
    one.formulation = two.formulation = formulation, two.error_budget = false;
    const RunResult whole = run_scene(one, {}), parts = run_scene(two, {});
    EXPECT_FALSE(whole.budget.within(1e-6));
    for (const OutputDifference& d : compare_outputs(whole.outputs, parts.outputs, whole.scene.outputs)) {
      const auto said = std::ranges::find(whole.budget.outputs, d.name, &OutputErrors::name);
      ASSERT_NE(said, whole.budget.outputs.end());
      std::printf("%s, %g s, %s: %.1e, said to be %.1e\n", formulation, duration, d.name.c_str(), d.error,
                  said->linearisation);
      EXPECT_GT(d.error * d.scale, 1e-6 * d.size) << d.name;
      EXPECT_GT(said->linearisation * said->scale, d.error * d.scale) << d.name;
      // A pull along the path that turns with the body averages out, and is bounded as if it did not.
      if (d.name == "hub.position") continue;
      EXPECT_LT(said->linearisation * said->scale, 60 * d.error * d.scale) << d.name;
    }
  }
}

// Geometric stiffness is looked at when a drive is largest: not beyond the end, where an orbit with J2 is not known.
TEST(Orbit, WithJ2ATableGoesOnBeyondTheEnd) {
  const RunResult r = run_scene(parse_scene(R"(format = "flexboom-scene-1"
name = "table"
duration = 0.5
output_step = 0.1
accuracy = { tolerance = 1e-3, budget = false }
orbit = { altitude = 5e5, J2 = true, gravity = "differential" }
[[bodies]]
name = "hub"
mass = 20
inertia = [1.0, 1.2, 0.9]
[[bodies]]
name = "boom"
segments = [{ shape = "round-bar", diameter = 0.01, length = 1.2, material = { E = 70e9, nu = 0.33, rho = 2700 } }]
[[joints]]
kind = "free"
b = { body = "hub" }
[[joints]]
kind = "fixed"
a = { body = "hub" }
b = { body = "boom", marker = "root" }
[[wheels]]
name = "wheel"
body = "hub"
inertia = 0.02
torque = { time = [0, 0.4, 3, 6], value = [0.02, 0.02, -0.05, 0.0], interpolation = "linear" }
)",
                                            "table"),
                                {});
  EXPECT_EQ(r.motion.time.back(), 0.5);
}

}  // namespace
}  // namespace flexboom
