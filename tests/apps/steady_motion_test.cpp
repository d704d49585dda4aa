// The motion for which bodies of basis "prestressed" are made.

#include "apps/simulate/steady_motion.hpp"

#include "tests/apps/run_testing.hpp"
#include "tests/apps/scene_testing.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace flexboom {
namespace {

Scene wires(int modes, const std::string& basis) {
  std::string text(builtin_scene("wire-spinner"));
  for (size_t at = 0; (at = text.find("modes = 8", at)) != std::string::npos; at += basis.size())
    text.replace(at, 9, fmt::format("modes = {}\nbasis = \"{}\"", modes, basis));
  return parse_scene(text, "wires.toml");
}

TEST(SteadyMotion, IsThatOfTheJointsAtRest) {
  const Scene scene = with_steady_motions(wires(4, "prestressed"));
  for (size_t i = 1; i < scene.bodies.size(); ++i) {  // the wires stand along their own x, whatever their start is
    const SteadyMotion& motion = scene.bodies[i].basis.motion.value();
    EXPECT_LT((motion.spin - Eigen::Vector3d(0, 0, 0.5)).norm(), 1e-12);
    EXPECT_LT((motion.acceleration - Eigen::Vector3d(-0.25 * 0.8, 0, 0)).norm(), 1e-12);
    ASSERT_EQ(motion.turns.size(), 2u);
    EXPECT_EQ(motion.turns[0], Eigen::Vector3d::UnitZ());
    EXPECT_EQ(motion.turns[1], Eigen::Vector3d::UnitY());
  }
  EXPECT_FALSE(scene.bodies[0].basis.motion.has_value());
}

TEST(SteadyMotion, ThatIsGivenStays) {
  Scene scene = wires(4, "prestressed");
  scene.bodies[1].basis.motion = SteadyMotion{{0, 0, 3}, {1, 2, 3}, {}};
  const Scene same = with_steady_motions(scene);
  EXPECT_EQ(same.bodies[1].basis.motion->spin, Eigen::Vector3d(0, 0, 3));
  EXPECT_TRUE(same.bodies[1].basis.motion->turns.empty());
  EXPECT_TRUE(same.bodies[2].basis.motion.has_value());
}

/// Largest difference of an output over the largest value of its vector.
double apart(const RunResult& a, const RunResult& b, const std::vector<std::string>& vector) {
  double difference = 0, size = 0;
  for (const std::string& name : vector) {
    difference = std::max(difference, (column(a, name) - column(b, name)).lpNorm<Eigen::Infinity>());
    size = std::max(size, column(b, name).lpNorm<Eigen::Infinity>());
  }
  return difference / size;
}

/// Wires that spin have next to no stiffness of their own: their clamped modes hold the shapes of strings slowly.
TEST(SteadyMotion, PrestressedShapesNeedFewerCoordinates) {
  const auto flown = [](int modes, const std::string& basis) {
    Scene scene = wires(modes, basis);
    scene.duration = 8;
    return run_scene(scene, {});
  };
  const RunResult many = flown(40, "clamped");
  const std::vector<std::string> tip = {"east.tip.y", "east.tip.z"};
  const double clamped = apart(flown(12, "clamped"), many, tip);
  const double prestressed = apart(flown(12, "prestressed"), many, tip);
  EXPECT_LT(prestressed, clamped / 2);
  EXPECT_LT(prestressed, 0.08);  // shapes of a string that starts straight: in proportion to the number of modes
  Scene other = wires(6, "prestressed");
  other.duration = 1;
  const RunResult relative = run_scene(other, {});
  other.formulation = "multipliers";
  EXPECT_LT(apart(run_scene(other, {}), relative, tip), 1e-4);
}

}  // namespace
}  // namespace flexboom
