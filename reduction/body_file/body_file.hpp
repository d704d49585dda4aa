#pragma once

#include "reduction/body/reduced_body.hpp"

#include <filesystem>

namespace flexboom {

/// Writes a body to an HDF5 file (README 6), whole or not at all. Every bit comes back.
/// @throws InputError if the body is not valid, naming the field, or the file cannot be written, with the reason.
void write_body_file(const std::filesystem::path&, const ReducedBody&);

/// Body of a file that `write_body_file` made.
/// @throws InputError naming the file if it cannot be read, is something else or of a newer version, was changed or
/// damaged after it was written, or holds no valid body.
ReducedBody read_body_file(const std::filesystem::path&);

}  // namespace flexboom
