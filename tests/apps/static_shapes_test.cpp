// Static shapes of the loads that joints put on booms.

#include "apps/model/static_shapes.hpp"
#include "apps/accuracy/error_budget.hpp"
#include "apps/model/prepared_body.hpp"
#include "tests/apps/run_testing.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexboom {
namespace {

using Eigen::RowVectorXd;

/// A bar that is clamped and carries a swinging weight on a spring hinge at its tip.
Scene bar_with_weight(const std::string& modes, double tolerance) {
  return parse_scene(fmt::format(R"(format = "flexboom-scene-1"
name = "bar"
duration = 1
output_step = 0.005
gravity = [0, -9.81, 0]
accuracy = {{ tolerance = {}, outputs = ["swing.angle", "bar.tip"] }}
[[bodies]]
name = "bar"
{}
directions = "all"
damping = {{ rule = "modal", value = 0.02 }}
[[bodies.segments]]
shape = "round-bar"
diameter = 0.01
length = 1
material = {{ E = 70e9, nu = 0.33, rho = 2700 }}
[[bodies]]
name = "weight"
mass = 0.02
inertia = [1e-4, 1e-3, 1e-3]
centre = [0.2, 0, 0]
[[joints]]
name = "clamp"
kind = "fixed"
b = {{ body = "bar", marker = "root" }}
[[joints]]
name = "swing"
kind = "hinge"
a = {{ body = "bar", marker = "tip" }}
b = {{ body = "weight" }}
stiffness = 20
damping = 0.01
start = 0.3
)",
                                 tolerance, modes),
                     "bar.toml");
}

/// Largest difference of an output, by its largest value.
double way_apart(const RunResult& a, const RunResult& b, const std::string& name) {
  const Eigen::VectorXd there = column(b, name);
  return (column(a, name) - there).cwiseAbs().maxCoeff() / there.cwiseAbs().maxCoeff();
}

// With any of the modes the bar gives way to a static load as Euler and Bernoulli say: L / EI per newton metre.
TEST(StaticShapes, HoldTheDeflectionWithAnyOfTheModes) {
  Scene scene = bar_with_weight("modes = 12\ncorrections = [\"tip.Fy\", \"tip.Mz\"]", 1e-6);
  BodyScene bar = scene.bodies[0];
  const double EI = 70e9 * std::numbers::pi * std::pow(0.01, 4) / 64;
  for (const std::vector<int>& shapes : {std::vector<int>{}, {1}, {2, 5}, {1, 2, 3, 4, 9}}) {
    bar.shapes = shapes;
    const ReducedBody body = prepare_body(bar).body;
    EXPECT_EQ(body.n(), (shapes.empty() ? 12 : std::ssize(shapes)) + 2);
    body.validate();
    const RowVectorXd slope = marker(body, "tip").S_theta.row(2), way = marker(body, "tip").S.row(1);
    const Eigen::MatrixXd flexibility = body.Ke.inverse();
    EXPECT_NEAR(slope * flexibility * slope.transpose(), 1 / EI, 1e-9 / EI);
    EXPECT_NEAR(slope * flexibility * way.transpose(), 1 / (2 * EI), 1e-9 / EI);
    const Eigen::MatrixXd mass = body.Me.diagonal().asDiagonal();
    EXPECT_LT((body.Me - mass).norm(), 1e-12 * mass.norm()) << "its coordinates are orthogonal";
  }
}

TEST(StaticShapes, AreThoseOfWhatActsBesideTheClamp) {
  Scene scene = bar_with_weight("modes = 2", 1e-6);
  const std::vector<std::string> all = static_shapes_of_loads(scene, scene.bodies[0]);
  EXPECT_EQ(all, static_shapes_at("tip"));
  EXPECT_TRUE(static_shapes_of_loads(scene, scene.bodies[1]).empty());
  EXPECT_EQ(with_static_shapes(with_static_shapes(scene.bodies[0], all), {"tip.Fy"}).basis.corrections, all);
  scene.bodies[0].clamp = "tip";
  EXPECT_EQ(static_shapes_of_loads(scene, scene.bodies[0]), static_shapes_at("root"));
}

class StaticShapesOfJoints : public testing::TestWithParam<std::string> {};

// The slope under the torque of the hinge converges as 1 / n, so a few more modes show a part of what is left out.
TEST_P(StaticShapesOfJoints, ShowWhatModesAloneLeaveOut) {
  Scene scene = bar_with_weight("modes = 6", 1e-3);
  scene.formulation = GetParam();
  const RunResult few = run_scene(scene, {});
  Scene many = bar_with_weight("modes = 30\ncorrections = [\"tip.Fy\", \"tip.Mz\", \"tip.Fx\"]", 1e-8);
  many.error_budget = false;
  const RunResult exact = run_scene(many, {});
  const double left_out = way_apart(few, exact, "swing.angle");
  const OutputErrors& said = few.budget.outputs.front();
  ASSERT_EQ(said.name, "swing.angle");
  EXPECT_GT(left_out, 1e-3);
  EXPECT_GT(said.truncation, 0.8 * left_out);
  EXPECT_LT(said.truncation, 1.5 * left_out);
}

