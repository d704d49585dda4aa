#include "apps/scene.hpp"

#include "fem/check.hpp"
#include "fem/mesh.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <random>
#include <variant>

namespace flexboom {
namespace {

using std::numbers::pi;

const std::filesystem::path meshes = std::filesystem::path(FLEXBOOM_TEST_DATA).parent_path() / "meshes";

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// A scene that uses every key away from its default.
const char* const full_scene = R"(format = "flexboom-scene-1"
name = "everything"
duration = 3
output_step = 0.1
vtu_step = 0.5
accuracy = { tolerance = 1e-3, outputs = ["hub.rate", "box.tip"], budget = false }
integrator = { method = "adams", formulation = "relative", settle = 1e-7, rescale_at_events = true }
orbit = { altitude = 5e5, inclination = 1.5, gravity = "differential", J2 = true }
hub = { mass = 8.5, inertia = [0.1, 0.12, 0.05], fixed = false, size = [0.1, 0.2, 0.3] }
initial = { rate = [0.1, -0.2, 0.3], velocity = [1, 2, 3e-3] }
[[bodies]]
name = "box"
structure = "beam"
modes = "auto"
directions = "all"
order = 3
theory = "euler-bernoulli"
shear = 0.85
rotary_inertia = false
backend = "dense"
damping = { rule = "rayleigh", alpha = 0.1, beta = 1e-5 }
[[bodies.segments]]
shape = "rectangular-tube"
height = 0.02
width = 0.01
thickness = 0.001
length = 0.2
elements = 3
material = { E = 7e10, nu = 0.3, rho = 2700 }
[[bodies.segments]]
shape = "general"
A = 1e-5
Iy = 1e-10
Iz = 2e-10
J = 3e-10
kappa_y = 0.8
end = { A = 2e-5, kappa_z = 0.7 }
length = 0.1
material = { E = 7e10, nu = 0.3, rho = 2700 }
[[bodies.attachments]]
name = "head"
position = "tip"
mass = 0.1
inertia = [[1e-4, 1e-6, 0], [1e-6, 1e-4, 0], [0, 0, 1e-4]]
offset = [0.01, 0, 0]
[[bodies.attachments]]
position = 0.15
mass = 0.01
[[hinges]]
body = "box"
point = [0.05, 0, 0]
stowed = [0.6, 0.8, 0]
outward = [0, 0, 1]
stiffness = 0.3
rest = 1.5
P2 = 0.02
P3 = 11
threshold = 1.4
start_angle = 0.1
start_rate = -0.1
)";

bool same(const SectionShape& a, const SectionShape& b) {
  if (a.index() != b.index()) return false;
  const Section x = section_of(a, 0.3, {"cowper", 0}), y = section_of(b, 0.3, {"cowper", 0});
  return x.A == y.A && x.Iy == y.Iy && x.Iz == y.Iz && x.J == y.J && x.kappa_y == y.kappa_y && x.kappa_z == y.kappa_z;
}

void expect_same(const BeamGeometry& a, const BeamGeometry& b) {
  EXPECT_EQ(a.theory, b.theory);
  EXPECT_EQ(a.shear.name, b.shear.name);
  EXPECT_EQ(a.shear.value, b.shear.value);
  EXPECT_EQ(a.rotary_inertia, b.rotary_inertia);
  EXPECT_EQ(a.order, b.order);
  ASSERT_EQ(a.segments.size(), b.segments.size());
  for (size_t i = 0; i < a.segments.size(); ++i) {
    const BeamSegment &x = a.segments[i], &y = b.segments[i];
    EXPECT_TRUE(same(x.start, y.start) && same(x.end, y.end)) << "segment " << i;
    EXPECT_EQ(x.length, y.length);
    EXPECT_EQ(x.elements, y.elements);
    EXPECT_EQ(x.material.E, y.material.E);
    EXPECT_EQ(x.material.nu, y.material.nu);
    EXPECT_EQ(x.material.rho, y.material.rho);
  }
  ASSERT_EQ(a.attachments.size(), b.attachments.size());
  for (size_t i = 0; i < a.attachments.size(); ++i) {
    const RigidAttachment &x = a.attachments[i], &y = b.attachments[i];
    EXPECT_EQ(x.name, y.name);
    EXPECT_EQ(x.position, y.position);
    EXPECT_EQ(x.mass, y.mass);
    EXPECT_EQ(x.inertia, y.inertia);
    EXPECT_EQ(x.offset, y.offset);
  }
}

void expect_same(const BodyScene& a, const BodyScene& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.structure, b.structure);
  EXPECT_EQ(a.clamp, b.clamp);
  EXPECT_EQ(a.modes, b.modes);
  EXPECT_EQ(a.modes_auto, b.modes_auto);
  EXPECT_EQ(a.directions, b.directions);
  EXPECT_EQ(a.damping.name, b.damping.name);
  EXPECT_EQ(a.damping.value, b.damping.value);
  EXPECT_EQ(a.damping.alpha, b.damping.alpha);
  EXPECT_EQ(a.damping.beta, b.damping.beta);
  EXPECT_EQ(a.backend, b.backend);
  expect_same(a.geometry, b.geometry);
}

