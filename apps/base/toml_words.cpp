#include "apps/base/toml_words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <numeric>
#include <vector>

namespace flexboom::toml_reader {
namespace {

// Edits (insert, delete, replace, swap neighbours) that turn a into b, upper and lower case alike.
size_t edit_distance(std::string_view a, std::string_view b) {
  const auto same = [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) == std::tolower(static_cast<unsigned char>(y));
  };
  std::vector<size_t> before, last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same(a[i - 1], b[j - 1]) ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && same(a[i - 1], b[j - 2]) && same(a[i - 2], b[j - 1]);
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before = last;
    last = row;
  }
  return last[b.size()];
}

}  // namespace

std::string shortened(const std::string& text) {
  if (text.size() <= 60) return text;
  size_t end = 57;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return text.substr(0, end) + "...";
}

std::string listed(std::span<const std::string_view> names) {
  std::string text;
  for (size_t i = 0; i < names.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == names.size() ? " or " : ", ") + in_quotes(names[i]);
  }
  return text;
}

std::string nearest(std::string_view value, std::span<const std::string_view> names) {
  value = value.substr(0, 100);
  size_t best = std::max<size_t>(1, value.size() / 3) + 1;
  std::string result;
  for (const std::string_view name : names) {
    const size_t distance = edit_distance(value, name);
    if (distance >= best) continue;
    best = distance;
    result = name;
  }
  return result;
}

std::string question(std::string_view value, std::span<const std::string_view> names) {
  const std::string near = nearest(value, names);
  return near.empty() ? "" : "did you mean " + in_quotes(near) + "? ";
}

std::string not_among(const std::string& value, std::span<const std::string_view> names) {
  return fmt::format("is {}; {}it must be {}", in_quotes(shortened(value)), question(value, names), listed(names));
}

std::string in_quotes(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') result += '\\';
    if (code < 0x20 || code == 0x7f) {
      result += fmt::format("\\u{:04X}", code);
    } else {
      result += c;
    }
  }
  return result + '"';
}

}  // namespace flexboom::toml_reader
