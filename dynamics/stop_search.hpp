#pragma once

#include "dynamics/crossing.hpp"
#include "dynamics/linear_part.hpp"
#include "dynamics/system.hpp"

#include <span>
#include <utility>
#include <vector>

namespace flexboom {

/// One step of exponential collocation: x = (p, u) at every place of it.
struct CollocatedStep {
  LinearPart* linear = nullptr;
  Grid* grid = nullptr;
  double start = 0, length = 0;  // [s]
  Eigen::MatrixXd X, Z;          // x and its coefficients at the points, a column each
  Eigen::MatrixXd M;             // of the remainder, see LinearPart::combine
};

/// Finds where a hinge first meets or leaves its stop within a step that may be longer than its vibrations.
class StopSearch {
 public:
  explicit StopSearch(const Layout& layout) : layout_(layout) {}

  /// The fraction at which the step ends: of the first crossing of an armed stop, or 1. crossed[i]: +1 where the gap of
  /// hinge i rises through zero there, -1 where it falls.
  double first_crossing(const CollocatedStep&, std::span<const char> contact, std::span<const char> armed,
                        std::span<int> crossed);

 private:
  /// Vibration of a gap that the points of a step are too far apart for.
  struct Ripple {
    double turn = 0;       // angle that the fastest of it goes through in a step
    double amplitude = 0;  // all of it
  };

  /// Of entry `at` of x, from a point of the step on.
  Ripple ripple(const CollocatedStep&, int at, int point);
  double first_crossing(const CollocatedStep&, int hinge, double side, double end);

  const Layout& layout_;
  std::vector<std::pair<int, double>> roots_;
  Eigen::VectorXd z_, amplitude_;
  GridPoint scratch_;
};

}  // namespace flexboom
