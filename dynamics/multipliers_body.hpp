#pragma once

// Inertial, elastic and gravity forces of one flexible body with its accelerations given. Internal to the redundant
// coordinates.

#include "dynamics/multipliers_place.hpp"
#include "reduction/reduced_body.hpp"

#include <vector>

namespace flexboom::redundant {

using spatial::Sym3;

/// A non-zero of J1, J2 (component xx, yy, zz, xy, yz, zx) or Cr1 (x, y, z).
struct Entry {
  size_t k = 0, l = 0, component = 0;
  double value = 0;
};

struct BodyData {
  size_t n = 0;
  double m = 0;
  Vec3<double> mc0;
  Sym3<double> J0;
  std::vector<Vec3<double>> Ct, Cr0;
  std::vector<Entry> J1, J2, Cr1;
  Eigen::MatrixXd Me, Ke, De;
};

BodyData body_data(const ReducedBody&);

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

/// Left-hand side of FORMULATION 3 less the elastic forces: what external forces must equal. `Cr` is scratch, n.
template <class T>
void body_forces(const BodyData& b, const BodyInput<T>& x, std::vector<Vec3<T>>& Cr, Vec3<T>& on_R, Vec3<T>& on_w,
                 T* on_q) {
  const Vec3<T>&w = x.w, a = transposed_product(x.A, x.acceleration);
  const std::array<T, 6> ww = {w.x * w.x,         w.y * w.y,         w.z * w.z,
                               2.0 * (w.x * w.y), 2.0 * (w.y * w.z), 2.0 * (w.z * w.x)};
  const auto at = [](Vec3<T>& v, size_t i) -> T& { return i == 0 ? v.x : i == 1 ? v.y : v.z; };
  Vec3<T> mc = {T(b.mc0.x), T(b.mc0.y), T(b.mc0.z)}, P{}, Cr_rate{}, Ct_acceleration{}, Cr_acceleration{};
  std::array<T, 6> J = {T(b.J0.xx), T(b.J0.yy), T(b.J0.zz), T(b.J0.xy), T(b.J0.yz), T(b.J0.zx)}, J_dot{};
  for (size_t k = 0; k < b.n; ++k) {
    mc += x.q[k] * b.Ct[k];
    P += x.q_dot[k] * b.Ct[k];
    Ct_acceleration += Vec3<T>{T(x.q_ddot[k] * b.Ct[k].x), T(x.q_ddot[k] * b.Ct[k].y), T(x.q_ddot[k] * b.Ct[k].z)};
    Cr[k] = {T(b.Cr0[k].x), T(b.Cr0[k].y), T(b.Cr0[k].z)};
    on_q[k] = T(0.0);
  }
  for (const Entry& e : b.Cr1) at(Cr[e.l], e.component) += e.value * x.q[e.k];
  for (const Entry& e : b.J1) {
    J[e.component] += e.value * x.q[e.k];
    J_dot[e.component] += e.value * x.q_dot[e.k];
    on_q[e.k] -= (0.5 * e.value) * ww[e.component];
  }
  for (const Entry& e : b.J2) {  // symmetric in k, l
    const T vq = e.value * x.q[e.l];
    J[e.component] += vq * x.q[e.k];
    J_dot[e.component] += 2.0 * (vq * x.q_dot[e.k]);
    on_q[e.k] -= vq * ww[e.component];
  }
  Vec3<T> w2 = 2.0 * w;
  for (const Entry& e : b.Cr1) on_q[e.k] -= e.value * (at(w2, e.component) * x.q_dot[e.l]);
  for (size_t k = 0; k < b.n; ++k) {
    Cr_rate += x.q_dot[k] * Cr[k];
    Cr_acceleration += x.q_ddot[k] * Cr[k];
    T f = dot(b.Ct[k], a) + dot(Cr[k], x.w_dot);
    const auto row = static_cast<Eigen::Index>(k);
    for (size_t l = 0; l < b.n; ++l) {
      const auto column = static_cast<Eigen::Index>(l);
      if (b.Me(row, column) != 0) f += T(b.Me(row, column) * x.q_ddot[l]);
      if (b.Ke(row, column) != 0) f += b.Ke(row, column) * x.q[l];
      if (b.De(row, column) != 0) f += b.De(row, column) * x.q_dot[l];
    }
    on_q[k] += f;
  }
  const Sym3<T> inertia = {J[0], J[1], J[2], J[3], J[4], J[5]};
  const Sym3<T> rate = {J_dot[0], J_dot[1], J_dot[2], J_dot[3], J_dot[4], J_dot[5]};
  // m a + w_dot x mc + Ct q_ddot + w x (w x mc + 2 Ct q_dot)
  on_R = x.A * (b.m * a + cross(x.w_dot, mc) + Ct_acceleration + cross(w, cross(w, mc) + 2.0 * P));
  // mc x a + J w_dot + Cr q_ddot + w x (J w + Cr q_dot) + J_dot w
  on_w = cross(mc, a) + inertia * x.w_dot + Cr_acceleration + cross(w, inertia * w + Cr_rate) + rate * w;
}

}  // namespace flexboom::redundant
