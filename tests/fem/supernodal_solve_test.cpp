#include "fem/linear_algebra/supernodal_solve.hpp"

#include "fem/linear_algebra/sparse_factor.hpp"

#include "box_matrix.hpp"

#include <utility>

namespace flexboom::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// One column goes through CHOLMOD's own substitution, more through ours.
MatrixXd solved_one_by_one(const SparseFactor& factor, const MatrixXd& B) {
  MatrixXd X(B.rows(), B.cols());
  for (Index c = 0; c < B.cols(); ++c) factor.solve(B.col(c), X.col(c));
  return X;
}

double difference(const MatrixXd& X, const MatrixXd& expected) { return (X - expected).norm() / expected.norm(); }

struct Box {
  int nx, ny, nz;
};
constexpr Box boxes[] = {{1, 1, 1}, {2, 1, 1}, {5, 1, 1}, {30, 1, 1}, {4, 3, 2}, {9, 8, 3}, {13, 12, 11}};

// Condition 1e2 to 1e3 with this shift: 1e-13 are the digits that another order of the same sums leaves.
TEST(SupernodalSolve, AgreesWithCholmodForAnyNumberOfColumns) {
  for (const auto [nx, ny, nz] : boxes) {
    const SparseMatrix A = box(nx, ny, nz, 0.1);
    SparseFactor factor(A, FactorKind::definite);
    factor.factorise(A);
    for (int columns = 1; columns <= 20; ++columns) {
      std::srand(7);
      const MatrixXd B = MatrixXd::Random(A.rows(), columns);
      MatrixXd X(A.rows(), columns);
      factor.solve(B, X);
      EXPECT_LT(difference(X, solved_one_by_one(factor, B)), 1e-13)
          << nx << " x " << ny << " x " << nz << ", " << columns << " columns";
    }
  }
}

TEST(SupernodalSolve, InPlaceAndBetweenOthers) {
  const SparseMatrix A = box(9, 8, 3, 0.1);
  const Index n = A.rows();
  SparseFactor factor(A, FactorKind::definite);
  factor.factorise(A);
  for (const Index columns : {3, 7, 8, 9, 11, 19}) {
    const MatrixXd B = MatrixXd::Random(n, columns);
    MatrixXd alone(n, columns), large = MatrixXd::Constant(n + 3, columns + 2, 1e3), in_place = B;
    factor.solve(B, alone);
    large.block(2, 1, n, columns) = B;
    factor.solve(large.block(2, 1, n, columns), large.block(2, 1, n, columns));
    EXPECT_EQ(large.block(2, 1, n, columns), alone);
    large.block(2, 1, n, columns).setConstant(1e3);
    EXPECT_EQ(large, MatrixXd::Constant(n + 3, columns + 2, 1e3)) << "written outside the block";
    factor.solve(in_place, in_place);
    EXPECT_EQ(in_place, alone);
  }
}

// Two blocks by hand: columns 0 to 12 with the rows 0 to 12, 14 and 16; columns 13 to 16. Above the diagonals lies what
// nobody may read.
TEST(SupernodalSolve, AgreesWithADenseTriangle) {
  constexpr Index n = 17, first = 13;
  const int column[] = {0, first, n}, row_start[] = {0, 15, 19}, value_start[] = {0, 15 * first};
  std::vector<int> row;
  for (int i = 0; i < first; ++i) row.push_back(i);
  row.insert(row.end(), {14, 16, 13, 14, 15, 16});
  std::vector<double> value(15 * first + 4 * 4, NAN);
  MatrixXd L = MatrixXd::Zero(n, n);
  std::srand(11);
  for (int s = 0; s < 2; ++s) {
    const Index rows = row_start[s + 1] - row_start[s];
    for (Index j = 0; j < column[s + 1] - column[s]; ++j) {
      for (Index i = j; i < rows; ++i) {
        const double entry = i == j ? 2.0 : 0.3 * MatrixXd::Random(1, 1)(0);
        value[static_cast<size_t>(value_start[s] + j * rows + i)] = entry;
        L(row[static_cast<size_t>(row_start[s] + i)], column[s] + j) = entry;
      }
    }
  }
  const Supernodes blocks{2, column, row_start, value_start, row.data(), value.data()};
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const std::pair<Index, void (*)(const Supernodes&, double*)> solvers[] = {
      {8, solve_by_rows_of_8}, {12, solve_by_rows_of_12}, {16, solve_by_rows_of_16}};
  for (const auto& [width, solve_by_rows] : solvers) {
    const Rows B = Rows::Random(n, width);
    std::vector<Eight> memory(static_cast<size_t>(n * width + 7) / 8);
    Eigen::Map<Rows> x(reinterpret_cast<double*>(memory.data()), n, width);
    x = B;
    solve_by_rows(blocks, x.data());
    const MatrixXd expected = (L * L.transpose()).llt().solve(MatrixXd(B));
    EXPECT_LT(difference(x, expected), 1e-13) << width << " columns";  // condition below 100
  }
}

}  // namespace
}  // namespace flexboom::testing
