// What sweeps draw, and what Sobol indices are made of.

#include "apps/sweep/indices.hpp"
#include "apps/sweep/quantities.hpp"
#include "apps/sweep/sampling.hpp"
#include "apps/sweep/variation.hpp"
#include "fem/base/check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <vector>

namespace flexboom {
namespace {

TEST(SobolSequence, FirstPointsAreThoseOfJoeAndKuo) {
  // In units of 1/16; dimensions 1, 2, 3, 8, 20, 40; scipy 1.10, whose points come in the order of the Gray code.
  const SobolSequence sequence(40);
  const std::vector<size_t> dimensions = {0, 1, 2, 7, 19, 39};
  const std::vector<std::vector<int>> expected = {{0, 0, 0, 0, 0, 0},     {8, 8, 8, 8, 8, 8},    {12, 4, 4, 12, 4, 4},
                                                  {4, 12, 12, 4, 12, 12}, {6, 6, 10, 14, 2, 14}, {14, 14, 2, 6, 10, 6},
                                                  {10, 2, 14, 2, 6, 10},  {2, 10, 6, 10, 14, 2}};
  for (size_t gray = 0; gray < expected.size(); ++gray)
    for (size_t d = 0; d < dimensions.size(); ++d)
      EXPECT_EQ(sequence.at(gray ^ (gray >> 1), dimensions[d]) >> 28, static_cast<unsigned>(expected[gray][d]))
          << "point " << gray << ", dimension " << dimensions[d] + 1;
}

TEST(SobolSequence, EveryDimensionHasOnePointInEachBinaryInterval) {
  const SobolSequence sequence(SobolSequence::most_dimensions);
  constexpr unsigned count = 1024;
  for (size_t d = 0; d < SobolSequence::most_dimensions; ++d) {
    std::set<std::uint32_t> intervals;
    for (unsigned i = 0; i < count; ++i) intervals.insert(sequence.at(i, d) >> 22);
    EXPECT_EQ(intervals.size(), count) << d;
  }
}

TEST(SobolSequence, MoreDimensionsThanThereAreIsAnError) {
  EXPECT_THROW(SobolSequence(SobolSequence::most_dimensions + 1), InputError);
}

TEST(NormalQuantile, IsTheInverseOfTheDistribution) {
  // Reference values to 16 digits: mpmath, sqrt(2) erfinv(2 p - 1).
  EXPECT_NEAR(normal_quantile(0.975), 1.959963984540054, 1e-15);
  EXPECT_NEAR(normal_quantile(0.99), 2.326347874040841, 1e-15);
  EXPECT_NEAR(normal_quantile(1e-10), -6.361340902404056, 1e-14);
  EXPECT_EQ(normal_quantile(0.5), 0);
  for (double z = -7; z < 6; z += 0.1) {
    const double p = 0.5 * std::erfc(-z / std::numbers::sqrt2);
    const double density = std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi);
    EXPECT_NEAR(normal_quantile(p), z, 1e-14 + 1e-15 * p / density) << z;  // round-off of p
  }
  EXPECT_EQ(normal_quantile(0), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(normal_quantile(1), std::numeric_limits<double>::infinity());
}

TEST(UniformDraw, DependsOnEachOfItsArguments) {
  std::set<double> draws;
  for (unsigned seed = 0; seed < 10; ++seed)
    for (unsigned d = 0; d < 10; ++d)
      for (unsigned run = 0; run < 10; ++run) draws.insert(uniform_draw(seed, d, run));
  EXPECT_EQ(draws.size(), 1000U);
  EXPECT_GT(*draws.begin(), 0);
  EXPECT_LT(*draws.rbegin(), 1);
}

TEST(LatinHypercube, HasOnePointInEachStratum) {
  constexpr size_t count = 500;
  const UnitPoints points(Sampling::lhs, 7, 3, count);
  for (size_t d = 0; d < 3; ++d) {
    std::set<size_t> strata;
    for (size_t i = 0; i < count; ++i) strata.insert(static_cast<size_t>(points.at(i, d) * count));
    EXPECT_EQ(strata.size(), count) << d;
  }
}

/// Ishigami and Homma 1990: sin x1 + a sin^2 x2 + b x3^4 sin x1, each x uniform in (-pi, pi).
double ishigami(double u1, double u2, double u3) {
  constexpr double a = 7, b = 0.1, pi = std::numbers::pi;
  const double x1 = pi * (2 * u1 - 1), x2 = pi * (2 * u2 - 1), x3 = pi * (2 * u3 - 1);
  return std::sin(x1) + a * std::pow(std::sin(x2), 2) + b * std::pow(x3, 4) * std::sin(x1);
}

TEST(SobolIndices, OfTheIshigamiFunctionAreThoseOfTheClosedForm) {
  constexpr double a = 7, b = 0.1;
  const double pi4 = std::pow(std::numbers::pi, 4), pi8 = pi4 * pi4;
  const double V1 = 0.5 * std::pow(1 + b * pi4 / 5, 2), V2 = a * a / 8, V13 = b * b * pi8 * 8 / 225;
  const double V = V1 + V2 + V13;
  const std::vector<double> first = {V1 / V, V2 / V, 0}, total = {(V1 + V13) / V, V2 / V, V13 / V};
  constexpr size_t n = 4096, d = 3;
  const UnitPoints points(Sampling::sobol, 1, 2 * d, n);
  const SobolIndices found = sobol_indices(d, n, [&](size_t point, size_t k) {
    const auto u = [&](size_t i) { return points.at(point, coordinate_of_base_point(d, k, i)); };
    return ishigami(u(0), u(1), u(2));
  });
  EXPECT_EQ(found.points, n);
  for (size_t i = 0; i < d; ++i) {
    EXPECT_NEAR(found.first[i], first[i], 0.02) << i;
    EXPECT_NEAR(found.total[i], total[i], 0.02) << i;
  }
}

TEST(SobolIndices, LeaveOutPointsThatLackARun) {
  constexpr size_t n = 4096;
  const UnitPoints points(Sampling::sobol, 1, 4, n);
  const auto lacks = [](size_t point) { return uniform_draw(5, 0, point) < 0.125; };
  size_t whole = 0;
  for (size_t point = 0; point < n; ++point) whole += lacks(point) ? 0 : 1;
  const SobolIndices found = sobol_indices(2, n, [&](size_t point, size_t k) {
    if (lacks(point) && k == 2) return std::nan("");
    return points.at(point, coordinate_of_base_point(2, k, 0));  // the second variable does nothing
  });
  EXPECT_EQ(found.points, whole);
  EXPECT_NEAR(found.first[0], 1, 3 / std::sqrt(n));  // points left out at random
  EXPECT_NEAR(found.total[1], 0, 1e-15);
}

TEST(SobolIndices, OfAConstantAreNotNumbers) {
  const SobolIndices found = sobol_indices(2, 16, [](size_t, size_t) { return 0.1; });
  EXPECT_TRUE(std::isnan(found.first[0]));
  EXPECT_TRUE(std::isnan(found.total[1]));
}

OutputTable damped_oscillation() {
  OutputTable table{{"t", "arm.tip.x", "arm.tip.y", "arm.tip.z"}, Eigen::MatrixXd::Zero(1001, 4)};
  for (Eigen::Index row = 0; row < 1001; ++row) {
    const double t = 0.01 * static_cast<double>(row);
    table.values.row(row) << t, 3 * std::exp(-t), 4 * std::exp(-t), 0;
  }
  return table;
}

TEST(Quantity, IsOfAColumnOrOfALength) {
  const OutputTable table = damped_oscillation();
  EXPECT_EQ(value_of(quantity_of("arm.tip.x:max"), table), 3);
  EXPECT_EQ(value_of(quantity_of("arm.tip:max"), table), 5);
  EXPECT_NEAR(value_of(quantity_of("arm.tip:rms"), table), 5 * std::sqrt((1 - std::exp(-20)) / 20), 1e-4);
  EXPECT_EQ(value_of(quantity_of("arm.tip.x:final"), table), 3 * std::exp(-10.0));
  EXPECT_NEAR(value_of(quantity_of("settle:arm.tip.x:0.05"), table), std::log(20.0), 0.01);  // a row
  EXPECT_EQ(value_of(quantity_of("settle:arm.tip.z:0.05"), table), 0);
  EXPECT_TRUE(std::isnan(value_of(quantity_of("arm.q3:max"), table)));
}

TEST(Quantity, TextThatIsNoneIsAnError) {
  for (const char* text : {"", "x", ":max", "x:", "x:mean", "settle:x", "settle:x:0", "settle:x:1", "settle::0.1"})
    EXPECT_THROW(quantity_of(text), InputError) << text;
}

TEST(SweepValues, GridTurnsItsLastListFastest) {
  const SweepValues values({.vary = {"a=1,2", "b=lin:0:1:3", "c=log:1:100:3", "d=word"}, .n = {}, .sample = ""});
  ASSERT_EQ(values.runs(), 18U);
  const std::vector<KeyVariant> last = values.of_run(17), second = values.of_run(1);
  EXPECT_EQ(last[0].number, 2);
  EXPECT_EQ(last[1].number, 1);
  EXPECT_EQ(last[2].number, 100);
  EXPECT_EQ(last[3].word, "word");
  EXPECT_EQ(second[1].number, 0);
  EXPECT_NEAR(second[2].number, 10, 1e-14);
}

TEST(SweepValues, BracketsAndQuotesAreOneValue) {
  const SweepValues values({.vary = {"a=min(t,1)*2,0.1", "b=[0,0,1],[0,1,0]", R"(c="x,y",z)"}, .n = {}, .sample = ""});
  ASSERT_EQ(values.runs(), 8U);
  const std::vector<KeyVariant> first = values.of_run(0), last = values.of_run(7);
  EXPECT_EQ(first[0].word, "min(t,1)*2");
  EXPECT_EQ(last[0].number, 0.1);
  EXPECT_EQ(first[1].word, "[0,0,1]");
  EXPECT_EQ(last[1].word, "[0,1,0]");
  EXPECT_EQ(first[2].word, "\"x,y\"");
  SceneSource source("sport");
  source.set("initial.rate", first[1]);
  EXPECT_EQ(source.read().start_rate, Eigen::Vector3d::UnitZ());
  source.set("name", {0, "\"x_y\""});
  EXPECT_EQ(source.read().name, "x_y");
  EXPECT_THROW(source.set("initial.rate", {0, "[0,0"}), InputError);
}

TEST(SweepValues, IndicesMixTwoPointsOfTheKeysThatVary) {
  const SweepValues values(
      {.vary = {"a=uniform:0:1", "b=5", "c=uniform:0:1"}, .n = 8, .sample = "sobol", .indices = true});
  ASSERT_EQ(values.runs(), 8U * 4);
  const auto A = values.of_run(4), B = values.of_run(5), AB_a = values.of_run(6), AB_c = values.of_run(7);
  EXPECT_EQ(A[1].number, 5);
  EXPECT_NE(A[0].number, B[0].number);
  EXPECT_EQ(AB_a[0].number, B[0].number);
  EXPECT_EQ(AB_a[2].number, A[2].number);
  EXPECT_EQ(AB_c[0].number, A[0].number);
  EXPECT_EQ(AB_c[2].number, B[2].number);
}

}  // namespace
}  // namespace flexboom
