#include "reduction/eigen/orthogonal_basis.hpp"
#include "reduction/eigen/shift.hpp"

#include "tests/reduction/eigen_testing.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>

namespace flexboom::test {
namespace {

using Eigen::MatrixXd;

double orthogonality(const MassBasis& basis, const SparseMatrix& M) {
  const MatrixXd gram = quadratic_form(M, basis.vectors());
  return (gram - MatrixXd::Identity(gram.rows(), gram.cols())).cwiseAbs().maxCoeff();
}

SparseMatrix masses(int n) {
  SparseMatrix M(n, n);
  for (int i = 0; i < n; ++i) M.insert(i, i) = 1 + i % 7;
  for (int i = 0; i + 1 < n; ++i) M.insert(i + 1, i) = 0.3;
  M.makeCompressed();
  return M;
}

TEST(MassBasis, CoefficientsGiveTheBlockBack) {
  const SparseMatrix M = masses(100);
  MassBasis basis(M, 20);
  basis.append(random_block(100, 6, 1), 1e-13);
  const MatrixXd W = random_block(100, 5, 2) + basis.vectors().leftCols<5>();
  const MatrixXd coefficients = basis.append(W, 1e-13);
  ASSERT_EQ(basis.size(), 11);
  EXPECT_LT((basis.vectors() * coefficients - W).norm(), 1e-14 * W.norm() * 10);  // a few eps, 100 x 11
  EXPECT_LT(orthogonality(basis, M), 1e-14);
}

TEST(MassBasis, DependentColumnsGiveNoDirectionAndNearlyDependentOnesDo) {
  const SparseMatrix M = masses(100);
  for (const double apart : {0.0, 1e-9, 1e-5}) {
    MassBasis basis(M, 20);
    basis.append(random_block(100, 4, 1), 1e-13);
    MatrixXd W = random_block(100, 3, 2);
    W.col(2) = W.col(0) + W.col(1) + apart * random_block(100, 1, 3);  // dependent but for that
    const MatrixXd coefficients = basis.append(W, 1e-13);
    EXPECT_EQ(basis.size(), apart > 0 ? 7 : 6) << apart;
    EXPECT_LT((basis.vectors() * coefficients - W).norm(), 1e-12);
    EXPECT_LT(orthogonality(basis, M), 1e-13) << apart;
  }
}

// One Gram matrix leaves eps / 1e-4 of such columns: they are polished by a second.
TEST(MassBasis, ColumnsAtSmallAnglesComeOutOrthogonal) {
  const SparseMatrix M = masses(400);
  MassBasis basis(M, 20);
  MatrixXd W = random_block(400, 8, 1);
  for (Eigen::Index i = 1; i < 8; ++i) W.col(i) = W.col(0) + 0.05 * W.col(i);
  basis.append(W, 1e-13);
  EXPECT_EQ(basis.size(), 8);
  EXPECT_LT(orthogonality(basis, M), 3e-15);  // 8 columns: a few eps
}

TEST(MassBasis, WhatIsInsideAddsNothing) {
  const SparseMatrix M = masses(50);
  MassBasis basis(M, 20);
  basis.append(random_block(50, 8, 1), 1e-13);
  const MatrixXd inside = basis.vectors() * random_block(8, 4, 5);
  basis.append(inside, 1e-13);
  EXPECT_EQ(basis.size(), 8);
  basis.append(MatrixXd::Zero(50, 3), 1e-13);
  EXPECT_EQ(basis.size(), 8);
}

TEST(MassBasis, RotationKeepsTheTail) {
  const SparseMatrix M = masses(700);  // more rows than a slice
  MassBasis basis(M, 12);
  basis.append(random_block(700, 6, 1), 1e-13);
  basis.append(random_block(700, 3, 2), 1e-13);
  const MatrixXd before = basis.vectors();
  const MatrixXd S = MatrixXd(random_block(6, 6, 4).householderQr().householderQ()).leftCols(2);
  basis.rotate(S);
  ASSERT_EQ(basis.size(), 5);
  EXPECT_LT((basis.vectors().leftCols<2>() - before.leftCols<6>() * S).norm(), 1e-14);
  EXPECT_EQ(basis.vectors().rightCols<3>(), before.rightCols<3>());
}

TEST(RandomBlock, IsCentredAndRepeats) {
  const MatrixXd a = random_block(1000, 3, 7);
  EXPECT_EQ(a, random_block(1000, 3, 7));
  EXPECT_NE(a, random_block(1000, 3, 8));
  EXPECT_LT(std::abs(a.mean()), 0.03);  // three standard deviations of the mean are 0.016
  EXPECT_LE(a.cwiseAbs().maxCoeff(), 0.5);
}

// Every problem of these tests by three ways that share no code.
TEST(BlockBackend, AgreesWithArpackAndDense) {
  const std::array<int, 3> size = {3, 3, 12};
  const std::vector<System> systems = {strings(300),           strings(40, 7),
                                       membrane(21),           strings_on_one_base(8, 20),
                                       lattice({4, 4, 4}, {}), lattice(size, root_of(size))};
  for (size_t i = 0; i < systems.size(); ++i) {
    const EigenProblem p = systems[i].problem(i == 4);
    const EigenPairs block = solve_modes(p, options(12, "block"));
    for (const std::string other : {"arpack", "dense"}) {
      const EigenPairs pairs = solve_modes(p, options(12, other));
      // Free bodies have zeros: relative to the first that is not.
      EXPECT_LT(
          (block.lambda - pairs.lambda).cwiseAbs().cwiseQuotient(pairs.lambda.cwiseAbs().cwiseMax(1e-2)).maxCoeff(),
          1e-9)
          << i << other;
      EXPECT_EQ(block.summary.pairs, pairs.summary.pairs) << i << other;
      EXPECT_EQ(block.summary.rigid_modes, pairs.summary.rigid_modes);
    }
  }
}

TEST(BlockBackend, RestartsInLittleRoomChangeNothing) {
  const System s = membrane(50);  // 2500 unknowns; 60 modes in a space of 127
  const std::vector<double> exact = membrane_frequencies(50);
  EigenOptions o = options(60, "block");
  o.tolerance = 1e-13;  // takes several restarts
  const EigenPairs pairs = solve_modes(s.problem(), o);
  for (int i = 0; i < 60; ++i) EXPECT_NEAR(pairs.lambda(i) / exact[static_cast<size_t>(i)], 1, 1e-12) << i;
  EXPECT_LT(pairs.summary.residual_max, 1e-12);
}

TEST(BlockBackend, ToleranceIsTheResidualReached) {
  const System s = membrane(50);
  EigenOptions o = options(20, "block");
  int solves = 1 << 20;
  for (const double tolerance : {1e-12, 1e-8, 1e-4}) {
    o.tolerance = tolerance;
    const EigenPairs pairs = solve_modes(s.problem(), o);
    EXPECT_LT(pairs.summary.residual_max, tolerance / 5);  // one more application of the inverse than was tested
    EXPECT_LT(pairs.summary.solves, solves);
    solves = pairs.summary.solves;
  }
}

TEST(Auto, TakesBlocksForLargeProblemsAndSaysSo) {
  const System small = membrane(20), large = membrane(50);
  EXPECT_EQ(solve_modes(small.problem(), options(5, "auto")).summary.backend, "arpack");
  EXPECT_EQ(solve_modes(large.problem(), options(5, "auto")).summary.backend, "block");
  EXPECT_NE(message([&] { solve_modes(small.problem(), options(5, "automatic")); }).find("\"auto\""),
            std::string::npos);
}

TEST(SturmPolicy, SaysWhatIsProven) {
  const System s = membrane(20);
  EigenOptions o = options(5, "block");
  for (const SturmPolicy policy : {SturmPolicy::always, SturmPolicy::when_cheap, SturmPolicy::never}) {
    o.sturm = policy;
    const EigenSummary summary = solve_modes(s.problem(), o).summary;
    const bool counted = policy != SturmPolicy::never;
    EXPECT_EQ(summary.sturm_checked, counted);
    EXPECT_EQ(summary.sturm_count, counted ? 6 : -1);  // modes 5 and 6 are a pair
    EXPECT_EQ(summary.sturm_method.empty(), !counted);
    EXPECT_EQ(summary.proof.find(counted ? "no mode below" : "completeness not proven: 400 unknowns"), 0U)
        << summary.proof;
  }
}

TEST(FreeShift, IsNearTheFirstElasticEigenvalue) {
  const System s = strings(120, 6, true);
  const EigenProblem p = s.problem(true);
  ShiftedFactor shifted(p);
  const double elastic = 4 * std::pow(std::sin(pi / 240), 2);
  EXPECT_NEAR(free_shift(p, shifted, 10) / elastic, -0.1, 0.01);
}

TEST(ZeroModes, AreThoseWhoseEnergyIsRoundOff) {
  const System s = strings(50, 3, true);
  EigenPairs pairs = solve_modes(s.problem(true), options(8, "dense"));
  EXPECT_EQ(zero_modes(s.problem(true), pairs), 3);
  const System held = strings(50);
  EXPECT_EQ(zero_modes(held.problem(), solve_modes(held.problem(), options(8, "dense"))), 0);
}

}  // namespace
}  // namespace flexboom::test
