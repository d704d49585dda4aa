#pragma once

#include "fem/formats/common/mesh_file.hpp"

#include <optional>
#include <string>
#include <string_view>

namespace flexboom::abaqus {

/// What a deck tells about the program that it was written for: the first sign of each, "file:line: *PART", or empty.
struct DialectSigns {
  std::string calculix, abaqus;
};

/// Reads the whole deck: keywords, parameters and values that one program alone has, and comments of the programs that
/// write decks.
DialectSigns dialect_signs(std::string_view text, const std::string& file);

/// Degrees of freedom that a named support of Abaqus holds ("ENCASTRE": "123456"), nothing for any other name.
std::optional<std::string_view> named_support(std::string_view name);

}  // namespace flexboom::abaqus
