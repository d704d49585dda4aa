#include "fem/linear_algebra/dense.hpp"
#include "fem/base/check.hpp"
#include "reduction/eigen/backends.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace flexboom {

// M x = nu (K - sigma M) x with nu = 1 / (omega^2 - sigma). The lowest modes are the largest nu, which have full
// relative precision. A singular M only adds zero values of nu.
EigenPairs dense_modes(const EigenProblem& problem, const SparseFactor&, const EigenRequest& request) {
  const double sigma = request.sigma;
  const Eigen::MatrixXd M(problem.M);
  SymmetricPairs all = [&] {
    try {
      return symmetric_pairs(M, Eigen::MatrixXd(problem.K) - sigma * M);
    } catch (const NumericalError& e) {
      throw NumericalError(
          fmt::format("dense: {}; B is K - sigma M, which the shift must leave positive definite", e.what()));
    }
  }();
  const Eigen::VectorXd nu = all.nu.reverse();
  const Eigen::Index count = std::min<Eigen::Index>(request.count, (nu.array() > infinite_nu * nu(0)).count());
  if (count < request.wanted) throw_too_few_eigenvalues(problem, nu(0), count, request.wanted);
  EigenPairs pairs;
  pairs.lambda = sigma + nu.head(count).array().inverse();
  pairs.Phi = all.x.rightCols(count).rowwise().reverse() * nu.head(count).cwiseSqrt().cwiseInverse().asDiagonal();
  return pairs;
}

}  // namespace flexboom
