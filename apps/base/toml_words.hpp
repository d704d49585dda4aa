#pragma once

#include <span>
#include <string>
#include <string_view>

/// Values and names in messages.
namespace flexboom::toml_reader {

/// `is "X"; it must be "a", "b" or "c"`, with the nearest name first asked for where one is near.
std::string not_among(const std::string& value, std::span<const std::string_view> names);

/// The name that differs by the fewest edits, empty if none is near.
std::string nearest(std::string_view value, std::span<const std::string_view> names);

/// `did you mean "X"? ` of the nearest, empty if none is near.
std::string question(std::string_view value, std::span<const std::string_view> names);

/// A TOML basic string with its quotes; control characters are escaped, so it is also fit for messages.
std::string in_quotes(std::string_view text);

/// `"a", "b" or "c"`
std::string listed(std::span<const std::string_view> names);

/// At most 60 bytes, not cut inside a UTF-8 character.
std::string shortened(const std::string& text);

}  // namespace flexboom::toml_reader
