#pragma once

#include "fem/formats/common/mesh_file.hpp"

#include <filesystem>
#include <span>
#include <string_view>

namespace flexboom {

/// A format: how it is recognised and what reads and writes it. A null pointer where it cannot.
struct MeshFormat {
  std::string_view name;
  std::span<const std::string_view> extensions;  // ".inp", ...
  MeshFile (*read)(const std::filesystem::path&, const ReadOptions&);
  void (*write)(const std::filesystem::path&, const Mesh&);
};

/// The table of formats: Gmsh, CalculiX/Abaqus, Nastran, VTK, and what the program gmsh reads (STEP, BREP, .geo).
std::span<const MeshFormat> mesh_formats();

/// Reads a mesh, the format being told by the extension. Nodes that no element uses are kept only where a connection,
/// mass or set needs them.
/// @throws InputError with file:line (byte offset in binary files), what was wrong, and what would be right. Also where
/// a dialect is given for a file that is no deck.
MeshFile read_mesh(const std::filesystem::path&, const ReadOptions& = {});

/// Writes a mesh with its sets, the format being told by the extension.
/// @throws InputError when the format cannot hold the mesh (saying which element or connection) or the disk refuses.
void write_mesh(const std::filesystem::path&, const Mesh&);

}  // namespace flexboom
