#include "apps/scene/scene.hpp"

#include "fem/base/check.hpp"
#include "scene_testing.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <random>

namespace flexboom {
namespace {

using std::numbers::pi;

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string fault_of(const std::string& text) {
  try {
    parse_scene(text, "scene.toml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Scene, SportReadsAsThePaperSays) {
  const Scene scene = read_scene(meshes / "sport.toml");
  EXPECT_EQ(scene.hub.mass, 8.5);
  const struct {
    const char* name;
    double length, diameter;
    Eigen::Vector3d point;
    double P1;
  } table_1[] = {{"efield_plus", 0.295, 0.005, {0.116, -0.151, 0.029}, 0.35},
                 {"efield_minus", 0.295, 0.005, {-0.111, -0.151, 0.029}, 0.35},
                 {"sip", 0.302, 0.010, {0.091, -0.151, -0.053}, 0.25},
                 {"slp", 0.146, 0.005, {0.069, -0.151, 0.053}, 0.31}};
  ASSERT_EQ(scene.bodies.size(), 4u);
  ASSERT_EQ(scene.hinges.size(), 4u);
  for (size_t i = 0; i < 4; ++i) {
    const auto& [name, length, diameter, point, P1] = table_1[i];
    const BodyScene& body = scene.bodies[i];
    EXPECT_EQ(body.name, name);
    EXPECT_EQ(body.modes, 2);
    EXPECT_EQ(body.damping.value, 0.05);
    const BeamSegment& bar = body.geometry.segments.at(0);
    EXPECT_EQ(bar.length, length);
    EXPECT_EQ(std::get<RoundBar>(bar.start).diameter, diameter);
    EXPECT_EQ(bar.material.E, 67e9);
    EXPECT_EQ(bar.material.nu, 0.33);
    EXPECT_EQ(bar.material.rho, 2840);
    const Hinge& hinge = scene.hinges[i].hinge;
    EXPECT_EQ(scene.hinges[i].body, name);
    EXPECT_EQ(hinge.point, point);
    EXPECT_EQ(hinge.mechanism.stiffness, P1 / (pi / 2));  // eq. 17: P1 / Theta_r per radian, free at pi/2
    EXPECT_EQ(hinge.mechanism.rest, pi / 2);
    EXPECT_EQ(hinge.mechanism.damping, 0.01);
    EXPECT_EQ(hinge.mechanism.stop_stiffness, 10);
    EXPECT_EQ(hinge.mechanism.threshold, pi / 2);
    EXPECT_NEAR(scene.hinges[i].start_angle, 87 * pi / 180, 1e-15);  // the decimals of the file
  }
  ASSERT_TRUE(scene.orbit.has_value());
  // 405 km: 92.6 minutes per turn, the digits of the textbook formula with mu and the radius to 7 digits.
  EXPECT_NEAR(2 * pi / scene.orbit->rate() / 60, 92.66, 0.02);
}

TEST(Scene, InertiaThatIsNearlySymmetricIsRepairedWithAWarning) {
  const Scene scene = read_scene(meshes / "sport.toml");
  const double Ixz = 0.5 * (0.00098 + 0.0009895);  // eq. 20 prints both
  const Eigen::Matrix3d symmetric{{0.10477, 0.003148, Ixz}, {0.003148, 0.05858, -0.001259}, {Ixz, -0.001259, 0.134942}};
  EXPECT_EQ(scene.hub.inertia, symmetric);
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_NE(scene.warnings[0].find("hub.inertia: not symmetric"), std::string::npos) << scene.warnings[0];
}

/// The scene with wheels flies the spacecraft of the other, stowed directions and hinge axes included.
TEST(Scene, CalibrationTurnsTheSpacecraftOfSport) {
  const Scene sport = load_scene("sport"), turned = load_scene("sport-calibration");
  ASSERT_TRUE(turned.bodies[0].rigid);
  EXPECT_EQ(turned.bodies[0].rigid->mass, sport.hub.mass);
  EXPECT_TRUE(turned.bodies[0].rigid->inertia.isApprox(sport.hub.inertia, 1e-15));
  EXPECT_EQ(turned.bodies[0].rigid->size, sport.hub.size);
  for (size_t i = 0; i < 4; ++i) {
    const Hinge& hinge = sport.hinges[i].hinge;
    const JointScene& joint = turned.joints[i + 1];
    EXPECT_EQ(joint.name, sport.hinges[i].body);
    EXPECT_EQ(joint.a.point, hinge.point);
    EXPECT_EQ(joint.a.x, hinge.stowed);
    EXPECT_EQ(joint.a.z, hinge.stowed.cross(hinge.outward));
    EXPECT_EQ(joint.mechanism.stiffness, hinge.mechanism.stiffness);
    EXPECT_EQ(joint.mechanism.rest, hinge.mechanism.rest);
    EXPECT_EQ(joint.mechanism.damping, hinge.mechanism.damping);
    EXPECT_EQ(joint.mechanism.stop_stiffness, hinge.mechanism.stop_stiffness);
    EXPECT_EQ(joint.mechanism.threshold, hinge.mechanism.threshold);
    const BeamSegment &bar = turned.bodies[i + 1].geometry.segments.at(0),
                      &same = sport.bodies[i].geometry.segments.at(0);
    EXPECT_EQ(bar.length, same.length);
    EXPECT_EQ(std::get<RoundBar>(bar.start).diameter, std::get<RoundBar>(same.start).diameter);
    EXPECT_EQ(bar.material.rho, same.material.rho);
    EXPECT_EQ(turned.bodies[i + 1].damping.value, sport.bodies[i].damping.value);
  }
}

TEST(Scene, BuiltInSceneIsTheFileInMeshes) {
  ASSERT_NE(builtin_scene("sport"), nullptr);
  EXPECT_EQ(builtin_scene("sport"), text_of(meshes / "sport.toml"));
  EXPECT_EQ(builtin_scene("spurt"), nullptr);
  EXPECT_EQ(load_scene("sport").bodies.size(), 4u);
  EXPECT_EQ(load_scene((meshes / "sport.toml").string()).bodies.size(), 4u);
}

TEST(Scene, NeitherFileNorBuiltInNameListsTheBuiltInNames) {
  try {
    load_scene("spurt");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("built-in: \"sport\""), std::string::npos) << error.what();
  }
}

TEST(Scene, MissingFileAndFolderAreInputErrors) {
  EXPECT_THROW(read_scene(meshes / "nowhere.toml"), InputError);
  EXPECT_THROW(read_scene(meshes), InputError);
  EXPECT_THROW(read_body(meshes / "nowhere.toml"), InputError);
}

TEST(Scene, DirectionsAreMadeOrthonormalWithinRounding) {
  const Scene scene = parse_scene(with(with(full_scene, "[0.6, 0.8, 0]", "[0.70710678, 0.70710678, 0]"),
                                       "outward = [0, 0, 1]", "outward = [-0.7071067, 0.7071068, 0]"),
                                  "scene.toml");
  const Hinge& hinge = scene.hinges.at(0).hinge;
  constexpr double round_off = 4e-16;  // of a normalisation
  EXPECT_NEAR(hinge.stowed.norm(), 1, round_off);
  EXPECT_NEAR(hinge.outward.norm(), 1, round_off);
  EXPECT_NEAR(hinge.stowed.dot(hinge.outward), 0, round_off);
}

TEST(Scene, MarkerOfEncodingAndWindowsLineEndsAreAccepted) {
  std::string text = "\xEF\xBB\xBF";
  for (const char c : std::string_view(full_scene)) {
    if (c == '\n') text += '\r';
    text += c;
  }
  EXPECT_EQ(parse_scene(text, "scene.toml").bodies.size(), 1u);
}

TEST(Scene, ModesOfARigidBodyAreWarnedOf) {
  const Scene scene = parse_scene(with(full_scene, "structure = \"beam\"", "structure = \"rigid\""), "scene.toml");
  ASSERT_FALSE(scene.warnings.empty());
  EXPECT_NE(scene.warnings[0].find("bodies[0].modes"), std::string::npos);
}

TEST(Scene, ModeCountIsCheckedAgainstTheMesh) {
  // One Euler-Bernoulli element of order 1: in the hinge plane a deflection and a rotation of the tip.
  const std::string body = R"(format = "flexboom-scene-1"
name = "few"
hub = { fixed = true }
[[bodies]]
name = "rod"
modes = 2
theory = "euler-bernoulli"
order = 1
segments = [{ shape = "round-bar", diameter = 0.01, length = 0.3, elements = 1, material = { E = 7e10, nu = 0.3, rho = 2700 } }]
[[hinges]]
body = "rod"
point = [0, 0, 0]
stowed = [1, 0, 0]
outward = [0, 1, 0]
P1 = 0
)";
  EXPECT_EQ(fault_of(body), "");
  EXPECT_NE(fault_of(with(body, "modes = 2", "modes = 3"))
                .find("scene.toml:6:1: bodies[0].modes: is 3, but the mesh has only 2"),
            std::string::npos);
  const std::string all =
      with(body, "modes = 2", "modes = 8\ndirections = \"all\"");  // 6 of the tip, 1 axial, 1 torsion
  EXPECT_EQ(fault_of(all), "");
  EXPECT_NE(fault_of(with(all, "modes = 8", "modes = 9")), "");
}

TEST(Scene, ValidateFindsWhatAnOverrideBreaks) {
  const auto broken = [](auto change) {
    Scene scene = load_scene("sport");
    change(scene);
    try {
      validate(scene);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(broken([](Scene&) {}), "");
  EXPECT_EQ(broken([](Scene& s) { s.duration = -1; }), "duration: is -1 s; it must be positive");
  EXPECT_EQ(broken([](Scene& s) { s.bodies[1].structure = "solid"; }), "");
  EXPECT_NE(broken([](Scene& s) { s.bodies[1].modes = 5000; }).find("bodies[1].modes: is 5000, but the mesh has only"),
            std::string::npos);
  EXPECT_NE(broken([](Scene& s) { s.integrator = "bfd"; }).find("did you mean \"bdf\"?"), std::string::npos);
  EXPECT_EQ(broken([](Scene& s) { s.formulation = "multipliers", s.integrator = "bdf"; }),
            "integrator.method: is \"bdf\"; it must be \"auto\" or \"ida\"; \"bdf\" takes formulation = \"relative\"");
  EXPECT_NE(broken([](Scene& s) { s.formulation = "redundant"; }).find("\"relative\" or \"multipliers\""),
            std::string::npos);
}

TEST(Scene, EveryFaultIsReportedInOneGo) {
  const std::string text =
      with(with(with(full_scene, "duration = 3", "duration = 0"), "nu = 0.3", "nu = 0.6"), "modes", "mode");
  const std::string fault = fault_of(text);
  EXPECT_EQ(std::count(fault.begin(), fault.end(), '\n'), 2) << fault;
  EXPECT_LT(fault.find("scene.toml:3:1: duration"), fault.find("mode: unknown key; did you mean \"modes\"?"));
  EXPECT_LT(fault.find("mode: unknown key"), fault.find("bodies[0].segments[0].material.nu: is 0.6"));
}

TEST(Scene, WhatStandsInTheWrongPlaceIsToldWhatCouldStandThere) {
  const auto fault = [](const std::string& text) { return fault_of("format = \"flexboom-scene-1\"\n" + text); };
  const auto expect = [&](const std::string& text, const std::string& words) {
    EXPECT_NE(fault(text).find(words), std::string::npos) << fault(text);
  };
  expect("accuracy = 1e-3", "accuracy: is the number 0.001; it must be a table with tolerance, outputs, absolute");
  expect("[[bodies]]\nname = \"boom\"\ndamping = 0.01", "damping: is the number 0.01; it must be a table with rule");
  expect("[[joints]]\nb = \"boom\"", "joints[0].b: is the string \"boom\"; it must be a table with body, marker");
  expect("bodies = [1]", "bodies[0]: is the whole number 1; it must be a table with mass");
  expect("[accuracy]\nabsolute = [\"1e-9 rad\", \"1e-3 rad\"]",
         "is '1e-3 rad', and another error in rad stands before it");
  expect("[orbit]\ngravity = 9.81", "orbit.gravity: is the number 9.81; it must be \"none\" or \"differential\"");
  expect("[[joints]]\nkind = 3", "joints[0].kind: is the whole number 3; it must be \"fixed\"");
  // What follows from it is not told.
  EXPECT_EQ(fault("[[bodies]]\nname = \"boom\"\ndamping = 0.01").find("rule: is missing"), std::string::npos);
}

TEST(Body, ExamplesAreRead) {
  const BodyScene boom = read_body(meshes / "boom4.toml");
  EXPECT_EQ(boom.modes, 10);
  EXPECT_EQ(boom.geometry.length(), 0.302);
  const BodyScene stepped = read_body(meshes / "stepped_boom.toml");
  EXPECT_EQ(stepped.geometry.segments.size(), 3u);
  EXPECT_EQ(std::get<Tube>(stepped.geometry.segments[1].end).diameter, 0.008);
  EXPECT_EQ(std::get<Tube>(stepped.geometry.segments[1].end).thickness, 0.001);
  EXPECT_EQ(stepped.geometry.attachments.at(1).position, stepped.geometry.length());
  EXPECT_GT(make_mesh(stepped.geometry).nodes.cols(), 3);
}

// Whatever bytes come in, the answer is a scene or an InputError that names the file.
void expect_scene_or_input_error(const std::string& text) {
  try {
    validate(parse_scene(text, "mutant.toml"));
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).rfind("mutant.toml:", 0), 0u) << error.what();
  }
}

TEST(SceneFuzz, MutationsOfSportAreAcceptedOrInputErrors) {
  const std::string sport = builtin_scene("sport");
  std::mt19937 random(20);
  const auto below = [&random](size_t n) { return std::uniform_int_distribution<size_t>(0, n - 1)(random); };
  for (int i = 0; i < 600; ++i) {
    std::string text = sport;
    switch (i % 4) {
      case 0:
        text.resize(below(text.size()));
        break;
      case 1:
        for (size_t k = 0; k <= below(8); ++k) text[below(text.size())] = static_cast<char>(below(256));
        break;
      case 2:
        text.erase(below(text.size()), below(40));
        break;
      default: {  // a piece moved somewhere else
        const std::string piece = text.substr(below(text.size()), below(60));
        text.insert(below(text.size()), piece);
      }
    }
    EXPECT_NO_FATAL_FAILURE(expect_scene_or_input_error(text));
  }
}

TEST(SceneFuzz, DeepNestingIsAnInputError) {
  std::string dotted, brackets = "a = ";
  for (int i = 0; i < 200000; ++i) dotted += "a.";
  for (int i = 0; i < 2000; ++i) brackets += "[";
  EXPECT_THROW(parse_scene(dotted + "a = 1", "deep.toml"), InputError);
  EXPECT_THROW(parse_scene(brackets, "deep.toml"), InputError);
}

}  // namespace
}  // namespace flexboom
