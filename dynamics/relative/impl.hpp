#pragma once

// The inside of Tree. Internal to `dynamics`.

#include "dynamics/relative/tree.hpp"
#include "dynamics/relative/workspace.hpp"

namespace flexboom {

struct Tree::Impl {
  Multibody scene;
  TreeLayout layout;
  tree::Model model;  // points to the scene
  std::vector<Stiffening> stiffening;
  std::vector<int> stops;
};

}  // namespace flexboom
