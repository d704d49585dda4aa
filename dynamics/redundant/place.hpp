#pragma once

// Kinematics of places on flexible bodies, written once for a scalar T. Internal to the redundant coordinates.

#include "dynamics/numerics/dual.hpp"
#include "dynamics/numerics/spatial.hpp"

#include <Eigen/Core>

#include <cmath>
#include <vector>

namespace flexboom::redundant {

using spatial::Mat3;
using spatial::Vec3;

using Lanes = Dual<8>;

inline double value(double a) { return a; }
inline double value(const Lanes& a) { return a.v; }

template <class S, class T>
auto product(const Mat3<S>& a, const Mat3<T>& b) {
  using R = decltype(a.row[0].x * b.row[0].x);
  Mat3<R> c;
  for (size_t i = 0; i < 3; ++i) {
    const Vec3<S>& r = a.row[i];
    c.row[i] = r.x * b.row[0] + r.y * b.row[1] + r.z * b.row[2];
  }
  return c;
}

/// a I + b tilde(v) + c tilde(v)^2.
template <class T>
Mat3<T> isotropic(const T& a, const T& b, const T& c, const Vec3<T>& v) {
  const T square = dot(v, v), d = a - c * square;
  const Vec3<T> bv = b * v, cv = c * v;
  return {{Vec3<T>{d + cv.x * v.x, cv.x * v.y - bv.z, cv.x * v.z + bv.y},
           Vec3<T>{cv.y * v.x + bv.z, d + cv.y * v.y, cv.y * v.z - bv.x},
           Vec3<T>{cv.z * v.x - bv.y, cv.z * v.y + bv.x, d + cv.z * v.z}}};
}

/// sum (-x)^k / (2 k + first)!: sin(a) / a for first = 1, (1 - cos a) / a^2 for 2, (a - sin a) / a^3 for 3, x = a^2.
template <class T>
T rotation_series(const T& x, int first) {
  int terms = 8;  // 0.5^8 / 17! is below round-off
  if (value(x) > 0.5) terms = 24;
  T sum(1.0);
  for (int k = terms; k > 0; --k) {
    const int m = 2 * k + first;
    sum = 1.0 - sum * x * (1.0 / (m * (m - 1)));
  }
  return sum * (first == 1 ? 1.0 : first == 2 ? 0.5 : 1.0 / 6);
}

/// Motion of a body's frame: R and v in inertial axes, w in its own, A: these -> inertial.
template <class T>
struct Frame {
  Vec3<T> R, v, w;
  Mat3<T> A;
};

/// What the elastic coordinates do at a place: displacement S q, rotation vector S_theta q, their rates; BRF axes.
template <class T>
struct Elastic {
  Vec3<T> s, phi, s_dot, phi_dot;
};

/// A non-zero of a matrix of vectors or symmetric tensors, numbered k, l.
struct Entry {
  size_t k = 0, l = 0, component = 0;
  double value = 0;
};

/// Constants of a place.
struct PlaceData {
  int body = -1;
  bool flexible = false;
  Vec3<double> position;
  Mat3<double> axes;                        // place -> BRF, undeformed
  Eigen::Matrix3Xd S, S_theta;              // 3 x n of a flexible place
  std::vector<Entry> S_slope, theta_slope;  // with geometric stiffness: column k gains this q_l
};

/// S and S_theta where the body is deformed, 3 x n each.
struct PlaceShapes {
  Eigen::Matrix3Xd S, S_theta;
};
PlaceShapes shapes_at(const PlaceData&, const double* q);

/// What q and its rates make of a flexible place; all zero of others.
Elastic<double> elastic_at(const PlaceData&, const double* q, const double* q_dot);

/// Second derivatives of S q and S_theta q that remain when q_ddot is zero.
Elastic<double> elastic_bias(const PlaceData&, const double* q_dot);

/// Motion of a place, inertial axes.
template <class T>
struct PlaceMotion {
  Vec3<T> arm, r, r_dot, omega;  // arm: r - R
  Mat3<T> axes;                  // place -> inertial
  Mat3<T> jacobian;              // J_l(phi): rotation of the place in BRF axes = J_l d phi
};

template <class T>
PlaceMotion<T> place_motion(const PlaceData& p, const Frame<T>& f, const Elastic<T>& e) {
  PlaceMotion<T> m;
  Vec3<T> u = {T(p.position.x), T(p.position.y), T(p.position.z)}, u_dot = cross(f.w, p.position);
  Vec3<T> w = f.w;
  if (p.flexible) {
    u += e.s;
    u_dot += cross(f.w, e.s) + e.s_dot;
    const T x = dot(e.phi, e.phi), one(1.0);
    const T b = rotation_series(x, 2);
    m.axes = product(f.A, product(isotropic(one, rotation_series(x, 1), b, e.phi), p.axes));
    m.jacobian = isotropic(one, b, rotation_series(x, 3), e.phi);
    w += m.jacobian * e.phi_dot;
  } else {
    m.axes = product(f.A, p.axes);
  }
  m.arm = f.A * u;
  m.r = f.R + m.arm;
  m.r_dot = f.v + f.A * u_dot;
  m.omega = f.A * w;
  return m;
}

/// Generalised forces on a body: on R (inertial axes), on rotation (BRF axes), on S q and on S_theta q at the place.
template <class T>
struct PlaceForce {
  Vec3<T> R, w, s, phi;
};

/// Of a force and a torque (inertial axes) at a place.
template <class T>
void add_force(const PlaceData& p, const Frame<T>& f, const PlaceMotion<T>& m, const Vec3<T>& force,
               const Vec3<T>& torque, PlaceForce<T>& out) {
  out.R += force;
  out.w += transposed_product(f.A, cross(m.arm, force) + torque);
  if (!p.flexible) return;
  out.s += transposed_product(f.A, force);
  out.phi += transposed_product(m.jacobian, transposed_product(f.A, torque));
}

}  // namespace flexboom::redundant
