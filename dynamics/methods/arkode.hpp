#pragma once

#include "dynamics/methods/integrator.hpp"
#include "dynamics/methods/ode.hpp"

namespace flexboom {

/// ARKODE's singly diagonally implicit Runge-Kutta methods with an explicit first stage: one step at a time, so that a
/// restart at a stop costs nothing. Newton with the exact Jacobian in its structured form.
std::unique_ptr<Stepper> make_arkode_implicit(std::unique_ptr<Ode>, const ErrorScale&);

/// ARKODE's explicit Runge-Kutta methods. Stiff modes set its steps.
std::unique_ptr<Stepper> make_arkode_explicit(std::unique_ptr<Ode>, const ErrorScale&);

}  // namespace flexboom
