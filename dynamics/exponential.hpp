#pragma once

#include "dynamics/integrator.hpp"

namespace flexboom {

/// Exact in the linear part: between two events x = (p, u) obeys x' = L x + N(x), L the Jacobian at rest, one for each
/// set of closed stops. A step takes L by its exponential and N by collocation at Gauss-Lobatto points (README,
/// "Exponential collocation"), so neither vibration nor stiffness sets its size, only the change of what is nonlinear.
std::unique_ptr<Stepper> make_exponential(const System&, const ErrorScale&);

}  // namespace flexboom
