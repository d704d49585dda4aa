#include "dynamics/methods/renewal.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace flexboom {
namespace {

constexpr long size = 10, block = 24;

/// A flight of `steps` steps, whose steps pass `pace(age)` where L is `age` steps old; says when L was taken anew.
template <class Pace>
std::vector<long> renewals(long steps, const Pace& pace) {
  Renewal renewal(size);
  renewal.restart(0, 0, 0);
  std::vector<long> when;
  double t = 0;
  long taken = 0;
  for (long n = 0; n < steps; ++n) {
    if (renewal.is_due(n, 4 * n, t)) when.push_back(taken = n), renewal.taken(n);
    t += pace(n - taken);
  }
  return when;
}

TEST(Renewal, IsRareWhereItDoesNotHelp) {
  const std::vector<long> when = renewals(20000, [](long) { return 0.1; });
  ASSERT_FALSE(when.empty());
  EXPECT_LE(when.size(), 5U);  // each wait is four times the last
  for (size_t k = 2; k < when.size(); ++k) EXPECT_GT(when[k] - when[k - 1], 3 * (when[k - 1] - when[k - 2])) << k;
}

TEST(Renewal, GoesOnWhereItHelps) {
  const std::vector<long> when = renewals(2000, [](long age) { return age < 60 ? 0.1 : 0.02; });
  EXPECT_GE(when.size(), 15U);
  for (size_t k = 1; k < when.size(); ++k) EXPECT_LE(when[k] - when[k - 1], 4 * block) << k;
}

TEST(Renewal, ContactsBeginTheWaitAnew) {
  Renewal renewal(size);
  for (long n = 0; n < 2000; ++n) {
    if (n % 30 == 0) renewal.restart(n, 4 * n, 0.1 * static_cast<double>(n));
    EXPECT_FALSE(renewal.is_due(n, 4 * n, 0.1 * static_cast<double>(n))) << n;
  }
}

TEST(Renewal, IsFreshForAFewSteps) {
  Renewal renewal(size);
  renewal.restart(0, 0, 0);
  EXPECT_FALSE(renewal.is_fresh(0));  // L is of another place
  renewal.taken(5);
  EXPECT_TRUE(renewal.is_fresh(5));
  EXPECT_TRUE(renewal.is_fresh(15));
  EXPECT_FALSE(renewal.is_fresh(50));
  renewal.taken(50);
  renewal.restart(51, 0, 0);
  EXPECT_FALSE(renewal.is_fresh(51));
}

}  // namespace
}  // namespace flexboom
