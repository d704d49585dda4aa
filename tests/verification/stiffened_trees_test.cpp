// Trees with geometric stiffness in their equations, from one mode per body to many: they fly to the end and keep their
// energy, whatever the modes.

#include "dynamics/methods/integrator.hpp"
#include "tests/apps/run_testing.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <string>
#include <vector>

namespace flexboom {
namespace {

constexpr long stalled = 2'000'000;  // steps

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
  for (unsigned seed = 1; seed <= 20; ++seed) fly_random_tree(seed, 40, seed % 2 ? "auto" : "on", 1e-4);
}

/// A scene of the folder `stiffened`. Each stalls within its duration where the kinetic energy is no square.
Scene scene_that_may_stall(const std::string& name) {
  Scene scene = read_scene(std::filesystem::path(FLEXBOOM_TEST_DATA) / "verification" / "stiffened" / (name + ".toml"));
  scene.error_budget = false;
  return scene;
}

const std::vector<std::string> scenes_that_may_stall = {"ringing_boom", "two_link_arm", "turned_panel"};

TEST(StiffenedTrees, FlyPastWhereTheyMayStall) {
  for (const std::string& name : scenes_that_may_stall) {
    SCOPED_TRACE(name);
    Scene scene = scene_that_may_stall(name);
    scene.tolerance = 1e-8;
    const flexboom::Run run = run_once(scene, {}, 0, stalled);
    EXPECT_EQ(run.motion.time.back(), scene.duration);
    EXPECT_LT(run.motion.summary.energy_balance, 1e-8);
  }
}

/// IDA and the implicit methods damp what rings: their balance follows their tolerance, with no bound of its own.
TEST(SlowStiffenedTrees, FlyPastWhereTheyMayStallByEveryMethod) {
  for (const std::string& name : scenes_that_may_stall) {
    const Scene given = scene_that_may_stall(name);
    const auto fly = [&](const std::string& method, const std::string& formulation) {
      SCOPED_TRACE(fmt::format("{} by {}, {}", name, method, formulation));
      Scene scene = given;
      scene.integrator = method, scene.formulation = formulation;
      scene.tolerance = 1e-5;
      const flexboom::Run run = run_once(scene, {}, 0, stalled);
      EXPECT_EQ(run.motion.time.back(), scene.duration);
      EXPECT_LT(run.motion.summary.energy_balance, 1e-2);
    };
    for (const IntegratorMethod& method : integrator_methods()) fly(std::string(method.name), "relative");
    fly("auto", "multipliers");
  }
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

// Every scene of the program with one to forty modes per body.
TEST(SlowStiffenedTrees, ScenesOfTheProgramFlyWithOneToFortyModes) {
  for (const std::string& name : builtin_scene_names())
    for (const int modes : {1, 2, 4, 10, 20, 40})
      for (const char* stiffening : {"on", "auto"}) {
        SCOPED_TRACE(fmt::format("{}, {} modes, stiffening {}", name, modes, stiffening));
        Scene scene = scene_named(name);
        const bool starts_slowly =
            name == "panel-slew" || name == "spin-up";  // below 1e-5 J energies are judged by that
        scene.duration = starts_slowly ? 1 : modes > 10 ? 0.01 : 0.05;
        scene.output_step = scene.duration / 10;
        scene.tolerance = 1e-9;
        for (BodyScene& body : scene.bodies) {
          if (body.rigid) continue;
          body.modes = modes, body.modes_auto = false;
          body.directions = "all";
          body.stiffening = stiffening;
        }
        const flexboom::Run run = run_once(scene, {}, 0, stalled);
        EXPECT_LT(run.motion.summary.energy_balance, 1e-8);
      }
}

}  // namespace
}  // namespace flexboom