void expect_same(const HingeScene& a, const HingeScene& b) {
  EXPECT_EQ(a.body, b.body);
  EXPECT_EQ(a.hinge.name, b.hinge.name);
  EXPECT_EQ(a.hinge.point, b.hinge.point);
  EXPECT_EQ(a.hinge.stowed, b.hinge.stowed);
  EXPECT_EQ(a.hinge.outward, b.hinge.outward);
  const HingeMechanism &x = a.hinge.mechanism, &y = b.hinge.mechanism;
  EXPECT_EQ(x.stiffness, y.stiffness);
  EXPECT_EQ(x.rest, y.rest);
  EXPECT_EQ(x.damping, y.damping);
  EXPECT_EQ(x.stop_stiffness, y.stop_stiffness);
  EXPECT_EQ(x.threshold, y.threshold);
  EXPECT_EQ(a.start_angle, b.start_angle);
  EXPECT_EQ(a.start_rate, b.start_rate);
}

void expect_same_settings(const Scene& a, const Scene& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.duration, b.duration);
  EXPECT_EQ(a.output_step, b.output_step);
  EXPECT_EQ(a.vtu_step, b.vtu_step);
  EXPECT_EQ(a.tolerance, b.tolerance);
  EXPECT_EQ(a.outputs, b.outputs);
  EXPECT_EQ(a.error_budget, b.error_budget);
  EXPECT_EQ(a.integrator, b.integrator);
  EXPECT_EQ(a.formulation, b.formulation);
  EXPECT_EQ(a.settle, b.settle);
  EXPECT_EQ(a.rescale_at_events, b.rescale_at_events);
  EXPECT_EQ(a.hub.mass, b.hub.mass);
  EXPECT_EQ(a.hub.inertia, b.hub.inertia);
  EXPECT_EQ(a.hub.fixed, b.hub.fixed);
  EXPECT_EQ(a.hub.size, b.hub.size);
  EXPECT_EQ(a.start_rate, b.start_rate);
  EXPECT_EQ(a.start_velocity, b.start_velocity);
  ASSERT_EQ(a.orbit.has_value(), b.orbit.has_value());
  if (!a.orbit) return;
  EXPECT_EQ(a.orbit->altitude, b.orbit->altitude);
  EXPECT_EQ(a.orbit->inclination, b.orbit->inclination);
  EXPECT_EQ(a.orbit->gravity, b.orbit->gravity);
  EXPECT_EQ(a.orbit->J2, b.orbit->J2);
}

// Warnings are about what was repaired; a scene that is written out has been repaired.
void expect_round_trip(const Scene& scene) {
  const std::string text = to_toml(scene);
  const Scene again = parse_scene(text, "again.toml");
  expect_same_settings(scene, again);
  ASSERT_EQ(scene.bodies.size(), again.bodies.size());
  for (size_t i = 0; i < scene.bodies.size(); ++i) expect_same(scene.bodies[i], again.bodies[i]);
  ASSERT_EQ(scene.hinges.size(), again.hinges.size());
  for (size_t i = 0; i < scene.hinges.size(); ++i) expect_same(scene.hinges[i], again.hinges[i]);
  EXPECT_TRUE(again.warnings.empty());
  EXPECT_EQ(text, to_toml(again));
}

