#include "dynamics/methods/stop_search.hpp"

#include <gtest/gtest.h>
#include <Eigen/LU>

#include <cmath>
#include <initializer_list>
#include <numbers>

namespace flexboom {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

using std::numbers::pi;

VectorXd values(std::initializer_list<double> v) { return Eigen::Map<const VectorXd>(v.begin(), std::ssize(v)); }

/// Oscillators whose sum is the gap: a step that is short for the first and long for the others.
struct SearchCase {
  VectorXd frequency, damping, amplitude, phase;
  Eigen::Index n;
  LinearPart linear;
  Grid grid;
  CollocatedStep step;

  SearchCase(const VectorXd& w, const VectorXd& d, const VectorXd& a, const VectorXd& at)
      : frequency(w), damping(d), amplitude(a), phase(at), n(w.size()), linear(matrix(w, d), {}, VectorXd::Zero(n)) {
    step.linear = &linear;
    step.length = 1;
    linear.grid(1, grid);
    step.grid = &grid;
    step.X.resize(2 * n, collocation::points);
    step.Z.resize(linear.size(), collocation::points);
    step.N = step.M = MatrixXd::Zero(linear.size(), collocation::points);
    for (int j = 0; j < collocation::points; ++j) {
      step.X.col(j) = state(collocation::node(j));
      step.Z.col(j) = linear.to_modes * step.X.col(j);
    }
  }

  /// Of (gap, all but the first oscillator) and their rates.
  static MatrixXd matrix(const VectorXd& w, const VectorXd& d) {
    const Eigen::Index n = w.size();
    MatrixXd T = MatrixXd::Identity(n, n), L = MatrixXd::Zero(2 * n, 2 * n);
    T.row(0).setOnes();
    L.topRightCorner(n, n).setIdentity();
    L.bottomLeftCorner(n, n) = -T * (w.cwiseAbs2() + d.cwiseAbs2()).asDiagonal() * T.inverse();
    L.bottomRightCorner(n, n) = -2 * T * d.asDiagonal() * T.inverse();
    return L;
  }

  VectorXd state(double t) const {
    VectorXd x = VectorXd::Zero(2 * n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double turn = frequency[i] * t + phase[i], size = amplitude[i] * std::exp(-damping[i] * t);
      const double q = size * std::cos(turn), v = -size * (damping[i] * std::cos(turn) + frequency[i] * std::sin(turn));
      x[0] += q, x[n] += v;
      if (i > 0) x[i] = q, x[n + i] = v;
    }
    return x;
  }

  double gap(double t) const {
    double sum = 0;
    for (Eigen::Index i = 0; i < n; ++i)
      sum += amplitude[i] * std::exp(-damping[i] * t) * std::cos(frequency[i] * t + phase[i]);
    return sum;
  }

  /// By walking, then halving; 2 for none.
  double expected() const {
    constexpr int places = 2'000'000;
    for (int k = 1; k <= places; ++k) {
      double a = (k - 1.0) / places, b = static_cast<double>(k) / places;
      if (gap(b) < 0) continue;
      while (b - a > 1e-15) (gap(0.5 * (a + b)) < 0 ? a : b) = 0.5 * (a + b);
      return b;
    }
    return 2;
  }

  double found() {
    const std::vector<char> contact = {0};
    const std::vector<double> levels = {0};
    std::vector<int> crossed = {0};
    const double end = StopSearch({{0, static_cast<int>(n)}}).first_crossing(step, contact, levels, crossed);
    return crossed[0] == 0 ? 2 : end;
  }
};

// The gap is negative where it is free: the slow part comes near, and the fast one reaches the stop first.
TEST(StopSearch, FindsTheFirstContactOfAFastVibration) {
  for (const double fast : {5.0, 70.0, 900.0, 7000.0})
    for (const double phase : {0.1, 1.7, 3.0}) {
      SearchCase c(values({1.3, fast}), values({0.1, 0.2}), values({1, 0.02}), values({0.7 + pi, phase}));
      const double expected = c.expected();
      ASSERT_LT(expected, 1);
      EXPECT_NEAR(c.found(), expected, 1e-11) << fast << " " << phase;
    }
}

// A vibration that is wide and not so fast counts beside one whose rate is a hundred times larger.
TEST(StopSearch, FindsAWideVibrationBesideAFastOne) {
  for (const double phase : {0.1, 1.3, 2.5, 3.7, 4.9}) {
    SearchCase c(values({1.0, 73.66, 17795}), values({0, 0.2, 0.2}), values({0.03, 0.02, 0.00497}),
                 values({pi, phase, 2 * phase}));
    ASSERT_LT(c.gap(0), 0);
    const double expected = c.expected();
    ASSERT_LT(expected, 1);
    EXPECT_NEAR(c.found(), expected, 1e-11) << phase;
  }
}

// It stays clear by less than the amplitude of the vibration.
TEST(StopSearch, FindsNoContactWhereThereIsNone) {
  for (const double fast : {70.0, 900.0}) {
    SearchCase near(values({0.2, fast}), values({0, 0.2}), values({0.1, 0.0975}), values({pi, 0}));
    EXPECT_EQ(near.expected(), 2);
    EXPECT_EQ(near.found(), 2);
  }
}

}  // namespace
}  // namespace flexboom
