#include "dynamics/stop_search.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace flexboom {
namespace {

using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

/// Two oscillators, whose sum is the gap: a step that is short for one and long for the other.
struct Case {
  Vector2d frequency, damping, amplitude, phase;
  LinearPart linear;
  Grid grid;
  CollocatedStep step;
  Layout layout;

  Case(const Vector2d& w, const Vector2d& d, const Vector2d& a, const Vector2d& at)
      : frequency(w), damping(d), amplitude(a), phase(at), linear(matrix(w, d), -1, VectorXd::Zero(2)) {
    layout.body = {0};
    layout.p = layout.u = 2;
    layout.size = 5;
    step.linear = &linear;
    step.length = 1;
    linear.grid(1, grid);
    step.grid = &grid;
    step.X.resize(4, collocation::points);
    step.Z.resize(linear.size(), collocation::points);
    step.N = step.M = MatrixXd::Zero(linear.size(), collocation::points);
    for (int j = 0; j < collocation::points; ++j) {
      step.X.col(j) = state(collocation::node(j));
      step.Z.col(j) = linear.to_modes * step.X.col(j);
    }
  }

  /// (gap, second oscillator) and rates.
  static MatrixXd matrix(const Vector2d& w, const Vector2d& d) {
    const Matrix2d T{{1, 1}, {0, 1}}, back = T.inverse();
    MatrixXd L = MatrixXd::Zero(4, 4);
    L.topRightCorner<2, 2>().setIdentity();
    L.bottomLeftCorner<2, 2>() = -T * (w.cwiseAbs2() + d.cwiseAbs2()).asDiagonal() * back;
    L.bottomRightCorner<2, 2>() = -2 * T * d.asDiagonal() * back;
    return L;
  }

  VectorXd state(double t) const {
    VectorXd x = VectorXd::Zero(4);
    for (int i = 0; i < 2; ++i) {
      const double turn = frequency[i] * t + phase[i], size = amplitude[i] * std::exp(-damping[i] * t);
      const double q = size * std::cos(turn), v = -size * (damping[i] * std::cos(turn) + frequency[i] * std::sin(turn));
      x[0] += q, x[2] += v;
      if (i == 1) x[1] = q, x[3] = v;
    }
    return x;
  }

  /// By walking, then halving; 2 for none.
  double expected() const {
    constexpr int places = 2'000'000;
    const auto gap = [&](double t) { return state(t)[0]; };
    for (int k = 1; k <= places; ++k) {
      double a = (k - 1.0) / places, b = static_cast<double>(k) / places;
      if (gap(b) < 0) continue;
      while (b - a > 1e-15) (gap(0.5 * (a + b)) < 0 ? a : b) = 0.5 * (a + b);
      return b;
    }
    return 2;
  }

  double found() {
    const std::vector<char> contact = {0}, armed = {1};
    std::vector<int> crossed = {0};
    const double end = StopSearch(layout).first_crossing(step, contact, armed, crossed);
    return crossed[0] == 0 ? 2 : end;
  }
};

// The gap is negative where it is free: the slow part comes near, and the fast one reaches the stop first.
TEST(StopSearch, FindsTheFirstContactOfAFastVibration) {
  for (const double fast : {5.0, 70.0, 900.0, 7000.0})
    for (const double phase : {0.1, 1.7, 3.0}) {
      Case c({1.3, fast}, {0.1, 0.2}, {1, 0.02}, {1.0 + M_PI - 0.3, phase});
      const double expected = c.expected();
      ASSERT_LT(expected, 1);
      EXPECT_NEAR(c.found(), expected, 1e-11) << fast << " " << phase;
    }
}

// It stays clear by less than the amplitude of the vibration.
TEST(StopSearch, FindsNoContactWhereThereIsNone) {
  for (const double fast : {70.0, 900.0}) {
    Case near({0.2, fast}, {0, 0.2}, {0.1, 0.0975}, {M_PI, 0});
    EXPECT_EQ(near.expected(), 2);
    EXPECT_EQ(near.found(), 2);
  }
}

}  // namespace
}  // namespace flexboom
