#pragma once

#include "fem/base/files.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom {

/// Text without the byte order mark of UTF-8 that some programs begin it with.
std::string_view without_byte_order_mark(std::string_view);

/// Text without blanks, tabs and carriage returns at its ends.
std::string_view trimmed(std::string_view);

/// Are these the same but for upper and lower case?
bool same_but_case(std::string_view, std::string_view);

/// A name as `known` spells it: itself, or where that is not known the only one that is the same but for case. Else it
/// comes back as it is.
template <class Names>
std::string spelled(std::string_view name, const Names& known) {
  const auto like = [name](std::string_view other) { return same_but_case(other, name); };
  const bool is_known = std::ranges::find(known, name) != std::ranges::end(known);
  if (is_known || std::ranges::count_if(known, like) != 1) return std::string(name);
  return std::string(*std::ranges::find_if(known, like));
}

/// A token as messages show it: in quotes, short, printable characters only.
std::string quoted(std::string_view token);

/// The whole of a token as a number (a leading + is allowed), nothing if it is something else or out of range.
std::optional<long> to_integer(std::string_view);

/// As to_integer; `nan`, `inf` and overflow are no numbers. Fortran: exponents may be written with D and d.
std::optional<double> to_real(std::string_view, bool fortran = false);

/// Numbers between commas, one at least; nothing if any is none.
std::optional<std::vector<double>> to_reals(std::string_view);

/// Reads text in memory, by lines or by tokens between white space. Everything returned is a view into that text, so a
/// fault costs nothing to keep: its line and column are found when it is reported.
class TextReader {
 public:
  /// The text must outlive the reader; `file` is its name in messages. A byte order mark is passed over.
  TextReader(std::string_view text, std::string file) : text_(without_byte_order_mark(text)), file_(std::move(file)) {}

  std::string_view text() const { return text_; }
  const std::string& file() const { return file_; }

  /// Byte where the next read begins.
  size_t position() const { return position_; }
  void seek(size_t position) { position_ = position; }
  bool at_end() const { return position_ >= text_.size(); }
  size_t bytes_left() const { return at_end() ? 0 : text_.size() - position_; }

  /// Next line without its end (\n or \r\n), or nothing at the end of the text.
  std::optional<std::string_view> next_line();

  /// Next token and the white space before it; lines do not count. Empty at the end of the text.
  std::string_view next_token();

  /// Next token as a number. @throws InputError naming `what` should be there.
  double real(std::string_view what);
  long integer(std::string_view what);

  /// Next token as a number in [low, high].
  long integer(std::string_view what, long low, long high);

  /// "file:line:column" of a view into the text (of the end of the text for a view from elsewhere).
  std::string location(std::string_view at) const;

  /// Line of a view into the text, from 1.
  long line_of(std::string_view at) const;

  /// @throws InputError "file:line:column: message".
  [[noreturn]] void fail(std::string_view at, const std::string& message) const;

 private:
  long integer_of(std::string_view token, std::string_view what) const;
  size_t offset_of(std::string_view at) const;

  std::string_view text_;
  std::string file_;
  size_t position_ = 0;
};

}  // namespace flexboom
