#pragma once

#include <cmath>

namespace flexboom {

/// The same number of four bodies that are computed side by side: one register where the machine has them that wide.
struct alignas(32) Quad {
  static constexpr int width = 4;
  using Lanes __attribute__((vector_size(width * sizeof(double)))) = double;

  Lanes v = {};

  Quad() = default;
  Quad(double a) : v{a, a, a, a} {}  // NOLINT(google-explicit-constructor): a constant is the same for all bodies
  explicit Quad(const Lanes& values) : v(values) {}

  Quad& operator+=(const Quad& b) { return *this = *this + b; }
  Quad& operator-=(const Quad& b) { return *this = *this - b; }
  friend Quad operator+(const Quad& a, const Quad& b) { return Quad(a.v + b.v); }
  friend Quad operator-(const Quad& a, const Quad& b) { return Quad(a.v - b.v); }
  friend Quad operator-(const Quad& a) { return Quad(-a.v); }
  friend Quad operator*(const Quad& a, const Quad& b) { return Quad(a.v * b.v); }
  friend Quad operator/(const Quad& a, const Quad& b) { return Quad(a.v / b.v); }
};

template <class F>
Quad lane_by_lane(const Quad& a, F f) {
  return Quad(Quad::Lanes{f(a.v[0]), f(a.v[1]), f(a.v[2]), f(a.v[3])});
}
inline Quad sin(const Quad& a) {
  return lane_by_lane(a, [](double x) { return std::sin(x); });
}
inline Quad cos(const Quad& a) {
  return lane_by_lane(a, [](double x) { return std::cos(x); });
}

inline double lane(double a, int) { return a; }
inline double lane(const Quad& a, int i) { return a.v[i]; }
inline void set_lane(Quad& a, int i, double value) { a.v[i] = value; }
/// The sum of the first `count` lanes.
inline double sum(const Quad& a, int count) {
  if (count == Quad::width) return (a.v[0] + a.v[1]) + (a.v[2] + a.v[3]);
  double s = 0;
  for (int i = 0; i < count; ++i) s += a.v[i];
  return s;
}

}  // namespace flexboom
