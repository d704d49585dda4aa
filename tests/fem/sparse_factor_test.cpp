#include "fem/sparse_factor.hpp"
#include "fem/check.hpp"

#include "fem_testing.hpp"

namespace flexboom::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

SparseMatrix clamped_stiffness(SparseMatrix* mass = nullptr) {
  const Mesh mesh = make_mesh(uniform_boom(RoundBar{0.01}, 0.3, BeamTheory::timoshenko, 6, 4));
  const Assembly a = assemble(mesh);
  const std::vector<int> free = free_dofs(a.dofs, node_set(mesh, "root"));
  if (mass) *mass = submatrix(a.M, free);
  return submatrix(a.K, free);
}

TEST(SparseFactor, SolvesLikeTheDenseOracle) {
  const SparseMatrix K = clamped_stiffness();
  SparseFactor factor(K);
  factor.factorise(K);
  std::srand(3);
  const VectorXd exact = VectorXd::Random(K.rows()), b = K * exact;
  VectorXd x(K.rows());
  factor.solve(b, x);
  const VectorXd scale = K.diagonal().cwiseSqrt();
  EXPECT_LT((scale.asDiagonal() * (x - exact)).norm(), 1e-11 * (scale.asDiagonal() * exact).norm());  // condition 1e4
  EXPECT_EQ(factor.negative_pivots(), 0);
  EXPECT_GE(factor.nonzeros(), (K.nonZeros() + K.rows()) / 2);
}

// Sylvester: negative pivots of K - s M are the eigenvalues below s. The same analysis serves every shift.
TEST(SparseFactor, CountsEigenvaluesBelowAShift) {
  SparseMatrix M;
  const SparseMatrix K = clamped_stiffness(&M);
  const SparseMatrix pattern = K + M;
  SparseFactor factor(pattern);
  const VectorXd lambda =
      Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(MatrixXd(K), MatrixXd(M), Eigen::EigenvaluesOnly)
          .eigenvalues();
  for (Index below : {0, 2, 6, 20}) {
    const double shift = below == 0 ? lambda(0) / 2 : (lambda(below - 1) + lambda(below)) / 2;
    const SparseMatrix A = K - shift * M;
    factor.factorise(A);
    EXPECT_EQ(factor.negative_pivots(), below);
    VectorXd x(A.rows());
    const VectorXd b = VectorXd::Ones(A.rows());
    factor.solve(b, x);
    EXPECT_LT((A * x - b).norm(), 1e-8 * b.norm());  // near an eigenvalue, without pivoting
  }
}

TEST(SparseFactor, SingularMatrixIsANumericalError) {
  SparseMatrix A(3, 3);
  A.insert(0, 0) = 1;
  A.insert(1, 1) = 1;
  A.insert(2, 2) = 1;
  A.insert(1, 0) = A.insert(0, 1) = 1;
  A.makeCompressed();
  SparseFactor factor(A);
  EXPECT_THROW(factor.factorise(A), NumericalError);
  EXPECT_EQ(input_error([&] { factor.negative_pivots(); }), "negative pivots: nothing is factorised");
  A.coeffRef(1, 1) = NAN;
  EXPECT_THROW(factor.factorise(A), NumericalError);
  A.coeffRef(1, 1) = 5;
  factor.factorise(A);  // and it recovers
  VectorXd x(3);
  factor.solve(VectorXd::Ones(3), x);
  EXPECT_LT((A * x - VectorXd::Ones(3)).norm(), 4 * eps);
}

TEST(SparseFactor, BadInputSaysWhatIsWrong) {
  EXPECT_EQ(input_error([] { SparseFactor factor(SparseMatrix(2, 3)); }),
            "sparse factorisation: the matrix is 2 x 3; it must be square");
  const SparseMatrix K = clamped_stiffness();
  SparseFactor factor(K);
  VectorXd x(K.rows());
  EXPECT_EQ(input_error([&] { factor.solve(x, x); }), "sparse solve: nothing is factorised");
  SparseMatrix other(K.rows(), K.cols());
  other.setIdentity();
  EXPECT_EQ(input_error([&] { factor.factorise(other); }),
            "sparse factorisation: the matrix has another pattern than the one analysed");
  factor.factorise(K);
  VectorXd shorter(1);
  EXPECT_THROW(factor.solve(x, shorter), InputError);
}

TEST(SparseFactor, Moves) {
  const SparseMatrix K = clamped_stiffness();
  SparseFactor first(K);
  first.factorise(K);
  SparseFactor second = std::move(first);
  VectorXd x(K.rows());
  second.solve(K * VectorXd::Ones(K.rows()), x);
  const VectorXd scale = K.diagonal().cwiseSqrt();
  EXPECT_LT((scale.asDiagonal() * (x - VectorXd::Ones(K.rows()))).norm(), 1e-11 * scale.norm());
}

}  // namespace
}  // namespace flexboom::testing
