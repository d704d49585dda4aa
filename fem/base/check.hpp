#pragma once

#include <stdexcept>
#include <string>

namespace flexboom {

/// The caller can fix it: a file, an option or an argument is wrong. The text says where, what, and what would be
/// right.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The numbers failed: a factorisation, an eigen-solve or an integration did not reach what was asked. The text says
/// which.
class NumericalError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// @throws InputError with `text` unless `condition` holds.
inline void require(bool condition, const std::string& text) {
  if (!condition) throw InputError(text);
}

}  // namespace flexboom
