#pragma once

#include "fem/base/text_reader.hpp"

#include <string>
#include <string_view>

namespace flexboom {

/// Numbers of a .msh file, which are text or binary of either byte order; its section marks are always text.
class GmshSource {
 public:
  GmshSource(std::string_view text, const std::string& file) : reader_(text, file) {}

  void set_binary(bool swapped) {
    binary_ = true;
    swapped_ = swapped;
  }
  bool is_binary() const { return binary_; }
  TextReader& text() { return reader_; }

  int integer(std::string_view what);
  double real(std::string_view what);

  /// A label or a number of things: 64 bit in binary files.
  long size(std::string_view what);

  /// A number of things that each take at least `numbers` numbers. @throws InputError when the file is too short.
  size_t count(std::string_view what, size_t numbers);

  /// The check of count().
  size_t check_count(std::string_view what, long count, size_t numbers);

  /// Passes over numbers.
  void skip_integers(size_t count);
  void skip_reals(size_t count);

  /// @throws InputError at the number read last.
  [[noreturn]] void fail(const std::string& message) const;

 private:
  template <class Number>
  Number binary(std::string_view what);

  TextReader reader_;
  size_t last_ = 0;  // where the number read last begins
  bool binary_ = false;
  bool swapped_ = false;
};

}  // namespace flexboom
