#pragma once

#include "dynamics/methods/integrator.hpp"
#include "dynamics/relative/split.hpp"

namespace flexboom {

/// Exact in the linear part: between two events x' = L x + N. L is the Jacobian at rest, one for each set of closed
/// stops, and where it does not serve (Renewal) the one where the flight is. A step takes L by its exponential and N by
/// collocation at Gauss-Lobatto points (README, "Exponential collocation"), so neither vibration nor stiffness sets its
/// size, only the change of what is nonlinear.
std::unique_ptr<Stepper> make_exponential(std::unique_ptr<SplitProblem>, const ErrorScale&);

}  // namespace flexboom
