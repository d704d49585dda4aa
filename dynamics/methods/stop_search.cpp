#include "dynamics/methods/stop_search.hpp"

#include "fem/base/lanes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexboom {

using Eigen::Index;

double StopSearch::first_crossing(const CollocatedStep& step, std::span<const char> contact,
                                  std::span<const double> levels, std::span<int> crossed) {
  crossings_.clear();
  for (size_t i = 0; i < levels.size(); ++i)
    if (std::isfinite(levels[i]))
      crossings_.add(i, first_crossing(step, static_cast<int>(i), levels[i], contact[i] ? 1 : -1, crossings_.end()));
  crossings_.mark(step.start, step.length, contact, crossed);
  return crossings_.end();
}

namespace {

/// What each of m modes has of an entry of x, beyond where the remainder n holds it. This share is the real part of
/// f (lambda z + n) / lambda. Here f are the eigenvectors at the entry, with the sign of the imaginary parts turned.
/// Real and imaginary parts are halves of 2 m entries. `rate`: the square of the share's size times |lambda|^2. Where
/// lambda = 0 the share is zero.
FLEXBOOM_FOR_EACH_PROCESSOR
void shares_of(Index m, const double* lambda_re, const double* lambda_im, const double* f, const double* z,
               const double* n, double* share, double* rate) {
#pragma GCC ivdep
  for (Index k = 0; k < m; ++k) {
    const double x = lambda_re[k], y = lambda_im[k], square = x * x + y * y, inverse = square > 0 ? 1 / square : 0;
    const double re = x * z[k] - y * z[m + k] + n[k], im = x * z[m + k] + y * z[k] + n[m + k];
    const double r = f[k] * re + f[m + k] * im, i = f[k] * im - f[m + k] * re;
    share[k] = (r * x + i * y) * inverse;
    share[m + k] = (i * x - r * y) * inverse;
    rate[k] = r * r + i * i;
  }
}

/// The sizes of shares together, of modes whose |lambda|^2 is not less than `least`.
FLEXBOOM_FOR_EACH_PROCESSOR
double sum_of_fast(Index m, double least, const double* lambda_re, const double* lambda_im, const double* share) {
  double sum = 0;
  for (Index k = 0; k < m; ++k) {
    const double x = lambda_re[k], y = lambda_im[k],
                 size = std::sqrt(share[k] * share[k] + share[m + k] * share[m + k]);
    sum += x * x + y * y < least ? 0 : size;
  }
  return sum;
}

}  // namespace

void StopSearch::take_shares(const CollocatedStep& step, int entry, int point) {
  const LinearPart& linear = *step.linear;
  const Index m = linear.lambda.size();
  shares_.resize(2 * m), rates_.resize(m);
  shares_of(m, linear.lambda_re().data(), linear.lambda_im().data(), linear.of_modes.col(entry).data(),
            step.Z.col(point).data(), step.N.col(point).data(), shares_.data(), rates_.data());
}

std::complex<double> StopSearch::share_of(Index mode) const { return {shares_[mode], shares_[rates_.size() + mode]}; }

double StopSearch::widest_ripple(const CollocatedStep& step) const {
  const LinearPart& linear = *step.linear;
  return sum_of_fast(rates_.size(), 4 / (step.length * step.length), linear.lambda_re().data(),
                     linear.lambda_im().data(), shares_.data());
}

StopSearch::Ripple StopSearch::ripple(const CollocatedStep& step) {
  const double fastest = rates_.maxCoeff();
  double widest = 0;
  fast_.clear();
  for (Index k = 0; k < rates_.size(); ++k) {
    const std::complex<double> rate = step.length * step.linear->lambda[k];
    if (std::norm(rate) < 4) continue;  // slow
    fast_.push_back({k, rate, share_of(k)});
    widest = std::max(widest, std::norm(fast_.back().share));
  }
  // Less than a fiftieth of the largest rate and of the widest is nothing.
  std::erase_if(fast_,
                [&](const Fast& f) { return rates_[f.mode] < 4e-4 * fastest && std::norm(f.share) < 4e-4 * widest; });
  Ripple r;
  for (const Fast& f : fast_) {
    if (f.rate.imag() < 2) continue;
    r.turn = std::max(r.turn, f.rate.imag());
    r.amplitude += std::abs(f.share);
  }
  return r;
}

