#pragma once

#include "dynamics/methods/integrator.hpp"
#include "dynamics/methods/ode.hpp"

namespace flexboom {

/// CVODE's variable-order backward differentiation formulas, Newton with the exact Jacobian in its structured form.
std::unique_ptr<Stepper> make_cvode_bdf(std::unique_ptr<Ode>, const ErrorScale&);

/// CVODE's variable-order Adams-Moulton formulas with the same Newton iteration.
std::unique_ptr<Stepper> make_cvode_adams(std::unique_ptr<Ode>, const ErrorScale&);

}  // namespace flexboom
