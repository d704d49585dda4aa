#include "fem/linear_algebra/dense.hpp"

#include "fem/base/check.hpp"

#include <gtest/gtest.h>

namespace flexboom {
namespace {

using Eigen::MatrixXd;

TEST(Dense, InverseIsTheInverse) {
  for (const int n : {0, 1, 7, 100}) {
    const MatrixXd A = MatrixXd::Random(n, n) + 3 * MatrixXd::Identity(n, n);
    EXPECT_LT((inverse(A) * A - MatrixXd::Identity(n, n)).norm(), 1e-11) << n;  // condition numbers up to 1e3
  }
}

TEST(Dense, InverseOfASingularMatrixIsRefused) { EXPECT_THROW(inverse(MatrixXd{{1, 2}, {2, 4}}), NumericalError); }

TEST(Dense, EigenvectorsSolveTheirEquation) {
  const MatrixXd A = MatrixXd::Random(30, 30);
  const RealEigenvectors e = eigenvectors(A);
  for (int k = 0; k < 30; ++k) {
    const double re = e.real[k], im = e.imaginary[k];
    if (im < 0) continue;
    const Eigen::VectorXd x = e.vectors.col(k);
    if (im == 0) {
      EXPECT_LT((A * x - re * x).norm(), 1e-12);
      continue;
    }
    const Eigen::VectorXd y = e.vectors.col(k + 1);
    EXPECT_LT((A * x - re * x + im * y).norm() + (A * y - re * y - im * x).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace flexboom
