#pragma once

#include "fem/formats/common/mesh_file.hpp"

#include <string>
#include <string_view>

namespace flexboom {

/// Reads a CalculiX or Abaqus input deck (.inp): a flat model, or one instance of one part. What would change the
/// frequencies and is not understood is an error; what has no effect on them is left out (MeshFile::notes). Where a
/// keyword means something else to each of the two programs, the dialect decides. Where no dialect is given, the deck
/// itself decides, by what it tells about the program that it was written for.
/// @param file path of the text: what *INCLUDE is relative to, and its name in messages.
/// @param options the dialect, and a material with which the deck's own may be missing.
/// @throws InputError file:line:column, also for faults in an included file, and where a dialect is needed and not
/// told.
MeshFile read_abaqus(std::string_view text, const std::string& file, const ReadOptions& = {});

}  // namespace flexboom
