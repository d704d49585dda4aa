// Files that begin with their format.

#include "apps/base/toml_reader.hpp"
#include "fem/base/check.hpp"
#include "fem/base/files.hpp"

#include <fmt/format.h>

namespace flexboom::toml_reader {
namespace {

constexpr size_t max_file_size = 16 << 20;  // [bytes]; no scene, but whatever was taken for one

bool is_blank(const std::string& text) { return text.find_first_not_of(" \t\r\n") == std::string::npos; }

}  // namespace

std::string read_text(const std::string& path) { return file_bytes(path, max_file_size); }

Value parse_format(const std::string& text, const std::string& file, std::string_view format) {
  require(!is_blank(text),
          fmt::format("{}:1:1: the file is empty; its first key must be format = \"{}\"", file, format));
  Value root = parse(text, file);
  for (const auto& [key, value] : root.entries) {
    const bool other = key == "format" && value.kind == Value::Kind::text && value.text != format;
    require(!other, fmt::format("{}:{}:{}: format: is {}; this version reads \"{}\" here", file, value.place.line,
                                value.place.column, toml_reader::in_quotes(value.text), format));
  }
  return root;
}

void read_format(TableReader& table, std::string_view format) {
  const std::string wanted = fmt::format("the first key must be format = \"{}\"", format);
  if (!table.has("format")) return table.fault("format", "is missing; " + wanted);
  table.text("format");
  if (table.value().entries.front().first != "format") table.fault("format", "stands behind other keys; " + wanted);
}

}  // namespace flexboom::toml_reader
