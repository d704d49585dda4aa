#include "fem/base/check.hpp"
#include "reduction/eigen/backends.hpp"

#include <Spectra/SymGEigsShiftSolver.h>

#include <algorithm>
#include <exception>
#include <string>

namespace flexboom {
namespace {

/// y = (K - sigma M)^-1 x through our own factor, in the shape Spectra asks for.
class ShiftedInverse {
 public:
  using Scalar = double;
  ShiftedInverse(const SparseFactor& factor, Eigen::Index n) : factor_(factor), n_(n) {}
  Eigen::Index rows() const { return n_; }
  Eigen::Index cols() const { return n_; }
  void set_shift(double) {}  // the factor comes with its shift
  void perform_op(const double* x, double* y) const {
    ++solves_;
    factor_.solve(Eigen::Map<const Eigen::VectorXd>(x, n_), Eigen::Map<Eigen::VectorXd>(y, n_));
  }
  int solves() const { return solves_; }

 private:
  const SparseFactor& factor_;
  Eigen::Index n_;
  mutable int solves_ = 0;  // Spectra calls perform_op as const
};

/// y = M x.
class MassProduct {
 public:
  using Scalar = double;
  explicit MassProduct(const SparseMatrix& M) : M_(M) {}
  Eigen::Index rows() const { return M_.rows(); }
  Eigen::Index cols() const { return M_.cols(); }
  void perform_op(const double* x, double* y) const {
    symmetric_product(M_, Eigen::Map<const Eigen::VectorXd>(x, M_.cols()), Eigen::Map<Eigen::VectorXd>(y, M_.rows()));
  }

 private:
  const SparseMatrix& M_;
};

using Solver = Spectra::SymGEigsShiftSolver<ShiftedInverse, MassProduct, Spectra::GEigsMode::ShiftInvert>;

/// Runs the iteration; whatever Spectra throws is a failure of the numbers. Returns how many pairs converged.
int iterate(Solver& solver, double tolerance) {
  try {
    solver.init();
    // Spectra compares with tolerance * |Ritz value| and stalls when asked for less than its round-off.
    const auto converged = solver.compute(Spectra::SortRule::LargestAlge, 500, std::max(tolerance, 1e-14));
    return static_cast<int>(converged);
  } catch (const std::exception& e) {
    throw NumericalError(std::string("Spectra: ") + e.what());
  }
}

}  // namespace

EigenPairs spectra_modes(const EigenProblem& problem, const SparseFactor& shifted, const EigenRequest& request) {
  const int count = request.count;
  const auto n = static_cast<int>(problem.K.rows());
  const int with_mass = finite_eigenvalues(problem);
  ShiftedInverse inverse(shifted, n);
  MassProduct mass(problem.M);
  Solver solver(inverse, mass, count, lanczos_vectors(count, with_mass), request.sigma);
  const int converged = iterate(solver, request.tolerance);
  if (solver.info() != Spectra::CompInfo::Successful || converged < count) {
    throw NumericalError("Spectra: " + std::to_string(converged) + " of " + std::to_string(count) +
                         " eigenvalues converged");
  }
  EigenPairs pairs;
  pairs.lambda = solver.eigenvalues();
  pairs.Phi = solver.eigenvectors();
  pairs.summary.iterations = static_cast<int>(solver.num_iterations());
  pairs.summary.solves = inverse.solves();
  return pairs;
}

}  // namespace flexboom
