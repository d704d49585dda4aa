#include "tests/reduction/eigen_testing.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace flexboom::test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// The rows that work for large problems.
class LargeBackend : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Table, LargeBackend, testing::Values("arpack", "block"),
                         [](const auto& row) { return row.param; });

double free_string_frequency(int n, int j) { return 4 * std::pow(std::sin(j * pi / (2 * n)), 2); }

TEST_P(LargeBackend, HundredsOfModes) {
  const int n = 47;
  const System s = membrane(n);  // 2209 unknowns
  const std::vector<double> exact = membrane_frequencies(n);
  const EigenPairs pairs = solve_modes(s.problem(), options(120, GetParam()));
  for (int i = 0; i < 120; ++i) EXPECT_NEAR(pairs.lambda(i) / exact[static_cast<size_t>(i)], 1, 1e-11) << i;
  EXPECT_GE(pairs.summary.sturm_count, 120);
  EXPECT_TRUE(pairs.summary.note.empty()) << pairs.summary.note;
}

TEST_P(LargeBackend, ClusterOfAHundredEqualStringsOnOneBase) {
  const int n = 4;
  const System s = strings_on_one_base(n, 100);
  const EigenPairs pairs = solve_modes(s.problem(), options(110, GetParam()));
  // One mode of all strings with the base, 99 of strings against each other, then the next of each.
  EXPECT_LT(pairs.lambda(0), string_frequency(n, 1) * (1 - 1e-3));
  for (int i = 1; i < 100; ++i) EXPECT_NEAR(pairs.lambda(i) / string_frequency(n, 1), 1, 1e-11) << i;
  EXPECT_GT(pairs.lambda(100), string_frequency(n, 1) * (1 + 1e-3));
  EXPECT_EQ(pairs.summary.pairs.front().size(), 99U);
  EXPECT_TRUE(pairs.summary.sturm_checked);
}

TEST_P(LargeBackend, AGroupMuchLargerThanWhatIsAsked) {
  const System s = strings(60, 40);  // 2400 unknowns: supernodal; every frequency 40 times
  EigenPairs pairs;
  try {
    pairs = solve_modes(s.problem(), options(10, GetParam()));
  } catch (const NumericalError& error) {
    // A single Lanczos vector sees copies by round-off alone; where it misses some, the Sturm count must have said so.
    EXPECT_NE(std::string(GetParam()), "block") << error.what();
    EXPECT_NE(std::string(error.what()).find("Sturm count"), std::string::npos) << error.what();
    return;
  }
  for (int i = 0; i < 10; ++i) EXPECT_NEAR(pairs.lambda(i) / string_frequency(60, 1), 1, 1e-11) << i;
  EXPECT_EQ(pairs.summary.sturm_count, 40);
}

TEST_P(LargeBackend, StiffnessContrastOfAMillion) {
  const std::array<int, 3> size = {3, 3, 20};
  const System s = lattice(size, root_of(size), 1, 1e-6);
  const EigenPairs pairs = solve_modes(s.problem(), options(12, GetParam()));
  const EigenPairs dense = solve_modes(s.problem(), options(12, "dense"));
  // eps |K| / lambda = 2e-16 * 10 / 1e-9: no solver can agree to more.
  for (int i = 0; i < 12; ++i) EXPECT_NEAR(pairs.lambda(i) / dense.lambda(i), 1, 1e-5) << i;
  EXPECT_EQ(pairs.summary.rigid_modes, 0);
}

/// Bar elements graded to the clamp down to 1e-11 of the length: the highest eigenvalue is 1e22 of the lowest, which
/// loses no digit by that.
TEST_P(LargeBackend, GradingToTheClampIsNoSingularity) {
  std::vector<double> x = {0};
  for (int level = 15; level > 0; --level) x.push_back(std::pow(0.2, level));
  constexpr int n = 2100;  // equal elements after that
  for (int k = 0; k < n; ++k) x.push_back(0.2 + 0.8 * (k + 1) / n);
  std::vector<Eigen::Triplet<double>> K, M;
  const auto add = [](auto& entries, int i, int j, double value) {
    if (i > 0 && j > 0) entries.emplace_back(i - 1, j - 1, value);  // node 0 is held
  };
  const auto nodes = static_cast<int>(x.size());
  for (int e = 1; e < nodes; ++e) {
    const double h = x[static_cast<size_t>(e)] - x[static_cast<size_t>(e) - 1];
    add(K, e, e, 1 / h), add(K, e - 1, e - 1, 1 / h), add(K, e, e - 1, -1 / h);
    add(M, e, e, h / 3), add(M, e - 1, e - 1, h / 3), add(M, e, e - 1, h / 6);
  }
  System s{SparseMatrix(nodes - 1, nodes - 1), SparseMatrix(nodes - 1, nodes - 1)};
  s.K.setFromTriplets(K.begin(), K.end());
  s.M.setFromTriplets(M.begin(), M.end());
  const EigenPairs pairs = solve_modes(s.problem(), options(3, GetParam()));
  EXPECT_EQ(pairs.summary.note, "");
  EXPECT_EQ(pairs.summary.sigma, 0);
  // Linear elements: the square of omega h / sqrt(12), with the element of length 0.16 for the most.
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(std::sqrt(pairs.lambda(k)) / ((k + 0.5) * pi), 1, 3e-3 * (k + 1) * (k + 1)) << k;
}

