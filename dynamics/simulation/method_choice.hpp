#pragma once

#include "dynamics/methods/integrator.hpp"
#include "dynamics/relative/tree.hpp"

#include <Eigen/Core>

#include <string>

namespace flexboom {

/// The method for a flight from y that exponential collocation cannot fly: "adams", "dirk" or "bdf".
///
/// Steps of Adams follow vibrations and decays, however small. Those of the implicit Runge-Kutta method do not, and
/// cost ten of Adams; those of bdf do not follow decays. Measured: a panel of 1 to 16 modes on a hinge with laws,
/// dampers and pads, tolerances of 1e-3 to 1e-9.
std::string method_beside_exponential(const Tree&, const Eigen::VectorXd& y, const IntegratorOptions&);

}  // namespace flexboom
