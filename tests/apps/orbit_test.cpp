#include "apps/scene/scene.hpp"
#include "apps/simulate/simulate.hpp"
#include "dynamics/numerics/rotation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

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

}  // namespace
}  // namespace flexboom
