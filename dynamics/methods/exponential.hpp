#pragma once

#include "dynamics/methods/integrator.hpp"
#include "dynamics/relative/split.hpp"

namespace flexboom {

/// Exact in the linear part: between two events x' = L x + N. L is the Jacobian at rest, one for each set of closed
/// stops. Where that does not serve (Renewal), L is the Jacobian where the flight is. A step takes L by its exponential
/// and N by collocation at Gauss-Lobatto points (README, "Exponential collocation"). So neither vibration nor stiffness
/// sets the size of a step, only the change of what is nonlinear.
std::unique_ptr<Stepper> make_exponential(std::unique_ptr<SplitProblem>, const ErrorScale&);

}  // namespace flexboom
