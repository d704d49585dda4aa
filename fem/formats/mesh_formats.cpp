#include "fem/formats/mesh_formats.hpp"

#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "fem/base/text_reader.hpp"
#include "fem/formats/abaqus/read.hpp"
#include "fem/formats/abaqus/write.hpp"
#include "fem/formats/gmsh/gmsh.hpp"
#include "fem/formats/gmsh/program.hpp"
#include "fem/formats/nastran/read.hpp"
#include "fem/formats/vtk/vtk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

namespace flexboom {
namespace {

namespace fs = std::filesystem;

// A format that is read from memory.
template <MeshFile (*read)(std::string_view text, const std::string& file)>
MeshFile from_memory(const fs::path& path, const ReadOptions&) {
  return read(file_bytes(path), path.string());
}

// A deck: it is read differently with options.
template <MeshFile (*read)(std::string_view text, const std::string& file, const ReadOptions&)>
MeshFile read_deck(const fs::path& path, const ReadOptions& options) {
  return read(file_bytes(path), path.string(), options);
}

void write_deck(const fs::path& path, const Mesh& mesh) { write_abaqus(path, mesh, std::nullopt); }

constexpr std::array<std::string_view, 1> gmsh_extensions = {".msh"};
constexpr std::array<std::string_view, 1> abaqus_extensions = {".inp"};
constexpr std::array<std::string_view, 4> nastran_extensions = {".bdf", ".nas", ".dat", ".fem"};
constexpr std::array<std::string_view, 1> vtk_extensions = {".vtu"};
constexpr std::array<std::string_view, 4> geometry_extensions = {".step", ".stp", ".brep", ".geo"};

constexpr std::array<MeshFormat, 5> formats{{
    {"Gmsh", gmsh_extensions, from_memory<read_gmsh>, write_gmsh},
    {"CalculiX and Abaqus", abaqus_extensions, read_deck<read_abaqus>, write_deck},
    {"Nastran", nastran_extensions, read_deck<read_nastran>, nullptr},
    {"VTK", vtk_extensions, from_memory<read_vtu>, write_vtu},
    {"geometry, meshed by gmsh", geometry_extensions, mesh_with_gmsh, nullptr},
}};

std::string lower_case(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// Extensions of the formats that a choice has a function for.
std::string extensions_with(const auto& has) {
  std::string list;
  for (const MeshFormat& format : formats) {
    if (!has(format)) continue;
    for (const std::string_view extension : format.extensions) {
      list += fmt::format("{}{}", list.empty() ? "" : ", ", extension);
    }
  }
  return list;
}

const MeshFormat* format_of(const fs::path& path) {
  const std::string extension = lower_case(path.extension().string());
  for (const MeshFormat& format : formats) {
    if (std::ranges::count(format.extensions, extension) > 0) return &format;
  }
  return nullptr;
}

}  // namespace

std::span<const MeshFormat> mesh_formats() { return formats; }

std::string_view name_of(Dialect dialect) { return dialect == Dialect::calculix ? "CalculiX" : "Abaqus"; }

MeshFile read_mesh(const fs::path& path, const ReadOptions& options) {
  const auto reads = [](const MeshFormat& format) { return format.read != nullptr; };
  const MeshFormat* format = format_of(path);
  if (format == nullptr || !reads(*format)) {
    throw InputError(fmt::format("{}: mesh files of extension \"{}\" are not read; there are {}", path.string(),
                                 path.extension().string(), extensions_with(reads)));
  }
  require(!options.dialect || format->read == read_deck<read_abaqus>,
          fmt::format("{}: a dialect (calculix, abaqus) is of decks (.inp)", path.string()));
  MeshFile file = format->read(path, options);
  if (options.material) {
    for (SolidProperty& p : file.mesh.solid_properties) p.material = *options.material;
    for (BeamProperty& p : file.mesh.beam_properties) p.material = *options.material;
  }
  return file;
}

void write_mesh(const fs::path& path, const Mesh& mesh) {
  const auto writes = [](const MeshFormat& format) { return format.write != nullptr; };
  const MeshFormat* format = format_of(path);
  if (format == nullptr || !writes(*format)) {
    throw InputError(fmt::format("{}: mesh files of extension \"{}\" are not written; there are {}", path.string(),
                                 path.extension().string(), extensions_with(writes)));
  }
  format->write(path, mesh);
}

}  // namespace flexboom
