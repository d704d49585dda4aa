#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace flexboom {

/// Distance of a hinge from its stop at the share c of a step, and the slope of the distance by c. It is counted on the
/// side where the hinge's flag says that it is (negative: it has crossed).
struct Clearance {
  double c = 0, value = 0, slope = 0;
};

inline constexpr double no_crossing = 2;
inline constexpr double crossed_from_the_start = 3;

/// The cubic through the values and slopes of two places.
class Hermite {
 public:
  Hermite(const Clearance& from, const Clearance& to)
      : from_(from),
        width_(to.c - from.c),
        d0_(from.slope * width_),
        c2_(3 * (to.value - from.value) - 2 * d0_ - to.slope * width_),
        c3_(2 * (from.value - to.value) + d0_ + to.slope * width_) {}

  Clearance operator()(double c) const {
    const double s = (c - from_.c) / width_;
    return {c, from_.value + s * (d0_ + s * (c2_ + s * c3_)), (d0_ + s * (2 * c2_ + s * 3 * c3_)) / width_};
  }

  /// Where it is lowest; before or behind everything where it has no dip.
  double bottom() const {
    const double root = c2_ * c2_ - 3 * c3_ * d0_;
    return root < 0 ? no_crossing : from_.c - width_ * d0_ / (c2_ + std::sqrt(root));
  }

 private:
  Clearance from_;
  double width_, d0_, c2_, c3_;
};

/// Newton from c in a bracket: clear at a, crossed at b. `at(c)` gives the Clearance.
template <class At>
double newton_in_bracket(const At& at, double a, double b, double c, double resolution) {
  for (int round = 0; round < 100; ++round) {
    const Clearance here = at(c);
    (here.value < 0 ? b : a) = c;
    double next = here.slope < 0 ? c - here.value / here.slope : 0.5 * (a + b);
    if (std::abs(next - c) <= resolution) return std::clamp(next, a, b);
    if (!(next > a && next < b)) next = 0.5 * (a + b);
    c = next;
    if (b - a <= resolution) break;
  }
  return c;
}

/// Between a place that is clear and one that is crossed; the first guess is where the cubic crosses.
template <class At>
double crossing_in_bracket(const At& at, const Clearance& from, const Clearance& to, double resolution) {
  const double guess = newton_in_bracket(Hermite(from, to), from.c, to.c, to.c, 1e-3 * (to.c - from.c));
  return newton_in_bracket(at, from.c, to.c, guess, resolution);
}

/// Whether the hinge may cross between two places so near that the clearance has at most one dip between them. It may
/// where it has crossed at the second place. It also may where the cubic has a dip that is worth following to its
/// bottom.
inline bool may_cross(const Clearance& from, const Clearance& to) {
  if (to.value < 0) return true;
  if (!(from.slope < 0 && to.slope > 0)) return false;
  const Hermite cubic(from, to);
  return cubic.bottom() != no_crossing &&
         cubic(std::clamp(cubic.bottom(), from.c, to.c)).value <= 0.5 * std::min(from.value, to.value);
}

/// The first crossing between two places so near that the clearance has at most one dip between them, or one of the
/// constants above. Contacts shorter than the distance are found by the bottom of the dip.
template <class At>
double crossing_between(const At& at, const Clearance& from, const Clearance& to, double resolution) {
  if (to.value < 0) {
    if (from.value > 0) return crossing_in_bracket(at, from, to, resolution);
    Clearance beyond = to;
    for (int tries = 0; tries < 60; ++tries) {
      const Clearance here = at(0.5 * (from.c + beyond.c));
      if (here.value > 0) return crossing_in_bracket(at, here, beyond, resolution);  // it comes off the stop
      beyond = here;
    }
    return crossed_from_the_start;
  }
  if (!may_cross(from, to)) return no_crossing;
  double c = std::clamp(Hermite(from, to).bottom(), from.c, to.c);
  Clearance a = from, b = to;
  for (int round = 0; round < 60 && c > a.c && c < b.c; ++round) {
    const Clearance here = at(c);
    if (here.value < 0) return crossing_in_bracket(at, from, here, resolution);
    (here.slope < 0 ? a : b) = here;
    if (std::min(a.value, b.value) + std::max(a.slope * (b.c - a.c), -b.slope * (b.c - a.c)) > 0)
      return no_crossing;  // a convex dip stays above its tangents
    const double next = a.c - a.slope * (b.c - a.c) / (b.slope - a.slope);
    c = std::abs(next - c) > resolution ? next : 0.5 * (a.c + b.c);
    if (b.c - a.c <= resolution) break;
  }
  return no_crossing;
}

/// What is crossed first within a step. Booms that are alike cross together.
class FirstCrossings {
 public:
  void clear() {
    roots_.clear();
    end_ = 1;
  }
  /// `root`: share of the step; beyond 1 there is none.
  void add(std::size_t i, double root) {
    if (root > 1) return;
    roots_.emplace_back(i, root);
    end_ = std::min(end_, root);
  }
  /// The share of the step that ends at the first crossing, or 1.
  double end() const { return end_; }
  /// crossed[i]: +1 for what is open and crossed there, -1 for what is closed, in a step of `length` from `start` [s].
  void mark(double start, double length, std::span<const char> closed, std::span<int> crossed) const {
    const double same = (4e-16 * std::abs(start) + 1e-14 * length) / length;
    for (const auto& [i, root] : roots_)
      if (root <= end_ + same) crossed[i] = closed[i] ? -1 : 1;
  }

 private:
  std::vector<std::pair<std::size_t, double>> roots_;
  double end_ = 1;
};

}  // namespace flexboom
