#include "fem/linear_algebra/inertia.hpp"

#include "fem/base/blas_threads.hpp"
#include "fem/base/check.hpp"

#include "box_matrix.hpp"

namespace flexboom::testing {
namespace {

using Eigen::MatrixXd;

TEST(Inertia, EveryMethodCountsWhatTheDenseSolverFinds) {
  for (const double shift : {1.0, -0.3, -1.7, -4.1}) {
    const SparseMatrix A = box(3, 3, 4, shift);
    const Eigen::VectorXd lambda = Eigen::SelfAdjointEigenSolver<MatrixXd>(full(A)).eigenvalues();
    const auto below = static_cast<int>((lambda.array() < 0).count());
    for (const InertiaMethod& method : inertia_methods()) EXPECT_EQ(method.count(A).negative, below) << method.name;
    EXPECT_EQ(inertia(A, 1e3).negative, below);
    EXPECT_EQ(inertia(A, 1e12).negative, below);
  }
}

TEST(Inertia, TheQuickestMethodIsTaken) {
  const SparseMatrix A = box(2, 2, 2, 1);
  EXPECT_EQ(inertia(A, 1e3).method, "CHOLMOD");
  if (inertia_methods().size() > 1) {
    EXPECT_EQ(inertia(A, 1e12).method, "MUMPS");
  }
  EXPECT_LT(inertia_seconds(1e6), inertia_seconds(1e12));
}

// [[0, 1], [1, 0]] has the eigenvalues -1 and 1 and no pivot on its diagonal: without pivots of order 2 there is no
// count, and the next method is asked.
TEST(Inertia, PivotsOfOrderTwoAreCounted) {
  SparseMatrix A(6, 6);
  for (int i = 0; i < 6; ++i) A.insert(i, i) = 0;
  for (int i = 0; i < 6; i += 2) A.insert(i + 1, i) = 1;
  A.makeCompressed();
  EXPECT_EQ(inertia_methods().front().name, "cholmod");
  EXPECT_THROW(inertia_methods().front().count(A), NumericalError);
  if (inertia_methods().size() == 1) {
    EXPECT_THROW(inertia(A, 1e3), NumericalError);
    GTEST_SKIP() << "no method with pivoting is there";
  }
  const Inertia count = inertia(A, 1e3);
  EXPECT_EQ(count.method, "MUMPS");
  EXPECT_EQ(count.negative, 3);
}

// In the first place MUMPS alone would count on.
TEST(Inertia, NotANumberIsNotCounted) {
  for (const int place : {0, 50}) {
    SparseMatrix A = box(3, 3, 4, 1);
    A.coeffRef(place, place) = NAN;
    for (const InertiaMethod& method : inertia_methods()) EXPECT_THROW(method.count(A), NumericalError) << method.name;
    EXPECT_THROW(inertia(A, 1e3), NumericalError);
  }
}

TEST(Inertia, ReadsTheLowerTriangleOnly) {
  const SparseMatrix A = box(3, 3, 4, -0.3);
  SparseMatrix with_rubbish = A + 1e3 * SparseMatrix(A.transpose().triangularView<Eigen::StrictlyUpper>());
  for (const InertiaMethod& method : inertia_methods())
    EXPECT_EQ(method.count(with_rubbish).negative, method.count(A).negative) << method.name;
}

TEST(LinearAlgebra, VersionsNameEveryLibrary) {
  const auto versions = linear_algebra_versions();
  ASSERT_EQ(versions.size(), inertia_methods().size() + 1);
  EXPECT_EQ(versions.front().first, "cholmod");
  EXPECT_EQ(versions.back().first, "blas");
  for (const auto& [name, version] : versions) EXPECT_FALSE(version.empty()) << name;
}

TEST(BlasThreads, AreBetweenOneAndWhatIsWanted) {
  EXPECT_EQ(set_blas_threads(0), 1);
  EXPECT_GE(set_blas_threads(64), 1);
  EXPECT_LE(set_blas_threads(2), 2);
  EXPECT_EQ(set_blas_threads(1), 1);
  EXPECT_GE(idle_cores(), 1);
}

}  // namespace
}  // namespace flexboom::testing
