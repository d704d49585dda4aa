#include "dynamics/methods/integrator.hpp"

#include "dynamics/methods/arkode.hpp"
#include "dynamics/methods/cvode.hpp"
#include "dynamics/methods/exponential.hpp"
#include "dynamics/methods/ode.hpp"
#include "dynamics/relative/split.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <array>

namespace flexboom {

using Eigen::VectorXd;

namespace {

constexpr std::array<IntegratorMethod, 5> methods = {{
    {"exponential", "exact in the linear part, collocation of order 8 in the rest", 0.1, 0.1, nullptr,
     make_exponential},
    {"bdf", "CVODE backward differentiation, order 1-5, Newton with the exact Jacobian", 0.005, 0.0005, make_cvode_bdf},
    {"adams", "CVODE Adams-Moulton, order 1-12, Newton with the exact Jacobian", 0.001, 0.001, make_cvode_adams},
    {"dirk", "ARKODE implicit Runge-Kutta, order 5, Newton with the exact Jacobian", 0.005, 0.0005,
     make_arkode_implicit},
    {"erk", "ARKODE explicit Runge-Kutta, order 6", 0.01, 0.01, make_arkode_explicit},
}};

}  // namespace

std::span<const IntegratorMethod> integrator_methods() { return methods; }

const IntegratorMethod& integrator_method(const std::string& name) {
  std::string known;
  for (const IntegratorMethod& m : methods) {
    if (m.name == name) return m;
    known += fmt::format(" '{}'", m.name);
  }
  throw InputError(fmt::format("integrator '{}' is not known; there are:{}", name, known));
}

}  // namespace flexboom
