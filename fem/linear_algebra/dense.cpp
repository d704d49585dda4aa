#include "fem/linear_algebra/dense.hpp"

#include "fem/base/blas_threads.hpp"
#include "fem/base/check.hpp"

#include <cblas.h>
#include <fmt/format.h>
#include <lapacke.h>

#include <utility>

namespace flexboom {

using Eigen::MatrixXd;
using Eigen::Ref;

void add_product(Ref<MatrixXd> Y, double factor, Transposed transposed, const Ref<const MatrixXd>& A,
                 const Ref<const MatrixXd>& X) {
  const bool turned = transposed == Transposed::yes;
  const Eigen::Index rows = turned ? A.cols() : A.rows(), inner = turned ? A.rows() : A.cols();
  require(Y.rows() == rows && Y.cols() == X.cols() && X.rows() == inner,
          fmt::format("product: {} x {} of {} x {}{} and {} x {}", Y.rows(), Y.cols(), A.rows(), A.cols(),
                      turned ? " transposed" : "", X.rows(), X.cols()));
  if (Y.size() == 0 || inner == 0) return;
  const auto m = static_cast<int>(rows), n = static_cast<int>(Y.cols()), k = static_cast<int>(inner);
  const auto lda = static_cast<int>(A.outerStride()), ldx = static_cast<int>(X.outerStride()),
             ldy = static_cast<int>(Y.outerStride());
  cblas_dgemm(CblasColMajor, turned ? CblasTrans : CblasNoTrans, CblasNoTrans, m, n, k, factor, A.data(), lda, X.data(),
              ldx, 1, Y.data(), ldy);
}

void add_gram(Ref<MatrixXd> Y, const Ref<const MatrixXd>& A) {
  require(Y.rows() == A.rows() && Y.cols() == A.rows(),
          fmt::format("Gram matrix: {} x {} of {} rows", Y.rows(), Y.cols(), A.rows()));
  if (A.size() == 0) return;
  const auto n = static_cast<int>(A.rows()), k = static_cast<int>(A.cols());
  const auto lda = static_cast<int>(A.outerStride()), ldy = static_cast<int>(Y.outerStride());
  cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, n, k, 1, A.data(), lda, 1, Y.data(), ldy);
}

MatrixXd transposed_product(const Ref<const MatrixXd>& A, const Ref<const MatrixXd>& X) {
  MatrixXd Y = MatrixXd::Zero(A.cols(), X.cols());
  add_product(Y, 1, Transposed::yes, A, X);
  return Y;
}

MatrixXd product(const Ref<const MatrixXd>& A, const Ref<const MatrixXd>& X) {
  MatrixXd Y = MatrixXd::Zero(A.rows(), X.cols());
  add_product(Y, 1, Transposed::no, A, X);
  return Y;
}

RealEigenvectors eigenvectors(MatrixXd A) {
  require(A.rows() == A.cols(), fmt::format("eigenvectors: the matrix is {} x {}", A.rows(), A.cols()));
  const auto n = static_cast<int>(A.rows());
  RealEigenvectors result{Eigen::VectorXd(n), Eigen::VectorXd(n), MatrixXd(n, n)};
  if (n == 0) return result;
  const OneBlasThread alone;  // the same digits for any number of threads
  const auto run = [&](double* work, int size) {
    return LAPACKE_dgeev_work(LAPACK_COL_MAJOR, 'N', 'V', n, A.data(), n, result.real.data(), result.imaginary.data(),
                              nullptr, 1, result.vectors.data(), n, work, size);
  };
  double best = 0;
  run(&best, -1);  // asks for the size
  Eigen::VectorXd work(static_cast<Eigen::Index>(best));
  const int info = run(work.data(), static_cast<int>(work.size()));
  if (info != 0 || !result.vectors.allFinite())
    throw NumericalError(fmt::format("eigenvectors: LAPACK failed ({}) on a matrix of {} rows", info, n));
  return result;
}

SymmetricPairs symmetric_pairs(MatrixXd A, MatrixXd B) {
  require(A.rows() == A.cols() && B.rows() == A.rows() && B.cols() == A.rows(),
          fmt::format("symmetric pairs: the matrices are {} x {} and {} x {}", A.rows(), A.cols(), B.rows(), B.cols()));
  const auto n = static_cast<int>(A.rows());
  Eigen::VectorXd nu(n);
  if (n == 0) return {nu, A};
  const OneBlasThread alone;  // the same digits for any number of threads
  constexpr int problem = 1;  // A x = nu B x
  const int info = LAPACKE_dsygvd(LAPACK_COL_MAJOR, problem, 'V', 'L', n, A.data(), n, B.data(), n, nu.data());
  if (info > n) throw NumericalError(fmt::format("symmetric pairs: B is not positive definite (row {})", info - n));
  if (info != 0 || !A.allFinite())
    throw NumericalError(fmt::format("symmetric pairs: LAPACK failed ({}) on matrices of {} rows", info, n));
  return {std::move(nu), std::move(A)};
}

MatrixXd inverse(MatrixXd A) {
  require(A.rows() == A.cols(), fmt::format("inverse: the matrix is {} x {}", A.rows(), A.cols()));
  const auto n = static_cast<int>(A.rows());
  if (n == 0) return A;
  const OneBlasThread alone;
  Eigen::VectorXi pivots(n);
  int info = LAPACKE_dgetrf_work(LAPACK_COL_MAJOR, n, n, A.data(), n, pivots.data());
  constexpr int panel = 64;
  Eigen::VectorXd work(panel * n);
  if (info == 0) info = LAPACKE_dgetri_work(LAPACK_COL_MAJOR, n, A.data(), n, pivots.data(), work.data(), panel * n);
  if (info != 0) throw NumericalError(fmt::format("inverse: a pivot is zero ({}) in a matrix of {} rows", info, n));
  return A;
}

}  // namespace flexboom
