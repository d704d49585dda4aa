#include "apps/scene/scene.hpp"
#include "apps/simulate/simulate.hpp"
#include "dynamics/numerics/rotation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

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

}  // namespace
}  // namespace flexboom
