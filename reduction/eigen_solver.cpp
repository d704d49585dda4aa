#include "reduction/eigen_solver.hpp"

#include "fem/check.hpp"
#include "reduction/eigen_backends.hpp"

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace flexboom {
namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();
constexpr int extra_modes = 3;         // beyond those wanted, so that the Sturm count finds a gap
constexpr int max_attempts = 4;        // the first and three with a moved shift or more modes
constexpr double max_residual = 1e-6;  // a frequency is then wrong by at most half of this

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

const EigenBackend& backend_named(const std::string& name) {
  std::string known;
  for (const EigenBackend& row : eigen_backends()) {
    if (row.name == name) return row;
    known += (known.empty() ? "\"" : ", \"") + std::string(row.name) + "\"";
  }
  throw InputError("eigen-solver \"" + name + "\" is unknown; there are " + known);
}

void check_input(const EigenProblem& p, const EigenOptions& options) {
  const Eigen::Index n = p.K.rows();
  require(p.K.cols() == n && p.M.rows() == n && p.M.cols() == n,
          "eigenproblem: K and M must be square and of one size");
  require(options.num_modes >= 1, fmt::format("modes: must be 1 or more, got {}", options.num_modes));
  require(options.num_modes <= n,
          fmt::format("modes: {} asked of a body with {} unknowns; ask for fewer or refine the mesh", options.num_modes,
                      n));
  require(!p.free_floating || !options.sigma || *options.sigma < 0,
          fmt::format("shift: a body that can move freely needs a negative shift (shift 0 loses modes), got {}",
                      options.sigma.value_or(0)));
  require(!options.sigma || std::isfinite(*options.sigma), "shift: must be finite");
}

/// Scale of the highest eigenvalues [rad^2/s^2]: the largest Rayleigh quotient of a unit vector.
double stiffness_scale(const EigenProblem& p) {
  const Eigen::VectorXd K = p.K.diagonal();
  const Eigen::VectorXd M = p.M.diagonal();
  double scale = 0;
  for (Eigen::Index i = 0; i < K.size(); ++i) {
    if (M(i) > 0) scale = std::max(scale, K(i) / M(i));
  }
  return scale > 0 ? scale : 1;
}

/// Factorises, solves, sorts and orthonormalises; nothing is verified yet.
EigenPairs raw_modes(const EigenProblem& p, SparseFactor& factor, const EigenBackend& wanted, double sigma, int count,
                     double tolerance) {
  auto start = std::chrono::steady_clock::now();
  factor.factorise(p.K - sigma * p.M);
  const double factor_seconds = seconds_since(start);
  if (const int below = factor.negative_pivots(); below > 0) {
    throw NumericalError(fmt::format("the shift {:.6g} lies above {} eigenvalues", sigma, below));
  }

  start = std::chrono::steady_clock::now();
  const bool too_small = count >= p.K.rows();  // Lanczos leaves at least one vector out
  const EigenBackend& backend = too_small ? backend_named("dense") : wanted;
  EigenPairs pairs = backend.solve(p, factor, sigma, count, tolerance);
  pairs.summary.eigen_seconds = seconds_since(start);
  pairs.summary.factor_seconds = factor_seconds;
  pairs.summary.backend = std::string(backend.name);
  if (backend.name != wanted.name) pairs.summary.backend += " (problem too small for " + std::string(wanted.name) + ")";
  pairs.summary.sigma = sigma;

  std::vector<int> order(static_cast<size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return pairs.lambda(a) < pairs.lambda(b); });
  pairs.lambda = pairs.lambda(order).eval();
  pairs.Phi = pairs.Phi(Eigen::all, order).eval();
  return pairs;
}

double orthogonality_error(const EigenProblem& p, const Eigen::MatrixXd& Phi) {
  const Eigen::MatrixXd gram = Phi.transpose() * (p.M * Phi);
  return (gram - Eigen::MatrixXd::Identity(gram.rows(), gram.cols())).cwiseAbs().maxCoeff();
}

