#pragma once

#include "reduction/eigen_solver.hpp"

namespace flexboom {

// The rows of eigen_backends(), each in the file that holds the door to its library. All return M-normalised vectors
// and fill `iterations` and `solves` of the summary; none verifies its answer, solve_modes does. They throw
// NumericalError.

/// Implicitly restarted Lanczos of ARPACK-NG, shift-invert mode (mode 3 of dsaupd). Wants 1 <= count < unknowns.
EigenPairs arpack_modes(const EigenProblem&, const SparseFactor& shifted, double sigma, int count, double tolerance);

/// Implicitly restarted Lanczos of Spectra, shift-invert. Wants 1 <= count < unknowns.
EigenPairs spectra_modes(const EigenProblem&, const SparseFactor& shifted, double sigma, int count, double tolerance);

/// Everything by Eigen's dense QR algorithm: the oracle, and the way for problems that are too small for Lanczos.
/// Needs sigma below the lowest eigenvalue; works with a singular M.
EigenPairs dense_modes(const EigenProblem&, const SparseFactor& shifted, double sigma, int count, double tolerance);

/// solve_modes with a backend that is not a row of the table: what tests use to see a wrong answer refused.
EigenPairs solve_modes_with(const EigenBackend&, const EigenProblem&, const EigenOptions&);

/// Lanczos vectors kept: enough to see the second vector of a double frequency early.
inline int lanczos_vectors(int count, int unknowns) {
  const int wanted = count < 10 ? 20 : 2 * count + 1;
  return wanted < unknowns ? wanted : unknowns;
}

}  // namespace flexboom