TEST_P(LargeBackend, PartWithoutDensityAndConsistentMass) {
  // Bar elements, M = h/6 [2 1; 1 2]; the middle third has no density: infinite eigenvalues.
  const int n = 300;
  System s = strings(n);
  std::vector<Eigen::Triplet<double>> M;
  for (int e = 0; e <= n; ++e) {
    if (e > n / 3 && e < 2 * n / 3) continue;
    if (e > 0) M.emplace_back(e - 1, e - 1, 2.0 / 6);
    if (e < n) M.emplace_back(e, e, 2.0 / 6);
    if (e > 0 && e < n) M.emplace_back(e, e - 1, 1.0 / 6);
  }
  s.M.setZero();
  s.M.setFromTriplets(M.begin(), M.end());
  const EigenPairs pairs = solve_modes(s.problem(), options(15, GetParam()));
  const EigenPairs dense = solve_modes(s.problem(), options(15, "dense"));
  for (int i = 0; i < 15; ++i) EXPECT_NEAR(pairs.lambda(i) / dense.lambda(i), 1, 1e-10) << i;
  // Within the part without mass the bar is straight: K phi is zero there.
  const Eigen::VectorXd force = symmetric_product(s.K, pairs.Phi.col(14));
  EXPECT_LT(force.segment(n / 3 + 2, n / 3 - 4).cwiseAbs().maxCoeff(), 1e-11 * pairs.Phi.cwiseAbs().maxCoeff());
}

TEST_P(LargeBackend, AllFiniteFrequenciesOfABodyWithFewMasses) {
  System s = strings(2500);
  for (int i = 0; i < 2500; ++i) s.M.coeffRef(i, i) = i % 250 == 100 ? 1 : 0;  // ten masses
  const EigenPairs pairs = solve_modes(s.problem(), options(10, GetParam()));
  EXPECT_EQ(pairs.summary.sturm_count, 10);
  EXPECT_EQ(message([&] { solve_modes(s.problem(), options(11, GetParam())); }),
            "modes: 11 asked, but only 10 of 2500 freedoms carry mass: there are no more finite frequencies");
}

// Mass matrix of rank 5 without a zero on its diagonal: nothing tells before the solve.
TEST(BlockBackend, MoreModesThanTheMassMatrixHasRankIsAnInputError) {
  for (const int n : {60, 2400}) {
    System s = strings(n);
    std::vector<Eigen::Triplet<double>> M;
    for (int i = 0; i < n; ++i) {
      for (int j = i; j < std::min(n, (i / (n / 5) + 1) * (n / 5)); ++j) M.emplace_back(j, i, 1.0 / n);
    }
    s.M.setFromTriplets(M.begin(), M.end());
    EXPECT_NE(message([&] { solve_modes(s.problem(), options(6, "block")); }).find("only 5 "), std::string::npos);
    const EigenPairs pairs = solve_modes(s.problem(), options(4, "block"));
    EXPECT_EQ(pairs.summary.sturm_count, 4);
    EXPECT_EQ(solve_modes(s.problem(), options(5, "block")).summary.sturm_count, 5);
  }
}

/// Freedoms of node 0 and others that leave a lattice 5, 4, ..., 1 rigid motions.
std::vector<int> support(std::array<int, 3> size, int rigid) {
  const int along_x = 3 * (size[0] - 1), along_z = 3 * size[0] * size[1] * (size[2] - 1);
  std::vector<int> held = {0, 1, 2, along_x + 1, along_x + 2};
  held.push_back(along_z + 1);
  held.resize(static_cast<size_t>(6 - rigid));
  return held;
}

