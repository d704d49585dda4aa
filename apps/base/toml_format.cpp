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

std::string format_of(const std::string& text) {
  constexpr std::string_view blank = " \t\r\n";
  size_t at = text.find_first_not_of(blank);
  while (at != std::string::npos && text[at] == '#') at = text.find_first_not_of(blank, text.find('\n', at));
  const std::string_view rest = at == std::string::npos ? "" : std::string_view(text).substr(at);
  const size_t open = rest.find_first_of("\"'\n");
  if (!rest.starts_with("format") || open == std::string_view::npos || rest[open] == '\n') return "";
  const size_t close = rest.find(rest[open], open + 1);
  return std::string(rest.substr(open + 1, close - open - 1));
}

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
