#include "dynamics/numerics/small_product.hpp"

#include <gtest/gtest.h>

namespace flexboom {
namespace {

using Eigen::MatrixXd;

/// Every number of rows and columns about the widths of registers, within larger matrices; what lies beside C stays.
TEST(SmallProduct, IsTheProductForEveryShape) {
  const int inner = 7;
  const MatrixXd A = MatrixXd::Random(110, inner), B = MatrixXd::Random(inner + 2, 10);
  for (int rows = 1; rows <= 100; ++rows)
    for (int columns = 1; columns <= 9; ++columns) {
      MatrixXd C = MatrixXd::Constant(110, 10, 3), expected = C;
      expected.block(2, 1, rows, columns) = A.topRows(rows) * B.block(1, 0, inner, columns);
      small_product(A.topRows(rows), B.block(1, 0, inner, columns), C.block(2, 1, rows, columns));
      EXPECT_LT((C - expected).cwiseAbs().maxCoeff(), 1e-14)  // round-off of seven products of numbers below 1
          << rows << " x " << columns;
    }
}

}  // namespace
}  // namespace flexboom
