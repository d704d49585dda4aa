#include "reduction/eigen/solver.hpp"

#include "fem/base/check.hpp"
#include "fem/base/stopwatch.hpp"
#include "reduction/eigen/backends.hpp"
#include "reduction/eigen/shift.hpp"
#include "reduction/eigen/verify.hpp"

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>

namespace flexboom {
namespace {

constexpr int extra_modes = 3;     // beyond those wanted, so that the Sturm count finds a gap
constexpr int max_attempts = 4;    // the first and three with a moved shift
constexpr int dense_limit = 1500;  // unknowns of the problems that go to the dense row by themselves

const EigenBackend& backend_named(const std::string& name) {
  std::string known;
  for (const EigenBackend& row : eigen_backends()) {
    if (row.name == name) return row;
    known += fmt::format("\"{}\", ", row.name);
  }
  throw InputError("eigen-solver \"" + name + "\" is unknown; there are " + known + "\"auto\"");
}

void check_entries(const SparseMatrix& A, const char* name) {
  for (Eigen::Index j = 0; j < A.cols(); ++j) {
    for (SparseMatrix::InnerIterator it(A, j); it; ++it) {
      if (std::isfinite(it.value()) || it.row() < j) continue;
      throw InputError(fmt::format("eigenproblem: entry ({}, {}) of {} is {}", it.row(), j, name, it.value()));
    }
  }
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
  check_entries(p.K, "K");
  check_entries(p.M, "M");
  Eigen::Index lightest = 0;
  const double least = p.M.diagonal().minCoeff(&lightest);
  require(least >= 0,
          fmt::format("eigenproblem: entry ({0}, {0}) of M is {1}; a mass is not negative", lightest, least));
  const int with_mass = finite_eigenvalues(p);
  require(options.num_modes <= with_mass,
          fmt::format("modes: {} asked, but only {} of {} freedoms carry mass: there are no more finite frequencies",
                      options.num_modes, with_mass, n));
}

/// Lanczos leaves at least one vector out: a backend that cannot return them all is replaced by one that can.
const EigenBackend& able(const EigenBackend& wanted, const EigenProblem& p, int count) {
  if (count < finite_eigenvalues(p) || wanted.name == "dense") return wanted;
  return backend_named(p.K.rows() <= dense_limit ? "dense" : "block");
}

/// Solves and verifies, with twice as many modes as long as no gap is seen above those wanted.
EigenPairs verified_modes(const EigenProblem& p, ShiftedFactor& shifted, const EigenBackend& wanted, double sigma,
                          int count, const EigenOptions& options) {
  const int most = finite_eigenvalues(p);
  shifted.move_to(sigma);
  for (count = std::min(most, count);; count = std::min(most, 2 * count)) {
    const EigenBackend& backend = able(wanted, p, count);
    const Stopwatch start;
    EigenPairs pairs = backend.solve(p, shifted.factor(), {sigma, options.num_modes, count, options.tolerance});
    EigenSummary& s = pairs.summary;
    s.eigen_seconds = start.seconds();
    s.backend = std::string(backend.name);
    if (backend.name != wanted.name) s.backend += " (problem too small for " + std::string(wanted.name) + ")";
    s.sigma = sigma;
    const auto found = static_cast<int>(pairs.lambda.size());
    const bool complete = found < count || count == most;
    if (verify(p, shifted, options, complete, pairs)) {
      shifted.report(s);
      return pairs;
    }
  }
}

/// A shift further down: off an eigenvalue it may sit on, and below zero modes nobody announced. It stays near the one
/// asked for: a shift deep inside the spectrum is a mistake that shall not be hidden.
double moved_down(double sigma, double scale, int attempt) {
  return sigma - std::max(1e-2 * std::abs(sigma), 1e-10 * scale * std::pow(10.0, attempt));
}

}  // namespace

std::span<const EigenBackend> eigen_backends() {
  static constexpr std::array<EigenBackend, 4> rows = {{
      {"arpack", arpack_modes},
      {"block", block_modes},
      {"spectra", spectra_modes},
      {"dense", dense_modes},
  }};
  return rows;
}

int finite_eigenvalues(const EigenProblem& p) {
  constexpr Eigen::Index small = 200;  // unknowns whose factor costs nothing
  const auto with_mass = static_cast<int>((p.M.diagonal().array() > 0).count());
  if (p.M.rows() > small) return with_mass;
  const Eigen::VectorXd scale = p.M.diagonal().unaryExpr([](double m) { return m > 0 ? 1 / std::sqrt(m) : 0; });
  const Eigen::MatrixXd M = scale.asDiagonal() * Eigen::MatrixXd(p.M) * scale.asDiagonal();
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(M);  // pivots by size; reads the lower triangle
  const int rank = static_cast<int>((ldlt.vectorD().array() > 1e-12).count());
  return std::min(rank, with_mass);
}

void throw_too_few_eigenvalues(const EigenProblem& p, double largest_nu, Eigen::Index found, int wanted) {
  const std::string text = fmt::format("modes: {} asked, but there are only {} finite frequencies", wanted, found);
  // Where round-off of the largest 1 / (lambda - sigma) hides those of high frequencies, nothing is known about them.
  if (infinite_nu * largest_nu * stiffness_scale(p) > 1)
    throw NumericalError(text + " that can be told from round-off");
  throw InputError(text + ": the other freedoms carry no mass of their own");
}

EigenPairs solve_modes(const EigenProblem& p, const EigenOptions& options) {
  if (options.backend != "auto") return solve_modes_with(backend_named(options.backend), p, options);
  // Measured: from about 2000 unknowns on solves by blocks win, below the smaller overhead of ARPACK does.
  if (p.K.rows() < many_unknowns) return solve_modes_with(backend_named("arpack"), p, options);
  try {
    return solve_modes_with(backend_named("block"), p, options);
  } catch (const NumericalError& e) {
    EigenPairs pairs = solve_modes_with(backend_named("arpack"), p, options);
    pairs.summary.note = fmt::format("block failed ({}); {}", e.what(), pairs.summary.note);
    return pairs;
  }
}

EigenPairs solve_modes_with(const EigenBackend& backend, const EigenProblem& p, const EigenOptions& options) {
  check_input(p, options);
  ShiftedFactor shifted(p);
  const bool may_choose = !options.sigma;
  double sigma = options.sigma.value_or(0);
  if (may_choose && p.free_floating) sigma = free_shift(p, shifted, options.num_modes);
  int count = options.num_modes + extra_modes;
  std::string note;
  for (int attempt = 0; attempt < max_attempts; ++attempt) {
    std::string reason;
    try {
      EigenPairs pairs = verified_modes(p, shifted, backend, sigma, count, options);
      pairs.summary.rigid_modes = zero_modes(p, pairs);
      if (sigma != 0 || pairs.summary.rigid_modes == 0) {
        pairs.summary.note = note;
        if (options.keep_factor) pairs.factor = shifted.take_factor_of_K();
        return pairs;
      }
      reason = fmt::format("K is singular to round-off, the body can move in {} ways", pairs.summary.rigid_modes);
    } catch (const NumericalError& e) {
      reason = e.what();
    }
    note += fmt::format("shift {:.6g}, {} modes: {}; ", sigma, count, reason);
    const bool chosen = may_choose && sigma == 0;
    sigma = chosen ? free_shift(p, shifted, options.num_modes) : moved_down(sigma, stiffness_scale(p), attempt);
    if (!chosen) count *= 2;
  }
  const bool are_many = 4 * static_cast<Eigen::Index>(options.num_modes) > p.K.rows();
  const std::string why =
      are_many ? fmt::format(
                     "{} modes of {} unknowns are asked for, and the highest are beyond any solver: ask for "
                     "fewer, or take more elements",
                     options.num_modes, p.K.rows())
               : "is the shift far inside the spectrum, or the body not held as said?";
  throw NumericalError("modes: no verified answer; " + note + why);
}

}  // namespace flexboom
