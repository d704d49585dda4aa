#pragma once

#include "fem/formats/common/mesh_file.hpp"

#include <string>
#include <string_view>

namespace flexboom {

/// Reads Nastran bulk data (.bdf, .nas, .dat, .fem), with or without executive and case control: small, large and free
/// fields. What would change the frequencies and is not understood is an error; what has no effect on them is left out
/// (MeshFile::notes). Frequencies asked for by EIGRL or EIGR become MeshFile::modes.
/// @param file path of the text: what INCLUDE is relative to, and its name in messages.
/// @throws InputError file:line:column, also for faults in an included file.
MeshFile read_nastran(std::string_view text, const std::string& file, const ReadOptions& = {});

}  // namespace flexboom
