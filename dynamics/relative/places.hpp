#pragma once

// Kinematics of places that move with a flexible body, for a scalar T. Internal to `dynamics`.

#include "dynamics/relative/constants.hpp"

#include <array>
#include <cmath>

namespace flexboom::tree {

/// Translation and rotation: a motion, or a force and a torque.
template <class T>
struct Twist {
  Vec3<T> t, w;

  Twist& operator+=(const Twist& b) {
    t += b.t, w += b.w;
    return *this;
  }
};

inline double value_of(double a) { return a; }
inline Quad value_of(const Quad& a) { return a; }
template <int N>
double value_of(const Dual<N>& a) {
  return a.v;
}

/// Functions of s = theta^2: f1 = sin(theta)/theta, f2 = (1 - cos theta)/s, f3 = (theta - sin theta)/theta^3, and
/// df2/ds, df3/ds.
template <class T>
struct RotationFunctions {
  T f1, f2, f3, f2_slope, f3_slope;

  explicit RotationFunctions(const T& s) {
    if (value_of(s) < 1) {  // series: the first term left out is below 1e-18
      f1 = series(s, 1, false), f2 = series(s, 2, false), f3 = series(s, 3, false);
      f2_slope = series(s, 2, true), f3_slope = series(s, 3, true);
      return;
    }
    using std::cos;
    using std::sin;
    using std::sqrt;
    const T theta = sqrt(s), sine = sin(theta), versine = T(1.0) - cos(theta), inverse = T(1.0) / s;
    f1 = sine / theta;
    f2 = versine * inverse;
    f3 = (theta - sine) / theta * inverse;
    f2_slope = (0.5 * f1 - f2) * inverse;
    f3_slope = 0.5 * (f2 - 3.0 * f3) * inverse;
  }

 private:
  /// sum (-s)^m / (2 m + first)!, or its derivative.
  static T series(const T& s, int first, bool slope) {
    static constexpr auto factorial = [] {
      std::array<double, 24> f{1};
      for (size_t i = 1; i < f.size(); ++i) f[i] = f[i - 1] * static_cast<double>(i);
      return f;
    }();
    T sum(0.0);
    for (int m = 9; m >= (slope ? 1 : 0); --m) {
      const double c = (m % 2 ? -1.0 : 1.0) / factorial[2 * static_cast<size_t>(m) + static_cast<size_t>(first)];
      sum = T(slope ? m * c : c) + s * sum;
    }
    return sum;
  }
};

template <class T, class C>
Mat3<T> lift(const Mat3<C>& a) {
  return {{equations::lift<T>(a.row[0]), equations::lift<T>(a.row[1]), equations::lift<T>(a.row[2])}};
}

/// Four times the same.
inline Vec3<Quad> four(const Vec3<double>& a) { return equations::lift<Quad>(a); }
inline Mat3<Quad> four(const Mat3<double>& a) { return lift<Quad>(a); }

/// The sum of the first `count` lanes.
inline Vec3<double> sum(const Vec3<Quad>& a, int count) {
  return {flexboom::sum(a.x, count), flexboom::sum(a.y, count), flexboom::sum(a.z, count)};
}
inline Sym3<double> sum(const Sym3<Quad>& a, int count) {
  using flexboom::sum;
  return {sum(a.xx, count), sum(a.yy, count), sum(a.zz, count), sum(a.xy, count), sum(a.yz, count), sum(a.zx, count)};
}
inline equations::ArticulatedInertia<double> sum(const equations::ArticulatedInertia<Quad>& a, int count) {
  equations::ArticulatedInertia<double> r;
  r.tt = sum(a.tt, count), r.ww = sum(a.ww, count), r.ft = sum(a.ft, count), r.fw = sum(a.fw, count);
  for (size_t i = 0; i < 3; ++i) r.tw.row[i] = sum(a.tw.row[i], count);
  return r;
}

template <class T, class S>
Mat3<T> product(const Mat3<T>& a, const Mat3<S>& b) {
  Mat3<T> r;
  for (size_t i = 0; i < 3; ++i) r.row[i] = a.row[i].x * b.row[0] + a.row[i].y * b.row[1] + a.row[i].z * b.row[2];
  return r;
}

/// A place relative to the frame of its body, in that frame: accelerations are those that remain when q_ddot is zero.
template <class T>
struct PlaceMotion {
  Vec3<T> r, r_dot, r_ddot;
  Mat3<T> E, turn;  // place -> body axes; the part of it that is elastic
  Vec3<T> w, alpha;

