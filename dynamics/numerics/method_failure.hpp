#pragma once

#include "fem/base/check.hpp"

namespace flexboom {

/// A method that cannot go on where another may.
class MethodFailure : public NumericalError {
 public:
  using NumericalError::NumericalError;
};

}  // namespace flexboom
