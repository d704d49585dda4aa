#pragma once

// Runs of scenes, and what is read from them.

#include "apps/accuracy/run_scene.hpp"
#include "fem/base/check.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace flexboom {

/// A built-in scene; its error budget is not computed.
inline Scene scene_named(const std::string& name) {
  Scene scene = load_scene(name);
  scene.error_budget = false;
  return scene;
}

/// The text as a file, read as a state. Tests run side by side: the file is this process's own.
inline SavedState state_of(const std::string& text, bool changed_too = false) {
  const std::filesystem::path folder =
      std::filesystem::path(::testing::TempDir()) / ("state." + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const std::shared_ptr<void> at_end(nullptr, [&](void*) { std::filesystem::remove_all(folder); });
  std::ofstream(folder / "state.toml") << text;
  return SavedState::read(folder / "state.toml", changed_too);
}

/// The scene from where a run ended.
inline Scene going_on(Scene scene, const RunResult& from) {
  scene.from = std::make_shared<SavedState>(state_of(to_toml(from.end, scene.name)));
  return scene;
}

/// Does a line have these words?
inline bool any_has(const std::vector<std::string>& lines, const std::string& words) {
  return std::ranges::any_of(lines, [&](const std::string& l) { return l.find(words) != std::string::npos; });
}

inline Eigen::VectorXd column(const RunResult& r, const std::string& name) {
  const auto i = std::find(r.outputs.names.begin(), r.outputs.names.end(), name);
  require(i != r.outputs.names.end(), "no column " + name);
  return r.outputs.values.col(i - r.outputs.names.begin());
}

inline Eigen::Vector3d vector_at(const RunResult& r, const std::string& name, Eigen::Index row) {
  return {column(r, name + ".x")[row], column(r, name + ".y")[row], column(r, name + ".z")[row]};
}

/// Runs of scenes in the formulation that is the parameter.
class InBothFormulations : public ::testing::TestWithParam<std::string> {
 protected:
  RunResult run(Scene scene) const {
    scene.formulation = GetParam();
    return run_scene(scene, {});
  }
};

}  // namespace flexboom
