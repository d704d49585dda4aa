#pragma once

// Decompositions and products of Eigen that many files use. Where this header comes first, as in the precompiled
// one, they are compiled once, in eigen_instances.cpp, and not again in every file. Nothing else changes, so no file
// includes it by name.

#include <Eigen/Dense>

namespace Eigen {

extern template class SelfAdjointEigenSolver<MatrixXd>;
extern template class GeneralizedSelfAdjointEigenSolver<MatrixXd>;
extern template class EigenSolver<MatrixXd>;
extern template class PartialPivLU<MatrixXd>;
extern template class FullPivLU<MatrixXd>;
extern template class LLT<MatrixXd>;
extern template class LDLT<MatrixXd>;
extern template class HouseholderQR<MatrixXd>;
extern template class ColPivHouseholderQR<MatrixXd>;
extern template class JacobiSVD<MatrixXd>;

namespace internal {

extern template struct general_matrix_matrix_product<Index, double, ColMajor, false, double, ColMajor, false, ColMajor,
                                                     1>;
extern template struct general_matrix_matrix_product<Index, double, RowMajor, false, double, ColMajor, false, ColMajor,
                                                     1>;
extern template struct general_matrix_matrix_product<Index, double, ColMajor, false, double, RowMajor, false, ColMajor,
                                                     1>;
extern template struct general_matrix_matrix_product<Index, double, RowMajor, false, double, RowMajor, false, ColMajor,
                                                     1>;

}  // namespace internal
}  // namespace Eigen
