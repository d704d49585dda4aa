// What geometric stiffness that is not there leaves of an error budget.

#include "tests/apps/reduced_testing.hpp"
#include "tests/apps/run_testing.hpp"
#include "tests/apps/scene_testing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace flexboom {
namespace {

// A file without geometric stiffness at a marker does not say what a load there does, nor how much nearer it comes.
TEST(Linearisation, OfLoadsThatStiffenNothingIsNotKnown) {
  const auto without_markers = [](ReducedBody& body) { body.Kg.markers.clear(); };
  const std::string weight =
      "[[bodies]]\nname = \"weight\"\nmass = 0.1\ninertia = [1e-5, 1e-5, 1e-5]\n"
      "[[joints]]\nname = \"clip\"\nkind = \"fixed\"\na = { body = \"boom\", marker = \"tip\" }\nb = { body = "
      "\"weight\" }\n";
  for (const std::string& more : {std::string(), weight}) {
    Scene scene = with_reduced(swing_on_joints + more, without_markers);
    scene.tolerance = 1e-3, scene.duration = 0.05;
    scene.outputs = {more.empty() ? "boom.tip" : "hinge.angle"};
    RunResult r = run_scene(scene, {});
    EXPECT_TRUE(std::isnan(r.budget.linearisation));
    EXPECT_TRUE(any_has(r.warnings, "body boom has no geometric stiffness of loads at tip"));
    scene.error_budget = false;
    EXPECT_TRUE(any_has(run_scene(scene, {}).warnings, "body boom has no geometric stiffness of loads at tip"));
    scene.error_budget = true;
    scene.outputs = {"hub.rotation"};
    r = run_scene(scene, {});
    EXPECT_EQ(std::isnan(r.budget.linearisation), !more.empty());
  }
}

// Wires that stand straight by their spin have nothing to bend them, so their plan may leave all modes out.
TEST(Truncation, OfABodyWithoutModesHasItsStiffening) {
  Scene scene = parse_scene(R"toml(format = "flexboom-scene-1"
name = "steady"
duration = 30.0
output_step = 0.5
accuracy = { tolerance = 1e-3 }
[[bodies]]
name = "hub"
mass = 250
inertia = [90, 90, 120]
[[bodies]]
name = "wire"
modes = 0
directions = "all"
segments = [{ shape = "round-bar", diameter = 0.001, length = 20.0, material = { E = 70e9, nu = 0.33, rho = 4000 } }]
[[joints]]
kind = "free"
b = { body = "hub" }
start_omega = [0.0, 0.0, 0.5]
[[joints]]
name = "wire"
kind = "fixed"
a = { body = "hub", point = [0.8, 0.0, 0.0] }
b = { body = "wire", marker = "root" }
)toml",
                            "steady.toml");
  scene.outputs = {"hub.rate", "hub.rotation"};
  EXPECT_LT(run_scene(scene, {}).budget.truncation, 1e-3);
}

}  // namespace
}  // namespace flexboom
