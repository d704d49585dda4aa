#pragma once

#include "reduction/exports/sid.hpp"

#include <array>

namespace flexboom {

/// How a SID file writes what the public codes disagree about.
struct SidDialect {
  bool mode_before_column = true;  // m1(row, mode, column) or m1(row, column, mode)
  bool Oe_xz_last = true;          // columns 4 to 6 xy yz xz or xy xz yz
  bool Ge_by_mode = true;          // three columns per mode or n columns per component
  bool J_as_column = true;         // 6 x 1 (xx yy zz xy xz yz) or 3 x 3
};

SidDialect sid_dialect(const ExportOptions&);

/// Places of xx yy zz xy xz yz in a 3 x 3 matrix.
constexpr std::array<std::pair<int, int>, 6> voigt = {{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};

/// The data with the columns of Oe and Ge in the order of the dialect and J in its form; and back.
SidFile to_dialect(SidFile, const SidDialect&);
SidFile from_dialect(SidFile, const SidDialect&);

/// Text of data whose columns are in the order of the dialect. `comment`: one line.
std::string sid_text(const SidFile&, const SidDialect&, const std::string& comment);

}  // namespace flexboom
