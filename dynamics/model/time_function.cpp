#include "dynamics/model/time_function.hpp"

#include "dynamics/numerics/expression.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <Eigen/SparseCore>
#include <Eigen/SparseLU>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

namespace flexboom {
namespace {

/// The three functions of a TimeFunction from one that returns all: at(t) -> {value, rate, acceleration}.
template <class At>
TimeFunction split(At at) {
  const auto shared = std::make_shared<const At>(std::move(at));
  return {[shared](double t) { return (*shared)(t)[0]; }, [shared](double t) { return (*shared)(t)[1]; },
          [shared](double t) { return (*shared)(t)[2]; }};
}

/// A polynomial of the time since `begin`, to the next piece.
struct Piece {
  double begin = 0;
  std::array<double, 4> c{};  // powers 0 to 3
};

std::array<double, 3> at(const Piece& p, double t) {
  const double s = t - p.begin;
  const auto& c = p.c;
  return {c[0] + s * (c[1] + s * (c[2] + s * c[3])), c[1] + s * (2 * c[2] + s * 3 * c[3]), 2 * c[2] + 6 * s * c[3]};
}

const Piece& piece_at(const std::vector<Piece>& pieces, double t) {
  const auto after = std::ranges::upper_bound(pieces, t, {}, &Piece::begin);
  return after == pieces.begin() ? pieces.front() : *std::prev(after);
}

/// Second derivatives of the not-a-knot cubic spline (of two points a line, of three a parabola).
Eigen::VectorXd spline_curvature(const std::vector<double>& t, const std::vector<double>& y) {
  const auto n = static_cast<int>(t.size());
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd rhs = Eigen::VectorXd::Zero(n);
  const auto h = [&](int i) { return t[static_cast<size_t>(i) + 1] - t[static_cast<size_t>(i)]; };
  const auto slope = [&](int i) { return (y[static_cast<size_t>(i) + 1] - y[static_cast<size_t>(i)]) / h(i); };
  for (int i = 1; i + 1 < n; ++i) {
    entries.insert(entries.end(), {{i, i - 1, h(i - 1)}, {i, i, 2 * (h(i - 1) + h(i))}, {i, i + 1, h(i)}});
    rhs[i] = 6 * (slope(i) - slope(i - 1));
  }
  for (const int end : {0, n - 1}) {
    const int in = end == 0 ? 1 : -1;
    entries.emplace_back(end, end, 1.0);
    if (n == 3) entries.emplace_back(end, 1, -1.0);
    if (n <= 3) continue;
    const double outer = end == 0 ? h(0) : h(n - 2), inner = end == 0 ? h(1) : h(n - 3);
    entries.emplace_back(end, end + in, -(1 + outer / inner));
    entries.emplace_back(end, end + 2 * in, outer / inner);
  }
  Eigen::SparseMatrix<double> A(n, n);
  A.setFromTriplets(entries.begin(), entries.end());
  Eigen::SparseLU<Eigen::SparseMatrix<double>> lu(A);
  if (lu.info() != Eigen::Success) throw NumericalError("table of times: no spline passes through its points");
  return lu.solve(rhs);
}

std::vector<Piece> table_pieces(const TimeTable& table) {
  const std::vector<double>&t = table.time, &y = table.value;
  const Eigen::VectorXd curvature =
      table.interpolation == "cubic" ? spline_curvature(t, y) : Eigen::VectorXd::Zero(std::ssize(t));
  std::vector<Piece> pieces;
  for (size_t i = 0; i + 1 < t.size(); ++i) {
    const double h = t[i + 1] - t[i], M0 = curvature[static_cast<Eigen::Index>(i)],
                 M1 = curvature[static_cast<Eigen::Index>(i) + 1];
    pieces.push_back({t[i], {y[i], (y[i + 1] - y[i]) / h - h * (2 * M0 + M1) / 6, M0 / 2, (M1 - M0) / (6 * h)}});
  }
  return pieces;
}

void check(const TimeTable& table) {
  const auto one_of = [](const std::string& word, const char* a, const char* b, const char* what) {
    require(word == a || word == b,
            fmt::format("table of times: {} '{}' is not known; there are '{}' and '{}'", what, word, a, b));
  };
  one_of(table.interpolation, "cubic", "linear", "interpolation");
  one_of(table.outside, "error", "hold", "outside");
  const size_t n = table.time.size();
  require(n >= 2 && n == table.value.size(),
          fmt::format("table of times: {} times and {} values; at least two rows are needed, each with both", n,
                      table.value.size()));
  for (size_t i = 0; i < n; ++i) {
    require(std::isfinite(table.time[i]) && std::isfinite(table.value[i]),
            fmt::format("table of times, row {}: {} s, {} is not finite", i + 1, table.time[i], table.value[i]));
  }
  for (size_t i = 1; i < n; ++i) {
    require(table.time[i] > table.time[i - 1],
            fmt::format("table of times, row {}: times must ascend, {:.17g} s comes after {:.17g} s", i + 1,
                        table.time[i], table.time[i - 1]));
  }
}

TimeCourse trapezoid(const Manoeuvre& m) {
  const double angle = std::abs(m.angle), sign = std::copysign(1.0, m.angle);
  const double rate = std::min(m.peak_rate, std::sqrt(angle * m.peak_acceleration)), a = m.peak_acceleration;
  const double ramp = rate / a, cruise = rate < m.peak_rate ? 0 : angle / rate - ramp;
  const double t1 = m.start + ramp, t2 = t1 + std::max(0.0, cruise), t3 = t2 + ramp;
  std::vector<Piece> pieces = {{-std::numeric_limits<double>::infinity(), {}},
                               {m.start, {0, 0, sign * a / 2, 0}},
                               {t1, {sign * rate * ramp / 2, sign * rate, 0, 0}},
                               {t2, {m.angle - sign * rate * ramp / 2, sign * rate, -sign * a / 2, 0}},
                               {t3, {m.angle, 0, 0, 0}}};
  TimeCourse c;
  c.corners = {m.start, t1, t2, t3};
  c.corners.erase(std::unique(c.corners.begin(), c.corners.end()), c.corners.end());
  c.function = split([pieces = std::move(pieces)](double t) {
    const Piece& p = piece_at(pieces, t);
    return std::isfinite(p.begin) ? at(p, t) : std::array<double, 3>{};
  });
  return c;
}

/// s = 35 x^4 - 84 x^5 + 70 x^6 - 20 x^7 with s' = 140 x^3 (1 - x)^3, at most 35/16 in the middle, and
/// s'' = 420 x^2 (1 - x)^2 (1 - 2 x), at most 84 / (5 sqrt 5) where x (1 - x) = 1/5.
TimeCourse smooth(const Manoeuvre& m) {
  const double angle = std::abs(m.angle);
  const double T =
      std::max(35.0 / 16 * angle / m.peak_rate, std::sqrt(84 / (5 * std::sqrt(5.0)) * angle / m.peak_acceleration));
  TimeCourse c;
  c.corners = {m.start, m.start + T};
  c.function = split([m, T](double t) -> std::array<double, 3> {
    const double x = (t - m.start) / T, b = x * (1 - x);
    if (x <= 0) return {0, 0, 0};
    if (x >= 1) return {m.angle, 0, 0};
    return {m.angle * x * x * x * x * (35 + x * (-84 + x * (70 - 20 * x))), m.angle / T * 140 * b * b * b,
            m.angle / (T * T) * 420 * b * b * (1 - 2 * x)};
  });
  return c;
}

/// Samples of a function at equal distances.
struct Sampled {
  std::vector<double> value;
  double negligible = 0;

