#include "fem/dense.hpp"

#include "fem/blas_threads.hpp"
#include "fem/check.hpp"

#include <fmt/format.h>

// Fortran BLAS and LAPACK, 32-bit integers.
extern "C" void dgemm_(const char* transa, const char* transb, const int* m, const int* n, const int* k,
                       const double* alpha, const double* a, const int* lda, const double* b, const int* ldb,
                       const double* beta, double* c, const int* ldc);
extern "C" void dsyrk_(const char* uplo, const char* trans, const int* n, const int* k, const double* alpha,
                       const double* a, const int* lda, const double* beta, double* c, const int* ldc);
extern "C" void dgeev_(const char* left, const char* right, const int* n, double* a, const int* lda, double* real,
                       double* imaginary, double* left_vectors, const int* ld_left, double* right_vectors,
                       const int* ld_right, double* work, const int* work_size, int* info);
extern "C" void dgetrf_(const int* m, const int* n, double* a, const int* lda, int* pivots, int* info);
extern "C" void dgetri_(const int* n, double* a, const int* lda, const int* pivots, double* work, const int* work_size,
                        int* info);

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
  const double one = 1;
  dgemm_(turned ? "T" : "N", "N", &m, &n, &k, &factor, A.data(), &lda, X.data(), &ldx, &one, Y.data(), &ldy);
}

void add_gram(Ref<MatrixXd> Y, const Ref<const MatrixXd>& A) {
  require(Y.rows() == A.rows() && Y.cols() == A.rows(),
          fmt::format("Gram matrix: {} x {} of {} rows", Y.rows(), Y.cols(), A.rows()));
  if (A.size() == 0) return;
  const auto n = static_cast<int>(A.rows()), k = static_cast<int>(A.cols());
  const auto lda = static_cast<int>(A.outerStride()), ldy = static_cast<int>(Y.outerStride());
  const double one = 1;
  dsyrk_("L", "N", &n, &k, &one, A.data(), &lda, &one, Y.data(), &ldy);
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
  const int ask = -1, one = 1;
  int info = 0;
  double best = 0;
  const auto run = [&](double* work, int size) {
    dgeev_("N", "V", &n, A.data(), &n, result.real.data(), result.imaginary.data(), nullptr, &one,
           result.vectors.data(), &n, work, &size, &info);
  };
  run(&best, ask);
  Eigen::VectorXd work(static_cast<Eigen::Index>(best));
  run(work.data(), static_cast<int>(work.size()));
  if (info != 0 || !result.vectors.allFinite())
    throw NumericalError(fmt::format("eigenvectors: LAPACK failed ({}) on a matrix of {} rows", info, n));
  return result;
}

MatrixXd inverse(MatrixXd A) {
  require(A.rows() == A.cols(), fmt::format("inverse: the matrix is {} x {}", A.rows(), A.cols()));
  const auto n = static_cast<int>(A.rows());
  if (n == 0) return A;
  const OneBlasThread alone;
  Eigen::VectorXi pivots(n);
  int info = 0;
  dgetrf_(&n, &n, A.data(), &n, pivots.data(), &info);
  constexpr int panel = 64;
  const int size = panel * n;
  Eigen::VectorXd work(size);
  if (info == 0) dgetri_(&n, A.data(), &n, pivots.data(), work.data(), &size, &info);
  if (info != 0) throw NumericalError(fmt::format("inverse: a pivot is zero ({}) in a matrix of {} rows", info, n));
  return A;
}

}  // namespace flexboom
