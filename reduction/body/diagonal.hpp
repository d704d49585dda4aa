#pragma once

#include <Eigen/Core>

#include <cmath>

namespace flexboom {

/// Is a symmetric matrix of generalised masses, stiffnesses or dampings diagonal but for the round-off that solvers
/// leave?
inline bool is_diagonal(const Eigen::MatrixXd& A) {
  constexpr double round_off = 1e-12;  // of what two elements of the diagonal allow between them
  const Eigen::VectorXd scale = A.diagonal().cwiseAbs().cwiseSqrt();
  for (Eigen::Index j = 0; j < A.cols(); ++j)
    for (Eigen::Index i = 0; i < A.rows(); ++i)
      if (i != j && std::abs(A(i, j)) > round_off * scale[i] * scale[j]) return false;
  return true;
}

}  // namespace flexboom
