#pragma once

#include <cmath>

namespace flexboom {

/// A number with N directional derivatives (forward-mode differentiation): f(Dual) carries f and df exactly, without
/// differences. The equations of motion are written once for a scalar T; T = double gives their value, T = Dual<N> N
/// columns of their Jacobian. N is a power of two: the derivatives are one vector of the compiler. So an operation on
/// all of them is one instruction where the machine has registers that wide.
template <int N>
struct Dual {
  // Aligned as any processor's memory is, whichever one a function is compiled for.
  static constexpr unsigned bytes = sizeof(double) * static_cast<unsigned>(N);
  using Lanes __attribute__((vector_size(bytes), aligned(bytes < 16 ? bytes : 16))) = double;

  double v = 0;
  Lanes d = {};

  Dual() = default;
  Dual(double value) : v(value) {}  // NOLINT(google-explicit-constructor): a constant is a Dual without derivatives
  Dual(double value, const Lanes& derivatives) : v(value), d(derivatives) {}

  Dual& operator+=(const Dual& b) { return *this = *this + b; }
  Dual& operator-=(const Dual& b) { return *this = *this - b; }
  friend Dual operator+(const Dual& a, const Dual& b) { return {a.v + b.v, a.d + b.d}; }
  friend Dual operator-(const Dual& a, const Dual& b) { return {a.v - b.v, a.d - b.d}; }
  friend Dual operator-(const Dual& a) { return {-a.v, -a.d}; }
  friend Dual operator*(const Dual& a, const Dual& b) { return {a.v * b.v, a.d * b.v + a.v * b.d}; }
  friend Dual operator*(double a, const Dual& b) { return {a * b.v, a * b.d}; }
  friend Dual operator*(const Dual& a, double b) { return b * a; }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const double inverse = 1.0 / b.v, ratio = a.v * inverse;
    return {ratio, (a.d - ratio * b.d) * inverse};
  }
};

template <int N>
Dual<N> sin(const Dual<N>& a) {
  using std::cos;
  using std::sin;
  return {sin(a.v), cos(a.v) * a.d};
}

template <int N>
Dual<N> cos(const Dual<N>& a) {
  using std::cos;
  using std::sin;
  return {cos(a.v), -sin(a.v) * a.d};
}

template <int N>
Dual<N> sqrt(const Dual<N>& a) {
  const double root = std::sqrt(a.v);
  return {root, (0.5 / root) * a.d};
}

template <int N>
Dual<N> atan2(const Dual<N>& y, const Dual<N>& x) {
  return {std::atan2(y.v, x.v), (x.v * y.d - y.v * x.d) * (1 / (x.v * x.v + y.v * y.v))};
}

}  // namespace flexboom
