#pragma once

#include "reduction/body/reduced_body.hpp"

#include <filesystem>
#include <optional>

namespace flexboom {

/// Bodies of the same model that leave less out. A flight with one of them tells what the kept body leaves out.
struct RicherBodies {
  std::optional<ReducedBody> more_modes;      // of the same basis and elements
  std::optional<ReducedBody> finer_elements;  // of the same basis, on a finer mesh
  double error_per_change = 1;                // at most: of the kept elements, by what the finer ones change

  bool empty() const { return !more_modes && !finer_elements; }
};

/// What a body file holds.
struct BodyFile {
  ReducedBody body;
  RicherBodies richer{};
};

/// Writes a body to an HDF5 file (README 6), whole or not at all. Every bit comes back.
/// @throws InputError if a body is not valid, naming the field, or the file cannot be written, with the reason.
void write_body_file(const std::filesystem::path&, const ReducedBody&, const RicherBodies& = {});

/// Content of a file that `write_body_file` made.
/// @throws InputError naming the file if it cannot be read, is something else, is of a newer version or holds no valid
/// body. Also if it was changed or damaged after it was written.
BodyFile read_whole_body_file(const std::filesystem::path&);

/// The body alone. @throws InputError as read_whole_body_file.
ReducedBody read_body_file(const std::filesystem::path&);

}  // namespace flexboom