  /// Does the polynomial through five of those from first to last follow the others?
  bool is_smooth(size_t first, size_t last) const {
    constexpr double weights[] = {1, -4, 6, -4, 1}, of_range = 1e-3;
    const size_t quarter = (last - first) / 4;
    const auto [low, high] = std::minmax_element(value.begin() + static_cast<std::ptrdiff_t>(first),
                                                 value.begin() + static_cast<std::ptrdiff_t>(last) + 1);
    const double allowed = std::max(of_range * (*high - *low), negligible);
    for (size_t i = first + 1; i < last; ++i) {
      if ((i - first) % quarter == 0) continue;
      double sum = 0, weight = 0;
      for (size_t j = 0; j < 5; ++j) {
        const size_t node = first + j * quarter;
        const double w = weights[j] / (static_cast<double>(i) - static_cast<double>(node));
        sum += w * value[node], weight += w;
      }
      if (!(std::abs(sum / weight - value[i]) <= allowed)) return false;
    }
    return true;
  }
};

void add_pieces(const std::vector<Sampled>& functions, size_t first, size_t last, std::vector<size_t>& ends) {
  const auto is_smooth = [&](const Sampled& f) { return f.is_smooth(first, last); };
  if (last - first <= 4 || std::ranges::all_of(functions, is_smooth)) {
    ends.push_back(last);
    return;
  }
  const size_t middle = (first + last) / 2;
  add_pieces(functions, first, middle, ends);
  add_pieces(functions, middle, last, ends);
}

}  // namespace

std::vector<double> smooth_pieces(const std::vector<std::function<double(double)>>& functions, double duration,
                                  int samples, double negligible) {
  if (functions.empty()) return {};
  const auto time = [&](size_t i) { return duration * static_cast<double>(i) / samples; };
  std::vector<Sampled> sampled;
  for (const std::function<double(double)>& f : functions) {
    Sampled& s = sampled.emplace_back();
    double largest = 0;
    for (size_t i = 0; i <= static_cast<size_t>(samples); ++i) {
      s.value.push_back(f(time(i)));
      if (std::isfinite(s.value.back())) largest = std::max(largest, std::abs(s.value.back()));
    }
    s.negligible = negligible * largest;
  }
  std::vector<size_t> ends;
  add_pieces(sampled, 0, static_cast<size_t>(samples), ends);
  std::vector<double> times;
  for (const size_t i : ends) times.push_back(time(i));
  return times;
}

TimeCourse time_expression(const std::string& text) {
  TimeCourse c;
  c.function = split([e = Expression(text)](double t) { return e.at(t); });
  return c;
}

TimeCourse time_table(const TimeTable& table) {
  check(table);
  TimeCourse c;
  const double begin = table.time.front(), end = table.time.back();
  const bool hold = table.outside == "hold";
  if (table.interpolation == "linear")
    c.corners = table.time;
  else if (hold)
    c.corners = {begin, end};
  if (!hold) c.begin = begin, c.end = end;
  c.function = split([pieces = table_pieces(table), begin, end, first = table.value.front(), last = table.value.back(),
                      hold](double t) -> std::array<double, 3> {
    if (t >= begin && t <= end) return at(piece_at(pieces, t), t);
    if (!hold)
      throw InputError(
          fmt::format("table of times: it ends at {:g} s and {:g} s, and {:g} s was asked for; make it "
                      "longer or set outside = \"hold\"",
                      begin, end, t));
    return {t < begin ? first : last, 0, 0};
  });
  return c;
}

TimeCourse rest_to_rest(const Manoeuvre& m) {
  require(m.profile == "trapezoid" || m.profile == "smooth",
          fmt::format("manoeuvre: profile '{}' is not known; there are 'trapezoid' and 'smooth'", m.profile));
  require(m.peak_rate > 0 && m.peak_acceleration > 0 && std::isfinite(m.angle) && std::isfinite(m.start),
          "manoeuvre: peak rate and peak acceleration must be positive, angle and start finite");
  if (m.angle == 0) return time_table({{m.start, m.start + 1}, {0, 0}, "linear", "hold"});
  return m.profile == "smooth" ? smooth(m) : trapezoid(m);
}

}  // namespace flexboom
