#include "reduction/eigen/solver.hpp"

#include "tests/reduction/eigen_testing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace flexboom::test {
namespace {

/// Every row of the table takes every one of these tests.
class EveryBackend : public testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(Table, EveryBackend, testing::ValuesIn(backend_names()),
                         [](const auto& row) { return row.param; });

TEST_P(EveryBackend, FindsTheFrequenciesOfAString) {
  const System s = strings(300);
  const EigenPairs pairs = solve_modes(s.problem(), options(12, GetParam()));
  ASSERT_EQ(pairs.lambda.size(), 12);
  // K - 0 M has condition number 4e4: round-off of the solves is a few 1e-12 of the lowest eigenvalue.
  for (int j = 0; j < 12; ++j) EXPECT_NEAR(pairs.lambda(j) / string_frequency(300, j + 1), 1, 1e-11) << j;
  EXPECT_EQ(pairs.summary.backend, GetParam());
  EXPECT_TRUE(pairs.summary.note.empty()) << pairs.summary.note;
  EXPECT_EQ(pairs.summary.sigma, 0);
  EXPECT_EQ(pairs.summary.sturm_count, 12);
  EXPECT_GT(pairs.summary.sturm_shift, pairs.lambda(11));
  EXPECT_LT(pairs.summary.residual_max, 1e-10);
  EXPECT_TRUE(pairs.summary.pairs.empty());
}

TEST_P(EveryBackend, VectorsAreOrthonormalAndSolveTheProblem) {
  const System s = membrane(17);
  const EigenPairs pairs = solve_modes(s.problem(), options(20, GetParam()));
  const Eigen::MatrixXd gram = pairs.Phi.transpose() * s.M * pairs.Phi;
  EXPECT_LT((gram - Eigen::MatrixXd::Identity(20, 20)).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_LT(pairs.summary.orthogonality_error, 1e-13);
  const Eigen::MatrixXd residual = s.K * pairs.Phi - s.M * pairs.Phi * pairs.lambda.asDiagonal();
  EXPECT_LT(residual.cwiseAbs().maxCoeff(), 1e-11);  // |K| = 8, M = I
}

TEST_P(EveryBackend, FindsBothOfEveryDoubleFrequency) {
  const int n = 21;
  const System s = membrane(n);
  const std::vector<double> exact = membrane_frequencies(n);
  const EigenPairs pairs = solve_modes(s.problem(), options(30, GetParam()));
  for (int i = 0; i < 30; ++i) EXPECT_NEAR(pairs.lambda(i) / exact[static_cast<size_t>(i)], 1, 1e-11) << i;
  EXPECT_EQ(pairs.summary.pairs.front(), (std::vector<int>{1, 2}));
}

// A search from random vectors has nothing to look into where all modes are found, or nearly all.
TEST_P(EveryBackend, SmallProblemsPassWithoutTheSturmCount) {
  for (int n = 1; n <= 24; ++n) {
    for (const bool free : {false, true}) {
      const System s = strings(n, 1, free && n > 1);
      for (int modes = 1; modes <= n; ++modes) {
        EigenOptions basic = options(modes, GetParam());
        basic.sturm = SturmPolicy::never;
        const EigenPairs pairs = solve_modes(s.problem(free && n > 1), basic);
        for (int j = 0; j < modes; ++j) {
          const double exact = free && n > 1 ? 4 * std::pow(std::sin(j * pi / (2 * n)), 2) : string_frequency(n, j + 1);
          EXPECT_NEAR(pairs.lambda(j), exact, 1e-10) << n << " " << modes << " " << j;
        }
      }
    }
  }
}

TEST_P(EveryBackend, CuttingAPairIsAllowedAndStillVerified) {
  const System s = membrane(15);
  const EigenPairs pairs = solve_modes(s.problem(), options(2, GetParam()));  // modes 2 and 3 are a pair
  EXPECT_EQ(pairs.lambda.size(), 2);
  EXPECT_EQ(pairs.summary.sturm_count, 3);
}

TEST_P(EveryBackend, FindsSevenfoldFrequencies) {
  const System s = strings(40, 7);
  const EigenPairs pairs = solve_modes(s.problem(), options(14, GetParam()));
  for (int i = 0; i < 14; ++i) EXPECT_NEAR(pairs.lambda(i) / string_frequency(40, i / 7 + 1), 1, 1e-11) << i;
  ASSERT_EQ(pairs.summary.pairs.size(), 2U);
  EXPECT_EQ(pairs.summary.pairs[1].size(), 7U);
}

TEST_P(EveryBackend, FindsZeroModesOfFreeBodies) {
  const System s = strings(120, 6, true);  // six strings: six zero modes
  const EigenPairs pairs = solve_modes(s.problem(true), options(18, GetParam()));
  EXPECT_LT(pairs.summary.sigma, 0);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(pairs.lambda(i), 0, 1e-11 * pairs.lambda(6)) << i;
  for (int i = 6; i < 18; ++i) {
    EXPECT_NEAR(pairs.lambda(i) / (4 * std::pow(std::sin((i / 6) * pi / 240), 2)), 1, 1e-11) << i;
  }
}

TEST_P(EveryBackend, FreeBodyThatWasNotAnnouncedIsFoundByMovingTheShift) {
  const System s = strings(120, 2, true);
  const EigenPairs pairs = solve_modes(s.problem(false), options(6, GetParam()));
  EXPECT_FALSE(pairs.summary.note.empty());
  EXPECT_LT(pairs.summary.sigma, 0);
  EXPECT_LT(std::abs(pairs.lambda(1)), 1e-6 * pairs.lambda(2));
  EXPECT_NEAR(pairs.lambda(2) / (4 * std::pow(std::sin(pi / 240), 2)), 1, 1e-6);
}

TEST_P(EveryBackend, ShiftOnAnEigenvalueIsMoved) {
  const System s = strings(60);
  EigenOptions o = options(5, GetParam());
  o.sigma = string_frequency(60, 1);
  const EigenPairs pairs = solve_modes(s.problem(), o);
  EXPECT_LT(pairs.summary.sigma, string_frequency(60, 1));
  EXPECT_FALSE(pairs.summary.note.empty());
  for (int j = 0; j < 5; ++j) EXPECT_NEAR(pairs.lambda(j) / string_frequency(60, j + 1), 1, 1e-9) << j;
}

TEST_P(EveryBackend, ShiftInsideTheSpectrumFailsRatherThanMissModes) {
  const System s = strings(60);
  EigenOptions o = options(5, GetParam());
  o.sigma = 1e6 * string_frequency(60, 6);  // far above everything
  EXPECT_THROW(solve_modes(s.problem(), o), NumericalError);
}

TEST_P(EveryBackend, AllModesOfASmallBodyComeFromTheDenseRow) {
  const System s = strings(6);
  for (const int wanted : {3, 5, 6}) {
    const EigenPairs pairs = solve_modes(s.problem(), options(wanted, GetParam()));
    EXPECT_EQ(pairs.summary.backend.find("dense"), 0U);
    for (int j = 0; j < wanted; ++j) EXPECT_NEAR(pairs.lambda(j) / string_frequency(6, j + 1), 1, 1e-13);
  }
}

TEST_P(EveryBackend, LanczosWorksWithFewMoreUnknownsThanModes) {
  const System s = strings(9);
  const EigenPairs pairs = solve_modes(s.problem(), options(5, GetParam()));  // asks for 8 of 9
  for (int j = 0; j < 5; ++j) EXPECT_NEAR(pairs.lambda(j) / string_frequency(9, j + 1), 1, 1e-12);
}

TEST_P(EveryBackend, MasslessFreedomsDoNotDisturb) {
  // Every second point without mass: two springs in series, so a string of 50 masses with springs of 1/2.
  System s = strings(101);
  for (int i = 0; i < 101; i += 2) s.M.coeffRef(i, i) = 0;
  const EigenPairs pairs = solve_modes(s.problem(), options(6, GetParam()));
  for (int j = 0; j < 6; ++j) EXPECT_NEAR(pairs.lambda(j) / (0.5 * string_frequency(50, j + 1)), 1, 1e-11) << j;
}

TEST_P(EveryBackend, AgreesWithTheDenseOracleAsSubspace) {
  const System s = membrane(12);
  const EigenPairs a = solve_modes(s.problem(), options(13, GetParam()));
  const EigenPairs b = solve_modes(s.problem(), options(13, "dense"));
  for (size_t g = 0; g < b.summary.pairs.size(); ++g) {
    const std::vector<int>& group = b.summary.pairs[g];
    ASSERT_EQ(a.summary.pairs[g], group);
    const Eigen::MatrixXd overlap = a.Phi(Eigen::all, group).transpose() * s.M * b.Phi(Eigen::all, group);
    const Eigen::MatrixXd square = overlap * overlap.transpose();
    EXPECT_LT((square - Eigen::MatrixXd::Identity(square.rows(), square.cols())).norm(), 1e-12);
  }
}

TEST_P(EveryBackend, RunsRepeatToTheLastDigit) {
  const System s = membrane(10);
  const EigenPairs a = solve_modes(s.problem(), options(7, GetParam()));
  const EigenPairs b = solve_modes(s.problem(), options(7, GetParam()));
  EXPECT_EQ(a.lambda, b.lambda);
  EXPECT_EQ(a.Phi, b.Phi);
}

/// Stiff springs of 1e10 between unit ones: eigenvalues over 10 decades.
TEST_P(EveryBackend, KeepsTheLowFrequenciesOfAStiffBody) {
  const int n = 200;
  std::vector<Eigen::Triplet<double>> K;
  const auto spring = [](int i) { return i % 2 == 0 ? 1.0 : 1e10; };  // spring i to the left of point i
  for (int i = 0; i < n; ++i) {
    K.emplace_back(i, i, spring(i) + spring(i + 1));
    if (i + 1 < n) {
      K.emplace_back(i, i + 1, -spring(i + 1));
      K.emplace_back(i + 1, i, -spring(i + 1));
    }
  }
  const System s = from_triplets(n, K, Eigen::VectorXd::Ones(n));
  const EigenPairs pairs = solve_modes(s.problem(), options(4, GetParam()));
  // Pairs of points move as one: a string of 100 masses of 2. A backward stable solver may change K by eps |K| = 4e-6,
  // and omega^2 by as much: this is why modal_basis sums the strain energy over the elements.
  for (int j = 0; j < 4; ++j) EXPECT_NEAR(pairs.lambda(j), 0.5 * string_frequency(100, j + 1), 4e-6) << j;
}

TEST(EigenSolver, BadRequestsAreRefusedWithAReason) {
  const System s = strings(10);
  EXPECT_NE(message([&] { solve_modes(s.problem(), options(11, "arpack")); }).find("10 unknowns"), std::string::npos);
  EXPECT_NE(message([&] { solve_modes(s.problem(), options(0, "arpack")); }).find("1 or more"), std::string::npos);
  const std::string unknown = message([&] { solve_modes(s.problem(), options(1, "lapack")); });
  for (const std::string& name : backend_names()) EXPECT_NE(unknown.find("\"" + name + "\""), std::string::npos);
  EigenOptions zero_shift = options(1, "arpack");
  zero_shift.sigma = 0;
  EXPECT_NE(message([&] { solve_modes(s.problem(true), zero_shift); }).find("negative shift"), std::string::npos);
}

// Backends that lie, each in one way.
EigenPairs one_mode_missed(const EigenProblem& p, const SparseFactor& f, const EigenRequest& request) {
  EigenRequest more = request;
  ++more.count;
  EigenPairs pairs = dense_modes(p, f, more);
  std::vector<int> kept;
  for (int i = 0; i < more.count; ++i) {
    if (i != 2) kept.push_back(i);  // the second of the first pair
  }
  pairs.lambda = pairs.lambda(kept).eval();
  pairs.Phi = pairs.Phi(Eigen::all, kept).eval();
  return pairs;
}

EigenPairs one_mode_twice(const EigenProblem& p, const SparseFactor& f, const EigenRequest& request) {
  EigenPairs pairs = dense_modes(p, f, request);
  pairs.Phi.col(2) = pairs.Phi.col(1);
  return pairs;
}

EigenPairs wrong_values(const EigenProblem& p, const SparseFactor& f, const EigenRequest& request) {
  EigenPairs pairs = dense_modes(p, f, request);
  pairs.lambda *= 1 + 1e-5;
  return pairs;
}

std::string refusal(const EigenBackend& backend, SturmPolicy sturm = SturmPolicy::always) {
  const System s = membrane(15);
  try {
    solve_modes_with(backend, s.problem(), {.num_modes = 6, .sigma = {}, .backend = "", .sturm = sturm});
  } catch (const NumericalError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(EigenSolver, WrongAnswersOfABackendAreRefused) {
  EXPECT_NE(refusal({"liar", one_mode_missed}).find("Sturm count"), std::string::npos);
  EXPECT_NE(refusal({"liar", one_mode_twice}).find("not M-orthonormal"), std::string::npos);
  EXPECT_NE(refusal({"liar", wrong_values}).find("residual"), std::string::npos);
  EXPECT_EQ(refusal({"honest", dense_modes}), "accepted");
  // Without the count, random vectors find the mode that is missing.
  EXPECT_NE(refusal({"liar", one_mode_missed}, SturmPolicy::never).find("search from random"), std::string::npos);
  EXPECT_EQ(refusal({"honest", dense_modes}, SturmPolicy::never), "accepted");
}

TEST(EigenSolver, TableHasTheBackendsPromised) {
  EXPECT_EQ(backend_names(), (std::vector<std::string>{"arpack", "block", "spectra", "dense"}));
}

}  // namespace
}  // namespace flexboom::test