TEST_P(LargeBackend, PartlySupportedBodiesAreFound) {
  for (const std::array<int, 3> size : {std::array{3, 4, 9}, std::array{6, 6, 21}}) {  // 324 and 2268 unknowns
    for (const int rigid : {3, 1, 5}) {
      if (rigid != 3 && size[2] > 9) continue;
      const System s = lattice(size, support(size, rigid));
      const EigenPairs pairs = solve_modes(s.problem(), options(10, GetParam()));
      EXPECT_EQ(pairs.summary.rigid_modes, rigid);
      EXPECT_NE(pairs.summary.note, "");
      EXPECT_LT(pairs.summary.sigma, 0);
      EXPECT_LT(pairs.lambda.head(rigid).cwiseAbs().maxCoeff(), 1e-8 * pairs.lambda(rigid));
      EXPECT_TRUE(pairs.summary.sturm_checked);
    }
    const System held = lattice(size, support(size, 0));
    EXPECT_EQ(solve_modes(held.problem(), options(10, GetParam())).summary.rigid_modes, 0);
    EXPECT_EQ(solve_modes(held.problem(), options(10, GetParam())).summary.note, "");
  }
}

TEST_P(LargeBackend, DisconnectedPartsHaveSixRigidModesEach) {
  for (const std::array<int, 3> size : {std::array{3, 3, 5}, std::array{4, 4, 16}}) {
    const System s = lattice(size, {}, 3);
    for (const bool announced : {true, false}) {
      const EigenPairs pairs = solve_modes(s.problem(announced), options(24, GetParam()));
      EXPECT_EQ(pairs.summary.rigid_modes, 18);
      for (int i = 18; i < 24; ++i) EXPECT_NEAR(pairs.lambda(i) / pairs.lambda(18 + (i - 18) / 3 * 3), 1, 1e-9);
      EXPECT_EQ(solve_modes(s.problem(announced), options(4, GetParam())).summary.rigid_modes, 4);
    }
  }
}

TEST_P(LargeBackend, LongFreeChainHasOneRigidMode) {
  const int n = 3000;
  const System s = strings(n, 1, true);
  for (const bool announced : {true, false}) {
    const EigenPairs pairs = solve_modes(s.problem(announced), options(8, GetParam()));
    EXPECT_EQ(pairs.summary.rigid_modes, 1);
    // lambda_1 = 1e-6 of K: eps |K| / lambda_1 = 1e-9 times what a chain of springs loses.
    for (int j = 1; j < 8; ++j) EXPECT_NEAR(pairs.lambda(j) / free_string_frequency(n, j), 1, 1e-8) << j;
  }
}

TEST_P(LargeBackend, ShiftOnAnEigenvalueOfALargeProblemIsMoved) {
  const System s = strings(2500);
  EigenOptions o = options(5, GetParam());
  o.sigma = string_frequency(2500, 1);
  const EigenPairs pairs = solve_modes(s.problem(), o);
  EXPECT_LT(pairs.summary.sigma, string_frequency(2500, 1));
  for (int j = 0; j < 5; ++j) EXPECT_NEAR(pairs.lambda(j) / string_frequency(2500, j + 1), 1, 1e-7) << j;
}

TEST(EigenHard, EntriesThatAreNotNumbersAreNamed) {
  System s = strings(10);
  s.K.coeffRef(4, 3) = nan;
  EXPECT_EQ(message([&] { solve_modes(s.problem(), options(2, "block")); }), "eigenproblem: entry (4, 3) of K is nan");
  s = strings(10);
  s.M.coeffRef(7, 7) = INFINITY;
  EXPECT_EQ(message([&] { solve_modes(s.problem(), options(2, "block")); }), "eigenproblem: entry (7, 7) of M is inf");
  s.M.coeffRef(7, 7) = -1;
  EXPECT_EQ(message([&] { solve_modes(s.problem(), options(2, "block")); }),
            "eigenproblem: entry (7, 7) of M is -1; a mass is not negative");
}

TEST(EigenHard, WhatStandsAboveTheDiagonalIsNotRead) {
  for (const std::string& name : backend_names()) {
    System s = strings(40);
    const EigenPairs clean = solve_modes(s.problem(), options(4, name));
    for (int i = 0; i + 1 < 40; ++i) s.K.coeffRef(i, i + 1) = nan;
    EXPECT_EQ(solve_modes(s.problem(), options(4, name)).lambda, clean.lambda) << name;
  }
}

}  // namespace
}  // namespace flexboom::test
