// stiffening = "auto": what happens between two outputs is looked at, too.

#include "tests/apps/run_testing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom {
namespace {

/// A strip of Euler load 39 N that its own load bends.
const std::string strip = R"toml(format = "flexboom-scene-1"
name = "strip"
duration = 1.0
output_step = 0.05
accuracy = { tolerance = 1e-3, budget = false }
[[bodies]]
name = "strip"
modes = 3
damping = { rule = "modal", value = 0.05 }
[[bodies.segments]]
shape = "rectangle"
height = 0.003
width = 0.03
length = 1.0
material = { E = 70e9, nu = 0.33, rho = 2700 }
[[loads]]
name = "lateral"
at = { body = "strip", marker = "tip" }
axes = "inertial"
force = ["0", "0.1", "0"]
)toml";
const std::string clamped = R"toml([[joints]]
name = "clamp"
kind = "fixed"
b = { body = "strip", marker = "root" }
)toml";

std::string pushed(const std::string& force) {
  return strip + clamped +
         "[[loads]]\nname = \"push\"\naxes = \"inertial\"\nat = { body = \"strip\", marker = \"tip\" }\n" +
         "force = [\"" + force + "\", \"0\", \"0\"]\n";
}

/// A slider along the strip, whose lower end is at hand.
std::string dropped(const std::string& end) {
  return strip + R"toml([[joints]]
name = "rail"
kind = "slider"
a = { body = "ground", x = [0, 0, 1], z = [1, 0, 0] }
b = { body = "strip", marker = "root", x = [0, 0, 1], z = [1, 0, 0] }
start_rate = -0.4
start = 0.05
)toml" + "lower_stop = { at = 0.0, " +
         end + " }\n";
}

/// Is geometric stiffness in the equations, as the plan says?
bool is_on(const std::string& text) {
  const RunResult r = run_scene(parse_scene(text, "scene.toml"), {});
  return std::ranges::any_of(r.plan, [](const std::string& line) {
    return line.starts_with("strip: geometric stiffness on (stiffening = \"auto\")");
  });
}

TEST(StiffeningChoice, StaysOffWhereNothingPushes) {
  EXPECT_FALSE(is_on(strip + clamped));
  EXPECT_FALSE(is_on(pushed("-1e-6")));
}

TEST(StiffeningChoice, SeesPulsesBetweenOutputs) { EXPECT_TRUE(is_on(pushed("-50*((t > 0.523)*(t < 0.527))"))); }

TEST(StiffeningChoice, SeesTonesThatAreZeroAtAllOutputs) { EXPECT_TRUE(is_on(pushed("5*sin(2*pi*20*t)"))); }

TEST(StiffeningChoice, SeesPadsThatPushBetweenOutputs) {
  const std::string pad = dropped("stiffness = 1e5");
  EXPECT_TRUE(is_on(pad));
  EXPECT_TRUE(is_on(pad + "[integrator]\nformulation = \"multipliers\"\n"));
}

// The tip goes across, so the strip gets shorter, and that is all that moves it along its slider.
TEST(StiffeningChoice, SeesWhatMovesAJointThatNothingElseMoves) {
  std::string free = dropped("stiffness = 1e5");
  free.replace(free.find("start_rate"), std::string::npos, "");
  EXPECT_TRUE(is_on(free));
  EXPECT_TRUE(is_on(free + "[integrator]\nformulation = \"multipliers\"\n"));
}

// A spring from the tip to the ground: the strip is stretched as it bends, and a flight without that does not show it.
TEST(StiffeningChoice, IsNotKnownWithoutItWhereBothEndsAreHeld) {
  std::string text = strip + clamped + R"toml([[springs]]
name = "stay"
a = { body = "strip", marker = "tip" }
b = { body = "ground", point = [2, 0, 0] }
stiffness = 1e5
free_length = 1.0
)toml";
  text.replace(text.find("modes = 3"), 9, "modes = 3\nstiffening = \"off\"");
  const RunResult r = run_scene(parse_scene(text, "scene.toml"), {});
  const auto has = [](const std::vector<std::string>& lines, std::string_view part) {
    return std::ranges::any_of(lines, [&](const std::string& l) { return l.find(part) != std::string::npos; });
  };
  EXPECT_TRUE(has(r.warnings, "body strip: a joint that closes a loop or a spring holds it at both ends"));
  EXPECT_TRUE(has(r.plan, "strip: geometric stiffness off (stiffening = \"off\"): its effect is not known"));
}

TEST(StiffeningChoice, BeginsWithItWhereStopsAreRigid) { EXPECT_TRUE(is_on(dropped("restitution = 0.8"))); }

}  // namespace
}  // namespace flexboom
