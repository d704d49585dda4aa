#pragma once

#include "fem/base/check.hpp"

namespace flexboom {

/// A method that cannot go on where another may.
class MethodFailure : public NumericalError {
 public:
  using NumericalError::NumericalError;
};

/// A state at which the equations have no answer. Of a trial within a step a shorter step may know better.
class UnfitState : public NumericalError {
 public:
  using NumericalError::NumericalError;
};

}  // namespace flexboom
