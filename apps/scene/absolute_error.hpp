#pragma once

#include <array>
#include <string>
#include <string_view>

namespace flexboom {

/// An error that does not count, of all outputs of a unit: "1e-9 rad".
struct AbsoluteError {
  double size = 0;
  std::string unit;  // one of output_units
};
inline constexpr std::array<std::string_view, 6> output_units = {"rad", "rad/s", "m", "m/s", "N", "N m"};

/// @throws InputError for anything but a number above zero and one of the units.
AbsoluteError absolute_error(const std::string& text);

}  // namespace flexboom
