#include "fem/base/text_reader.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <functional>

namespace flexboom {
namespace {

constexpr size_t longest_quote = 40;    // of a token in a message
constexpr size_t longest_number = 128;  // characters of a number with a Fortran exponent

bool is_space(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t' || c == '\f' || c == '\v'; }

std::string_view without_plus(std::string_view token) {
  const bool plus = token.size() > 1 && token[0] == '+' && token[1] != '-' && token[1] != '+';
  return plus ? token.substr(1) : token;
}

template <class Number>
std::optional<Number> whole_token(std::string_view token) {
  token = without_plus(token);
  Number value{};
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), value);
  if (error != std::errc{} || end != token.data() + token.size()) return {};
  return value;
}

}  // namespace

std::string_view without_byte_order_mark(std::string_view text) {
  constexpr std::string_view mark = "\xEF\xBB\xBF";
  return text.starts_with(mark) ? text.substr(mark.size()) : text;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

bool same_but_case(std::string_view a, std::string_view b) {
  const auto lower = [](unsigned char c) { return std::tolower(c); };
  return std::ranges::equal(a, b, {}, lower, lower);
}

std::string quoted(std::string_view token) {
  std::string result = "\"";
  for (const char c : token.substr(0, longest_quote)) result += c >= ' ' && c <= '~' ? c : '?';
  return result + (token.size() > longest_quote ? "...\"" : "\"");
}

std::optional<long> to_integer(std::string_view token) { return whole_token<long>(token); }

std::optional<double> to_real(std::string_view token, bool fortran) {
  std::array<char, longest_number> copy;
  if (fortran && token.find_first_of("dD") != std::string_view::npos) {
    if (token.size() > copy.size()) return {};
    std::ranges::transform(token, copy.begin(), [](char c) { return c == 'd' || c == 'D' ? 'e' : c; });
    token = {copy.data(), token.size()};
  }
  const std::optional<double> value = whole_token<double>(token);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<std::vector<double>> to_reals(std::string_view text) {
  std::vector<double> values;
  for (size_t from = 0; from != std::string_view::npos;) {
    const size_t comma = text.find(',', from);
    const std::optional<double> value = to_real(text.substr(from, comma - from));
    if (!value) return {};
    values.push_back(*value);
    from = comma == std::string_view::npos ? comma : comma + 1;
  }
  return values;
}

std::optional<std::string_view> TextReader::next_line() {
  if (at_end()) return {};
  const size_t end = std::min(text_.find('\n', position_), text_.size());
  std::string_view line = text_.substr(position_, end - position_);
  position_ = end + 1;
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

std::string_view TextReader::next_token() {
  while (!at_end() && is_space(text_[position_])) ++position_;
  const size_t begin = std::min(position_, text_.size());
  while (!at_end() && !is_space(text_[position_])) ++position_;
  return text_.substr(begin, std::min(position_, text_.size()) - begin);
}

double TextReader::real(std::string_view what) {
  const std::string_view token = next_token();
  if (const std::optional<double> value = to_real(token)) return *value;
  if (token.empty()) fail(token, fmt::format("the file ends where {} should be", what));
  fail(token, fmt::format("{} is not a finite number: {}", what, quoted(token)));
}

long TextReader::integer(std::string_view what) {
  const std::string_view token = next_token();
  return integer_of(token, what);
}

long TextReader::integer(std::string_view what, long low, long high) {
  const std::string_view token = next_token();
  const long value = integer_of(token, what);
  if (value < low || value > high) fail(token, fmt::format("{} is {}; it must be {} to {}", what, value, low, high));
  return value;
}

long TextReader::integer_of(std::string_view token, std::string_view what) const {
  if (const std::optional<long> value = to_integer(token)) return *value;
  if (token.empty()) fail(token, fmt::format("the file ends where {} should be", what));
  fail(token, fmt::format("{} is not a whole number: {}", what, quoted(token)));
}

size_t TextReader::offset_of(std::string_view at) const {
  const std::less<> less;
  const char *begin = text_.data(), *end = begin + text_.size();
  return at.data() == nullptr || less(at.data(), begin) || less(end, at.data())
             ? text_.size()
             : static_cast<size_t>(at.data() - begin);
}

long TextReader::line_of(std::string_view at) const {
  return 1 + std::ranges::count(text_.substr(0, offset_of(at)), '\n');
}

std::string TextReader::location(std::string_view at) const {
  const size_t offset = offset_of(at);
  const size_t line_begin = offset == 0 ? 0 : text_.rfind('\n', offset - 1) + 1;  // npos + 1 = 0
  return fmt::format("{}:{}:{}", file_, line_of(at), offset - line_begin + 1);
}

void TextReader::fail(std::string_view at, const std::string& message) const {
  throw InputError(location(at) + ": " + message);
}

}  // namespace flexboom
