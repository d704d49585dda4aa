#pragma once

#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>

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

/// @throws InputError where `output` is the file that the command reads.
inline void require_not_replaced(const std::filesystem::path& input, const std::filesystem::path& output) {
  std::error_code error;  // a file that is not there is not the other one
  require(!std::filesystem::equivalent(input, output, error),
          fmt::format("{} would be overwritten, and it is what is read; give the output another name", input.string()));
}

}  // namespace flexboom
