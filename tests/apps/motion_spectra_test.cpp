// What the motion of a run does to vibrations that a model leaves out.

#include "apps/accuracy/motion_spectra.hpp"
#include "apps/accuracy/error_budget.hpp"
#include "apps/accuracy/modes_beyond.hpp"
#include "tests/apps/run_testing.hpp"
#include "tests/apps/scene_testing.hpp"
#include "tests/apps/slender_boom.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

namespace flexboom {
namespace {

// A slender boom on a heavy hub. Its frequencies are those of a clamped Euler-Bernoulli beam, nearly.
const std::string boom_on_hub = std::string(R"toml(format = "flexboom-scene-1"
name = "shaken"
duration = 0.5
output_step = 0.001
[accuracy]
tolerance = 1e-2
outputs = ["boom.tip"]
[[bodies]]
name = "hub"
mass = 50.0
inertia = [20.0, 20.0, 20.0]
[[bodies]]
name = "boom"
theory = "euler-bernoulli"
order = 10
rotary_inertia = false
modes = 3
)toml") + slender_boom + R"toml([[joints]]
name = "hub"
kind = "free"
b = { body = "hub" }
[[joints]]
name = "clamp"
kind = "fixed"
a = { body = "hub" }
b = { body = "boom", marker = "root" }
[[loads]]
name = "push"
at = { body = "boom", marker = "tip" }
force = [0, "2e-4*sin(2*pi*t)^2", 0]
)toml";

/// A mass of 1 kg on a spring that starts stretched and has this frequency beside the hub, on any place.
std::string sprung_mass(double frequency, double start, const std::string& at = "body = \"hub\"", double mass = 1) {
  return fmt::format(
      "[[bodies]]\nname = \"mass\"\nmass = {0}\ninertia = [1e-8, 1e-8, 1e-8]\n[[joints]]\nname = \"spring\"\nkind = "
      "\"slider\"\na = {{ {1}, x = [1, 0, 0], z = [0, 1, 0] }}\nb = {{ body = \"mass\" }}\nstiffness = {2:.12g}\nrest "
      "= 0.0\nstart = {3}\n",
      mass, at, mass * frequency * frequency, start);
}

/// An unbalanced rotor on the hub.
std::string rotor(double rate) {
  return fmt::format(
      "[[bodies]]\nname = \"rotor\"\nmass = 1.0\ninertia = [1e-4, 1e-4, 1e-4]\ncentre = [1e-5, 0, 0]\n[[joints]]\nname "
      "= "
      "\"axle\"\nkind = \"hinge\"\na = {{ body = \"hub\" }}\nb = {{ body = \"rotor\" }}\nstart_rate = {}\n",
      rate);
}

/// The budget of a run with few modes knows what the tone does, and a plan takes the mode in. Reference: many modes.
void expect_shown(const std::string& shaker, int modes) {
  Scene scene = parse_scene(boom_on_hub + shaker, "shaken.toml"), full = scene;
  full.error_budget = false, full.tolerance = 1e-6, full.bodies[1].modes = modes;
  const OutputTable reference = without_coordinates(run_scene(full, {}).outputs);
  const auto error = [&](const RunResult& r) {
    return largest(
        compare_outputs(without_coordinates(r.outputs), reference, scene.outputs, floors_of(scene, r.bodies)));
  };
  const RunResult r = run_scene(scene, {});
  EXPECT_GT(error(r), 3e-2);
  EXPECT_GT(r.budget.truncation, 0.8 * error(r));
  EXPECT_LT(r.budget.truncation, 3 * error(r));
  scene.bodies[1].modes_auto = true;
  const RunResult planned = run_scene(scene, {});
  EXPECT_TRUE(planned.budget.within(scene.tolerance)) << planned.budget.total();
  EXPECT_LT(error(planned), scene.tolerance);
}

// A mass that rings at 0.04 mm beside the hub, in resonance with the tenth mode. Three modes and the next four know
// nothing of it. Reference: 16 modes.
TEST(MotionSpectra, ASprungMassShakesModesThatAreLeftOut) {
  expect_shown(sprung_mass(clamped_frequency(10), 4e-5), 16);
}

TEST(MotionSpectra, ARotorShakesModesThatAreLeftOut) { expect_shown(rotor(clamped_frequency(10)), 16); }

/// What the motion does to modes beyond those of the scene and the next.
ShakenModes shaken_modes(const std::string& shaker) {
  const Scene scene = parse_scene(boom_on_hub + shaker, "shaken.toml");
  Scene alone = scene;
  alone.error_budget = false;
  const RunResult r = run_scene(alone, {});
  return shaken_modes(scene, r, {}, {}, {});
}

TEST(MotionSpectra, WhatIsFarFromAModeOrSmallDoesNotCount) {
  EXPECT_TRUE(any_counts(shaken_modes(sprung_mass(clamped_frequency(10), 1e-5)), 1e-2));
  EXPECT_FALSE(any_counts(shaken_modes(sprung_mass(clamped_frequency(10.5), 1e-5)), 1e-2));
  EXPECT_FALSE(any_counts(shaken_modes(sprung_mass(clamped_frequency(10), 1e-8)), 1e-2));
  EXPECT_TRUE(shaken_modes("").empty());  // nothing is as fast
}

// The load of what is joined to the tip moves modes, though the root is as good as held.
TEST(MotionSpectra, KnowTheLoadsOfWhatIsJoined) {
  EXPECT_TRUE(any_counts(
      shaken_modes(sprung_mass(clamped_frequency(9.9), 3e-4, "body = \"boom\", marker = \"tip\"", 1e-4)), 0.1));
}

// A tone that is set off near the end, where nothing was heard before.
TEST(MotionSpectra, HearWhatAPulseSetsOff) {
  const std::string plucked =
      with(sprung_mass(clamped_frequency(10), 0), "rest = 0.0", "rest = 0.0\ndrive = \"300*((t>0.4)*(t<0.401))\"");
  EXPECT_TRUE(any_counts(shaken_modes(plucked), 1e-2));
}

// A run of ten periods of the tone, with few outputs.
TEST(MotionSpectra, HearAToneInAShortRun) {
  Scene scene = parse_scene(boom_on_hub + sprung_mass(clamped_frequency(10), 1e-4), "shaken.toml");
  scene.duration = 20 * std::numbers::pi / clamped_frequency(10), scene.output_step = scene.duration / 10;
  scene.error_budget = false;
  const RunResult r = run_scene(scene, {});
  const ShakenModes shaken = shaken_modes(scene, r, {}, {}, {});
  EXPECT_TRUE(any_counts(shaken, 1e-2));
}

// They are those of the equations: a mass on a spring beside a heavy hub, and twice the rate of a rotor.
TEST(MotionSpectra, KnowTheFastestVibrationAndTurn) {
  const auto fastest = [](const std::string& shaker) {
    const Scene scene = parse_scene(boom_on_hub + shaker, "shaken.toml");
    Scene alone = scene;
    alone.error_budget = false;
    return fastest_motion(run_scene(alone, {}));
  };
  EXPECT_NEAR(fastest(sprung_mass(5000, 1e-4)), 5000 * std::sqrt(1 + 1 / 50.108), 20);
  EXPECT_NEAR(fastest(rotor(3000)), 6000, 1);
}

}  // namespace
}  // namespace flexboom
