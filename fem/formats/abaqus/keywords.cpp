#include "fem/formats/abaqus/keywords.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace flexboom::abaqus {
namespace {

bool is_keyword(std::string_view line) { return line.starts_with('*'); }

Keyword::Parameter parameter_of(std::string_view field) {
  const size_t equals = std::min(field.find('='), field.size());
  const std::string_view value = field.substr(std::min(equals + 1, field.size()));
  return {upper_key(field.substr(0, equals)), unquoted(value), field};
}

}  // namespace

std::optional<std::string_view> Keyword::find(std::string_view key) const {
  for (const Parameter& parameter : parameters) {
    if (parameter.key == key) return parameter.value;
  }
  return {};
}

std::optional<std::string_view> Lines::peek() {
  while (const auto raw = text_.peek_line()) {
    const std::string_view line = trimmed(*raw);
    if (line.empty() || line.starts_with("**")) {
      if (comments != nullptr && !line.empty()) comments->push_back(line);
      text_.skip_line();
      continue;
    }
    if (!is_keyword(line)) return line;
    if (upper_key(line.substr(0, line.find(','))) != "*INCLUDE") return line;
    const Keyword include = parse(line);
    text_.skip_line();
    allow(include, {"INPUT"});
    text_.include(need(include, "INPUT"), include.at);
  }
  return {};
}

Keyword Lines::parse(std::string_view line) const {
  std::vector<std::string_view> fields;
  split_at_commas(line, fields);
  Keyword keyword;
  keyword.name = upper_key(fields[0].substr(1));
  keyword.at = fields[0];
  for (size_t i = 1; i < fields.size(); ++i) {
    if (!fields[i].empty()) keyword.parameters.push_back(parameter_of(fields[i]));
  }
  if (keyword.name.empty()) text_.fail(line, "a keyword is missing after *");
  return keyword;
}

// Abaqus lets a keyword go on after a comma; CalculiX does not and may end one with a comma. Lines of data have no "=".
void Lines::continue_keyword(Keyword& keyword, std::string_view line) {
  while (line.ends_with(',')) {
    const auto next = peek();
    if (!next || is_keyword(*next) || next->find('=') == std::string_view::npos) return;
    line = *next;
    text_.skip_line();
    std::vector<std::string_view> fields;
    split_at_commas(line, fields);
    for (const std::string_view field : fields) keyword.parameters.push_back(parameter_of(field));
  }
}

std::optional<Keyword> Lines::next_keyword() {
  while (const auto line = peek()) {
    text_.skip_line();
    if (!is_keyword(*line)) continue;
    Keyword keyword = parse(*line);
    continue_keyword(keyword, *line);
    if (const auto file = keyword.find("INPUT")) {
      text_.include(*file, keyword.at);
      std::erase_if(keyword.parameters, [](const Keyword::Parameter& p) { return p.key == "INPUT"; });
    }
    return keyword;
  }
  return {};
}

const std::vector<std::string_view>* Lines::next_data() {
  const auto line = peek();
  if (!line || is_keyword(*line)) return nullptr;
  text_.skip_line();
  line_ = *line;
  split_at_commas(line_, fields_);
  return &fields_;
}

void Lines::allow(const Keyword& keyword, std::initializer_list<std::string_view> parameters) const {
  for (const Keyword::Parameter& parameter : keyword.parameters) {
    if (std::ranges::count(parameters, std::string_view(parameter.key)) > 0) continue;
    text_.fail(parameter.at,
               fmt::format("{}: parameter {} is not understood; there are {}", keyword.at, parameter.key,
                           parameters.size() == 0 ? "none" : fmt::format("{}", fmt::join(parameters, ", "))));
  }
}

std::string_view Lines::need(const Keyword& keyword, std::string_view key) const {
  const auto value = keyword.find(key);
  if (!value || value->empty()) text_.fail(keyword.at, fmt::format("{}: parameter {} is missing", keyword.at, key));
  return *value;
}

}  // namespace flexboom::abaqus
