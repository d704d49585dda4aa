// Warnings of what a theory cannot hold, of odd scenes and of files.

#include "apps/commands/commands.hpp"
#include "tests/apps/reduced_testing.hpp"
#include "tests/apps/run_testing.hpp"
#include "tests/apps/scene_testing.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

namespace flexboom {
namespace {

using WarningsOfRuns = InBothFormulations;
INSTANTIATE_TEST_SUITE_P(Formulations, WarningsOfRuns, testing::Values("relative", "multipliers"),
                         [](const auto& row) { return row.param; });

TEST_P(WarningsOfRuns, LargeDeflectionsAreNamed) {
  for (const std::string& text : {swing_on_hinge, swing_on_joints}) {
    const std::string soft = with(text, "E = 70e9", "E = 70e6");
    Scene scene = parse_scene(soft, "soft.toml");
    scene.error_budget = false;
    scene.duration = 0.3;
    if (scene.is_tree)
      scene.joints.back().start_rate = {20};
    else
      scene.hinges[0].start_rate = 20;
    const RunResult large = run(scene);
    EXPECT_TRUE(any_has(large.warnings, "body boom: it bends by ")) << text;
    EXPECT_TRUE(any_has(large.warnings, " m at t = "));
    EXPECT_TRUE(any_has(large.warnings, "% of its length"));
    Scene stiff = parse_scene(text, "stiff.toml");
    stiff.error_budget = false;
    stiff.duration = 0.1;
    const RunResult small = run(stiff);
    EXPECT_FALSE(any_has(small.warnings, "it bends by "));
  }
}

/// A boom pressed along its axis beyond and below Euler's load, pi^2 E I / (4 L^2).
TEST_P(WarningsOfRuns, BucklingIsNamed) {
  const BodyScene boom = parse_scene(swing_on_joints, "boom.toml").bodies.at(0);
  const BeamSegment& segment = boom.geometry.segments.at(0);
  const double I = section_of(segment.start, segment.material.nu, boom.geometry.shear).Iz;
  const double euler = std::pow(M_PI / (2 * segment.length), 2) * segment.material.E * I;
  for (const double share : {0.5, 2.0}) {
    Scene scene = parse_scene(
        fmt::format("{}[[loads]]\nname = \"press\"\nat = {{ body = \"boom\", marker = \"tip\" }}\nforce = [{}, 0, 0]\n",
                    swing_on_joints, -share * euler),
        "pressed.toml");
    scene.joints.back().kind = JointKind::fixed;
    scene.joints.back().mechanism = {}, scene.joints.back().start.clear();
    scene.joints.front().kind = JointKind::fixed;
    scene.bodies[0].stiffening = "on";
    scene.error_budget = false;
    scene.duration = 0.01;
    const RunResult r = run(scene);
    EXPECT_EQ(any_has(r.warnings, "it buckles"), share > 1) << fmt::format("{}", fmt::join(r.warnings, "\n"));
    EXPECT_EQ(any_has(r.warnings, "body boom: at t = "), share > 1);
  }
}

TEST(Warnings, OfSpringsAndStartsBeyondTheStop) {
  const std::string hinge = with(swing_on_hinge, "P3 = 0", "P3 = 20\nthreshold = 1.2");
  EXPECT_TRUE(any_has(parse_scene(hinge, "x.toml").warnings, "hinge boom: starts at 1.5 rad, beyond the stop"));
  EXPECT_TRUE(any_has(parse_scene(hinge, "x.toml").warnings, "hinge boom: the spring is at rest at 1.5708 rad"));
  const std::string joint = swing_on_joints + "stop_stiffness = 10\nthreshold = 0.05\nrest = 0.06\n";
  EXPECT_TRUE(any_has(parse_scene(joint, "x.toml").warnings, "joint hinge: starts at 0.07 rad, beyond the stop"));
  EXPECT_TRUE(any_has(parse_scene(joint, "x.toml").warnings, "joint hinge: the spring is at rest at 0.06 rad"));
  for (const std::string pad : {"upper_stop = { at = 0.05, ", "lower_stop = { at = 0.08, "}) {
    const std::string law =
        swing_on_joints + pad + "stiffness = 10 }\nrest = " + (pad[0] == 'u' ? "0.06" : "0.07") + "\n";
    EXPECT_TRUE(any_has(parse_scene(law, "x.toml").warnings, "joint hinge: starts at 0.07 rad, beyond the stop"))
        << pad;
    EXPECT_TRUE(any_has(parse_scene(law, "x.toml").warnings, "joint hinge: the spring is at rest at 0.0")) << pad;
  }
  for (const std::string& text : {swing_on_hinge, swing_on_joints})
    EXPECT_TRUE(parse_scene(text, "x.toml").warnings.empty());
  for (const std::string& name : builtin_scene_names())
    EXPECT_FALSE(any_has(load_scene(name).warnings, "beyond the stop")) << name;
}

TEST_P(WarningsOfRuns, ASpringPressedToAPointIsAFault) {
  const std::string spring =
      "[[springs]]\nname = \"bumper\"\nstiffness = 3\na = { body = \"hub\", point = [0.05, 0, 0] }\n"
      "b = { body = \"boom\", marker = \"root\" }\nfree_length = ";
  Scene scene = parse_scene(swing_on_joints + spring + "0.1\n", "spring.toml");
  EXPECT_THROW(run(scene), InputError);
  scene.springs[0].free_length = 0;
  EXPECT_NO_THROW(run(scene));
}

TEST(Warnings, OfPerCent) {
  for (const std::string rule : {"modal", "loss-factor"}) {
    const std::string scene =
        with(swing_on_joints, "rule = \"modal\", value = 0.05", "rule = \"" + rule + "\", value = 5");
    EXPECT_TRUE(any_has(parse_scene(scene, "x.toml").warnings, "body boom: its damping ratio is ")) << rule;
  }
}

TEST(Warnings, OfWhatIsMostLikelyMeantOtherwise) {
  const auto warnings = [](const std::string& text) { return parse_scene(text, "x.toml").warnings; };
  const std::string ramp = swing_on_joints + "drive = { time = [0, 0.2, 0.21, 1], value = [0, 0, 1, 1]";
  EXPECT_TRUE(any_has(warnings(ramp + " }\n"), "drive of joint hinge: its cubic is "));
  EXPECT_TRUE(warnings(ramp + ", interpolation = \"linear\" }\n").empty());
  const std::string slit = with(swing_on_joints, "modes = 1", "modes = 1\nsolid = { slit = 1e-4 }");
  EXPECT_TRUE(any_has(warnings(slit), "body boom: its slit is one of structure = \"solid\""));
  EXPECT_TRUE(any_has(warnings(with(swing_on_joints, "E = 70e9", "E = 70")), "is no material in Pa and kg/m^3"));
}

TEST(Warnings, OfKeysThatDoNothing) {
  const auto has = [](const std::string& text, const std::string& words) {
    return any_has(parse_scene(text, "x.toml").warnings, words);
  };
  const std::string closed =
      with(swing_on_joints, "modes = 1", "modes = 1\nstructure = \"eq14\"\nrotary_inertia = false\norder = 6");
  EXPECT_TRUE(has(closed, "body boom: rotary_inertia, order do nothing, structure is \"eq14\" and has no beams"));
  EXPECT_TRUE(has(swing_on_joints + "threshold = 0.3\n", "joint hinge: threshold does nothing"));
  EXPECT_TRUE(has(swing_on_joints + "[integrator]\nsettle = 0.1\n", "integrator: settle does nothing"));
  EXPECT_FALSE(has(swing_on_joints + "threshold = 0.3\nstop_stiffness = 2\n", "nothing"));
  EXPECT_TRUE(has(with(swing_on_joints, "stiffness = 1\n", "rest = 0.1\n"), "joint hinge: rest does nothing"));
  EXPECT_TRUE(has(with(swing_on_joints, "kind = \"free\"\n", "kind = \"free\"\nloads = true\n"),
                  "joint hub: loads does nothing"));
  const std::string at = "= { body = \"boom\", marker = \"tip\" }\n";
  EXPECT_TRUE(has(swing_on_joints + "[[loads]]\nname = \"idle\"\nat " + at, "load idle: it does nothing"));
  EXPECT_TRUE(has(swing_on_joints + "[[springs]]\nname = \"slack\"\na = { body = \"hub\" }\nb " + at,
                  "spring slack: it does nothing"));
  EXPECT_FALSE(has(swing_on_joints, "nothing"));
}

TEST(Warnings, OfKilometresAndDegrees) {
  const std::string joint = swing_on_joints + "rest = 90\n";
  EXPECT_TRUE(any_has(parse_scene(joint, "x.toml").warnings, "joint hinge: has the rest of its spring at 90 rad"));
  const std::string scene = swing_on_hinge + "[orbit]\naltitude = 405\n";
  EXPECT_TRUE(any_has(parse_scene(scene, "x.toml").warnings, "orbit.altitude: 405 m is inside the atmosphere"));
}

// What a file says of itself is read where it is used.
TEST(Warnings, OfABodyWhoseFileFailsItsOwnChecks) {
  const auto failed = [](ReducedBody& body) { body.certificate = {{"mass", 1.0, 2.0, 0.5, false}}; };
  const auto passed = [](ReducedBody& body) { body.certificate = {{"mass", 1.0, 1.0, 0.0, true}}; };
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("check." + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  for (const bool good : {true, false}) {
    Scene scene = with_reduced(swing_on_joints, good ? std::function<void(ReducedBody&)>(passed) : failed);
    scene.bodies[0].reduced_file = folder / "boom.h5";
    write_body_file(scene.bodies[0].reduced_file, *scene.bodies[0].reduced);
    std::ofstream(folder / "scene.toml") << to_toml(scene);
    CommonOptions quiet;
    quiet.quiet = true;
    EXPECT_EQ(check_command((folder / "scene.toml").string(), quiet), good ? exit_ok : exit_check_failed);
    EXPECT_EQ(any_has(read_scene(folder / "scene.toml").warnings, "fails its own check \"mass\""), !good);
  }
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace flexboom
