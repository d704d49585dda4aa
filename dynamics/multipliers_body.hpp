#pragma once

// Inertial, elastic and gravity forces of one flexible body with its accelerations given. Internal to the redundant
// coordinates.

#include "dynamics/multibody.hpp"
#include "dynamics/multipliers_place.hpp"
#include "reduction/reduced_body.hpp"

#include <vector>

namespace flexboom::redundant {

using spatial::Sym3;

struct BodyData {
  size_t n = 0;
  double m = 0;
  Vec3<double> mc0;
  Sym3<double> J0;
  std::vector<Vec3<double>> Ct, Cr0;
  std::vector<Entry> J1, J2, Cr1;         // components xx, yy, zz, xy, yz, zx; Cr1: x, y, z
  std::vector<Entry> Ct_slope, Cr_slope;  // with geometric stiffness: Ct_k gains this q_l, Cr_k too
  Eigen::MatrixXd Me, Ke, De;
};

/// @throws InputError when geometric stiffness is asked for but the body has none.
BodyData body_data(const ReducedBody&, Stiffening);

/// Inertia of a deformed body (README, "Geometric stiffness in the equations").
template <class T>
struct DeformedBody {
  Vec3<T> mc;
  std::array<T, 6> J;
  std::vector<Vec3<T>> Ct, Cr;  // n each

  explicit DeformedBody(size_t n) : mc{}, J{}, Ct(n), Cr(n) {}
};

template <class T>
void deform(const BodyData& b, const T* q, DeformedBody<T>& d) {
  d.mc = {T(b.mc0.x), T(b.mc0.y), T(b.mc0.z)};
  d.J = {T(b.J0.xx), T(b.J0.yy), T(b.J0.zz), T(b.J0.xy), T(b.J0.yz), T(b.J0.zx)};
  for (size_t k = 0; k < b.n; ++k) {
    d.mc += q[k] * b.Ct[k];
    d.Ct[k] = {T(b.Ct[k].x), T(b.Ct[k].y), T(b.Ct[k].z)};
    d.Cr[k] = {T(b.Cr0[k].x), T(b.Cr0[k].y), T(b.Cr0[k].z)};
  }
  for (const Entry& e : b.Cr1) component(d.Cr[e.l], e.component) += e.value * q[e.k];
  for (const Entry& e : b.J1) d.J[e.component] += e.value * q[e.k];
  for (const Entry& e : b.J2) d.J[e.component] += e.value * (q[e.k] * q[e.l]);
  for (const Entry& e : b.Ct_slope) {
    const T v = e.value * q[e.l];
    component(d.Ct[e.k], e.component) += v;
    component(d.mc, e.component) += 0.5 * (v * q[e.k]);
  }
  for (const Entry& e : b.Cr_slope) component(d.Cr[e.k], e.component) += e.value * q[e.l];
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

/// Left-hand side of FORMULATION 3 less the elastic forces: what external forces must equal. `d` is scratch.
template <class T>
void body_forces(const BodyData& b, const BodyInput<T>& x, DeformedBody<T>& d, Vec3<T>& on_R, Vec3<T>& on_w, T* on_q) {
  const Vec3<T>&w = x.w, a = transposed_product(x.A, x.acceleration);
  const std::array<T, 6> ww = {w.x * w.x,         w.y * w.y,         w.z * w.z,
                               2.0 * (w.x * w.y), 2.0 * (w.y * w.z), 2.0 * (w.z * w.x)};
  deform(b, x.q, d);
  Vec3<T> P{}, Cr_rate{}, Ct_acceleration{}, Cr_acceleration{}, t2{}, w2{};
  std::array<T, 6> J_dot{};
  for (size_t k = 0; k < b.n; ++k) on_q[k] = T(0.0);
  for (const Entry& e : b.J1) {
    J_dot[e.component] += e.value * x.q_dot[e.k];
    on_q[e.k] -= (0.5 * e.value) * ww[e.component];
  }
  for (const Entry& e : b.J2) {  // symmetric in k, l
    const T vq = e.value * x.q[e.l];
    J_dot[e.component] += 2.0 * (vq * x.q_dot[e.k]);
    on_q[e.k] -= vq * ww[e.component];
  }
  Vec3<T> twice = 2.0 * w;
  for (const Entry& e : b.Cr1) on_q[e.k] -= e.value * (component(twice, e.component) * x.q_dot[e.l]);
  for (const Entry& e : b.Ct_slope) component(t2, e.component) += e.value * (x.q_dot[e.k] * x.q_dot[e.l]);
  for (const Entry& e : b.Cr_slope) component(w2, e.component) += e.value * (x.q_dot[e.k] * x.q_dot[e.l]);
  for (size_t k = 0; k < b.n; ++k) {
    P += x.q_dot[k] * d.Ct[k];
    Cr_rate += x.q_dot[k] * d.Cr[k];
    Ct_acceleration += x.q_ddot[k] * d.Ct[k];
    Cr_acceleration += x.q_ddot[k] * d.Cr[k];
    T f = dot(d.Ct[k], a) + dot(d.Cr[k], x.w_dot);
    const auto row = static_cast<Eigen::Index>(k);
    for (size_t l = 0; l < b.n; ++l) {
      const auto column = static_cast<Eigen::Index>(l);
      if (b.Me(row, column) != 0) f += T(b.Me(row, column) * x.q_ddot[l]);
      if (b.Ke(row, column) != 0) f += b.Ke(row, column) * x.q[l];
      if (b.De(row, column) != 0) f += b.De(row, column) * x.q_dot[l];
    }
    on_q[k] += f;
  }
  const Sym3<T> inertia = {d.J[0], d.J[1], d.J[2], d.J[3], d.J[4], d.J[5]};
  const Sym3<T> rate = {J_dot[0], J_dot[1], J_dot[2], J_dot[3], J_dot[4], J_dot[5]};
  // m a + w_dot x mc + Ct q_ddot + w x (w x mc + 2 Ct q_dot) + q_dot^T Ka q_dot
  on_R = x.A * (b.m * a + cross(x.w_dot, d.mc) + Ct_acceleration + cross(w, cross(w, d.mc) + 2.0 * P) + t2);
  // mc x a + J w_dot + Cr q_ddot + w x (J w + Cr q_dot) + J_dot w + q_dot^T Kalpha q_dot
  on_w = cross(d.mc, a) + inertia * x.w_dot + Cr_acceleration + cross(w, inertia * w + Cr_rate) + rate * w + w2;
}

/// Momenta about the BRF origin and kinetic energy, BRF axes; v: velocity of R in them. `d` is scratch.
inline void body_momenta(const BodyData& b, const Vec3<double>& v, const Vec3<double>& w, const double* q,
                         const double* q_dot, DeformedBody<double>& d, Vec3<double>& P, Vec3<double>& H,
                         double& kinetic) {
  deform(b, q, d);
  const Sym3<double> inertia = {d.J[0], d.J[1], d.J[2], d.J[3], d.J[4], d.J[5]};
  P = b.m * v + cross(w, d.mc);
  H = cross(d.mc, v) + inertia * w;
  double modal = 0;
  for (size_t k = 0; k < b.n; ++k) {
    P += q_dot[k] * d.Ct[k];
    H += q_dot[k] * d.Cr[k];
    double p = dot(d.Ct[k], v) + dot(d.Cr[k], w);
    for (size_t l = 0; l < b.n; ++l) p += b.Me(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l)) * q_dot[l];
    modal += q_dot[k] * p;
  }
  kinetic = 0.5 * (dot(v, P) + dot(w, H) + modal);
}

}  // namespace flexboom::redundant
