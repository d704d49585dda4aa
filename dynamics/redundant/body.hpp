#pragma once

// Inertial, elastic and gravity forces of one flexible body with its accelerations given. Internal to the redundant
// coordinates.

#include "dynamics/model/multibody.hpp"
#include "dynamics/redundant/place.hpp"
#include "reduction/body/reduced_body.hpp"

#include <vector>

namespace flexboom::redundant {

using spatial::Sym3;

struct BodyData {
  size_t n = 0,
         shapes = 0;  // coordinates; shapes, of which those beyond n follow the coordinates (geometric stiffness)
  double m = 0;
  Vec3<double> mc0;
  Sym3<double> J0;
  std::vector<Vec3<double>> Ct, Cr0;  // of all shapes, as the integrals below
  std::vector<Entry> J1, J2, Cr1;     // components xx, yy, zz, xy, yz, zx; Cr1: x, y, z
  Eigen::MatrixXd Me, Ke, De;         // n x n
  std::vector<Entry> follow;          // shape n + component moves by 1/2 sum value q_k q_l
  Eigen::MatrixXd Me_follow;          // (shapes - n) x n
};

/// @throws InputError when geometric stiffness is asked for but the body has none.
BodyData body_data(const ReducedBody&, Stiffening);

/// A deformed body (README, "Geometric stiffness in the equations"). Vectors over all shapes but for `slope`.
template <class T>
struct DeformedBody {
  Vec3<T> mc{};
  std::array<T, 6> J{};
  std::vector<Vec3<T>> Cr;
  std::vector<T> q, q_dot, q_ddot, on_q;
  std::vector<T> slope;  // d q_a / d q_k of what follows, (shapes - n) x n by rows

