#include "fem/linear_algebra/sparse.hpp"

#include "fem_testing.hpp"

namespace flexboom::testing {
namespace {

using Eigen::MatrixXd;

/// Lower triangle of a seeded sparse symmetric matrix, with rubbish above the diagonal that must not be read.
SparseMatrix seeded(int n, double density, unsigned seed) {
  std::srand(seed);
  std::vector<Eigen::Triplet<double>> triplets;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const double value = static_cast<double>(std::rand()) / RAND_MAX;
      if (i == j || value < density) triplets.emplace_back(i, j, i < j ? 1e9 : value + 0.5);
    }
  }
  SparseMatrix A(n, n);
  A.setFromTriplets(triplets.begin(), triplets.end());
  return A;
}

TEST(SymmetricProduct, ReadsTheLowerTriangleForAnyNumberOfColumns) {
  const SparseMatrix A = seeded(40, 0.1, 5);
  for (const int columns : {1, 3, 4, 8, 13, 25}) {
    const MatrixXd X = MatrixXd::Random(40, columns);
    const MatrixXd expected = full(A) * X;
    EXPECT_LT((symmetric_product(A, X) - expected).cwiseAbs().maxCoeff(), 64 * eps * expected.cwiseAbs().maxCoeff());
    EXPECT_LT((quadratic_form(A, X) - X.transpose() * expected).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(SymmetricProduct, RefusesSizesThatDoNotFit) {
  EXPECT_EQ(input_error([] { symmetric_product(seeded(4, 0.5, 1), MatrixXd::Zero(5, 2)); }),
            "product: a 4 x 4 matrix with a 5 x 2 block");
}

TEST(Shifted, HasOnePatternForEveryShift) {
  const SparseMatrix K = seeded(30, 0.2, 7), M = seeded(30, 0.1, 8);
  for (const double sigma : {0.0, -2.5, 3.0}) {
    const SparseMatrix A = shifted(K, sigma, M);
    EXPECT_LT((full(A) - (full(K) - sigma * full(M))).cwiseAbs().maxCoeff(), 1e-15);
    EXPECT_EQ(A.nonZeros(), shifted(K, 1, M).nonZeros());
    EXPECT_TRUE(MatrixXd(A).isLowerTriangular(0));
  }
}

}  // namespace
}  // namespace flexboom::testing
