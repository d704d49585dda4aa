#pragma once

#include <array>
#include <cmath>

namespace flexboom {

/// A number with N directional derivatives (forward-mode differentiation): f(Dual) carries f and df exactly, without differences.
/// The equations of motion are written once for a scalar T; T = double gives their value, T = Dual<N> N columns of their Jacobian.
template <int N>
struct Dual {
  double v = 0;
  std::array<double, N> d{};

  Dual() = default;
  Dual(double value) : v(value) {}  // NOLINT(google-explicit-constructor): a constant is a Dual without derivatives

  Dual& operator+=(const Dual& b) {
    v += b.v;
    for (int i = 0; i < N; ++i) d[i] += b.d[i];
    return *this;
  }
  Dual& operator-=(const Dual& b) {
    v -= b.v;
    for (int i = 0; i < N; ++i) d[i] -= b.d[i];
    return *this;
  }
  friend Dual operator+(Dual a, const Dual& b) { return a += b; }
  friend Dual operator-(Dual a, const Dual& b) { return a -= b; }
  friend Dual operator-(Dual a) {
    a.v = -a.v;
    for (int i = 0; i < N; ++i) a.d[i] = -a.d[i];
    return a;
  }
  friend Dual operator*(const Dual& a, const Dual& b) {
    Dual r;
    r.v = a.v * b.v;
    for (int i = 0; i < N; ++i) r.d[i] = a.d[i] * b.v + a.v * b.d[i];
    return r;
  }
  friend Dual operator*(double a, Dual b) {
    b.v *= a;
    for (int i = 0; i < N; ++i) b.d[i] *= a;
    return b;
  }
  friend Dual operator*(const Dual& a, double b) { return b * a; }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const double inverse = 1 / b.v;
    Dual r;
    r.v = a.v * inverse;
    for (int i = 0; i < N; ++i) r.d[i] = (a.d[i] - r.v * b.d[i]) * inverse;
    return r;
  }
};

template <int N>
Dual<N> sin(const Dual<N>& a) {
  Dual<N> r = std::cos(a.v) * a;
  r.v = std::sin(a.v);
  return r;
}

template <int N>
Dual<N> cos(const Dual<N>& a) {
  Dual<N> r = -std::sin(a.v) * a;
  r.v = std::cos(a.v);
  return r;
}

}  // namespace flexboom
