#include "fem/linear_algebra/sparse.hpp"

#include "fem/base/check.hpp"
#include "fem/base/lanes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace flexboom {
namespace {

using Eigen::Index;

/// A compressed matrix as plain arrays.
struct Columns {
  Index count;
  const int* start;
  const int* row;
  const double* value;
};

/// Y += A X for a few columns kept row by row, so that an entry of A meets a run of neighbours.
template <class Rows>
[[gnu::always_inline]] inline void accumulate(const Columns& A, const Rows* x, Rows* y) {
  for (Index j = 0; j < A.count; ++j) {
    const Rows x_j = x[j];
    Rows sum = y[j];
    for (int k = A.start[j]; k < A.start[j + 1]; ++k) {
      const Index i = A.row[k];
      if (i < j) continue;
      add(sum, A.value[k], x[i]);
      if (i != j) add(y[i], A.value[k], x_j);
    }
    y[j] = sum;
  }
}

template <class Rows>
[[gnu::always_inline]] inline void accumulate(const Columns& A, const double* x, double* y) {
  accumulate(A, reinterpret_cast<const Rows*>(x), reinterpret_cast<Rows*>(y));
}

#ifdef FLEXBOOM_PROCESSORS
[[gnu::target("avx512f")]] void by_8(const Columns& A, const double* x, double* y) {
  accumulate<LaneRow<Eight, 1>>(A, x, y);
}
[[gnu::target("avx512f")]] void by_4(const Columns& A, const double* x, double* y) {
  accumulate<LaneRow<Four, 1>>(A, x, y);
}
[[gnu::target("avx2,fma")]] void by_8(const Columns& A, const double* x, double* y) {
  accumulate<LaneRow<Four, 2>>(A, x, y);
}
[[gnu::target("avx2,fma")]] void by_4(const Columns& A, const double* x, double* y) {
  accumulate<LaneRow<Four, 1>>(A, x, y);
}
#endif
FLEXBOOM_ANY_PROCESSOR void by_8(const Columns& A, const double* x, double* y) { accumulate<LaneRow<Two, 4>>(A, x, y); }
FLEXBOOM_ANY_PROCESSOR void by_4(const Columns& A, const double* x, double* y) { accumulate<LaneRow<Two, 2>>(A, x, y); }

void add_product(const Columns& A, const Eight* x, Eight* y) {
  by_8(A, reinterpret_cast<const double*>(x), reinterpret_cast<double*>(y));
}
void add_product(const Columns& A, const Four* x, Four* y) {
  by_4(A, reinterpret_cast<const double*>(x), reinterpret_cast<double*>(y));
}

template <class Rows>
void product_of_columns(const Columns& A, const Eigen::Ref<const Eigen::MatrixXd>& X, Index first,
                        Eigen::Ref<Eigen::MatrixXd> Y) {
  const auto rows = static_cast<size_t>(A.count);
  const int width = static_cast<int>(std::min<Index>(Rows::width, X.cols() - first));  // fewer: beside zeros
  std::vector<Rows> x(rows, Rows{}), y(rows, Rows{});
  for (int c = 0; c < width; ++c) {
    for (size_t i = 0; i < rows; ++i) x[i].of[c] = X(static_cast<Index>(i), first + c);
  }
  add_product(A, x.data(), y.data());
  for (int c = 0; c < width; ++c) {
    for (size_t i = 0; i < rows; ++i) Y(static_cast<Index>(i), first + c) = y[i].of[c];
  }
}

}  // namespace

void symmetric_product(const SparseMatrix& A, const Eigen::Ref<const Eigen::MatrixXd>& X,
                       Eigen::Ref<Eigen::MatrixXd> Y) {
  require(A.rows() == A.cols() && A.cols() == X.rows() && Y.rows() == X.rows() && Y.cols() == X.cols(),
          fmt::format("product: a {} x {} matrix with a {} x {} block", A.rows(), A.cols(), X.rows(), X.cols()));
  require(A.isCompressed(), "product: the matrix must be compressed");
  const Columns columns{A.cols(), A.outerIndexPtr(), A.innerIndexPtr(), A.valuePtr()};
  Index done = 0;
  for (; done + 4 < X.cols(); done += 8) product_of_columns<Eight>(columns, X, done, Y);
  for (; done + 1 < X.cols(); done += 4) product_of_columns<Four>(columns, X, done, Y);
  for (; done < X.cols(); ++done) Y.col(done) = A.selfadjointView<Eigen::Lower>() * X.col(done);
}

Eigen::MatrixXd symmetric_product(const SparseMatrix& A, const Eigen::Ref<const Eigen::MatrixXd>& X) {
  Eigen::MatrixXd Y(X.rows(), X.cols());
  symmetric_product(A, X, Y);
  return Y;
}

Eigen::MatrixXd quadratic_form(const SparseMatrix& A, const Eigen::Ref<const Eigen::MatrixXd>& X) {
  return X.transpose() * symmetric_product(A, X);
}

SparseMatrix shifted(const SparseMatrix& K, double sigma, const SparseMatrix& M) {
  SparseMatrix result(K.rows(), K.cols());
  std::vector<int>::size_type entries = 0;
  for (int pass = 0; pass < 2; ++pass) {
    if (pass == 1) result.resizeNonZeros(static_cast<Index>(entries));
    entries = 0;
    for (Index j = 0; j < K.cols(); ++j) {
      result.outerIndexPtr()[j] = static_cast<int>(entries);
      SparseMatrix::InnerIterator k(K, j), m(M, j);
      while (k || m) {
        const Index row = !m || (k && k.row() <= m.row()) ? k.row() : m.row();
        double value = 0;
        if (k && k.row() == row) {
          value += k.value();
          ++k;
        }
        if (m && m.row() == row) {
          value -= sigma * m.value();
          ++m;
        }
        if (row < j) continue;
        if (pass == 1) {
          result.innerIndexPtr()[entries] = static_cast<int>(row);
          result.valuePtr()[entries] = value;
        }
        ++entries;
      }
    }
    result.outerIndexPtr()[K.cols()] = static_cast<int>(entries);
  }
  return result;
}

}  // namespace flexboom
