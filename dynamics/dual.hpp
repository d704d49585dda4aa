#pragma once

#include <cmath>
#include <type_traits>

namespace flexboom {

/// N directions of a V each.
template <int N, class V>
struct Directions {
  V of[N] = {};

  V& operator[](int i) { return of[i]; }
  const V& operator[](int i) const { return of[i]; }
  friend Directions operator+(const Directions& a, const Directions& b) {
    return combined(a, b, [](const V& x, const V& y) { return x + y; });
  }
  friend Directions operator-(const Directions& a, const Directions& b) {
    return combined(a, b, [](const V& x, const V& y) { return x - y; });
  }
  friend Directions operator-(const Directions& a) {
    return combined(a, a, [](const V& x, const V&) { return -x; });
  }
  friend Directions operator*(const Directions& a, const V& b) {
    return combined(a, a, [&b](const V& x, const V&) { return x * b; });
  }
  friend Directions operator*(const V& a, const Directions& b) { return b * a; }

 private:
  template <class F>
  static Directions combined(const Directions& a, const Directions& b, F f) {
    Directions r;
    for (int i = 0; i < N; ++i) r.of[i] = f(a.of[i], b.of[i]);
    return r;
  }
};

/// A number with N directional derivatives (forward-mode differentiation): f(Dual) carries f and df exactly, without
/// differences. The equations of motion are written once for a scalar T; T = double gives their value, T = Dual<N> N
/// columns of their Jacobian. With V = double, N is a power of two: the derivatives are one vector of the compiler, so
/// that an operation on all of them is one instruction where the machine has registers that wide.
template <int N, class V = double>
struct Dual {
  static constexpr bool of_doubles = std::is_same_v<V, double>;
  struct Registers {  // aligned as any processor's memory is, whichever one a function is compiled for
    static constexpr unsigned size = sizeof(double) * static_cast<unsigned>(of_doubles ? N : 1);
    using type __attribute__((vector_size(size), aligned(size < 16 ? size : 16))) = double;
  };
  struct Several {
    using type = Directions<N, V>;
  };
  using Lanes = typename std::conditional_t<of_doubles, Registers, Several>::type;

  V v = 0;
  Lanes d = {};

  Dual() = default;
  Dual(double value) : v(value) {}  // NOLINT(google-explicit-constructor): a constant is a Dual without derivatives
  Dual(const V& value) requires(!of_doubles) : v(value) {}  // NOLINT(google-explicit-constructor)
  Dual(const V& value, const Lanes& derivatives) : v(value), d(derivatives) {}

  Dual& operator+=(const Dual& b) { return *this = *this + b; }
  Dual& operator-=(const Dual& b) { return *this = *this - b; }
  friend Dual operator+(const Dual& a, const Dual& b) { return {a.v + b.v, a.d + b.d}; }
  friend Dual operator-(const Dual& a, const Dual& b) { return {a.v - b.v, a.d - b.d}; }
  friend Dual operator-(const Dual& a) { return {-a.v, -a.d}; }
  friend Dual operator*(const Dual& a, const Dual& b) { return {a.v * b.v, a.d * b.v + a.v * b.d}; }
  friend Dual operator*(const V& a, const Dual& b) { return {a * b.v, a * b.d}; }
  friend Dual operator*(const Dual& a, const V& b) { return b * a; }
  friend Dual operator*(double a, const Dual& b) requires(!of_doubles) { return V(a) * b; }
  friend Dual operator*(const Dual& a, double b) requires(!of_doubles) { return V(b) * a; }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const V inverse = 1.0 / b.v, ratio = a.v * inverse;
    return {ratio, (a.d - ratio * b.d) * inverse};
  }
};

template <int N, class V>
Dual<N, V> sin(const Dual<N, V>& a) {
  using std::cos;
  using std::sin;
  return {sin(a.v), cos(a.v) * a.d};
}

template <int N, class V>
Dual<N, V> cos(const Dual<N, V>& a) {
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
