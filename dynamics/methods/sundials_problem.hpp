#pragma once

// Internal to `dynamics`: what CVODE and ARKODE share on one system.

#include "dynamics/methods/integrator.hpp"
#include "dynamics/methods/ode.hpp"
#include "dynamics/numerics/crossing.hpp"

#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>
#include <sundials/sundials_nvector.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace flexboom::sundials {

/// An Ode as SUNDIALS calls it, with the contacts of a smooth piece. User data of its functions. The matrix that
/// SUNDIALS gets is a token: I - gamma J lives in the Ode in its own form.
class Problem {
 public:
  Problem(std::unique_ptr<Ode>, const ErrorScale&, SUNContext);
  ~Problem();
  Problem(const Problem&) = delete;
  Problem& operator=(const Problem&) = delete;

  Ode& ode() const { return *ode_; }
  int size() const { return ode_->size(); }
  SUNMatrix matrix() const { return matrix_; }
  SUNLinearSolver solver() const { return solver_; }
  long jacobians() const { return jacobians_; }

  void set_contacts(std::span<const char> contact) { contact_.assign(contact.begin(), contact.end()); }
  std::span<const char> contacts() const { return contact_; }

  /// What a function below has caught in the step from a time to another, thrown on: SUNDIALS is C. A shorter step may
  /// have found its way (flag >= 0); one that gets nowhere has not.
  void rethrow(int flag, double from, double to);

  static int derivative(realtype t, N_Vector y, N_Vector y_dot, void* problem) noexcept;
  static int weights(N_Vector y, N_Vector weight, void* problem) noexcept;
  static int linear_system(realtype t, N_Vector y, booleantype jacobian_is_current, booleantype* jacobian_was_updated,
                           realtype gamma, void* problem) noexcept;

 private:
  std::unique_ptr<Ode> ode_;
  const ErrorScale& scale_;
  std::vector<char> contact_;
  SUNMatrix matrix_ = nullptr;
  SUNLinearSolver solver_ = nullptr;
  std::exception_ptr error_;
  long jacobians_ = 0;
};

/// Stops that are met or left within a step.
class StepCrossings {
 public:
  /// Gaps at which a step ends; at an infinite one, none does.
  void watch(std::span<const double> levels) { levels_.assign(levels.begin(), levels.end()); }

  /// The state at the start of a step.
  void begin(const Problem& problem, double t, const double* y) {
    from_.resize(levels_.size());
    for (size_t i = 0; i < levels_.size(); ++i)
      if (std::isfinite(levels_[i])) from_[i] = clearance(problem, t, y, i, 0, 1);
  }

  /// The fraction of the step from t that ends at the first crossing, or 1. y: at its end. state_at(c): the state at a
  /// fraction. crossed[i]: +1 where the gap of hinge i rises through its level there, -1 where it falls, or 0.
  template <class StateAt>
  double first(const Problem& problem, double t, double length, const double* y, const StateAt& state_at,
               std::span<int> crossed) {
    std::fill(crossed.begin(), crossed.end(), 0);
    crossings_.clear();
    for (size_t i = 0; i < levels_.size(); ++i) {
      if (!std::isfinite(levels_[i])) continue;
      const auto at = [&](double c) { return clearance(problem, t + c * length, state_at(c), i, c, length); };
      Clearance from = from_[i];
      from.slope *= length;
      const double resolution = 4e-16 * std::max(1.0, std::abs(t) / length);
      const double root = crossing_between(at, from, clearance(problem, t + length, y, i, 1, length), resolution);
      crossings_.add(i, root == crossed_from_the_start ? 0 : root);
    }
    crossings_.mark(t, length, problem.contacts(), crossed);
    return crossings_.end();
  }

 private:
  /// Of the gap beyond its level, on the side of its flag.
  Clearance clearance(const Problem& problem, double t, const double* y, size_t i, double c, double length) const {
    const double side = problem.contacts()[i] ? 1 : -1;
    const int hinge = static_cast<int>(i);
    if (hinge >= problem.ode().stops()) {
      const Gap gap = problem.ode().switch_gap(t, y, hinge);
      return {c, side * (gap.value - levels_[i]), side * length * gap.rate};
    }
    return {c, side * (problem.ode().gap(y, hinge) - levels_[i]), side * length * problem.ode().gap_rate(y, hinge)};
  }

  std::vector<double> levels_;
  std::vector<Clearance> from_;  // slopes per second
  FirstCrossings crossings_;
};

}  // namespace flexboom::sundials
