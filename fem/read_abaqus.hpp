#pragma once

#include "fem/mesh_file.hpp"

#include <string>
#include <string_view>

namespace flexboom {

/// Reads a CalculiX or Abaqus input deck (.inp): a flat model, or one instance of one part. What would change the
/// frequencies and is not understood is an error; what has no effect on them is left out (MeshFile::notes). Where the
/// two programs differ, CalculiX is followed.
/// @param file path of the text: what *INCLUDE is relative to, and its name in messages.
/// @throws InputError file:line:column, also for faults in an included file.
MeshFile read_abaqus(std::string_view text, const std::string& file);

}  // namespace flexboom
