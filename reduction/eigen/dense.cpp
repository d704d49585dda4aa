#include "fem/base/check.hpp"
#include "reduction/eigen/backends.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>

namespace flexboom {

// With K - sigma M = L L^T the problem becomes L^-1 M L^-T y = nu y, nu = 1 / (omega^2 - sigma), phi = L^-T y. The
// lowest modes are the largest nu, which the QR algorithm gives to full relative precision. A singular M only adds zero
// values of nu.
EigenPairs dense_modes(const EigenProblem& problem, const SparseFactor&, const EigenRequest& request) {
  const double sigma = request.sigma;
  const Eigen::MatrixXd M = Eigen::MatrixXd(problem.M).selfadjointView<Eigen::Lower>();
  const Eigen::LLT<Eigen::MatrixXd> llt(
      Eigen::MatrixXd(Eigen::MatrixXd(problem.K) - sigma * M));  // reads the lower triangle
  if (llt.info() != Eigen::Success) {
    throw NumericalError("dense: K - sigma M is not positive definite, the shift is not below the lowest eigenvalue");
  }
  const auto L = llt.matrixL();
  Eigen::MatrixXd C = L.solve(M);
  C = L.solve(C.transpose().eval());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(Eigen::MatrixXd((C + C.transpose()) / 2));
  if (eigen.info() != Eigen::Success) throw NumericalError("dense: the QR algorithm did not converge");

  const Eigen::VectorXd nu = eigen.eigenvalues().reverse();
  const Eigen::Index count = std::min<Eigen::Index>(request.count, (nu.array() > infinite_nu * nu(0)).count());
  if (count < request.wanted) throw_too_few_eigenvalues(problem, nu(0), count, request.wanted);
  EigenPairs pairs;
  pairs.lambda = sigma + nu.head(count).array().inverse();
  pairs.Phi = llt.matrixU().solve(eigen.eigenvectors().rightCols(count).rowwise().reverse());
  pairs.Phi *= nu.head(count).cwiseSqrt().cwiseInverse().asDiagonal();
  return pairs;
}

}  // namespace flexboom