template <class At>
double StopSearch::crossing_at_places(const CollocatedStep& step, const At& at, const Clearance& from,
                                      const Clearance& to, const Places& places) {
  // The fast ones go on from the first point as by themselves, and drift to where they are at the second; the rest is
  // a cubic.
  const double width = to.c - from.c;
  Clearance slow_from = from, slow_to = to;
  take_shares(step, places.gap, places.to);
  for (Fast& f : fast_) {
    const std::complex<double> there = places.side * share_of(f.mode);
    f.share *= places.side;
    f.factor = std::exp(f.rate * width / static_cast<double>(places.parts));
    slow_from.value -= f.share.real(), slow_from.slope -= (f.rate * f.share).real();
    slow_to.value -= there.real(), slow_to.slope -= (f.rate * there).real();
    f.drift = there - f.share * std::exp(f.rate * width);
  }
  const Hermite slow(slow_from, slow_to);
  const auto nearly = [&](int place) {
    const double s = static_cast<double>(place) / places.parts;
    Clearance r = slow(from.c + s * width);
    for (Fast& f : fast_) {
      f.share *= f.factor;
      r.value += (f.share + s * f.drift).real();
      r.slope += (f.rate * f.share + f.drift / width).real();
    }
    return r;
  };
  const auto exactly = [&](int place) {
    return place == 0 ? from : place == places.parts ? to : at(from.c + width * place / places.parts);
  };
  Clearance here = from;
  for (int place = 1; place <= places.parts; ++place) {
    const Clearance next = place == places.parts ? to : nearly(place);
    if (may_cross(here, next)) {
      int first = std::max(0, place - 2);  // one further on either side, for `nearly`
      Clearance a = exactly(first);
      while (first > 0 && a.value < 0) a = exactly(--first);
      for (int k = first + 1; k <= std::min(places.parts, place + 1); ++k) {
        const Clearance b = exactly(k);
        const double root = crossing_between(at, a, b, places.resolution);
        if (root != no_crossing) return root;
        a = b;
      }
    }
    here = next;
  }
  return no_crossing;
}

/// The first fraction of the step where the gap leaves the side of its flag, or no_crossing: behind `end` nobody asks.
double StopSearch::first_crossing(const CollocatedStep& step, int hinge, double level, double side, double end) {
  const SplitLayout::Coordinate at_stop = gaps_[static_cast<size_t>(hinge)];
  const int gap = at_stop.value, rate = at_stop.rate;
  const LinearPart& linear = *step.linear;
  z_.resize(linear.size());
  const auto at = [&](double c) {
    linear.point(c, step.length, scratch_);
    linear.combine(scratch_, 0, step.Z.col(0), step.M, z_);
    return Clearance{c, side * (linear.of_modes.col(gap).dot(z_) - level),
                     side * step.length * linear.of_modes.col(rate).dot(z_)};
  };
  const auto at_point = [&](int j) {
    return Clearance{collocation::node(j), side * (step.X(gap, j) - level), side * step.length * step.X(rate, j)};
  };
  double nearest = std::numeric_limits<double>::infinity();  // of the points to the level
  for (int j = 0; j < collocation::points; ++j) nearest = std::min(nearest, at_point(j).value);
  take_shares(step, gap, 0);
  const Ripple at_start = nearest > 2 * widest_ripple(step) ? Ripple{} : ripple(step);
  const double resolution = 4e-16 * std::max(1.0, std::abs(step.start) / step.length);
  const auto parts_of = [](const Ripple& r, const Clearance& from, const Clearance& to) {
    constexpr double most = 4096;
    const double turn = r.turn * (to.c - from.c);
    const bool clear = turn < 1 || std::min(from.value, to.value) > 2 * r.amplitude;
    return clear ? 1 : static_cast<int>(std::ceil(std::min(most, turn)));
  };
  Clearance from = at_point(0);
  for (int j = 1; j < collocation::points && from.c <= end; ++j) {
    const Clearance to = at_point(j);
    int parts = parts_of(at_start, from, to);
    if (parts > 1 && j > 1) {
      take_shares(step, gap, j - 1);
      parts = parts_of(ripple(step), from, to);  // what is left of it
    }
    const double root = parts == 1 ? crossing_between(at, from, to, resolution)
                                   : crossing_at_places(step, at, from, to, {gap, j, parts, side, resolution});
    if (root <= 1) return root;
    if (root == crossed_from_the_start) return 0;  // pressed to the other side from rest on the stop
    from = to;
  }
  return no_crossing;
}

}  // namespace flexboom
