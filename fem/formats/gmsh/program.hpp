#pragma once

#include "fem/formats/common/mesh_file.hpp"

#include <filesystem>

namespace flexboom {

/// Meshes a geometry (.step, .stp, .brep, .geo) with the program gmsh, which must be installed. STEP and BREP files
/// give tetrahedra of second order, .geo files what they say. Lengths of STEP files are turned into metres; the others
/// have no unit and are taken as they are. A script that starts programs or writes files is refused unless the options
/// trust it.
/// @throws InputError when gmsh is missing (naming the package) or fails (with its last words).
MeshFile mesh_with_gmsh(const std::filesystem::path&, const ReadOptions&);

}  // namespace flexboom
