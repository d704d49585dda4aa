// What `flexboom keys` and meshes/README.md say of the keys is what the readers do.

#include "apps/scene/key_tables.hpp"

#include "apps/scene/scene.hpp"
#include "apps/scene/scene_keys.hpp"
#include "fem/base/check.hpp"
#include "scene_testing.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <vector>

namespace flexboom {
namespace {

// The tables are made of the description that the readers use, so they have every key, once.
TEST(Scene, EveryKeyThatIsReadIsInTheTables) {
  std::set<std::string> documented;
  for (const KeySection& section : key_sections())
    for (const KeyRow& row : section.rows) documented.insert(row.key);
  std::set<std::string> known = keys_known(full_scene, ".");
  known.merge(keys_known(full_tree, "."));
  known.merge(keys_known(builtin_scene("sport-calibration"), "."));
  known.merge(keys_known(builtin_scene("latching-panel"), "."));
  EXPECT_GT(known.size(), 150u);
  const std::set<std::string> tables = {"format",  "accuracy", "integrator", "orbit",    "bodies",     "joints",
                                        "springs", "loads",    "wheels",     "turns",    "hub",        "initial",
                                        "hinges",  "solid",    "grading",    "segments", "attachments"};
  for (const std::string& key : known) {
    const std::string name = key.substr(key.rfind('.') + 1);
    EXPECT_TRUE(documented.contains(name) || tables.contains(name)) << key;
  }
}

/// Scenes with every table and nothing that need not be said. A comment names the section whose keys belong there.
const char* const least_tree = R"(format = "flexboom-scene-1"
name = "least"
# Top level of a scene
[accuracy]
# [accuracy]
[integrator]
# [integrator]
[orbit]
# [orbit]
[[bodies]]
name = "boom"
# [[bodies]]
[bodies.damping]
rule = "none"
# Damping
[bodies.solid]
# [bodies.solid]
[[bodies.segments]]
shape = "general"
A = 1e-4
Iy = 1e-9
Iz = 1e-9
J = 1e-9
length = 1
material = { E = 7e10, nu = 0.3, rho = 2700 }
# [[bodies.segments]]
[[bodies.attachments]]
position = "tip"
mass = 1
# [[bodies.attachments]]
[[bodies]]
name = "hub"
mass = 1
inertia = [1, 1, 1]
# Rigid `[[bodies]]`
[[bodies]]
name = "stiff"
basis = "prestressed"
[bodies.prestress]
# Prestress
[[bodies.segments]]
shape = "round-bar"
diameter = 0.01
length = 1
material = { E = 7e10, nu = 0.3, rho = 2700 }
[[joints]]
kind = "free"
b = { body = "hub" }
[[joints]]
kind = "hinge"
b = { body = "boom" }
# [[joints]]
# Laws of a hinge or a slider
[joints.a]
body = "hub"
[joints.upper_stop]
at = 1
restitution = 0.5
# Stop
[[joints]]
kind = "hinge"
a = { body = "hub" }
b = { body = "stiff" }
[joints.drive]
angle = 1
peak_rate = 1
peak_acceleration = 1
# Turn over time
[[springs]]
name = "spring"
b = { body = "hub", point = [1, 0, 0] }
# [[springs]]
[springs.a]
# Place
[[loads]]
name = "load"
at = { body = "hub" }
# [[loads]]
[[wheels]]
name = "x"
body = "hub"
axis = [1, 0, 0]
inertia = 1
[[wheels]]
name = "y"
body = "hub"
axis = [0, 1, 0]
inertia = 1
[[wheels]]
name = "z"
body = "hub"
inertia = 1
# [[wheels]]
[[wheels]]
name = "fourth"
body = "hub"
inertia = 1
[wheels.torque]
time = [0, 20]
value = [1, 1]
# Table over time
[[turns]]
body = "hub"
angle = 1
peak_rate = 0.1
peak_acceleration = 0.1
# [[turns]]
)";

const char* const least_hub = R"(format = "flexboom-scene-1"
name = "least"
[hub]
mass = 1
inertia = [1, 1, 1]
# [hub]
[initial]
# [initial]
[[bodies]]
name = "boom"
segments = [{ shape = "round-bar", diameter = 0.01, length = 1, material = { E = 7e10, nu = 0.3, rho = 2700 } }]
[[hinges]]
body = "boom"
point = [0, 0, 0]
stowed = [0, 1, 0]
outward = [1, 0, 0]
stiffness = 1
# [[hinges]]
)";

