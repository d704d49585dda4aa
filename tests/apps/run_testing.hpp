#pragma once

// Runs of scenes, and what is read from them.

#include "apps/simulate.hpp"
#include "fem/check.hpp"

#include <algorithm>
#include <string>

namespace flexboom {

/// A built-in scene; its error budget is not computed.
inline Scene scene_named(const std::string& name) {
  Scene scene = load_scene(name);
  scene.error_budget = false;
  return scene;
}

inline Eigen::VectorXd column(const RunResult& r, const std::string& name) {
  const auto i = std::find(r.outputs.names.begin(), r.outputs.names.end(), name);
  require(i != r.outputs.names.end(), "no column " + name);
  return r.outputs.values.col(i - r.outputs.names.begin());
}

inline Eigen::Vector3d vector_at(const RunResult& r, const std::string& name, Eigen::Index row) {
  return {column(r, name + ".x")[row], column(r, name + ".y")[row], column(r, name + ".z")[row]};
}

}  // namespace flexboom
