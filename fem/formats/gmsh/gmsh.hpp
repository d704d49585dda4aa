#pragma once

#include "fem/formats/common/mesh_file.hpp"

#include <filesystem>
#include <string>
#include <string_view>

namespace flexboom {

/// Reads a Gmsh file of version 2.2 or 4.1, ASCII or binary of either byte order. Physical groups of volumes become
/// element sets and, one each, solid properties without material. Groups of surfaces, lines and points become node sets
/// of all nodes of their elements. A group without a name has its number for one. A file without any group has sets
/// "volume_1", "surface_6", ... of its entities. Hexahedra of order 3 to 8 become "hex".
/// @throws InputError with file:line:column, or file: byte in a binary file.
MeshFile read_gmsh(std::string_view text, const std::string& file);

/// Writes version 4.1, ASCII: element sets and properties as physical volumes (lines of beams), node sets as physical
/// points. Materials and sections are not part of the format; "hex" of order 1 and 2 read back as hex8 and hex27.
/// @throws InputError naming the body, support, connection or element that the format cannot hold.
void write_gmsh(const std::filesystem::path&, const Mesh&);

}  // namespace flexboom
