#pragma once

#include <Eigen/Core>

#include <memory>
#include <span>

namespace flexboom {

/// A differential-algebraic system F(t, y, y_dot) = 0.
class DaeProblem {
 public:
  virtual ~DaeProblem() = default;
  virtual int size() const = 0;
  /// 1 where an unknown is differential and its error counts, 0 where it is algebraic.
  virtual Eigen::VectorXd differential() const = 0;
  virtual void residual(double t, const double* y, const double* y_dot, double* F) = 0;
  /// Values of dF/dy + c dF/dy_dot in the pattern below.
  virtual void newton_matrix(double t, double c, const double* y, const double* y_dot, double* values) = 0;
  virtual std::span<const int> column_starts() const = 0;  // compressed columns
  virtual std::span<const int> rows() const = 0;
  /// Inverse of the errors allowed per step.
  virtual void weights(double* w) const = 0;
  virtual int roots() const = 0;
  virtual void root_values(double t, const double* y, double* values) = 0;
};

struct DaeCounts {
  long steps = 0, residual_evaluations = 0, factorisations = 0, newton_iterations = 0, error_test_failures = 0,
       convergence_failures = 0;

  DaeCounts& operator+=(const DaeCounts&);
};

/// SUNDIALS IDA (BDF of order 1 to 5 with variable step) on one problem; Newton by KLU.
class Ida {
 public:
  /// @throws NumericalError where SUNDIALS has no memory.
  explicit Ida(DaeProblem&);
  ~Ida();
  Ida(const Ida&) = delete;
  Ida& operator=(const Ida&) = delete;

  /// Starts again, of order 1, at a consistent (y, y_dot).
  void restart(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& y_dot);
  /// One step, not beyond t_end, or to a root: crossed[i] = +1 (rises), -1 or 0. @throws NumericalError.
  void step(double t_end, double& t, Eigen::VectorXd& y, std::span<int> crossed);
  /// y within the last step.
  void interpolate(double t, Eigen::VectorXd& y);
  DaeCounts counts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace flexboom
