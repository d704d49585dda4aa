#include "fem/check.hpp"
#include "reduction/eigen_backends.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <limits>
#include <string>

namespace flexboom {

// With K - sigma M = L L^T the problem becomes L^-1 M L^-T y = nu y, nu = 1 / (omega^2 - sigma), phi = L^-T y: the
// lowest modes are the largest nu, which the QR algorithm gives to full relative precision, and a singular M only adds
// nu = 0.
EigenPairs dense_modes(const EigenProblem& problem, const SparseFactor&, double sigma, int count, double) {
  const Eigen::MatrixXd M = problem.M;
  const Eigen::LLT<Eigen::MatrixXd> llt(Eigen::MatrixXd(problem.K) - sigma * M);
  if (llt.info() != Eigen::Success) {
    throw NumericalError("dense: K - sigma M is not positive definite, the shift is not below the lowest eigenvalue");
  }
  const auto L = llt.matrixL();
  Eigen::MatrixXd C = L.solve(M);
  C = L.solve(C.transpose().eval());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen((C + C.transpose()) / 2);
  if (eigen.info() != Eigen::Success) throw NumericalError("dense: the QR algorithm did not converge");

  const Eigen::VectorXd nu = eigen.eigenvalues().tail(count).reverse();
  const double smallest = static_cast<double>(M.rows()) * std::numeric_limits<double>::epsilon() * nu(0);
  if (nu(count - 1) <= smallest) {
    throw NumericalError("dense: fewer than " + std::to_string(count) +
                         " finite eigenvalues, the mass matrix is singular");
  }
  EigenPairs pairs;
  pairs.lambda = sigma + nu.array().inverse();
  pairs.Phi = llt.matrixU().solve(eigen.eigenvectors().rightCols(count).rowwise().reverse());
  pairs.Phi *= nu.cwiseSqrt().cwiseInverse().asDiagonal();
  return pairs;
}

}  // namespace flexboom
