// Trees with geometric stiffness in their equations, from one mode per body to many: they fly to the end and keep their
// energy, whatever the modes.

#include "tests/apps/run_testing.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

namespace flexboom {
namespace {

/// A tree of random beams without damping: a hub in free flight or on a spring hinge, beams on it and on each other.
std::string random_tree(unsigned seed, int modes, const std::string& stiffening, double duration) {
  std::mt19937 random(seed);
  const auto between = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  const auto one_of = [&](const std::vector<std::string>& choices) {
    return choices[std::uniform_int_distribution<size_t>(0, choices.size() - 1)(random)];
  };
  const int beams = std::uniform_int_distribution<int>(2, 3)(random);
  std::string s = fmt::format(R"(
format = "flexboom-scene-1"
name = "tree"
duration = {}
output_step = {}
[accuracy]
tolerance = 1e-9
budget = false
[[bodies]]
name = "hub"
mass = {}
inertia = [1.0, 1.5, 2.0]
)",
                              duration, duration / 10, between(1, 50));
  s += between(0, 1) < 0.7
           ? fmt::format(
                 "[[joints]]\nname = \"hub\"\nkind = \"free\"\nb = {{ body = \"hub\" }}\nstart_omega = [{}, {}, {}]\n",
                 between(-1, 1), between(-1, 1), between(-2, 2))
           : "[[joints]]\nname = \"hub\"\nkind = \"hinge\"\nb = { body = \"hub\" }\nstiffness = 10\nstart = 0.3\n";
  std::vector<std::string> parents = {"hub"};
  for (int i = 0; i < beams; ++i) {
    const std::string name = "beam" + std::to_string(i), parent = one_of(parents);
    s += fmt::format("[[bodies]]\nname = \"{}\"\nmodes = {}\ndirections = \"all\"\nstiffening = \"{}\"\n", name, modes,
                     stiffening);
    const std::string shape = one_of({"round-bar", "tube", "rectangle"});
    s += fmt::format("[[bodies.segments]]\nshape = \"{}\"\n", shape);
    if (shape == "round-bar") s += fmt::format("diameter = {}\n", between(0.004, 0.02));
    if (shape == "tube") s += fmt::format("diameter = {}\nthickness = 0.001\n", between(0.01, 0.04));
    if (shape == "rectangle") s += fmt::format("height = {}\nwidth = {}\n", between(0.003, 0.01), between(0.02, 0.1));
    s += fmt::format("length = {}\nmaterial = {{ E = 7e10, nu = 0.33, rho = 2700.0 }}\n", between(0.3, 2));
    if (between(0, 1) < 0.6)
      s += fmt::format(
          "[[bodies.attachments]]\nname = \"load\"\nposition = \"tip\"\nmass = {}\ninertia = [1e-4, 1e-4, 1e-4]\n",
          between(0.05, 0.6));
    const std::string kind = one_of({"fixed", "hinge", "hinge", "universal", "spherical"});
    const std::string at = parent == "hub" ? fmt::format("point = [{}, {}, {}]", between(-0.3, 0.3), between(-0.3, 0.3),
                                                         between(-0.3, 0.3))
                                           : "marker = \"tip\"";
    s += fmt::format(
        "[[joints]]\nname = \"{0}\"\nkind = \"{1}\"\na = {{ body = \"{2}\", {3} }}\nb = {{ body = \"{0}\", marker = "
        "\"root\" }}\n",
        name, kind, parent, at);
    if (kind == "hinge") s += fmt::format("stiffness = {}\nstart = {}\n", between(5, 100), between(-0.1, 0.1));
    parents.push_back(name);
  }
  return s;
}

/// Flies the tree; the number of its steps.
long fly_random_tree(unsigned seed, int modes, const std::string& stiffening, double duration) {
  SCOPED_TRACE(fmt::format("seed {}, {} modes, stiffening {}", seed, modes, stiffening));
  constexpr long stalled = 2'000'000;
  const Run run = run_once(parse_scene(random_tree(seed, modes, stiffening, duration), "tree.toml"), {}, 0, stalled);
  EXPECT_LT(run.motion.summary.energy_balance, 1e-8);
  return run.motion.summary.steps;
}

TEST(StiffenedTrees, FlyAndKeepTheirEnergy) {
  for (unsigned seed = 1; seed <= 6; ++seed)
    for (const int modes : {1, 3, 8}) fly_random_tree(seed, modes, seed % 2 ? "on" : "auto", 0.02);
}

TEST(SlowStiffenedTrees, TwentyFlyAndKeepTheirEnergyWithUpToFortyModes) {
  for (unsigned seed = 1; seed <= 20; ++seed)
    for (const int modes : {1, 2, 5, 12}) fly_random_tree(seed, modes, seed % 2 ? "on" : "auto", 0.01);
  // The fastest of 40 clamped modes on a hinge set steps near 1e-8 s.
  for (unsigned seed = 1; seed <= 5; ++seed) fly_random_tree(seed, 40, "on", 1e-4);
}

// The scenes of the program with eight modes per body: with terms of the first order in the second-order displacements
// alone, an arm stalls after 0.03 s and a panel when its hub turns.
TEST(StiffenedTrees, ScenesOfTheProgramFlyWithMoreModes) {
  for (const char* name : {"two-link-arm", "flexible-appendage", "panel-slew", "spin-up", "wire-spinner"}) {
    SCOPED_TRACE(name);
    Scene scene = scene_named(name);
    scene.duration = 0.5;
    scene.output_step = 0.05;
    scene.tolerance = 1e-9;
    for (BodyScene& body : scene.bodies) {
      if (body.rigid) continue;
      body.modes = 8;
      body.directions = "all";
      body.stiffening = "on";
    }
    const flexboom::Run run = run_once(scene, {}, 0, 500'000);
    EXPECT_LT(run.motion.summary.energy_balance, 1e-8);
  }
}

}  // namespace
}  // namespace flexboom
