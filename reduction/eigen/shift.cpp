#include "reduction/eigen/shift.hpp"

#include "fem/base/check.hpp"
#include "reduction/eigen/backends.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double eps = std::numeric_limits<double>::epsilon();

/// Root of the sum of squares of the terms of x^T A x, from the lower triangle: entries have errors of their own.
double root_of_squares(const SparseMatrix& A, const VectorXd& x) {
  double sum = 0;
  for (Index j = 0; j < A.cols(); ++j) {
    for (SparseMatrix::InnerIterator it(A, j); it; ++it) {
      if (it.row() < j) continue;
      const double term = (it.row() == j ? 1 : 2) * it.value() * x(it.row()) * x(j);
      sum += term * term;
    }
  }
  return std::sqrt(sum);
}

}  // namespace

ShiftedFactor::ShiftedFactor(EigenProblem problem) : problem_(std::move(problem)) {}

void ShiftedFactor::analyse(const SparseMatrix& pattern) {
  const bool small = pattern.rows() <= indefinite_unknowns;
  factor_ = std::make_unique<SparseFactor>(pattern, small ? FactorKind::indefinite : FactorKind::definite);
  entries_ = pattern.nonZeros();
  analyse_seconds_ += factor_->summary().analyse_seconds;
}

void ShiftedFactor::factorise(const SparseMatrix& A) {
  if (!factor_ || entries_ != A.nonZeros()) analyse(A);
  factor_->factorise(A);
  summary_ = factor_->summary();
  factor_seconds_ += summary_.factor_seconds;
}

void ShiftedFactor::move_to(double sigma) {
  if (factor_ && sigma_ == sigma) return;
  sigma_.reset();
  try {
    factorise(sigma == 0 ? problem_.K : shifted(problem_.K, sigma, problem_.M));
  } catch (const NumericalError& e) {
    throw NumericalError(fmt::format("the shift {:.6g} lies above eigenvalues or on one ({})", sigma, e.what()));
  }
  if (problem_.K.rows() <= indefinite_unknowns) {
    const int below = factor_->negative_pivots();
    if (below > 0) throw NumericalError(fmt::format("the shift {:.6g} lies above {} eigenvalues", sigma, below));
  }
  sigma_ = sigma;
}

std::shared_ptr<const SparseFactor> ShiftedFactor::take_factor_of_K() {
  if (sigma_ != 0) return nullptr;
  sigma_.reset();
  return std::move(factor_);
}

void ShiftedFactor::release() {
  factor_.reset();
  sigma_.reset();
}

void ShiftedFactor::report(EigenSummary& s) const {
  s.ordering = summary_.ordering;
  s.factor_nonzeros = summary_.nonzeros;
  s.factor_bytes = summary_.bytes;
  s.analyse_seconds = analyse_seconds_;
  s.factor_seconds = factor_seconds_;
}

double stiffness_scale(const EigenProblem& p) {
  const VectorXd K = p.K.diagonal();
  const VectorXd M = p.M.diagonal();
  double scale = 0;
  for (Index i = 0; i < K.size(); ++i) {
    if (M(i) > 0) scale = std::max(scale, K(i) / M(i));
  }
  return scale > 0 ? scale : 1;
}

double energy_round_off(const EigenProblem& p, double sigma, const Eigen::Ref<const VectorXd>& phi) {
  const double of_mass = sigma == 0 ? 0 : std::abs(sigma) * root_of_squares(p.M, phi);
  return eps * (root_of_squares(p.K, phi) + of_mass);
}

int zero_modes(const EigenProblem& p, const EigenPairs& pairs) {
  double largest = 0;  // of the energies counted as zero, and the round-off in them
  int zero = 0;        // modes below the last gap of 100
  for (int i = 0; i < pairs.lambda.size(); ++i) {
    const VectorXd phi = pairs.Phi.col(i);
    if (i > 0 && pairs.lambda(i) > 100 * largest) zero = i;
    const double round_off = energy_round_off(p, 0, phi);
    // phi may be coarse, then lambda is better than the energy; next to a large shift the energy is.
    const double energy = std::min(std::abs(pairs.lambda(i)), std::abs(quadratic_form(p.K, phi)(0, 0)));
    if (energy > no_digit * round_off) return zero;
    largest = std::max({largest, energy, round_off});
  }
  return static_cast<int>(pairs.lambda.size());
}

double free_shift(const EigenProblem& p, ShiftedFactor& shifted, int num_modes) {
  constexpr double few_digits = 1e-3;
  const auto n = static_cast<int>(p.K.rows());
  const int with_mass = finite_eigenvalues(p);
  double crude = -1e-9 * stiffness_scale(p);
  for (int count = std::min(with_mass, 7), attempt = 0;; ++attempt) {
    try {
      shifted.move_to(crude);
    } catch (const NumericalError&) {
      if (attempt >= 3) throw;
      crude *= 10;
      continue;
    }
    const EigenRequest request{crude, count, count, few_digits};
    const EigenPairs pairs = (n <= 50 ? dense_modes : block_modes)(p, shifted.factor(), request);
    const auto found = static_cast<int>(pairs.lambda.size());
    const int zero = zero_modes(p, pairs);
    if (zero < found && pairs.lambda(zero) > 0) {
      const double elastic = pairs.lambda(zero);
      const bool good_enough = -crude >= 0.01 * elastic && -crude <= elastic;
      return good_enough ? crude : -0.1 * elastic;
    }
    if (found < count || count == with_mass || count > num_modes) return crude;  // nothing but zero modes
    count = std::min(with_mass, 2 * count);
  }
}

}  // namespace flexboom
