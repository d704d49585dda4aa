#pragma once

#include "dynamics/numerics/crossing.hpp"
#include "dynamics/numerics/linear_part.hpp"
#include "dynamics/relative/split.hpp"

#include <complex>
#include <span>
#include <utility>
#include <vector>

namespace flexboom {

/// One step of exponential collocation: x at every place of it.
struct CollocatedStep {
  LinearPart* linear = nullptr;
  const Grid* grid = nullptr;
  double start = 0, length = 0;  // [s]
  Eigen::MatrixXd X, Z,
      N;              // x (inner points: angular velocities, gaps and rates alone), its coefficients, their remainders
  Eigen::MatrixXd M;  // of the remainder, see LinearPart::combine
};

/// Finds where a hinge first meets or leaves its stop within a step that may be longer than its vibrations.
class StopSearch {
 public:
  explicit StopSearch(std::vector<SplitLayout::Coordinate> gaps) : gaps_(std::move(gaps)) {}

  /// The fraction at which the step ends: that of the first gap that crosses its level, or 1. Infinite levels are never
  /// crossed. crossed[i]: +1 where the gap of hinge i rises there, -1 where it falls.
  double first_crossing(const CollocatedStep&, std::span<const char> contact, std::span<const double> levels,
                        std::span<int> crossed);

 private:
  /// What changes in the gap faster than the points of a step show: the real part of each.
  struct Fast {
    Eigen::Index mode;
    std::complex<double> rate;                   // eigenvalue times the length of the step
    std::complex<double> share;                  // of the gap, at a point
    std::complex<double> factor = 0, drift = 0;  // from one place to the next; by the end
  };

  /// All of it that vibrates.
  struct Ripple {
    double turn = 0;       // angle that the fastest goes through in a step
    double amplitude = 0;  // together
  };

  /// Sets `shares_` and `rates_`: what each mode has of an entry of x at a point, and of its rate.
  void take_shares(const CollocatedStep&, int entry, int point);
  std::complex<double> share_of(Eigen::Index mode) const;

  /// Of what `take_shares` took; sets `fast_`.
  Ripple ripple(const CollocatedStep&);
  /// No less than its amplitude, at a small part of the cost.
  double widest_ripple(const CollocatedStep&) const;
  double first_crossing(const CollocatedStep&, int hinge, double level, double side, double end);

  struct Places {
    int gap, to;  // entry of x; point at the end
    int parts;
    double side, resolution;
  };

  /// Between two points, at places in between: nearly, by `fast_` and the two points, and exactly where it may cross.
  template <class At>
  double crossing_at_places(const CollocatedStep&, const At& at, const Clearance& from, const Clearance& to,
                            const Places&);

  std::vector<SplitLayout::Coordinate> gaps_;  // of each stop
  FirstCrossings crossings_;
  std::vector<Fast> fast_;
  Eigen::VectorXd z_, shares_, rates_;  // shares: real parts, then imaginary parts; rates: squares
  GridPoint scratch_;
};

}  // namespace flexboom
