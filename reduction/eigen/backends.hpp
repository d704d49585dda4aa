#pragma once

#include "reduction/eigen/solver.hpp"

namespace flexboom {

// The rows of eigen_backends(), each in the file that holds the door to its library. All return M-normalised vectors
// and fill `iterations` and `solves` of the summary; none verifies its answer, solve_modes does. They throw
// NumericalError.

/// Implicitly restarted Lanczos of ARPACK-NG, shift-invert mode (mode 3 of dsaupd). Wants 1 <= count < unknowns.
EigenPairs arpack_modes(const EigenProblem&, const SparseFactor& shifted, const EigenRequest&);

/// Block Lanczos in the M inner product with full reorthogonalisation and thick restarts; solves with blocks of
/// right-hand sides. Takes any count, a singular M and any multiplicity.
EigenPairs block_modes(const EigenProblem&, const SparseFactor& shifted, const EigenRequest&);

/// Implicitly restarted Lanczos of Spectra, shift-invert. Wants 1 <= count < unknowns.
EigenPairs spectra_modes(const EigenProblem&, const SparseFactor& shifted, const EigenRequest&);

/// Everything by LAPACK's divide and conquer: the oracle, and the way for problems that are too small for Lanczos.
/// Needs sigma below the lowest eigenvalue; works with a singular M.
EigenPairs dense_modes(const EigenProblem&, const SparseFactor& shifted, const EigenRequest&);

/// solve_modes with a backend that is not a row of the table: what tests use to see a wrong answer refused.
EigenPairs solve_modes_with(const EigenBackend&, const EigenProblem&, const EigenOptions&);

/// nu = 1 / (lambda - sigma) below this part of the largest is round-off: an infinite eigenvalue.
constexpr double infinite_nu = 1e-14;

/// What a backend throws that found all there is, and that is less than wanted. @throws InputError, or NumericalError
/// when the shift is so near an eigenvalue that the others drown in round-off.
[[noreturn]] void throw_too_few_eigenvalues(const EigenProblem&, double largest_nu, Eigen::Index found, int wanted);

/// How many finite eigenvalues there can be: the rank of M, of large problems (where it hardly matters) the freedoms
/// with mass. Elements with fewer mass points than nodes have fewer of them than freedoms.
int finite_eigenvalues(const EigenProblem&);

/// From this many unknowns on, backends are content with fewer digits unless they are told. Solves cost time then, and
/// an eigenvalue is as good as the square of its residual. Smaller problems keep all digits of their vectors.
constexpr int many_unknowns = 2000;

/// Lanczos vectors kept: enough to see the second vector of a double frequency early.
inline int lanczos_vectors(int count, int unknowns) {
  const int wanted = count < 10 ? 20 : 2 * count + 1;
  return wanted < unknowns ? wanted : unknowns;
}

}  // namespace flexboom
