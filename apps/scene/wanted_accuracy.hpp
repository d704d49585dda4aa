#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom {

/// An error that does not count, of all outputs of a unit: "1e-9 rad".
struct AbsoluteError {
  double size = 0;
  std::string unit;  // one of output_units
};
inline constexpr std::array<std::string_view, 6> output_units = {"rad", "rad/s", "m", "m/s", "N", "N m"};

/// @throws InputError for anything but a number above zero and one of the units.
AbsoluteError absolute_error(const std::string& text);

/// An output whose errors count: "hub.rotation", "hub.rotation 1e-4" or "hub.rotation 1e-9 rad".
struct WantedOutput {
  std::string name;
  double accuracy = 0;  // 0: that of the scene; else relative, or absolute where there is a unit
  std::string unit{};   // that of the output
};

/// @throws InputError for anything else.
WantedOutput wanted_output(const std::string& text);

/// The same, and its unit is that of the output. `outputs`: as unit_of. @throws InputError, where it is not, too.
WantedOutput wanted_output(const std::string& text, const std::vector<std::string>& outputs);

/// Is this output one of those that are named? @throws InputError as wanted_output.
bool names_output(const std::vector<std::string>& wanted, const std::string& output);

/// "m/s" of "hub.velocity"; empty of elastic coordinates and energies. `outputs`: those beside it, which tell whether
/// its joint slides.
std::string_view unit_of(const std::string& output, const std::vector<std::string>& outputs);

}  // namespace flexboom
