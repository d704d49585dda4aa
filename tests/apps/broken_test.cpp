// Every file in broken/ has something wrong. broken/expected.txt says what must be reported: one line per fault,
// "file:line: words of the message"; the report must have these faults and no others.

#include "apps/scene/scene.hpp"
#include "fem/base/check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace flexboom {
namespace {

const std::filesystem::path folder = std::filesystem::path(FLEXBOOM_TEST_DATA) / "apps" / "broken";

struct Expectation {
  std::string place;  // file:line:
  std::string words;
};

// By the file that is read; "scene.toml < body.toml:3: words" is a fault found in another file while reading
// scene.toml.
std::map<std::string, std::vector<Expectation>> read_expectations() {
  std::map<std::string, std::vector<Expectation>> table;
  std::ifstream file(folder / "expected.txt");
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    const size_t arrow = line.find(" < ");
    const std::string fault = arrow == std::string::npos ? line : line.substr(arrow + 3);
    const size_t space = fault.find(' ');
    const std::string place = fault.substr(0, space);
    const std::string read = arrow == std::string::npos ? place.substr(0, place.find(':')) : line.substr(0, arrow);
    table[read].push_back({place, fault.substr(space + 1)});
  }
  return table;
}

std::vector<std::string> reported_faults(const std::string& name) {
  try {
    const bool is_body = name.starts_with("body_");
    is_body ? static_cast<void>(read_body(folder / name)) : static_cast<void>(read_scene(folder / name));
  } catch (const InputError& error) {
    std::vector<std::string> lines;
    std::istringstream text(error.what());
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    return lines;
  }
  return {};
}

class BrokenFile : public ::testing::TestWithParam<std::string> {};

TEST_P(BrokenFile, ReportsItsFaultsAndNoOthers) {
  const std::vector<Expectation> expected = read_expectations()[GetParam()];
  const std::vector<std::string> reported = reported_faults(GetParam());
  for (const Expectation& e : expected) {
    const auto matches = [&e](const std::string& line) {
      return line.starts_with((folder / e.place).string()) && line.find(e.words) != std::string::npos;
    };
    EXPECT_TRUE(std::any_of(reported.begin(), reported.end(), matches)) << e.place << " " << e.words;
  }
  EXPECT_EQ(reported.size(), expected.size());
  if (HasFailure()) {
    for (const std::string& line : reported) ADD_FAILURE() << line;
  }
}

std::vector<std::string> expected_files() {
  std::vector<std::string> names;
  for (const auto& [name, faults] : read_expectations()) names.push_back(name);
  return names;
}

std::string test_name(const ::testing::TestParamInfo<std::string>& info) {
  return info.param.substr(0, info.param.find('.'));
}

INSTANTIATE_TEST_SUITE_P(Scene, BrokenFile, ::testing::ValuesIn(expected_files()), test_name);

TEST(Broken, EveryFileIsInTheTable) {
  const auto table = read_expectations();
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (entry.path().extension() != ".toml" || name.starts_with("part_")) continue;
    EXPECT_TRUE(table.contains(name)) << name;
  }
  EXPECT_GE(table.size(), 24u);
}

}  // namespace
}  // namespace flexboom
