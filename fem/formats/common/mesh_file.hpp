#pragma once

#include "fem/mesh/mesh.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom {

/// The program that a deck (.inp) is for. Some keywords mean something else in each (README).
enum class Dialect { calculix, abaqus };
std::string_view name_of(Dialect);

/// What is said beside a file.
struct ReadOptions {
  std::optional<Dialect> dialect;    // of a deck; nothing: what the deck tells, where it matters
  bool trust = false;                // a .geo file may run commands and write files
  std::optional<Material> material;  // of everything, instead of the file's, which is not even read
};

/// What a mesh file holds beside the mesh.
struct MeshFile {
  Mesh mesh;                 // not validated: a material may still be missing
  std::optional<int> modes;  // number of frequencies that the file asks for (a deck with a *FREQUENCY step, EIGRL)
  std::vector<std::string> notes;  // what was read as something else or left out without effect on the modes
};

}  // namespace flexboom
