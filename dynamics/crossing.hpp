#pragma once

#include <algorithm>
#include <cmath>

namespace flexboom {

/// Distance of a hinge from its stop on the side where its flag says that it is (negative: it has crossed), at a place
/// c of a step, and its slope there.
struct Clearance {
  double c = 0, value = 0, slope = 0;
};

inline constexpr double no_crossing = 2;
inline constexpr double crossed_from_the_start = 3;

/// Newton in a bracket: clear at a, crossed at b. `at(c)` gives the Clearance.
template <class At>
double crossing_in_bracket(const At& at, double a, double b, double resolution) {
  double c = b;
  for (int round = 0; round < 100; ++round) {
    const Clearance here = at(c);
    (here.value < 0 ? b : a) = c;
    double next = here.slope < 0 ? c - here.value / here.slope : 0.5 * (a + b);
    if (!(next > a && next < b)) next = 0.5 * (a + b);
    const double moved = std::abs(next - c);
    c = next;
    if (moved <= resolution || b - a <= resolution) break;
  }
  return c;
}

/// The first crossing between two places so near that the clearance has at most one dip between them, or one of the
/// constants above. Contacts shorter than the distance are found by the bottom of the dip.
template <class At>
double crossing_between(const At& at, const Clearance& from, const Clearance& to, double resolution) {
  if (to.value < 0) {
    if (from.value > 0) return crossing_in_bracket(at, from.c, to.c, resolution);
    double c = 0.5 * (from.c + to.c);
    for (int tries = 0; tries < 60; ++tries, c = 0.5 * (from.c + c))
      if (at(c).value > 0) return crossing_in_bracket(at, c, to.c, resolution);  // it starts on the stop and comes off
    return crossed_from_the_start;
  }
  if (!(from.slope < 0 && to.slope > 0)) return no_crossing;
  // The cubic through values and slopes says whether the dip is worth following to its bottom, where the slope is zero.
  const double width = to.c - from.c, d0 = from.slope * width, d1 = to.slope * width;
  const double c3 = 2 * (from.value - to.value) + d0 + d1, c2 = 3 * (to.value - from.value) - 2 * d0 - d1;
  const double root = c2 * c2 - 3 * c3 * d0;
  if (root < 0) return no_crossing;
  const double s = std::clamp(-d0 / (c2 + std::sqrt(root)), 0.0, 1.0);
  if (from.value + s * (d0 + s * (c2 + s * c3)) > 0.5 * std::min(from.value, to.value)) return no_crossing;
  Clearance a = from, b = to;
  double c = from.c + s * width;
  for (int round = 0; round < 60 && c > a.c && c < b.c; ++round) {
    const Clearance here = at(c);
    if (here.value < 0) return crossing_in_bracket(at, from.c, c, resolution);
    (here.slope < 0 ? a : b) = here;
    if (std::min(a.value, b.value) + std::max(a.slope * (b.c - a.c), -b.slope * (b.c - a.c)) > 0)
      return no_crossing;  // a convex dip stays above its tangents
    const double next = a.c - a.slope * (b.c - a.c) / (b.slope - a.slope);
    c = std::abs(next - c) > resolution ? next : 0.5 * (a.c + b.c);
    if (b.c - a.c <= resolution) break;
  }
  return no_crossing;
}

}  // namespace flexboom
