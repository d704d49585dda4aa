#pragma once

#include "fem/sparse_factor.hpp"

#include <Eigen/Core>

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom {

/// K phi = omega^2 M phi with K symmetric semidefinite and M symmetric positive (semi)definite.
struct EigenProblem {
  const SparseMatrix& K;
  const SparseMatrix& M;
  bool free_floating = false;  // the body can move freely: the shift must be negative
};

struct EigenOptions {
  int num_modes = 10;
  std::optional<double> sigma;  // shift [rad^2/s^2]; chosen by the program when absent: 0 if clamped, negative if free
  double tolerance = 0;         // relative accuracy of Ritz values asked of the backend; 0 is machine precision
  std::string backend = "arpack";
};

/// What a solve did and how far it can be trusted.
struct EigenSummary {
  std::string backend;
  double sigma = 0;                // shift used [rad^2/s^2]
  int iterations = 0;              // restarts of the backend
  int solves = 0;                  // applications of the inverse
  double residual_max = 0;         // max |(K - sigma M)^-1 M phi - phi / (w^2 - sigma)|_M (w^2 - sigma), see README
  double orthogonality_error = 0;  // max |Phi^T M Phi - I|
  int sturm_count = 0;             // negative pivots of K - s M just above the last mode returned
  double sturm_shift = 0;          // that s [rad^2/s^2]
  double factor_seconds = 0;
  double eigen_seconds = 0;
  std::vector<std::vector<int>> pairs;  // groups of equal frequencies (indices, ascending)
  std::string note;                     // what had to be changed on the way (shift moved, ...), empty if nothing
};

struct EigenPairs {
  Eigen::VectorXd lambda;  // omega^2, ascending [rad^2/s^2]
  Eigen::MatrixXd Phi;     // M-orthonormal, one column per mode
  EigenSummary summary;
};

/// A backend finds the `count` eigenvalues nearest above sigma, given the factor of K - sigma M. It may return them in
/// any order.
struct EigenBackend {
  std::string_view name;
  EigenPairs (*solve)(const EigenProblem&, const SparseFactor& shifted, double sigma, int count, double tolerance);
};

/// The table of backends: "arpack", "spectra", "dense".
std::span<const EigenBackend> eigen_backends();

/// The lowest modes: ascending, M-orthonormal, sign not fixed, verified. Asks the backend for a few more than wanted so
/// that the Sturm count is taken in a gap and no group of equal frequencies is cut without being noticed.
/// @throws InputError for more modes than unknowns or an unknown backend (listing those that exist).
/// @throws NumericalError when a residual, the orthogonality or the Sturm count is wrong.
EigenPairs solve_modes(const EigenProblem&, const EigenOptions&);

}  // namespace flexboom
