#include "fem/base/eigen_instances.hpp"

namespace Eigen {

template class SelfAdjointEigenSolver<MatrixXd>;
template class GeneralizedSelfAdjointEigenSolver<MatrixXd>;
template class EigenSolver<MatrixXd>;
template class PartialPivLU<MatrixXd>;
template class FullPivLU<MatrixXd>;
template class LLT<MatrixXd>;
template class LDLT<MatrixXd>;
template class HouseholderQR<MatrixXd>;
template class ColPivHouseholderQR<MatrixXd>;
template class JacobiSVD<MatrixXd>;

namespace internal {

template struct general_matrix_matrix_product<Index, double, ColMajor, false, double, ColMajor, false, ColMajor, 1>;
template struct general_matrix_matrix_product<Index, double, RowMajor, false, double, ColMajor, false, ColMajor, 1>;
template struct general_matrix_matrix_product<Index, double, ColMajor, false, double, RowMajor, false, ColMajor, 1>;
template struct general_matrix_matrix_product<Index, double, RowMajor, false, double, RowMajor, false, ColMajor, 1>;

}  // namespace internal
}  // namespace Eigen
