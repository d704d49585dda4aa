#pragma once

// Decompositions and products of Eigen that many files use. Where this header comes first, as in the precompiled
// one, they are compiled once, in eigen_instances.cpp, and not again in every file. Nothing else changes, so no file
// includes it by name. An argument that is an expression is another instance, of seconds: hand over MatrixXd(...).

#include <Eigen/Dense>

#ifndef FLEXBOOM_EIGEN_INSTANCE
#define FLEXBOOM_EIGEN_INSTANCE extern template
#endif

namespace Eigen {

FLEXBOOM_EIGEN_INSTANCE class SelfAdjointEigenSolver<MatrixXd>;
FLEXBOOM_EIGEN_INSTANCE SelfAdjointEigenSolver<MatrixXd>& SelfAdjointEigenSolver<MatrixXd>::compute(
    const EigenBase<MatrixXd>&, int);
FLEXBOOM_EIGEN_INSTANCE class SelfAdjointEigenSolver<Matrix3d>;
FLEXBOOM_EIGEN_INSTANCE SelfAdjointEigenSolver<Matrix3d>& SelfAdjointEigenSolver<Matrix3d>::compute(
    const EigenBase<Matrix3d>&, int);
FLEXBOOM_EIGEN_INSTANCE class GeneralizedSelfAdjointEigenSolver<MatrixXd>;
FLEXBOOM_EIGEN_INSTANCE class PartialPivLU<MatrixXd>;
FLEXBOOM_EIGEN_INSTANCE class LLT<MatrixXd>;
FLEXBOOM_EIGEN_INSTANCE LLT<MatrixXd>& LLT<MatrixXd>::compute(const EigenBase<MatrixXd>&);
FLEXBOOM_EIGEN_INSTANCE void LLT<MatrixXd>::_solve_impl_transposed<true>(const MatrixXd&, MatrixXd&) const;
FLEXBOOM_EIGEN_INSTANCE void LLT<MatrixXd>::_solve_impl_transposed<true>(const VectorXd&, VectorXd&) const;
FLEXBOOM_EIGEN_INSTANCE class LDLT<MatrixXd>;
FLEXBOOM_EIGEN_INSTANCE LDLT<MatrixXd>& LDLT<MatrixXd>::compute(const EigenBase<MatrixXd>&);
FLEXBOOM_EIGEN_INSTANCE void LDLT<MatrixXd>::_solve_impl_transposed<true>(const MatrixXd&, MatrixXd&) const;
FLEXBOOM_EIGEN_INSTANCE void LDLT<MatrixXd>::_solve_impl_transposed<true>(const VectorXd&, VectorXd&) const;
FLEXBOOM_EIGEN_INSTANCE class ColPivHouseholderQR<MatrixXd>;
FLEXBOOM_EIGEN_INSTANCE ColPivHouseholderQR<MatrixXd>& ColPivHouseholderQR<MatrixXd>::compute(
    const EigenBase<MatrixXd>&);
FLEXBOOM_EIGEN_INSTANCE void ColPivHouseholderQR<MatrixXd>::_solve_impl(const MatrixXd&, MatrixXd&) const;
FLEXBOOM_EIGEN_INSTANCE void ColPivHouseholderQR<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;
FLEXBOOM_EIGEN_INSTANCE class JacobiSVD<MatrixXd>;

namespace internal {

FLEXBOOM_EIGEN_INSTANCE void apply_block_householder_on_the_left(Block<MatrixXd>&, const Block<MatrixXd>&,
                                                                 const VectorBlock<const VectorXd>&, bool);
FLEXBOOM_EIGEN_INSTANCE struct triangular_solve_matrix<double, Index, OnTheLeft, UnitLower, false, ColMajor, ColMajor,
                                                       1>;
FLEXBOOM_EIGEN_INSTANCE struct triangular_solve_matrix<double, Index, OnTheLeft, Upper, false, ColMajor, ColMajor, 1>;
FLEXBOOM_EIGEN_INSTANCE struct triangular_solve_matrix<double, Index, OnTheLeft, Lower, false, ColMajor, ColMajor, 1>;
FLEXBOOM_EIGEN_INSTANCE struct general_matrix_matrix_product<Index, double, ColMajor, false, double, ColMajor, false,
                                                             ColMajor, 1>;
FLEXBOOM_EIGEN_INSTANCE struct general_matrix_matrix_product<Index, double, RowMajor, false, double, ColMajor, false,
                                                             ColMajor, 1>;
FLEXBOOM_EIGEN_INSTANCE struct general_matrix_matrix_product<Index, double, ColMajor, false, double, RowMajor, false,
                                                             ColMajor, 1>;
FLEXBOOM_EIGEN_INSTANCE struct general_matrix_matrix_product<Index, double, RowMajor, false, double, RowMajor, false,
                                                             ColMajor, 1>;

}  // namespace internal
}  // namespace Eigen