  explicit DeformedBody(const BodyData& b)
      : Cr(b.shapes), q(b.shapes), q_dot(b.shapes), q_ddot(b.shapes), on_q(b.shapes), slope((b.shapes - b.n) * b.n) {}
};

/// Sets mc, J, Cr, q and slope.
template <class T>
void deform(const BodyData& b, const T* q, DeformedBody<T>& d) {
  for (size_t k = 0; k < b.n; ++k) d.q[k] = q[k];
  for (size_t a = b.n; a < b.shapes; ++a) d.q[a] = T(0.0);
  for (T& s : d.slope) s = T(0.0);
  for (const Entry& e : b.follow) {
    const T v = e.value * q[e.l];
    d.slope[e.component * b.n + e.k] += v;
    d.q[b.n + e.component] += 0.5 * (v * q[e.k]);
  }
  d.mc = {T(b.mc0.x), T(b.mc0.y), T(b.mc0.z)};
  d.J = {T(b.J0.xx), T(b.J0.yy), T(b.J0.zz), T(b.J0.xy), T(b.J0.yz), T(b.J0.zx)};
  for (size_t k = 0; k < b.shapes; ++k) {
    d.mc += d.q[k] * b.Ct[k];
    d.Cr[k] = {T(b.Cr0[k].x), T(b.Cr0[k].y), T(b.Cr0[k].z)};
  }
  for (const Entry& e : b.Cr1) component(d.Cr[e.l], e.component) += e.value * d.q[e.k];
  for (const Entry& e : b.J1) d.J[e.component] += e.value * d.q[e.k];
  for (const Entry& e : b.J2) d.J[e.component] += e.value * (d.q[e.k] * d.q[e.l]);
}

/// Rates of the shapes that follow, from those of the coordinates; after deform.
template <class T>
void set_rates(const BodyData& b, const T* q_dot, DeformedBody<T>& d) {
  for (size_t k = 0; k < b.n; ++k) d.q_dot[k] = q_dot[k];
  for (size_t a = b.n; a < b.shapes; ++a) {
    d.q_dot[a] = T(0.0);
    for (size_t k = 0; k < b.n; ++k) d.q_dot[a] += d.slope[(a - b.n) * b.n + k] * q_dot[k];
  }
}

/// Accelerations likewise; after set_rates.
template <class T>
void set_accelerations(const BodyData& b, const double* q_ddot, DeformedBody<T>& d) {
  for (size_t k = 0; k < b.n; ++k) d.q_ddot[k] = T(q_ddot[k]);
  for (size_t a = b.n; a < b.shapes; ++a) {
    d.q_ddot[a] = T(0.0);
    for (size_t k = 0; k < b.n; ++k) d.q_ddot[a] += q_ddot[k] * d.slope[(a - b.n) * b.n + k];
  }
  for (const Entry& e : b.follow) d.q_ddot[b.n + e.component] += e.value * (d.q_dot[e.k] * d.q_dot[e.l]);
}

/// Row k of the mass matrix of the shapes times a vector over them. What follows is orthogonal, with mean square 1.
template <class T>
T mass_times(const BodyData& b, size_t k, const std::vector<T>& v) {
  T sum = k < b.n ? T(0.0) : b.m * v[k];
  const auto at = [](size_t i) { return static_cast<Eigen::Index>(i); };
  if (k < b.n) {
    for (size_t l = 0; l < b.n; ++l)
      if (const double Me = b.Me(at(k), at(l)); Me != 0) sum += Me * v[l];
    for (size_t a = b.n; a < b.shapes; ++a) sum += b.Me_follow(at(a - b.n), at(k)) * v[a];
  } else {
    for (size_t l = 0; l < b.n; ++l) sum += b.Me_follow(at(k - b.n), at(l)) * v[l];
  }
  return sum;
}

/// What acts on the shapes, on the coordinates that they follow.
template <class T>
T projected(const BodyData& b, size_t k, const std::vector<T>& on_shapes, const std::vector<T>& slope) {
  T sum = on_shapes[k];
  for (size_t a = b.n; a < b.shapes; ++a) sum += slope[(a - b.n) * b.n + k] * on_shapes[a];
  return sum;
}

/// Motion of a body; q and q_dot may carry derivatives, accelerations never do. acceleration: of R less gravity,
/// inertial axes.
template <class T>
struct BodyInput {
  Mat3<T> A;
  Vec3<T> w;
  const T *q = nullptr, *q_dot = nullptr;
  Vec3<double> acceleration, w_dot;
  const double* q_ddot = nullptr;
};

/// Left-hand side of the equations of one body (README, "Equations of motion") less the elastic forces: what external
/// forces must equal. `d` is scratch.
template <class T>
void body_forces(const BodyData& b, const BodyInput<T>& x, DeformedBody<T>& d, Vec3<T>& on_R, Vec3<T>& on_w, T* on_q) {
  const Vec3<T>&w = x.w, a = transposed_product(x.A, x.acceleration);
  const std::array<T, 6> ww = {w.x * w.x,         w.y * w.y,         w.z * w.z,
                               2.0 * (w.x * w.y), 2.0 * (w.y * w.z), 2.0 * (w.z * w.x)};
  deform(b, x.q, d);
  set_rates(b, x.q_dot, d);
  set_accelerations(b, x.q_ddot, d);
  Vec3<T> P{}, Cr_rate{}, Ct_acceleration{}, Cr_acceleration{};
  std::array<T, 6> J_dot{};
  for (size_t k = 0; k < b.shapes; ++k) d.on_q[k] = mass_times(b, k, d.q_ddot);
  for (const Entry& e : b.J1) {
    J_dot[e.component] += e.value * d.q_dot[e.k];
    d.on_q[e.k] -= (0.5 * e.value) * ww[e.component];
  }
  for (const Entry& e : b.J2) {  // symmetric in k, l
    const T vq = e.value * d.q[e.l];
    J_dot[e.component] += 2.0 * (vq * d.q_dot[e.k]);
    d.on_q[e.k] -= vq * ww[e.component];
  }
  Vec3<T> twice = 2.0 * w;
  for (const Entry& e : b.Cr1) d.on_q[e.k] -= e.value * (component(twice, e.component) * d.q_dot[e.l]);
  for (size_t k = 0; k < b.shapes; ++k) {
    P += d.q_dot[k] * b.Ct[k];
    Cr_rate += d.q_dot[k] * d.Cr[k];
    Ct_acceleration += d.q_ddot[k] * b.Ct[k];
    Cr_acceleration += d.q_ddot[k] * d.Cr[k];
    d.on_q[k] += dot(b.Ct[k], a) + dot(d.Cr[k], x.w_dot);
  }
  for (size_t k = 0; k < b.n; ++k) {
    T f = projected(b, k, d.on_q, d.slope);
    const auto row = static_cast<Eigen::Index>(k);
    for (size_t l = 0; l < b.n; ++l) {
      const auto column = static_cast<Eigen::Index>(l);
      if (b.Ke(row, column) != 0) f += b.Ke(row, column) * x.q[l];
      if (b.De(row, column) != 0) f += b.De(row, column) * x.q_dot[l];
    }
    on_q[k] = f;
  }
  const Sym3<T> inertia = {d.J[0], d.J[1], d.J[2], d.J[3], d.J[4], d.J[5]};
  const Sym3<T> rate = {J_dot[0], J_dot[1], J_dot[2], J_dot[3], J_dot[4], J_dot[5]};
  // m a + w_dot x mc + Ct q_ddot + w x (w x mc + 2 Ct q_dot)
  on_R = x.A * (b.m * a + cross(x.w_dot, d.mc) + Ct_acceleration + cross(w, cross(w, d.mc) + 2.0 * P));
  // mc x a + J w_dot + Cr q_ddot + w x (J w + Cr q_dot) + J_dot w
  on_w = cross(d.mc, a) + inertia * x.w_dot + Cr_acceleration + cross(w, inertia * w + Cr_rate) + rate * w;
}

/// Momenta about the BRF origin and kinetic energy, BRF axes; v: velocity of R in them. `d` is scratch.
inline void body_momenta(const BodyData& b, const Vec3<double>& v, const Vec3<double>& w, const double* q,
                         const double* q_dot, DeformedBody<double>& d, Vec3<double>& P, Vec3<double>& H,
                         double& kinetic) {
  deform(b, q, d);
  set_rates(b, q_dot, d);
  const Sym3<double> inertia = {d.J[0], d.J[1], d.J[2], d.J[3], d.J[4], d.J[5]};
  P = b.m * v + cross(w, d.mc);
  H = cross(d.mc, v) + inertia * w;
  double modal = 0;
  for (size_t k = 0; k < b.shapes; ++k) {
    P += d.q_dot[k] * b.Ct[k];
    H += d.q_dot[k] * d.Cr[k];
    modal += d.q_dot[k] * (dot(b.Ct[k], v) + dot(d.Cr[k], w) + mass_times(b, k, d.q_dot));
  }
  kinetic = 0.5 * (dot(v, P) + dot(w, H) + modal);
}

}  // namespace flexboom::redundant
