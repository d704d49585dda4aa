// What functions of time do to vibrations that a model leaves out.

#include "apps/accuracy/drive_spectra.hpp"
#include "apps/accuracy/error_budget.hpp"
#include "tests/apps/run_testing.hpp"
#include "tests/apps/scene_testing.hpp"
#include "tests/apps/slender_boom.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace flexboom {
namespace {

// A slender boom on a slider. Its frequencies are those of a clamped Euler-Bernoulli beam.
const std::string shaken = std::string(R"toml(format = "flexboom-scene-1"
name = "shaken"
duration = 2.0
output_step = 0.01
[accuracy]
tolerance = 1e-3
outputs = ["boom.tip"]
[[bodies]]
name = "boom"
theory = "euler-bernoulli"
rotary_inertia = false
modes = 3
)toml") + slender_boom + R"toml([[joints]]
name = "shaker"
kind = "slider"
a = { x = [1, 0, 0], z = [0, 1, 0] }
b = { body = "boom", marker = "root", x = [1, 0, 0], z = [0, 1, 0] }
motion = "0.1*(1-cos(0.7*t))"
)toml";

std::string shaken_by(const std::string& motion) { return with(shaken, "0.1*(1-cos(0.7*t))", motion); }

double fastest(const std::string& motion, double shown) {
  return DriveSpectra(parse_scene(shaken_by(motion), "shaken.toml")).fastest_beyond(10, shown);
}

TEST(DriveSpectra, AToneBeyondTheModesShownIsFound) {
  EXPECT_NEAR(fastest("0.05*(1-cos(0.7*t))+1e-6*(1-cos(3000*t))", 300), 3000, 30);
  EXPECT_NEAR(fastest("0.05*(1-cos(0.7*t))+1e-6*(1-cos(90*t))+1e-9*(1-cos(20000*t))", 300), 20000, 40);
  EXPECT_EQ(fastest("0.05*(1-cos(0.7*t))+1e-6*(1-cos(3000*t))", 3100), 0);
}

// 4096 looks in 2 s see nothing of a tone of 2048 Hz, or of twice as many.
TEST(DriveSpectra, ATonePeriodicWithTheLooksIsFound) {
  for (const int times : {1, 2})
    EXPECT_NEAR(fastest(fmt::format("0.05*(1-cos(0.7*t))+1e-6*(1-cos(2*pi*2048*{}*t))", times), 300),
                2 * std::numbers::pi * 2048 * times, 200);
}

// What the modes up to there show of these is a bound for the others.
TEST(DriveSpectra, SlowMotionsPulsesAndCornersHaveNoTones) {
  EXPECT_EQ(fastest("0.05*(1-cos(0.7*t))", 300), 0);
  EXPECT_EQ(fastest("0.01*t^2", 300), 0);
  EXPECT_EQ(fastest("0.001*(t-1)^3*(t>1)", 300), 0);
  EXPECT_EQ(fastest("1e-3*exp(-((t-1)/0.003)^2)", 300), 0);
  const std::string thruster = shaken + "[[loads]]\nname = \"thruster\"\nat = { body = \"boom\", marker = \"tip\" }\n";
  for (const char* force : {"0.01*(sin(2*pi*20*t)>0)", "0.01*(sin(2*pi*20*t)>0.9)", "0.01*(t>0.3)"}) {
    const std::string text = thruster + fmt::format("force = [0, \"{}\", 0]\n", force);
    EXPECT_EQ(DriveSpectra(parse_scene(text, "thruster.toml")).fastest_beyond(10, 2654), 0) << force;
  }
}

// A resonance with the tenth mode, of which three modes and the next four know nothing. Reference: 14 modes.
TEST(TruncationOfATone, ReachesTheModesThatItMoves) {
  const std::string text = shaken_by(fmt::format("0.05*(1-cos(0.7*t))+5e-7*(1-cos({:.9f}*t))", clamped_frequency(10)));
  Scene scene = parse_scene(text, "shaken.toml");
  const RunResult r = run_scene(scene, {});
  Scene full = scene;
  full.error_budget = false, full.tolerance = 1e-6, full.bodies[0].modes = 14;
  const OutputTable reference = without_coordinates(run_scene(full, {}).outputs);
  const double truth =
      largest(compare_outputs(without_coordinates(r.outputs), reference, scene.outputs, floors_of(scene, r.bodies)));
  EXPECT_GT(truth, 1e-2);
  EXPECT_GT(r.budget.truncation, 0.8 * truth);
  EXPECT_LT(r.budget.truncation, 3 * truth);
  scene.bodies[0].modes_auto = true;
  const RunResult planned = run_scene(scene, {});
  EXPECT_TRUE(planned.budget.within(scene.tolerance));
  const double left = largest(
      compare_outputs(without_coordinates(planned.outputs), reference, scene.outputs, floors_of(scene, r.bodies)));
  EXPECT_LT(left, scene.tolerance);
}

TEST(TruncationOfATone, IsWarnedOfWithoutABudget) {
  const std::string tone = fmt::format("0.05*(1-cos(0.7*t))+5e-7*(1-cos({:.9f}*t))", clamped_frequency(16));
  for (const auto& [motion, is_warned] : {std::pair(tone, true), {std::string("0.05*(1-cos(0.7*t))"), false}}) {
    Scene scene = parse_scene(shaken_by(motion), "shaken.toml");
    scene.error_budget = false, scene.bodies[0].modes_auto = true;
    EXPECT_EQ(any_has(run_scene(scene, {}).warnings, "the modes may be too few, and the error budget is off"),
              is_warned);
  }
}

// A mode that the elements do not know, or too many of them, is no mode that is shown.
TEST(TruncationOfATone, BeyondAllModesThatAreTriedIsNotMeasured) {
  const std::string text = shaken_by("0.05*(1-cos(0.7*t))+1e-10*(1-cos(300000*t))");
  const RunResult r = run_scene(parse_scene(with(text, "duration = 2.0", "duration = 0.05"), "shaken.toml"), {});
  EXPECT_TRUE(std::isnan(r.budget.truncation));
  EXPECT_TRUE(any_has(r.warnings, "truncation not measured: a function of time moves vibrations of body boom"));
}

}  // namespace
}  // namespace flexboom
