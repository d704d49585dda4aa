#pragma once

#include "reduction/eigen/solver.hpp"

#include <memory>

namespace flexboom {

/// The factor of K - sigma M, moved from shift to shift with one symbolic analysis. At shift 0 K itself is factorised,
/// no copy is made.
class ShiftedFactor {
 public:
  explicit ShiftedFactor(EigenProblem);

  /// Factorises K - sigma M, unless that is the factor in place.
  /// @throws NumericalError when K - sigma M is not positive definite: sigma lies above eigenvalues or on one.
  void move_to(double sigma);

  const SparseFactor& factor() const { return *factor_; }
  double flops() const { return summary_.flops; }

  /// Frees the factor: a second factorisation may need the memory.
  void release();

  /// Gives the factor away where it is that of K, else nothing.
  std::shared_ptr<const SparseFactor> take_factor_of_K();

  /// Ordering, entries, bytes and the seconds of all factorisations so far.
  void report(EigenSummary&) const;

 private:
  void analyse(const SparseMatrix& pattern);
  void factorise(const SparseMatrix& A);

  EigenProblem problem_;
  std::unique_ptr<SparseFactor> factor_;
  std::optional<double> sigma_;  // of the factor in place
  Eigen::Index entries_ = 0;     // stored entries of the pattern analysed
  FactorSummary summary_;        // of the last factor
  double analyse_seconds_ = 0;
  double factor_seconds_ = 0;
};

/// Problems up to this size are factorised as L D L^T, whose negative pivots say how many eigenvalues lie below the
/// shift. Larger ones are factorised as supernodal L L^T, which is faster.
constexpr int indefinite_unknowns = 2000;

/// Scale of the highest eigenvalues [rad^2/s^2]: the largest Rayleigh quotient of a unit vector.
double stiffness_scale(const EigenProblem&);

/// What round-off leaves in the energy phi^T (K - sigma M) phi. It is a unit in the last place of each term of the sum;
/// these add up like independent errors. Of rigid modes ten were found at most, of a clamped tube of 200 diameters
/// 4700.
double energy_round_off(const EigenProblem&, double sigma, const Eigen::Ref<const Eigen::VectorXd>& phi);

/// An energy of fewer such units is zero.
constexpr double no_digit = 32;

/// How many of the lowest modes have a frequency that is zero to round-off: their strain energy has no digit, and the
/// next is 100 times larger.
int zero_modes(const EigenProblem&, const EigenPairs&);

/// Shift for a body that can move freely: minus a tenth of the first elastic eigenvalue. The rigid modes are then well
/// apart from it, and K - sigma M is as well conditioned as it can be. A first solve of few modes and digits finds that
/// eigenvalue. When its own shift is good enough, it is returned and its factor is in place.
double free_shift(const EigenProblem&, ShiftedFactor&, int num_modes);

}  // namespace flexboom
