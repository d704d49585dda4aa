#pragma once

#include "fem/linear_algebra/sparse_factor.hpp"

#include <Eigen/Core>

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom {

/// K phi = omega^2 M phi with K symmetric semidefinite and M symmetric positive (semi)definite: lower triangles.
struct EigenProblem {
  const SparseMatrix& K;
  const SparseMatrix& M;
  bool free_floating = false;  // the body can move freely: the shift must be negative
  Eigen::MatrixXd start{};     // shapes that the lowest modes may resemble: time saved, nothing else; may be empty
};

/// When the eigenvalues below the last mode are counted by a second factorisation, which proves that none is missed.
enum class SturmPolicy { when_cheap, always, never };

struct EigenOptions {
  int num_modes = 10;
  std::optional<double>
      sigma{};           // shift [rad^2/s^2]; chosen by the program when absent: 0 if clamped, negative if free
  double tolerance = 0;  // relative residual asked of the backend; 0 is the backend's own choice, see README
  std::string backend = "arpack";  // a row of eigen_backends(), or "auto"
  SturmPolicy sturm = SturmPolicy::when_cheap;
  bool whole_groups = false;  // return more modes than asked where a group of equal frequencies would be cut
  bool keep_factor = false;   // hand out the factor of K where the shift is 0
};

/// What a solve did and how far it can be trusted.
struct EigenSummary {
  std::string backend;             // the row that gave the answer
  double sigma = 0;                // shift used [rad^2/s^2]
  int iterations = 0;              // restarts of the backend; block: steps
  int solves = 0;                  // right-hand sides that met the inverse
  int rigid_modes = 0;             // modes among those returned whose frequency is zero to round-off
  double residual_max = 0;         // max |(K - sigma M)^-1 M phi - phi / (w^2 - sigma)|_M (w^2 - sigma), see README
  double orthogonality_error = 0;  // max |Phi^T M Phi - I|
  bool sturm_checked = false;      // whether the count was made
  int sturm_count = -1;            // eigenvalues below sturm_shift; -1 when not counted
  double sturm_shift = 0;          // in the gap above the last mode returned [rad^2/s^2]
  std::string sturm_method;        // who counted
  std::string proof;               // one sentence: what is proven about completeness and what is not
  std::string ordering;            // of the factor
  long factor_nonzeros = 0;
  double factor_bytes = 0;
  double analyse_seconds = 0;
  double factor_seconds = 0;
  double eigen_seconds = 0;
  double verify_seconds = 0;  // with sturm_seconds
  double sturm_seconds = 0;
  std::vector<std::vector<int>> pairs;  // groups of equal frequencies (indices, ascending)
  std::string note;                     // what had to be changed on the way (shift moved, ...), empty if nothing
};

struct EigenPairs {
  Eigen::VectorXd lambda;  // omega^2, ascending [rad^2/s^2]
  Eigen::MatrixXd Phi;     // M-orthonormal, one column per mode
  EigenSummary summary;
  std::shared_ptr<const SparseFactor> factor{};  // of K, with EigenOptions::keep_factor; null: K was not factorised
};

/// What is asked of a backend: the `count` eigenvalues nearest above sigma. The first `wanted` shall have the relative
/// residual `tolerance` (0: the backend's own choice). The others serve to see the gap above them and may be coarser.
struct EigenRequest {
  double sigma = 0;
  int wanted = 1;
  int count = 1;
  double tolerance = 0;
};

/// A backend gets the factor of K - sigma M and may return the pairs in any order.
struct EigenBackend {
  std::string_view name;
  EigenPairs (*solve)(const EigenProblem&, const SparseFactor& shifted, const EigenRequest&);
};

/// The table of backends: "arpack", "block", "spectra", "dense".
std::span<const EigenBackend> eigen_backends();

/// The lowest modes: ascending, M-orthonormal, sign not fixed, verified. Asks the backend for a few more than wanted.
/// So the Sturm count is taken in a gap, and no group of equal frequencies is cut without being noticed.
/// @throws InputError for more modes than unknowns that carry mass, an entry of K or M that is not finite, or an
/// unknown backend (listing those that exist).
/// @throws NumericalError when a residual, the orthogonality, the Sturm count or the check that stands in for it fails.
EigenPairs solve_modes(const EigenProblem&, const EigenOptions&);

}  // namespace flexboom