/// Gram-Schmidt in the M inner product, as a Cholesky factor of Phi^T M Phi. It only polishes: vectors that are far
/// from orthonormal mean that the backend returned one mode twice.
void orthonormalise(const EigenProblem& p, EigenPairs& pairs) {
  const Eigen::MatrixXd gram = pairs.Phi.transpose() * (p.M * pairs.Phi);
  const double error = (gram - Eigen::MatrixXd::Identity(gram.rows(), gram.cols())).cwiseAbs().maxCoeff();
  if (!(error < 1e-6)) throw NumericalError(fmt::format("modes are not M-orthonormal, error {:.2g}", error));
  const Eigen::LLT<Eigen::MatrixXd> llt(gram);
  llt.matrixU().solveInPlace<Eigen::OnTheRight>(pairs.Phi);
}

/// Residual of each pair in the shift-inverted problem: |(K - sigma M)^-1 M phi - phi / (lambda - sigma)|_M (lambda -
/// sigma), a bound of the relative error of lambda - sigma. Read from the factor that is in place.
Eigen::VectorXd residuals(const EigenProblem& p, const SparseFactor& shifted, const EigenPairs& pairs) {
  Eigen::VectorXd result(pairs.lambda.size());
  Eigen::VectorXd x(p.K.rows());
  for (Eigen::Index i = 0; i < result.size(); ++i) {
    const Eigen::VectorXd phi = pairs.Phi.col(i);
    shifted.solve(p.M * phi, x);
    const double distance = pairs.lambda(i) - pairs.summary.sigma;
    const Eigen::VectorXd w = x * distance - phi;
    result(i) = std::sqrt(std::max(0.0, w.dot(p.M * w)));
  }
  return result;
}

/// Whether eigenvalues i and i + 1 are one to the accuracy they are known to. The measure is lambda - sigma, which is
/// what the solver resolves; 1e-8 is ten times the noise that was seen in double frequencies of slender round bars.
bool same_group(const EigenPairs& pairs, const Eigen::VectorXd& residual, Eigen::Index i) {
  const double noise = 10 * std::max(residual(i), residual(i + 1));
  return pairs.lambda(i + 1) - pairs.lambda(i) <= std::max(1e-8, noise) * (pairs.lambda(i + 1) - pairs.summary.sigma);
}

/// Number of modes up to the first gap that holds the wanted ones; 0 when the last group found reaches the end of the
/// set.
int modes_below_gap(const EigenPairs& pairs, const Eigen::VectorXd& residual, int wanted, bool complete) {
  const auto found = static_cast<int>(pairs.lambda.size());
  for (int i = wanted; i < found; ++i) {
    if (!same_group(pairs, residual, i - 1)) return i;
  }
  return complete ? found : 0;
}

/// Counts the eigenvalues below a shift in the gap above the first `expected` modes (Sylvester's law of inertia).
void sturm_check(const EigenProblem& p, SparseFactor& factor, EigenPairs& pairs, int expected) {
  EigenSummary& s = pairs.summary;
  const double last = pairs.lambda(expected - 1);
  const bool has_next = expected < pairs.lambda.size();
  s.sturm_shift = has_next ? (last + pairs.lambda(expected)) / 2 : last + 0.1 * (last - s.sigma);
  factor.factorise(p.K - s.sturm_shift * p.M);
  s.sturm_count = factor.negative_pivots();
  if (s.sturm_count != expected) {
    throw NumericalError(fmt::format("Sturm count: {} eigenvalues below {:.6g}, the solver found {}", s.sturm_count,
                                     s.sturm_shift, expected));
  }
}

/// Keeps the first `wanted` modes and lists the groups among them.
void trim(EigenPairs& pairs, const Eigen::VectorXd& residual, int wanted) {
  for (int first = 0; first < wanted;) {
    int last = first;
    while (last + 1 < wanted && same_group(pairs, residual, last)) ++last;
    if (last > first) {
      std::vector<int>& group = pairs.summary.pairs.emplace_back(static_cast<size_t>(last - first + 1));
      std::iota(group.begin(), group.end(), first);
    }
    first = last + 1;
  }
  pairs.lambda = pairs.lambda.head(wanted).eval();
  pairs.Phi = pairs.Phi.leftCols(wanted).eval();
}

