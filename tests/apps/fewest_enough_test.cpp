#include "apps/accuracy/fewest_enough.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <vector>

namespace flexboom {
namespace {

/// Of n modes, each moving by a factor less than the one before.
std::vector<double> falling(size_t n, double factor) {
  std::vector<double> displacements(n, 1.0);
  for (size_t i = 1; i < n; ++i) displacements[i] = factor * displacements[i - 1];
  return displacements;
}

struct Found {
  size_t enough = 0;
  double error = 0, error_of_fewer = 0;
  int trials = 0;
};

Found found(FewestEnough search, const std::function<double(size_t)>& error_of) {
  Found r;
  for (; !search.is_settled(); ++r.trials) search.tell(error_of(search.next()));
  r.enough = search.enough(), r.error = search.error(), r.error_of_fewer = search.error_of_fewer();
  return r;
}

// Whatever the first guess is: an eighth at most above the fewest, and what was found is what was told.
TEST(FewestEnough, AreFoundToAnEighth) {
  constexpr double bearable = 1e-3;
  for (const size_t needed : {1U, 2U, 7U, 20U, 39U})
    for (const size_t first : {0U, 3U, 10U, 38U}) {
      const auto error_of = [&](size_t count) {
        return 0.9 * bearable * std::pow(0.7, double(count) - double(needed));
      };
      const Found r = found({falling(40, 0.7), bearable, 0, first}, error_of);
      EXPECT_GE(r.enough, needed) << first;
      EXPECT_LE(r.enough, needed + r.enough / 8) << needed << " " << first;
      EXPECT_DOUBLE_EQ(r.error, r.enough < 40 ? error_of(r.enough) : 0) << needed << " " << first;
      EXPECT_LE(r.trials, 6);
    }
}

TEST(FewestEnough, AreAllWhereFewerAreNot) {
  const auto too_large = [](size_t) { return 1.0; };
  Found r = found({falling(12, 0.5), 1e-3, 0, 4}, too_large);
  EXPECT_EQ(r.enough, 12U);
  EXPECT_EQ(r.error, 0);
  EXPECT_EQ(r.error_of_fewer, 1);
  r = found({falling(12, 0.5), 1e-3, 0, 4}, [](size_t) { return std::numeric_limits<double>::quiet_NaN(); });
  EXPECT_EQ(r.enough, 12U);
  EXPECT_TRUE(std::isnan(r.error_of_fewer));
}

TEST(FewestEnough, AreNoFewerThanWereFoundTooFewBefore) {
  size_t least = 100;
  const auto small = [&](size_t count) {
    least = std::min(least, count);
    return 0.0;
  };
  EXPECT_GE(found({falling(40, 0.9), 1e-3, 16, 1}, small).enough, 16U);
  EXPECT_GE(least, 16U);
}

TEST(FewestEnough, AreNoneWhereNothingMoves) {
  const FewestEnough search({}, 1e-3, 3, 0);
  EXPECT_TRUE(search.is_settled());
  EXPECT_EQ(search.enough(), 0U);
}

// The second core flies what is asked for next, should this be too few.
TEST(FewestEnough, SayWhatComesAfterTooFew) {
  FewestEnough search(falling(40, 0.9), 1e-3, 0, 5);
  const size_t after = search.after_too_few();
  EXPECT_EQ(search.next(), 5U);
  search.tell(1);
  EXPECT_EQ(search.next(), after);
  EXPECT_GT(after, 5U);
}

}  // namespace
}  // namespace flexboom