/// A default of the tables as a value of TOML; empty where it is told in words.
std::string plain_default(const std::string& text) {
  if (text == "zero") return "[0, 0, 0]";
  if (text == "pi/2") return fmt::format("{}", std::numbers::pi / 2);
  if (text == "true" || text == "false") return text;
  if (text.starts_with("`\"") || text.starts_with("`[")) return text.substr(1, text.size() - 2);
  const bool number = !text.empty() && text.find_first_not_of("0123456789.+-e") == std::string::npos;
  return number || text.starts_with('[') ? text : "";
}

// To say it changes nothing.
TEST(Scene, DefaultsOfTheTablesAreThoseOfTheScene) {
  const std::map<std::string, std::string> beside = {// without which a key is not for the body, or is not written
                                                     {"[[bodies]] directions", "modes = 1\n"},
                                                     {"[[bodies]] interfaces", "basis = \"craig-bampton\"\n"},
                                                     {"[[bodies]] reference", "basis = \"craig-bampton\"\n"}};
  const auto read_back = [](const std::string& text) { return to_toml(parse_scene(text, "least.toml")); };
  int defaults = 0;
  for (const KeySection& section : key_sections())
    for (const KeyRow& row : section.rows) {
      const std::string value = plain_default(row.otherwise), mark = "# " + section.title + "\n";
      const std::string key = section.title + " " + row.key;
      if (value.empty() || key == "Reduced `[[bodies]]` stiffening") continue;
      if (key == "[[joints]] start_rate") continue;  // one number or two; none is written as none
      const std::string least = std::string(least_tree).find(mark) != std::string::npos ? least_tree : least_hub;
      const std::string other = beside.contains(key) ? beside.at(key) : "";
      SCOPED_TRACE(key + " = " + value);
      try {
        EXPECT_EQ(read_back(with(least, mark, other + row.key + " = " + value + "\n")),
                  read_back(with(least, mark, other)));
      } catch (const InputError& error) {
        ADD_FAILURE() << error.what();
      }
      ++defaults;
    }
  EXPECT_GT(defaults, 80);
  EXPECT_TRUE(parse_scene(least_tree, "least.toml").joints[1].start_rate.empty());
}

/// meshes/README.md has what `flexboom keys` prints: each table as it is, and no other table of keys.
TEST(Scene, ReadmeHasTheTablesOfTheProgram) {
  std::ifstream file(meshes / "README.md");
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const std::vector<KeySection> sections = key_sections();
  size_t tables = 0;
  const std::string head = "| key | unit | default |";
  for (size_t at = text.find(head); at != std::string::npos; at = text.find(head, at + 1)) ++tables;
  EXPECT_EQ(tables, sections.size());
  for (const KeySection& section : sections)
    EXPECT_NE(text.find(to_markdown(section)), std::string::npos) << "meshes/README.md needs, from `flexboom keys`:\n"
                                                                  << to_markdown(section);
}

/// The example that meshes/README.md explains is the scene of that name, word by word.
TEST(Scene, ReadmeExplainsTheSceneAsItIs) {
  std::ifstream file(meshes / "README.md");
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const size_t end = text.find("\n## Files");
  const std::string scene = builtin_scene("wing-satellite"), mark = "```toml\n";
  int blocks = 0;
  for (size_t at = text.find(mark); at < end; at = text.find(mark, at + 1), ++blocks) {
    const std::string block = text.substr(at + mark.size(), text.find("```", at + 1) - at - mark.size());
    for (size_t part = 0; part < block.size();) {  // separated by empty lines
      const size_t next = std::min(block.find("\n\n", part), block.size() - 1);
      const std::string piece = block.substr(part, next + 1 - part);
      EXPECT_NE(scene.find(piece), std::string::npos) << piece;
      part = next + 2;
    }
  }
  EXPECT_GE(blocks, 5);
}

}  // namespace
}  // namespace flexboom