EigenPairs verified_modes(const EigenProblem& p, SparseFactor& factor, const EigenBackend& backend, double sigma,
                          int count, const EigenOptions& options) {
  EigenPairs pairs = raw_modes(p, factor, backend, sigma, count, options.tolerance);
  orthonormalise(p, pairs);
  const Eigen::VectorXd residual = residuals(p, factor, pairs);
  pairs.summary.residual_max = residual.head(options.num_modes).maxCoeff();
  if (!(pairs.summary.residual_max <= std::max(max_residual, 100 * options.tolerance))) {
    throw NumericalError(fmt::format("residual {:.2g} of the modes is too large", pairs.summary.residual_max));
  }
  const int expected = modes_below_gap(pairs, residual, options.num_modes, count == p.K.rows());
  if (expected == 0) throw NumericalError("no gap above the modes asked for");
  sturm_check(p, factor, pairs, expected);
  trim(pairs, residual, options.num_modes);
  pairs.summary.orthogonality_error = orthogonality_error(p, pairs.Phi);
  return pairs;
}

/// Shift for a body that can move freely: minus a tenth of the first elastic eigenvalue, so that the rigid modes are
/// well apart from it and K - sigma M is as well conditioned as it can be. A first solve with a shift far below finds
/// that eigenvalue.
double free_shift(const EigenProblem& p, SparseFactor& factor, const EigenBackend& backend, int num_modes) {
  const double crude = -1e-9 * stiffness_scale(p);
  const int count = static_cast<int>(std::min<Eigen::Index>(p.K.rows(), std::max(num_modes, 6) + extra_modes));
  const EigenPairs pairs = raw_modes(p, factor, backend, crude, count, 0);
  for (int i = 0; i < count; ++i) {
    // Below this a Rayleigh quotient is round-off of its own sum: eps |phi|^T |K| |phi|, with room for the digits lost
    // by the solver.
    const Eigen::VectorXd phi = pairs.Phi.col(i).cwiseAbs();
    const double noise = 1e4 * eps * phi.dot(p.K.cwiseAbs() * phi);
    if (pairs.lambda(i) > std::max(noise, -1e-6 * crude)) return -0.1 * pairs.lambda(i);
  }
  return crude;
}

/// A shift further down: off an eigenvalue it may sit on, and below zero modes nobody announced. It stays near the one
/// asked for: a shift deep inside the spectrum is a mistake that shall not be hidden.
double moved_down(double sigma, double scale, int attempt) {
  return sigma - std::max(1e-2 * std::abs(sigma), 1e-10 * scale * std::pow(10.0, attempt));
}

}  // namespace

std::span<const EigenBackend> eigen_backends() {
  static constexpr std::array<EigenBackend, 3> rows = {{
      {"arpack", arpack_modes},
      {"spectra", spectra_modes},
      {"dense", dense_modes},
  }};
  return rows;
}

EigenPairs solve_modes(const EigenProblem& p, const EigenOptions& options) {
  return solve_modes_with(backend_named(options.backend), p, options);
}

EigenPairs solve_modes_with(const EigenBackend& backend, const EigenProblem& p, const EigenOptions& options) {
  check_input(p, options);
  SparseFactor factor(p.K - p.M);  // the pattern of every K - sigma M
  const double scale = stiffness_scale(p);
  const auto n = static_cast<int>(p.K.rows());

  double sigma = 0;
  if (options.sigma) {
    sigma = *options.sigma;
  } else if (p.free_floating) {
    sigma = free_shift(p, factor, backend, options.num_modes);
  }
  int count = std::min(n, options.num_modes + extra_modes);
  std::string note;
  for (int attempt = 0; attempt < max_attempts; ++attempt) {
    try {
      EigenPairs pairs = verified_modes(p, factor, backend, sigma, count, options);
      pairs.summary.note = note;
      return pairs;
    } catch (const NumericalError& e) {
      note += fmt::format("shift {:.6g}, {} modes: {}; ", sigma, count, e.what());
      sigma = moved_down(sigma, scale, attempt);
      count = std::min(n, 2 * count);
    }
  }
  throw NumericalError("modes: no verified answer; " + note +
                       "is the shift far inside the spectrum, or the body not held as said?");
}

}  // namespace flexboom