  Vec3<T> acceleration(const Vec3<T>& w_body) const { return cross(w_body, cross(w_body, r) + 2.0 * r_dot) + r_ddot; }
  Vec3<T> angular_acceleration(const Vec3<T>& w_body) const { return alpha + cross(w_body, w); }
};

/// Fills U with the motion of the place per unit of each rate q_dot_k.
template <class T>
void move_place(const PlaceModel& m, const T* q, const T* q_dot, PlaceMotion<T>& s, Twist<T>* U) {
  const size_t n = m.S.size();
  s.r = equations::lift<T>(m.position);
  Vec3<T> theta{}, rate{}, bias{};
  s.r_dot = s.r_ddot = Vec3<T>{};
  for (size_t k = 0; k < n; ++k) {
    U[k] = {equations::lift<T>(m.S[k]), equations::lift<T>(m.S_theta[k])};
    s.r += q[k] * m.S[k];
    theta += q[k] * m.S_theta[k];
  }
  const auto add_slopes = [=](const equations::Rows<double>& slopes, Vec3<T> Twist<T>::*part, Vec3<T>& moved,
                              Vec3<T>& second) {
    for (const equations::RowOf& row : slopes.rows) {
      const T v = slopes.sum(row, q);
      component(U[row.k].*part, row.component) += v;
      component(moved, row.component) += 0.5 * (v * q[row.k]);
      component(second, row.component) += slopes.sum(row, q_dot) * q_dot[row.k];
    }
  };
  add_slopes(m.S_slope, &Twist<T>::t, s.r, s.r_ddot);
  add_slopes(m.theta_slope, &Twist<T>::w, theta, bias);
  for (size_t k = 0; k < n; ++k) s.r_dot += q_dot[k] * U[k].t, rate += q_dot[k] * U[k].w;
  // Rotation exp(tilde(theta)); its angular velocity J theta_dot, J = 1 + f2 tilde(theta) + f3 tilde(theta)^2.
  const T s2 = dot(theta, theta), s2_dot = 2.0 * dot(theta, rate);
  const RotationFunctions<T> f(s2);
  const auto J = [&](const Vec3<T>& v) {
    const Vec3<T> c = cross(theta, v);
    return v + f.f2 * c + f.f3 * cross(theta, c);
  };
  const Vec3<T> c = cross(theta, rate);
  s.w = J(rate);
  s.alpha = J(bias) + (f.f2_slope * s2_dot) * c + f.f3 * cross(rate, c) + (f.f3_slope * s2_dot) * cross(theta, c);
  for (size_t k = 0; k < n; ++k) U[k].w = J(U[k].w);
  const T one(1.0), diagonal = one - f.f2 * s2;  // 1 + f1 tilde(theta) + f2 (theta theta^T - s2)
  const Vec3<T> a = f.f1 * theta, b = f.f2 * theta;
  s.turn = {{Vec3<T>{diagonal + b.x * theta.x, b.x * theta.y - a.z, b.x * theta.z + a.y},
             Vec3<T>{b.y * theta.x + a.z, diagonal + b.y * theta.y, b.y * theta.z - a.x},
             Vec3<T>{b.z * theta.x - a.y, b.z * theta.y + a.x, diagonal + b.z * theta.z}}};
  s.E = product(s.turn, m.axes);
}

/// Of a place that does not move.
template <class T>
void fix_place(const PlaceModel& m, PlaceMotion<T>& s) {
  s.r = equations::lift<T>(m.position);
  s.E = lift<T>(m.axes);
  s.turn = Mat3<T>{{Vec3<T>{T(1.0), T(0.0), T(0.0)}, Vec3<T>{T(0.0), T(1.0), T(0.0)}, Vec3<T>{T(0.0), T(0.0), T(1.0)}}};
  s.r_dot = s.r_ddot = s.w = s.alpha = Vec3<T>{};
}

/// Rotation matrix of a quaternion (w, x, y, z), normalised.
template <class T>
Mat3<T> rotation_of(const T* q) {
  const T two = T(2.0) / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]), one(1.0);
  const T x = two * q[1], y = two * q[2], z = two * q[3];
  return {{Vec3<T>{one - (y * q[2] + z * q[3]), x * q[2] - z * q[0], x * q[3] + y * q[0]},
           Vec3<T>{x * q[2] + z * q[0], one - (x * q[1] + z * q[3]), y * q[3] - x * q[0]},
           Vec3<T>{x * q[3] - y * q[0], y * q[3] + x * q[0], one - (x * q[1] + y * q[2])}}};
}

}  // namespace flexboom::tree
