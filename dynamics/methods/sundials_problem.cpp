#include "dynamics/methods/sundials_problem.hpp"

#include "dynamics/numerics/method_failure.hpp"
#include "fem/base/check.hpp"

#include <nvector/nvector_serial.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexboom::sundials {

namespace {

/// What SUNDIALS hears of a call: 0, it is done; 1, a shorter step may do; -1, nothing will. Its error waits for
/// `Problem::rethrow`.
template <class Call>
int guarded(std::exception_ptr& error, const Call& call) noexcept {
  try {
    call();
    return 0;
  } catch (const UnfitState&) {
    error = std::current_exception();
    return 1;
  } catch (...) {  // a function of time may throw
    error = std::current_exception();
    return -1;
  }
}

}  // namespace

Problem::Problem(std::unique_ptr<Ode> ode, const ErrorScale& scale, SUNContext context)
    : ode_(std::move(ode)), scale_(scale), contact_(static_cast<size_t>(ode_->stops()), 0) {
  matrix_ = SUNMatNewEmpty(context);
  solver_ = SUNLinSolNewEmpty(context);
  if (matrix_ == nullptr || solver_ == nullptr) throw NumericalError("SUNDIALS: out of memory");
  matrix_->ops->getid = [](SUNMatrix) { return SUNMATRIX_CUSTOM; };
  matrix_->ops->zero = [](SUNMatrix) { return 0; };
  solver_->content = this;
  solver_->ops->gettype = [](SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; };
  solver_->ops->initialize = [](SUNLinearSolver) { return 0; };
  solver_->ops->setup = [](SUNLinearSolver, SUNMatrix) { return 0; };
  solver_->ops->solve = [](SUNLinearSolver s, SUNMatrix, N_Vector x, N_Vector b, realtype) {
    static_cast<Problem*>(s->content)->ode_->solve(N_VGetArrayPointer(b), N_VGetArrayPointer(x));
    return 0;
  };
}

Problem::~Problem() {
  SUNLinSolFreeEmpty(solver_);
  SUNMatFreeEmpty(matrix_);
}

void Problem::rethrow(int flag, double from, double to) {
  const std::exception_ptr error = std::exchange(error_, nullptr);
  const bool got_on = flag >= 0 && to - from > 1e-14 * std::max(1.0, std::abs(from));
  if (error && !got_on) std::rethrow_exception(error);
}

int Problem::derivative(realtype t, N_Vector y, N_Vector y_dot, void* problem) noexcept {
  auto& self = *static_cast<Problem*>(problem);
  return guarded(self.error_,
                 [&] { self.ode_->derivative(t, N_VGetArrayPointer(y), self.contact_, N_VGetArrayPointer(y_dot)); });
}

int Problem::weights(N_Vector, N_Vector weight, void* problem) noexcept {
  const auto& self = *static_cast<const Problem*>(problem);
  const Eigen::VectorXd& scale = self.scale_.scale;
  Eigen::Map<Eigen::VectorXd>(N_VGetArrayPointer(weight), scale.size()) =
      (self.scale_.tolerance * scale.array()).inverse().matrix();
  return 0;
}

int Problem::linear_system(realtype t, N_Vector y, booleantype jacobian_is_current, booleantype* jacobian_was_updated,
                           realtype gamma, void* problem) noexcept {
  auto& self = *static_cast<Problem*>(problem);
  return guarded(self.error_, [&] {
    if (!jacobian_is_current) {
      self.ode_->jacobian(t, N_VGetArrayPointer(y), self.contact_);
      ++self.jacobians_;
    }
    *jacobian_was_updated = !jacobian_is_current;
    self.ode_->factorise(gamma);
  });
}

}  // namespace flexboom::sundials
