#include "fem/sparse.hpp"

#include "fem/check.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace flexboom {
namespace {

using Eigen::Index;
using RowMajorBlock = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Y += A X for `width` columns kept row by row, so that an entry of A meets a run of neighbours.
template <int width>
void accumulate(const SparseMatrix& A, const double* X, double* Y) {
  using Row = Eigen::Map<const Eigen::Array<double, width, 1>>;
  using MutableRow = Eigen::Map<Eigen::Array<double, width, 1>>;
  for (Index j = 0; j < A.cols(); ++j) {
    const Row x_j(X + j * width);
    Eigen::Array<double, width, 1> sum = Eigen::Array<double, width, 1>::Zero();
    for (SparseMatrix::InnerIterator it(A, j); it; ++it) {
      const Index i = it.row();
      if (i < j) continue;
      const double a = it.value();
      if (i == j) {
        sum += a * x_j;
      } else {
        sum += a * Row(X + i * width);
        MutableRow(Y + i * width) += a * x_j;
      }
    }
    MutableRow(Y + j * width) += sum;
  }
}

template <int width>
void product_of_columns(const SparseMatrix& A, const Eigen::Ref<const Eigen::MatrixXd>& X, Index first,
                        Eigen::Ref<Eigen::MatrixXd> Y) {
  const RowMajorBlock x = X.middleCols(first, width);
  RowMajorBlock y = RowMajorBlock::Zero(X.rows(), width);
  accumulate<width>(A, x.data(), y.data());
  Y.middleCols(first, width) = y;
}

}  // namespace

void symmetric_product(const SparseMatrix& A, const Eigen::Ref<const Eigen::MatrixXd>& X,
                       Eigen::Ref<Eigen::MatrixXd> Y) {
  require(A.rows() == A.cols() && A.cols() == X.rows() && Y.rows() == X.rows() && Y.cols() == X.cols(),
          fmt::format("product: a {} x {} matrix with a {} x {} block", A.rows(), A.cols(), X.rows(), X.cols()));
  Index done = 0;
  for (; done + 8 <= X.cols(); done += 8) product_of_columns<8>(A, X, done, Y);
  for (; done + 4 <= X.cols(); done += 4) product_of_columns<4>(A, X, done, Y);
  for (; done < X.cols(); ++done) product_of_columns<1>(A, X, done, Y);
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