std::string fault_of(const std::string& text) {
  try {
    parse_scene(text, "scene.toml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Scene, SportReadsAsThePaperSays) {
  const Scene scene = read_scene(meshes / "sport.toml");
  EXPECT_EQ(scene.bodies.size(), 4u);
  EXPECT_EQ(scene.bodies[2].name, "sip");
  EXPECT_EQ(std::get<RoundBar>(scene.bodies[2].geometry.segments.at(0).start).diameter, 0.010);
  EXPECT_EQ(scene.bodies[3].damping.value, 0.05);
  EXPECT_EQ(scene.hinges[3].hinge.mechanism.stiffness, 0.31 / (pi / 2));
  EXPECT_EQ(scene.hinges[3].hinge.mechanism.rest, pi / 2);
  EXPECT_NEAR(scene.hinges[0].start_angle, 87 * pi / 180, 1e-15);  // the decimals of the file
  ASSERT_TRUE(scene.orbit.has_value());
  // 405 km: 92.6 minutes per turn, the digits of the textbook formula with mu and the radius to 7 digits.
  EXPECT_NEAR(2 * pi / scene.orbit->rate() / 60, 92.66, 0.02);
}

TEST(Scene, InertiaThatIsNearlySymmetricIsRepairedWithAWarning) {
  const Scene scene = read_scene(meshes / "sport.toml");
  EXPECT_EQ(scene.hub.inertia(0, 1), 0.5 * (0.00098 + 0.0009895));
  EXPECT_EQ(scene.hub.inertia, scene.hub.inertia.transpose());
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_NE(scene.warnings[0].find("hub.inertia: not symmetric"), std::string::npos) << scene.warnings[0];
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

TEST(Scene, EveryKeyIsRead) {
  const Scene scene = parse_scene(full_scene, "full.toml");
  const BodyScene& body = scene.bodies.at(0);
  EXPECT_EQ(scene.integrator, "adams");
  EXPECT_EQ(scene.settle, 1e-7);
  EXPECT_FALSE(scene.error_budget);
  EXPECT_TRUE(body.modes_auto);
  EXPECT_EQ(body.geometry.shear.name, "value");
  EXPECT_EQ(body.geometry.shear.value, 0.85);
  EXPECT_EQ(body.geometry.theory, BeamTheory::euler_bernoulli);
  const auto& end = std::get<GeneralSection>(body.geometry.segments.at(1).end);
  EXPECT_EQ(end.A, 2e-5);
  EXPECT_EQ(end.Iz, 2e-10);  // as the start
  EXPECT_EQ(end.kappa_z, 0.7);
  EXPECT_EQ(body.geometry.attachments.at(0).position, body.geometry.length());
  EXPECT_EQ(scene.hinges.at(0).hinge.mechanism.stiffness, 0.3);
}

TEST(Scene, WrittenSceneReadsBackTheSame) {
  expect_round_trip(load_scene("sport"));
  expect_round_trip(parse_scene(full_scene, "full.toml"));
}

TEST(Scene, RandomNumbersSurviveTheRoundTripBitForBit) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0.1, 1);
  for (int i = 0; i < 20; ++i) {
    Scene scene = load_scene("sport");
    scene.duration = std::pow(10, 4 * unit(random));
    for (HingeScene& hinge : scene.hinges) {
      hinge.hinge.stowed = Eigen::Vector3d::NullaryExpr([&] { return unit(random); }).normalized();
      hinge.hinge.outward = hinge.hinge.stowed.unitOrthogonal();
      hinge.hinge.mechanism.stiffness = unit(random) * 1e-7;
      hinge.start_angle = unit(random) * 1e22;
    }
    expect_round_trip(scene);
  }
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

TEST(Scene, HubAloneIsAScene) {
  const Scene scene =
      parse_scene("format = \"flexboom-scene-1\"\nname = \"hub\"\n[hub]\nmass = 1\ninertia = [1, 1, 1]\n", "hub.toml");
  EXPECT_TRUE(scene.bodies.empty());
  EXPECT_EQ(scene.duration, 10);
  expect_round_trip(scene);
}

TEST(Scene, FixedHubNeedsNoMass) {
  const Scene scene =
      parse_scene("format = \"flexboom-scene-1\"\nname = \"hub\"\nhub = { fixed = true }\n", "hub.toml");
  EXPECT_TRUE(scene.hub.fixed);
  expect_round_trip(scene);
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
  ASSERT_EQ(scene.warnings.size(), 1u);
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
  EXPECT_EQ(
      broken([](Scene& s) { s.bodies[1].structure = "solid"; }),
      "bodies[1].structure: \"solid\" has modes and a mesh but does not fly in this version; in a scene it must be "
      "\"beam\", \"eq14\" or \"rigid\"");
  EXPECT_NE(broken([](Scene& s) { s.bodies[1].modes = 5000; }).find("bodies[1].modes: is 5000, but the mesh has only"),
            std::string::npos);
  EXPECT_NE(broken([](Scene& s) { s.integrator = "bfd"; }).find("did you mean \"bdf\"?"), std::string::npos);
  EXPECT_EQ(broken([](Scene& s) { s.formulation = "multipliers", s.integrator = "bdf"; }),
            "integrator.method: is \"bdf\"; it must be \"auto\" or \"ida\"");
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

TEST(Scene, BodyFromAFileTakesOverridesButNoGeometry) {
  const std::string entry = R"(format = "flexboom-scene-1"
name = "with_file"
hub = { fixed = true }
[[bodies]]
file = "boom4.toml"
name = "probe"
modes = 3
)";
  const std::string hinge =
      "[[hinges]]\nbody = \"probe\"\npoint = [0, 0, 0]\nstowed = [1, 0, 0]\noutward = [0, 1, 0]\nP1 = 0\n";
  const Scene scene = parse_scene(entry + hinge, "scene.toml", meshes);
  EXPECT_EQ(scene.bodies.at(0).name, "probe");
  EXPECT_EQ(scene.bodies.at(0).modes, 3);
  EXPECT_EQ(scene.bodies.at(0).geometry.order, 8);
  expect_round_trip(scene);
  try {
    parse_scene(entry + "order = 3\n" + hinge, "scene.toml", meshes);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("scene.toml:8:1: bodies[0].order: unknown key"), std::string::npos)
        << error.what();
  }
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
