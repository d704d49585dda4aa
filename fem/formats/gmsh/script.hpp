#pragma once

#include <filesystem>

namespace flexboom {

/// Looks through a geometry that gmsh shall read, and everything that it includes or merges, for what starts programs
/// or writes files. Gmsh would do it without asking.
/// @throws InputError at the first such command, and where a name of a file is computed, so that it cannot be followed.
void refuse_commands(const std::filesystem::path&);

}  // namespace flexboom