class StaticShapesOfBases : public testing::TestWithParam<std::string> {};

// Modes of no basis hold the slope under a torque where nothing of theirs is.
TEST_P(StaticShapesOfBases, ShowWhatModesAloneLeaveOut) {
  const RunResult few = run_scene(bar_with_weight("modes = 6\n" + GetParam(), 1e-3), {});
  Scene many = bar_with_weight("modes = 30\ncorrections = [\"tip.Fy\", \"tip.Mz\", \"tip.Fx\"]", 1e-8);
  many.error_budget = false;
  const RunResult exact = run_scene(many, {});
  for (const char* name : {"swing.angle", "bar.tip"}) {
    const double left_out = way_apart(few, exact, name == std::string("bar.tip") ? "bar.tip.y" : name);
    const auto said = std::ranges::find(few.budget.outputs, name, &OutputErrors::name);
    ASSERT_NE(said, few.budget.outputs.end());
    EXPECT_GT(left_out, 1e-3) << name;
    EXPECT_GT(said->truncation, left_out) << name;
    EXPECT_LT(said->truncation, 3 * left_out) << name;
  }
}

INSTANTIATE_TEST_SUITE_P(Bases, StaticShapesOfBases,
                         testing::Values("basis = \"hinge\"\nhinge_stiffness = [0.0, 5.0]",
                                         "basis = \"prestressed\"\nprestress = { spin = [0.0, 0.0, 0.1] }",
                                         "basis = \"craig-bampton\"\ninterfaces = [\"root\"]"));

// The static shape of a load at an interface is among the coordinates of the interface.
TEST(StaticShapes, InterfacesHoldThemAlready) {
  const std::string basis = "modes = 2\nbasis = \"craig-bampton\"\ninterfaces = [\"root\", \"tip\"]";
  Scene scene = bar_with_weight(basis, 1e-2);
  EXPECT_TRUE(static_shapes_of_loads(scene, scene.bodies[0]).empty());
  EXPECT_FALSE(std::isnan(run_scene(scene, {}).budget.truncation));
}

// Of a file: a load at the tip is one on an attachment that sits there, and none on one that sits elsewhere.
TEST(StaticShapes, OfAFileAreThoseOfTheNode) {
  const auto bar = [](double position) {
    ReducedBody body = blank_body("bar", 1);
    const Eigen::Vector3d x(1, 0, 0);
    body.markers.push_back({"tip", x, Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)});
    body.markers.push_back({"mass", position * x, position * Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)});
    body.coordinates.push_back({"attachment", 0, "mass", "Fy"});
    return body;
  };
  for (const double position : {1.0, 0.5}) {
    Scene scene = bar_with_weight("", 1e-3);
    BodyScene& b = scene.bodies[0];
    b.reduced = std::make_shared<const ReducedBody>(bar(position));
    b.richer = std::make_shared<const RicherBodies>(RicherBodies{bar(position), {}});
    const std::vector<std::string> none, tip{"tip"};
    EXPECT_EQ(loads_without_shapes(scene, b), position == 1 ? none : tip) << position;
  }
}

// The panel that carries another one has them, and then few modes will do.
TEST(StaticShapes, ArePartOfAPlan) {
  Scene scene = scene_named("wing-satellite");
  scene.tolerance = 1e-2;
  scene.error_budget = true;
  for (BodyScene& b : scene.bodies)
    if (b.is_boom()) b.modes_auto = true;
  const RunResult r = run_scene(scene, {});
  EXPECT_TRUE(r.budget.measured && r.budget.within(1e-2)) << r.budget.total();
  const auto corrections = [&](const char* name) {
    return std::ranges::find(r.scene.bodies, name, &BodyScene::name)->basis.corrections;
  };
  EXPECT_EQ(std::ranges::count(corrections("inner"), "tip.Mz"), 1);
  EXPECT_TRUE(corrections("outer").empty() && corrections("boom").empty());
  EXPECT_LT(std::ranges::find(r.scene.bodies, "inner", &BodyScene::name)->shapes.size(), 6u);
}

INSTANTIATE_TEST_SUITE_P(Formulations, StaticShapesOfJoints, testing::Values("relative", "multipliers"),
                         [](const auto& which) { return which.param; });

}  // namespace
}  // namespace flexboom
