#include "apps/base/toml_value.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <utility>

namespace flexboom::toml_reader {
namespace {

using Kind = Value::Kind;

constexpr size_t max_line =
    4096;  // bounds the depth of a dotted key, which the parser and its destructors recurse over

Place place_at(const std::string& file, const toml::source_position& position) {
  return {file, static_cast<int>(position.line), static_cast<int>(position.column)};
}

Value convert(const toml::node& node, const Place& place);

Value convert_array(const toml::array& array, const Place& place) {
  Value value;
  value.kind = Kind::array;
  for (const toml::node& item : array) value.items.push_back(convert(item, place_at(place.file, item.source().begin)));
  return value;
}

// toml++ sorts keys by name; people think in the order of the file.
Value convert_table(const toml::table& table, const Place& place) {
  Value value;
  for (auto&& [key, item] : table) {
    value.entries.push_back({std::string(key.str()), convert(item, place_at(place.file, key.source().begin))});
  }
  std::stable_sort(value.entries.begin(), value.entries.end(), [](const auto& a, const auto& b) {
    return std::pair(a.second.place.line, a.second.place.column) <
           std::pair(b.second.place.line, b.second.place.column);
  });
  return value;
}

Value convert_scalar(const toml::node& node) {
  Value value;
  value.kind = Kind::date;
  if (const auto* text = node.as_string()) {
    value.kind = Kind::text;
    value.text = text->get();
  } else if (const auto* integer = node.as_integer()) {
    value.kind = Kind::integer;
    value.integer = integer->get();
    value.number = static_cast<double>(integer->get());
  } else if (const auto* number = node.as_floating_point()) {
    value.kind = Kind::number;
    value.number = number->get();
  } else if (const auto* boolean = node.as_boolean()) {
    value.kind = Kind::boolean;
    value.boolean = boolean->get();
  }
  return value;
}

Value convert(const toml::node& node, const Place& place) {
  Value value = node.is_table()   ? convert_table(*node.as_table(), place)
                : node.is_array() ? convert_array(*node.as_array(), place)
                                  : convert_scalar(node);
  value.place = place;
  return value;
}

void check_lines(const std::string& text, const std::string& file) {
  require(!text.starts_with("\x89HDF"),
          fmt::format(
              "{}:1:1: is an HDF5 file, not text; a reduced body is `file` of one of the [[bodies]] of a scene with "
              "[[joints]], and `flexboom inspect` reads it",
              file));
  const size_t zero = text.find('\0');
  require(zero == std::string::npos,
          fmt::format("{}:1:1: is a binary file, not text: its byte {} is zero", file, zero + 1));
  size_t begin = 0;
  for (int line = 1; begin < text.size(); ++line) {
    const size_t end = std::min(text.find('\n', begin), text.size());
    require(end - begin <= max_line,
            fmt::format("{}:{}:1: the line has {} characters; {} are allowed", file, line, end - begin, max_line));
    begin = end + 1;
  }
}

}  // namespace

std::string where(const Place& place) {
  if (place.file.empty()) return "";
  if (place.line == 0) return place.file + ": ";
  return fmt::format("{}:{}:{}: ", place.file, place.line, place.column);
}

Value parse(const std::string& text, const std::string& file) {
  check_lines(text, file);
  try {
    return convert(toml::parse(text, file), {file, 1, 1});
  } catch (const toml::parse_error& error) {
    throw InputError(where(place_at(file, error.source().begin)) +
                     "not valid TOML: " + std::string(error.description()));
  }
}

}  // namespace flexboom::toml_reader
