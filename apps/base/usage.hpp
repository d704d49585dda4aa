#pragma once

#include "fem/base/check.hpp"

namespace flexboom {

/// A command line that is wrong whatever its files say; its exit code is that of usage.
class UsageError : public InputError {
 public:
  using InputError::InputError;
};

/// @throws UsageError with `text` unless `condition` holds.
inline void require_usage(bool condition, const std::string& text) {
  if (!condition) throw UsageError(text);
}

}  // namespace flexboom
