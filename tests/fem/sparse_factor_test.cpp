#include "fem/linear_algebra/sparse_factor.hpp"

#include "fem/assembly/constraints.hpp"
#include "fem/base/check.hpp"

#include "fem_testing.hpp"

namespace flexboom::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

SparseMatrix clamped_stiffness(SparseMatrix* mass = nullptr) {
  const Mesh mesh = make_mesh(uniform_boom(RoundBar{0.01}, 0.3, BeamTheory::timoshenko, 6, 4));
  const Assembly a = assemble(mesh);
  const Unknowns u = unknowns(mesh, a.dofs, node_set(mesh, "root"));
  if (mass) *mass = u.reduced(a.M);
  return u.reduced(a.K);
}

constexpr std::array kinds = {FactorKind::indefinite, FactorKind::definite};

TEST(SparseFactor, SolvesBlocksLikeTheDenseOracle) {
  const SparseMatrix K = clamped_stiffness();
  for (const FactorKind kind : kinds) {
    SparseFactor factor(K, kind);
    factor.factorise(K);
    for (const int columns : {1, 2, 13}) {
      std::srand(3);
      const MatrixXd exact = MatrixXd::Random(K.rows(), columns), b = symmetric_product(K, exact);
      MatrixXd x(K.rows(), columns);
      factor.solve(b, x);
      const VectorXd scale = K.diagonal().cwiseSqrt();
      EXPECT_LT((scale.asDiagonal() * (x - exact)).norm(),
                1e-11 * (scale.asDiagonal() * exact).norm());  // condition 1e4
    }
    EXPECT_EQ(factor.negative_pivots(), 0);
    EXPECT_GE(factor.nonzeros(), K.nonZeros());
    EXPECT_GE(factor.summary().bytes, 8.0 * static_cast<double>(factor.nonzeros()));
  }
}

TEST(SparseFactor, ADefiniteFactorRefusesWhatIsNot) {
  SparseMatrix M;
  const SparseMatrix K = clamped_stiffness(&M);
  SparseFactor factor(shifted(K, 1, M), FactorKind::definite);
  const SparseMatrix above = shifted(K, 1e9, M);
  EXPECT_THROW(factor.factorise(above), NumericalError);
  const SparseMatrix below = shifted(K, -1e3, M);
  factor.factorise(below);  // and it recovers
  VectorXd x(K.rows());
  const VectorXd ones = VectorXd::Ones(K.rows());
  factor.solve(symmetric_product(below, ones), x);
  const VectorXd scale = K.diagonal().cwiseSqrt();
  EXPECT_LT((scale.asDiagonal() * (x - ones)).norm(), 1e-11 * scale.norm());
}

// Two dense parts that a third couples: the factor has wide blocks, which are kept as panels with less of the square
// above their triangles.
TEST(SparseFactor, WideBlocksAreKeptAsPanels) {
  constexpr Index part = 400, n = 3 * part;
  std::srand(5);
  MatrixXd dense = MatrixXd::Random(n, n);
  dense = (dense + dense.transpose()).eval() / 2;
  dense.block(part, 0, part, part).setZero();
  dense.block(0, part, part, part).setZero();
  dense.diagonal().array() += 2 * std::sqrt(static_cast<double>(n));
  const SparseMatrix A = MatrixXd(dense.triangularView<Eigen::Lower>()).sparseView();
  SparseFactor factor(A, FactorKind::definite);
  const MatrixXd exact = MatrixXd::Random(n, 13), b = dense * exact;
  for (int round = 0; round < 2; ++round) {  // the second reuses all
    factor.factorise(A);
    for (const int columns : {1, 2, 13}) {
      MatrixXd x(n, columns);
      factor.solve(b.leftCols(columns), x);
      EXPECT_LT((x - exact.leftCols(columns)).norm(), 1e-13 * exact.leftCols(columns).norm());  // condition 3
    }
  }
  const auto entries = static_cast<double>(factor.nonzeros());
  EXPECT_EQ(entries, 2 * part * (part + 1) / 2 + part * (part + 1) / 2 + 2 * part * part);
  EXPECT_LT(factor.summary().bytes, 8 * 1.22 * entries);  // 1.43 with a square for each block
}

// Sylvester: negative pivots of K - s M are the eigenvalues below s. The same analysis serves every shift.
TEST(SparseFactor, CountsEigenvaluesBelowAShift) {
  SparseMatrix M;
  const SparseMatrix K = clamped_stiffness(&M);
  SparseFactor factor(shifted(K, 1, M));
  const VectorXd lambda =
      Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(full(K), full(M), Eigen::EigenvaluesOnly).eigenvalues();
  for (Index below : {0, 2, 6, 20}) {
    const double shift = below == 0 ? lambda(0) / 2 : (lambda(below - 1) + lambda(below)) / 2;
    const SparseMatrix A = shifted(K, shift, M);
    factor.factorise(A);
    EXPECT_EQ(factor.negative_pivots(), below);
    VectorXd x(A.rows());
    const VectorXd b = VectorXd::Ones(A.rows());
    factor.solve(b, x);
    EXPECT_LT((symmetric_product(A, x) - b).norm(), 1e-8 * b.norm());  // near an eigenvalue, without pivoting
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

TEST(SparseFactor, NotANumberIsANumericalErrorOfEveryKind) {
  SparseMatrix K = clamped_stiffness();
  for (const FactorKind kind : kinds) {
    SparseFactor factor(K, kind);
    SparseMatrix broken = K;
    broken.coeffRef(K.rows() / 2, K.rows() / 2) = NAN;
    EXPECT_THROW(factor.factorise(broken), NumericalError);
  }
}

// Blocks within larger ones, with gaps between their columns, and in place: the same digits as for a block alone.
TEST(SparseFactor, SolvesBlocksWhereverTheyLie) {
  const SparseMatrix K = clamped_stiffness();
  const Index n = K.rows();
  for (const FactorKind kind : kinds) {
    SparseFactor factor(K, kind);
    factor.factorise(K);
    std::srand(5);
    const MatrixXd b = MatrixXd::Random(n, 5);
    MatrixXd alone(n, 5), large = MatrixXd::Constant(n + 3, 7, 1e3), in_place = b;
    factor.solve(b, alone);
    large.block(2, 1, n, 5) = b;
    factor.solve(large.block(2, 1, n, 5), large.block(2, 1, n, 5));
    EXPECT_EQ(large.block(2, 1, n, 5), alone);
    large.block(2, 1, n, 5).setConstant(1e3);
    EXPECT_EQ(large, MatrixXd::Constant(n + 3, 7, 1e3)) << "written outside the block";
    factor.solve(in_place, in_place);
    EXPECT_EQ(in_place, alone);
    MatrixXd none(n, 0);
    factor.solve(none, none);
  }
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
  second.solve(symmetric_product(K, VectorXd::Ones(K.rows())), x);
  const VectorXd scale = K.diagonal().cwiseSqrt();
  EXPECT_LT((scale.asDiagonal() * (x - VectorXd::Ones(K.rows()))).norm(), 1e-11 * scale.norm());
}

}  // namespace
}  // namespace flexboom::testing
