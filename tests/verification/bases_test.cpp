// Every basis in every place: one motion to the modes that each leaves out.

#include "tests/apps/run_testing.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace flexboom {
namespace {

constexpr const char* start = R"toml(format = "flexboom-scene-1"
name = "bases"
duration = 0.2
output_step = 0.01
accuracy = { tolerance = 1e-7, budget = false }
)toml";

// Its stiffening, which a hub does not have, is left out everywhere.
constexpr const char* boom = R"toml(
[[bodies]]
name = "boom"
structure = "{}"
{}
stiffening = "off"
solid = {{ accuracy = 1e-2 }}
segments = [{{ shape = "round-bar", diameter = 0.004, length = 0.4, material = {{ E = 67e9, nu = 0.33, rho = 2840 }} }}]
)toml";

constexpr const char* on_a_hub = R"toml(
[hub]
mass = 2.5
inertia = [[0.010, 0.001, 0], [0.001, 0.014, 0], [0, 0, 0.006]]
[initial]
rate = [1e-3, 2e-3, -1.5e-3]
[[hinges]]
body = "boom"
point = [0.1, 0.05, 0.15]
stowed = [0, 0, -1]
outward = [1, 0, 0]
stiffness = 0.3
P2 = 0.002
P3 = 20
threshold = 1.4
rest = 1.4
start_angle = 1.398
start_rate = 0.02
)toml";

/// The same by joints, and a weight on the tip of the boom.
constexpr const char* on_joints = R"toml(
[[bodies]]
name = "hub"
mass = 2.5
inertia = [[0.010, 0.001, 0], [0.001, 0.014, 0], [0, 0, 0.006]]
[[bodies]]
name = "weight"
mass = 0.01
inertia = [1e-6, 1e-6, 1e-6]
[[joints]]
kind = "free"
b = { body = "hub" }
start_omega = [1e-3, 2e-3, -1.5e-3]
[[joints]]
kind = "hinge"
a = { body = "hub", point = [0.1, 0.05, 0.15], x = [0, 0, -1], z = [0, -1, 0] }
b = { body = "boom" }
stiffness = 0.3
rest = 1.4
damping = 0.002
stop_stiffness = 20
threshold = 1.4
start = 1.398
start_rate = 0.02
[[joints]]
kind = "spherical"
a = { body = "boom", marker = "tip" }
b = { body = "weight", point = [0, 0.01, 0] }
)toml";

struct Basis {
  const char* name;
  const char* keys;
  bool root_held = true;
};

// Enough modes for a truncation below 1e-4. Where the root moves in the frame, the static shapes of its loads stand for
// the many modes that they need. The frames differ by the square of the deflection, which is 1e-5 of the motion here.
constexpr Basis bases[] = {
    {"hinge", "basis = \"hinge\"\nmodes = 3\ncorrections = [\"tip.Fy\"]"},
    {"prestressed", "basis = \"prestressed\"\nmodes = 6\ncorrections = [\"tip.Fy\"]"},
    {"craig-bampton", "basis = \"craig-bampton\"\nmodes = 4"},
    {"orthonormal craig-bampton", "basis = \"craig-bampton\"\nmodes = 4\northonormal = true"},
    {"craig-bampton carried at its tip", "basis = \"craig-bampton\"\nmodes = 4\nreference = \"tip\""},
    {"mean-axis", "basis = \"mean-axis\"\nmodes = 5\ncorrections = [\"root.Fy\", \"root.Mz\", \"tip.Fy\"]", false},
    {"clamped at its tip", "clamp = \"tip\"\nmodes = 5\ncorrections = [\"root.Fy\", \"root.Mz\"]", false},
};

// The frames' share, as above.
constexpr double frames_apart = 1e-4;
// A root that is not held rides on the mean motion of its face, whose points may move against each other. A clamped
// face may not. The clamp therefore shortens the boom by a part of its radius, which is 5e-3 of the length here.
constexpr double faces_apart = 3e-3;

RunResult flown(const char* structure, const char* keys, const char* place, const char* formulation) {
  Scene scene = parse_scene(start + fmt::format(fmt::runtime(boom), structure, keys) + place, "bases");
  scene.formulation = formulation;
  scene.bodies_kept_in = std::filesystem::path(::testing::TempDir()) / "flexboom_bases";
  validate(scene);
  return run_scene(scene, {});
}

/// Largest difference of what has the same meaning in every frame, over its largest value. Vectors count as a whole: an
/// axis along which nearly nothing moves has no digits of its own.
double apart(const RunResult& a, const RunResult& b) {
  double most = 0;
  const auto compare = [&](const std::vector<std::string>& outputs) {
    double difference = 0, size = 0;
    for (const std::string& output : outputs) {
      const Eigen::VectorXd u = column(a, output), v = column(b, output);
      difference = std::max(difference, (u - v).lpNorm<Eigen::Infinity>());
      size = std::max(size, v.lpNorm<Eigen::Infinity>());
    }
    most = std::max(most, difference / size);
  };
  compare({"hub.rotation.x", "hub.rotation.y", "hub.rotation.z"});
  compare({"hub.position.x", "hub.position.y", "hub.position.z"});
  compare({"boom.angle"});
  return most;
}

class SlowBases : public ::testing::TestWithParam<const char*> {};

TEST_P(SlowBases, FlyAlikeInEveryPlace) {
  const std::string structure = GetParam();
  for (const char* place : {on_a_hub, on_joints}) {
    const std::string where = place == on_a_hub ? "hub" : "joints";
    const RunResult clamped = flown(GetParam(), "modes = 14", place, "relative");
    const RunResult rough = flown(GetParam(), "modes = 0", place, "relative");
    for (const Basis& basis : bases)
      for (const char* formulation : {"relative", "multipliers"}) {
        const std::string name = fmt::format("{} {} on {} by {}", basis.name, structure, where, formulation);
        try {
          const RunResult r = flown(GetParam(), basis.keys, place, formulation);
          const double error = apart(r, clamped);
          std::printf("%s: %d coordinates, %.1e apart (rigid %.1e)\n", name.c_str(), r.bodies[0].body.n(), error,
                      apart(rough, clamped));
          EXPECT_LT(error, structure == "solid" && !basis.root_held ? faces_apart : frames_apart) << name;
          EXPECT_LT(r.motion.summary.energy_balance, 1e-6) << name;
          EXPECT_EQ(r.motion.events.size(), clamped.motion.events.size()) << name;
        } catch (const std::exception& fault) {
          ADD_FAILURE() << name << ": " << fault.what();
        }
      }
  }
}

INSTANTIATE_TEST_SUITE_P(Structures, SlowBases, ::testing::Values("beam", "solid"),
                         [](const auto& instance) { return std::string(instance.param); });

}  // namespace
}  // namespace flexboom
