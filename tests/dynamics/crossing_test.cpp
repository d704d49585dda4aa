#include "dynamics/numerics/crossing.hpp"

#include <gtest/gtest.h>

namespace flexboom {
namespace {

/// A clearance, and how often it was asked for.
template <class F, class Slope>
struct Counted {
  F f;
  Slope slope;
  mutable int asked = 0;
  Clearance operator()(double c) const {
    ++asked;
    return {c, f(c), slope(c)};
  }
};
template <class F, class Slope>
Counted(F, Slope) -> Counted<F, Slope>;

constexpr double resolution = 1e-15;

// Few evaluations, and none in vain when Newton arrives.
TEST(Crossing, IsFoundInAFewEvaluations) {
  for (const double root : {0.003, 0.29444834116712798, 0.5, 0.9999}) {
    const Counted at{[&](double c) { return std::exp(-3 * c) - std::exp(-3 * root); },
                     [](double c) { return -3 * std::exp(-3 * c); }};
    const Clearance from = at(0), to = at(1);
    at.asked = 0;
    EXPECT_NEAR(crossing_between(at, from, to, resolution), root, 2e-15);
    EXPECT_LE(at.asked, 5) << root;
  }
}

// It starts on the stop, comes off, and is back soon.
TEST(Crossing, OfAMotionThatStartsOnTheStop) {
  const double back = 3e-5;
  const Counted at{[&](double c) { return c * (back - c); }, [&](double c) { return back - 2 * c; }};
  EXPECT_NEAR(crossing_between(at, at(0), at(0.2), resolution), back, 1e-15);
  const Counted pressed{[](double c) { return -c * c; }, [](double c) { return -2 * c; }};
  EXPECT_EQ(crossing_between(pressed, pressed(0), pressed(1), resolution), crossed_from_the_start);
}

// A dip that ends where it began: followed to its bottom, and crossed on the way down.
TEST(Crossing, OfADipBetweenTwoPlaces) {
  for (const double depth : {1e-3, 1e-9}) {
    const Counted at{[&](double c) { return (c - 0.6) * (c - 0.6) - depth; }, [](double c) { return 2 * (c - 0.6); }};
    EXPECT_NEAR(crossing_between(at, at(0), at(1), resolution), 0.6 - std::sqrt(depth), 1e-14) << depth;
  }
  const Counted clear{[](double c) { return (c - 0.6) * (c - 0.6) + 1e-9; }, [](double c) { return 2 * (c - 0.6); }};
  EXPECT_EQ(crossing_between(clear, clear(0), clear(1), resolution), no_crossing);
}

}  // namespace
}  // namespace flexboom
