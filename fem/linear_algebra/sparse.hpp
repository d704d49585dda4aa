#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

namespace flexboom {

/// Compressed columns. A symmetric matrix stores its lower triangle; what may be stored above the diagonal is never
/// read.
using SparseMatrix = Eigen::SparseMatrix<double>;

/// Y = A X of a symmetric matrix; A is read once for all columns of X.
void symmetric_product(const SparseMatrix& A, const Eigen::Ref<const Eigen::MatrixXd>& X,
                       Eigen::Ref<Eigen::MatrixXd> Y);
Eigen::MatrixXd symmetric_product(const SparseMatrix& A, const Eigen::Ref<const Eigen::MatrixXd>& X);

/// X^T A X of a symmetric matrix, k x k.
Eigen::MatrixXd quadratic_form(const SparseMatrix& A, const Eigen::Ref<const Eigen::MatrixXd>& X);

/// The lower triangle of K - sigma M over the union of both patterns, which does not depend on sigma.
SparseMatrix shifted(const SparseMatrix& K, double sigma, const SparseMatrix& M);

}  // namespace flexboom
