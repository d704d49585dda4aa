#pragma once

// Scenes with bodies that were reduced before.

#include "apps/model/prepared_body.hpp"
#include "apps/scene/scene.hpp"
#include "reduction/body_file/body_file.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace flexboom {

/// A scene with joints whose boom was reduced before; `change` makes the file's body another one.
inline Scene with_reduced(const std::string& text, const std::function<void(ReducedBody&)>& change = {}) {
  Scene scene = parse_scene(text, "reduced.toml");
  BodyScene& boom = scene.bodies.at(0);
  ReducedBody body = prepare_body(boom).body;
  if (change) change(body);
  const std::filesystem::path file =
      std::filesystem::path(testing::TempDir()) / ("boom." + std::to_string(::getpid()) + ".h5");
  write_body_file(file, body);
  BodyScene reduced;
  reduced.name = boom.name;
  reduced.structure = body.structure;
  reduced.modes = 0;
  reduced.stiffening = "auto";
  reduced.reduced = std::make_shared<const ReducedBody>(read_body_file(file));
  reduced.reduced_file = file;
  std::filesystem::remove(file);
  boom = reduced;
  return scene;
}

/// The marker "tip" under another name.
inline std::function<void(ReducedBody&)> called(const std::string& name) {
  return [name](ReducedBody& body) {
    for (Marker& m : body.markers)
      if (m.name == "tip") m.name = name;
    for (MarkerStiffness& m : body.Kg.markers)
      if (m.marker == "tip") m.marker = name;
  };
}

}  // namespace flexboom
