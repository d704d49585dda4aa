#pragma once

#include "fem/base/check.hpp"

#include <functional>
#include <string>

namespace flexboom::test {

/// The message of the InputError that `f` throws, empty if it throws none.
inline std::string message(const std::function<void()>& f) {
  try {
    f();
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

}  // namespace flexboom::test
