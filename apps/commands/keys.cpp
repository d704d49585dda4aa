#include "apps/base/toml_reader.hpp"
#include "apps/commands/commands.hpp"
#include "apps/scene/key_tables.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace flexboom {
namespace {

/// "[[bodies.segments]]" -> "bodies.segments".
std::string plain(std::string title) {
  std::erase_if(title, [](char c) { return c == '[' || c == ']' || c == '`'; });
  return title;
}

/// The section of that name, and those below it. Without a name: all.
std::vector<KeySection> sections_of(const std::string& name) {
  std::vector<KeySection> all = key_sections();
  std::vector<std::string> titles;
  titles.reserve(all.size());
  for (const KeySection& s : all) titles.push_back(plain(s.title));
  const std::string wanted = plain(name);
  std::erase_if(all, [&](const KeySection& s) {
    return !wanted.empty() && plain(s.title) != wanted && !plain(s.title).starts_with(wanted + ".");
  });
  require(!all.empty(),
          "TABLE: " + toml_reader::not_among(wanted, std::vector<std::string_view>(titles.begin(), titles.end())));
  return all;
}

}  // namespace

int keys_command(const std::string& table, const CommonOptions& common) {
  nlohmann::ordered_json json;
  std::string text;
  for (const KeySection& section : sections_of(table)) {
    if (!text.empty()) text += '\n';
    text += to_markdown(section);
    for (const KeyRow& row : section.rows)
      json[section.title][row.key] = {{"unit", row.unit}, {"default", row.otherwise}, {"what", row.what}};
  }
  if (common.json)
    fmt::print("{}\n", json.dump(2));
  else if (!common.quiet)
    fmt::print("{}", text);
  return exit_ok;
}

}  // namespace flexboom
