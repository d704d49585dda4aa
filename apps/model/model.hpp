#pragma once

#include "apps/scene/scene.hpp"
#include "fem/assembly/constraints.hpp"
#include "fem/formats/common/mesh_file.hpp"
#include "reduction/basis/basis.hpp"
#include "reduction/body/reduced_body.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace flexboom {

/// What replaces or completes a file on the command line.
struct ModelOptions {
  std::optional<std::string> clamp;      // node set that is fixed beside the file's own supports
  std::optional<std::string> material;   // "E,nu,rho" of everything
  bool free = false;                     // no clamp and no supports
  std::optional<std::string> structure;  // of a body file: "beam" or "solid"
  std::optional<std::string> element;    // of a solid made by flexboom
  std::optional<int> order;
  std::optional<double> accuracy;
  ReadOptions read;  // of a mesh file
};

/// What `modes`, `mesh` and `bench` work on: a body file made into a mesh, or a mesh file.
struct Model {
  std::string name;
  Mesh mesh;
  Clamp clamp;
  std::optional<int> modes;            // number of modes that the file asks for
  std::vector<std::string> notes;      // what was read as something else, and what is most likely a mistake
  std::optional<std::string> backend;  // eigen-solver that the file asks for
  DampingRule damping;                 // none of mesh files
  BasisOptions basis;                  // its names and places; clamped of mesh files
  std::optional<BodyScene> body;       // of which the mesh is made; none of mesh files
  std::string clamped;                 // node set of `body` that is held; empty: none
};

/// The model on a mesh that is so many steps finer than that of its body, as mesh_of. A step of beams is two orders:
/// one alone may add shapes that a mode has no part of, by symmetry.
/// @throws InputError where it is no boom, or has no mesh that is so coarse.
Model refined(const Model&, int steps);

/// As refined. Empty where the mesh has more than 140 000 unknowns: about a minute, and four gigabytes.
std::optional<Model> refined_if_bearable(const Model&, int steps);

/// @throws InputError naming the file and the place in it, a set that it lacks, or an option that does not apply to it.
Model load_model(const std::filesystem::path&, const ModelOptions&);

/// "E,nu,rho". @throws InputError.
Material parse_material(const std::string&);

}  // namespace flexboom
