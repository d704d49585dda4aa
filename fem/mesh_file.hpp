#pragma once

#include "fem/mesh.hpp"

#include <filesystem>
#include <optional>
#include <span>
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
/// @throws InputError with file:line (byte offset in binary files), what was wrong, and what would be right; also where
/// a dialect is given for a file that is no deck.
MeshFile read_mesh(const std::filesystem::path&, const ReadOptions& = {});

/// Writes a mesh with its sets, the format being told by the extension.
/// @throws InputError when the format cannot hold the mesh (saying which element or connection) or the disk refuses.
void write_mesh(const std::filesystem::path&, const Mesh&);

}  // namespace flexboom
