#include "dynamics/stop_search.hpp"

#include <algorithm>
#include <cmath>

namespace flexboom {

using Eigen::Index;

double StopSearch::first_crossing(const CollocatedStep& step, std::span<const char> contact,
                                  std::span<const char> armed, std::span<int> crossed) {
  roots_.clear();
  double end = 1;
  for (size_t i = 0; i < armed.size(); ++i) {
    if (!armed[i]) continue;
    const double root = first_crossing(step, static_cast<int>(i), contact[i] ? 1 : -1, end);
    if (root > 1) continue;
    roots_.emplace_back(static_cast<int>(i), root);
    end = std::min(end, root);
  }
  // Booms that are alike cross together.
  const double same = (4e-16 * std::abs(step.start) + 1e-14 * step.length) / step.length;
  for (const auto& [i, root] : roots_)
    if (root <= end + same) crossed[static_cast<size_t>(i)] = contact[static_cast<size_t>(i)] ? -1 : 1;
  return end;
}

StopSearch::Ripple StopSearch::ripple(const CollocatedStep& step, int at, int point) {
  const LinearPart& linear = *step.linear;
  const Index m = linear.lambda.size();
  amplitude_.resize(m);
  const auto squared = [](double a, double b) { return a * a + b * b; };
  const auto rate = [&](Index k) { return std::norm(linear.lambda[k]) * amplitude_[k] * amplitude_[k]; };  // squared
  double fastest = 0;
  for (Index k = 0; k < m; ++k) {
    amplitude_[k] = std::sqrt(squared(linear.of_modes(k, at), linear.of_modes(m + k, at)) *
                              squared(step.Z(k, point), step.Z(m + k, point)));
    fastest = std::max(fastest, rate(k));
  }
  Ripple r;
  for (Index k = 0; k < m; ++k) {
    const double turn = linear.lambda[k].imag() * step.length;
    if (turn < 2 || rate(k) < 4e-4 * fastest) continue;  // slow, or less than a fiftieth of the largest rate
    r.turn = std::max(r.turn, turn);
    r.amplitude += amplitude_[k];
  }
  return r;
}

/// The first fraction of the step where the gap leaves the side of its flag, or no_crossing: behind `end` nobody asks.
double StopSearch::first_crossing(const CollocatedStep& step, int hinge, double side, double end) {
  const int gap = layout_.body[static_cast<size_t>(hinge)], rate = layout_.p + layout_.base + gap;
  const LinearPart& linear = *step.linear;
  z_.resize(linear.size());
  const auto by = [&](double c, const GridPoint& point) {
    linear.combine(point, 0, step.Z.col(0), step.M, z_);
    return Clearance{c, side * linear.of_modes.col(gap).dot(z_),
                     side * step.length * linear.of_modes.col(rate).dot(z_)};
  };
  const auto at = [&](double c) {
    linear.point(c, step.length, scratch_);
    return by(c, scratch_);
  };
  const auto at_point = [&](int j) {
    return Clearance{collocation::node(j), side * step.X(gap, j), side * step.length * step.X(rate, j)};
  };
  const Ripple at_start = ripple(step, gap, 0);
  const double resolution = 4e-16 * std::max(1.0, std::abs(step.start) / step.length);
  const auto level_of = [](const Ripple& r, const Clearance& from, const Clearance& to) {
    const double turn = r.turn * (to.c - from.c);
    const bool clear = turn < 1 || std::min(from.value, to.value) > 2 * r.amplitude;
    return clear ? 0 : std::min(6, static_cast<int>(std::ceil(std::log2(turn))));
  };
  Clearance from = at_point(0);
  for (int j = 1; j < collocation::points && from.c <= end; ++j) {
    const Clearance to = at_point(j);
    int level = level_of(at_start, from, to);
    if (level > 0 && j > 1) level = level_of(ripple(step, gap, j - 1), from, to);  // what is left of it
    const std::vector<GridPoint>& between = linear.between(*step.grid, step.length, j, level);
    const int parts = 1 << level;
    for (int part = 1; part <= parts; ++part) {
      const Clearance next =
          part == parts ? to : by(collocation::between(j, part, parts), between[static_cast<size_t>(part) - 1]);
      const double root = crossing_between(at, from, next, resolution);
      if (root <= 1) return root;
      if (root == crossed_from_the_start) return 0;  // pressed to the other side from rest on the stop
      from = next;
    }
  }
  return no_crossing;
}

}  // namespace flexboom
