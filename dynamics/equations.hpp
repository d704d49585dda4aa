#pragma once

// The equations of one flexible body on a hinge, written once for constants C (of one body, or of four side by side)
// and a scalar T: C, or C with derivatives (README, "Equations of motion"). Internal to `dynamics`.

#include "dynamics/dual.hpp"
#include "dynamics/gravity_terms.hpp"
#include "dynamics/spatial.hpp"

#include <cmath>
#include <type_traits>
#include <vector>

namespace flexboom::equations {

/// One non-zero of J1 (component: xx, yy, zz, xy, yz, zx), J2 (the same) or Cr1 (component: x, y, z). A straight boom
/// that bends in one plane has a handful, a general body n^2 times six: the loops run over what the body has.
template <class C>
struct TermOf {
  int k = 0, l = 0, component = 0;
  C value = 0;
};
using Term = TermOf<double>;

/// Constants of one appendage, packed for the inner loop. Arrays over modes are contiguous.
template <class C>
struct BodyOf {
  int n = 0;
  C m = 0;
  Vec3<C> mc0;
  Sym3<C> J0;
  std::vector<Vec3<C>> Ct, Cr0;        // n
  std::vector<TermOf<C>> Cr1, J1, J2;  // non-zeros
  std::vector<C> Ke, De, Me;           // n x n
  std::vector<C> Me_inverse;           // n x n
  bool diagonal = false;               // Ke, De and Me are diagonal: modes, no constraint shapes
  std::vector<Vec3<C>> Gt;             // Me^-1 Ct^T, n
  Sym3<C> Ctt;                         // Ct Me^-1 Ct^T

  size_t row_begin(size_t k) const { return diagonal ? k : 0; }
  size_t row_end(size_t k) const { return diagonal ? k + 1 : static_cast<size_t>(n); }

  Vec3<C> d;  // hinge point, hub axes
  Mat3<C> B;  // columns stowed, outward, stowed x outward: boom axes at Theta = 0 -> hub axes
  C cos_threshold = 0, sin_threshold = 0;
  C stiffness = 0, preload = 0;  // spring torque = preload - stiffness Delta
  C damping = 0, stop_stiffness = 0;
};
using Body = BodyOf<double>;

/// Quantities of one body that the second sweep needs again.
template <class T>
struct BodyScratch {
  Mat3<T> A;                // boom -> hub axes
  std::vector<Vec3<T>> Cr;  // Cr(q), n
  std::vector<Vec3<T>> Gw;  // Me^-1 Cr^T, n
  std::vector<T> b, g;      // modal force and Me^-1 of it, n
  Vec3<T> t0, w0;           // hinge row after elimination of q
  T b0{}, inverse_J_left{};
  GravityLoad<T> gravity;  // in a field only

  explicit BodyScratch(size_t n = 0) : Cr(n), Gw(n), b(n), g(n) {}
};

/// Mass matrix (symmetric, in blocks of translation and rotation) and force of the hub with everything condensed to it,
/// hub axes.
template <class T>
struct HubSystem {
  Sym3<T> tt, ww;
  Mat3<T> tw;
  Vec3<T> ft, fw;

  HubSystem& operator+=(const HubSystem& b) {
    tt += b.tt, ww += b.ww, ft += b.ft, fw += b.fw;
    for (size_t i = 0; i < 3; ++i) tw.row[i] += b.tw.row[i];
    return *this;
  }
};

/// A constant as a number with derivatives.
template <class T, class C>
Vec3<T> lift(const Vec3<C>& a) {
  return {T(a.x), T(a.y), T(a.z)};
}
template <class T, class C>
Sym3<T> lift(const Sym3<C>& a) {
  return {T(a.xx), T(a.yy), T(a.zz), T(a.xy), T(a.yz), T(a.zx)};
}

/// A (v) A^T of a symmetric matrix.
template <class T>
Sym3<T> rotate(const Mat3<T>& A, const Sym3<T>& S) {
  const Vec3<T> r0 = S * A.row[0], r1 = S * A.row[1], r2 = S * A.row[2];
  return {dot(A.row[0], r0), dot(A.row[1], r1), dot(A.row[2], r2),
          dot(A.row[0], r1), dot(A.row[1], r2), dot(A.row[2], r0)};
}

/// A S A^T of a general matrix.
template <class T>
Mat3<T> rotate(const Mat3<T>& A, const Mat3<T>& S) {
  Mat3<T> r;
  for (size_t j = 0; j < 3; ++j) {
    const Vec3<T> c = S * A.row[j];  // S A^T, column j
    const T x = dot(A.row[0], c), y = dot(A.row[1], c), z = dot(A.row[2], c);
    (j == 0 ? r.row[0].x : j == 1 ? r.row[0].y : r.row[0].z) = x;
    (j == 0 ? r.row[1].x : j == 1 ? r.row[1].y : r.row[1].z) = y;
    (j == 0 ? r.row[2].x : j == 1 ? r.row[2].y : r.row[2].z) = z;
  }
  return r;
}

/// a -= u v^T
template <class T, class S>
void subtract_product(Mat3<T>& a, const Vec3<S>& u, const Vec3<T>& v) {
  a.row[0] -= u.x * v;
  a.row[1] -= u.y * v;
  a.row[2] -= u.z * v;
}

/// Boom axes -> hub axes at gap Delta: B Rz(threshold + Delta).
template <class C, class T>
Mat3<T> boom_axes(const BodyOf<C>& body, const T& gap) {
  using std::cos;
  using std::sin;
  const T cd = cos(gap), sd = sin(gap);
  const T c = body.cos_threshold * cd - body.sin_threshold * sd;
  const T s = body.sin_threshold * cd + body.cos_threshold * sd;
  Mat3<T> A;
  for (size_t i = 0; i < 3; ++i) {
    const Vec3<C>& b = body.B.row[i];
    A.row[i] = {b.x * c + b.y * s, b.y * c - b.x * s, T(b.z)};
  }
  return A;
}

/// Torque of the hinge along +Theta (eqs. 16-19). `closed`: 1 where the stop is, else 0.
template <class C, class T>
T hinge_torque(const BodyOf<C>& body, const T& gap, const T& rate, const C& closed) {
  const C k = body.stiffness + closed * body.stop_stiffness;
  return body.preload - k * gap - body.damping * rate;
}

/// Inertia of the deformed body: mc(q), J(q), Jdot; Cr(q) goes to the scratch.
template <class T>
struct Inertia {
  Vec3<T> mc;
  Sym3<T> J, J_dot;
};

template <class C, class T>
Inertia<T> inertia_at(const BodyOf<C>& body, const T* q, const T* q_dot, BodyScratch<T>& s) {
  Inertia<T> r;
  r.mc = lift<T>(body.mc0);
  r.J = lift<T>(body.J0);
  for (size_t k = 0; k < static_cast<size_t>(body.n); ++k) {
    r.mc += q[k] * body.Ct[k];
    s.Cr[k] = lift<T>(body.Cr0[k]);
  }
  for (const TermOf<C>& t : body.Cr1) component(s.Cr[static_cast<size_t>(t.l)], t.component) += t.value * q[t.k];
  for (const TermOf<C>& t : body.J1) {
    component(r.J, t.component) += t.value * q[t.k];
    component(r.J_dot, t.component) += t.value * q_dot[t.k];
  }
  for (const TermOf<C>& t : body.J2) {  // symmetric in k, l: d/dt(q_k q_l) summed over both is 2 q_dot_k q_l
    const T vq = t.value * q[t.l];
    component(r.J, t.component) += vq * q[t.k];
    component(r.J_dot, t.component) += 2.0 * (vq * q_dot[t.k]);
  }
  return r;
}

/// Forces of structure and damping, -Ke q - De q_dot.
template <class C, class T>
void elastic_forces(const BodyOf<C>& body, const T* q, const T* q_dot, T* b) {
  const auto n = static_cast<size_t>(body.n);
  for (size_t k = 0; k < n; ++k) {
    T f = T(0.0);
    for (size_t l = body.row_begin(k); l < body.row_end(k); ++l)
      f -= body.Ke[k * n + l] * q[l] + body.De[k * n + l] * q_dot[l];
    b[k] = f;
  }
}

/// Adds the modal forces of the motion, 1/2 w^T dJ/dq_k w + 2 w . (Cr1[k] q_dot) (README, "Equations of motion"), of
/// one body with angular velocity w in its own axes.
template <class C, class T>
void add_inertial_forces(const BodyOf<C>& body, const Vec3<T>& w, const T* q, const T* q_dot, T* b) {
  const T ww[] = {w.x * w.x, w.y * w.y, w.z * w.z, 2.0 * (w.x * w.y), 2.0 * (w.y * w.z), 2.0 * (w.z * w.x)};
  for (const TermOf<C>& t : body.J1) b[t.k] += (0.5 * t.value) * ww[t.component];
  for (const TermOf<C>& t : body.J2) b[t.k] += t.value * (q[t.l] * ww[t.component]);
  const T* const wi[] = {&w.x, &w.y, &w.z};
  for (const TermOf<C>& t : body.Cr1) b[t.k] += (2.0 * t.value) * (*wi[t.component] * q_dot[t.l]);
}

/// Both, to the scratch.
template <class C, class T>
void modal_forces(const BodyOf<C>& body, const Vec3<T>& w, const T* q, const T* q_dot, BodyScratch<T>& s) {
  elastic_forces(body, q, q_dot, s.b.data());
  add_inertial_forces(body, w, q, q_dot, s.b.data());
}

/// Adds gravity to force, torque and modal forces (`s.b`) of one body in its own axes: m a + G mc, mc x a + axial(G J),
/// Ct^T a - 1/2 G : dJ/dq_k. `field`: about the hub's origin, hub axes; w: of the body; Ct_rate = Ct q_dot.
template <class C>
void add_gravity(const BodyOf<C>& body, const Gravity<double>& field, const Vec3<C>& w_hub, const Vec3<C>& w,
                 const C* q, const Inertia<C>& inertia, const Vec3<C>& Ct_rate, BodyScratch<C>& s, Vec3<C>& ft,
                 Vec3<C>& fw) {
  const Gravity<C> here = field.at(body.d, s.A);
  const Vec3<C>& a = here.acceleration;
  const Sym3<C>& G = here.gradient;
  const Vec3<C> force = body.m * a + G * inertia.mc;
  const Vec3<C> torque = cross(inertia.mc, a) + gradient_torque(G, inertia.J);
  ft += force;
  fw += torque;
  const C g[] = {G.xx, G.yy, G.zz, 2.0 * G.xy, 2.0 * G.yz, 2.0 * G.zx};
  for (size_t k = 0; k < static_cast<size_t>(body.n); ++k) s.b[k] += dot(body.Ct[k], a);
  for (const TermOf<C>& t : body.J1) s.b[static_cast<size_t>(t.k)] -= 0.5 * t.value * g[t.component];
  for (const TermOf<C>& t : body.J2) s.b[static_cast<size_t>(t.k)] -= t.value * q[t.l] * g[t.component];
  s.gravity.force = s.A * force;
  s.gravity.power = dot(s.gravity.force, cross(w_hub, body.d)) + dot(torque, w) + dot(a, Ct_rate) -
                    0.5 * contraction(G, inertia.J_dot);
}

/// First sweep: one body's equations at its own frame acceleration (a, alpha), with q_ddot and Delta_ddot eliminated,
/// added to the hub's. `field`: gravity about the hub's origin, hub axes, or null; of values only, not of derivatives.
template <class C, class T>
void condense(const BodyOf<C>& body, const Vec3<T>& w_hub, const T* p, const T* u, const C& closed, BodyScratch<T>& s,
              bool fixed_hub, HubSystem<T>& hub, [[maybe_unused]] const Gravity<double>* field = nullptr) {
  const auto n = static_cast<size_t>(body.n);
  const T* q = p + 1;
  const T* q_dot = u + 1;
  const T rate = u[0];
  s.A = boom_axes(body, p[0]);

  // Angular velocity of the boom, and its frame acceleration when all accelerations of the unknowns are zero.
  const Vec3<T> w_carried = transposed_product(s.A, w_hub);
  Vec3<T> w = w_carried;
  w.z += rate;
  const Vec3<T> a_bias = transposed_product(s.A, cross(w_hub, cross(w_hub, body.d)));
  const Vec3<T> alpha_bias = {rate * w_carried.y, -(rate * w_carried.x), T(0.0)};

  const Inertia<T> inertia = inertia_at(body, q, q_dot, s);
  modal_forces(body, w, q, q_dot, s);

  // Forces less the mass matrix times the bias accelerations (README, "Equations of motion").
  Vec3<T> Ct_rate{}, Cr_rate{};
  for (size_t k = 0; k < n; ++k) {
    Ct_rate += q_dot[k] * body.Ct[k];
    Cr_rate += q_dot[k] * s.Cr[k];
    s.b[k] -= dot(body.Ct[k], a_bias) + dot(s.Cr[k], alpha_bias);
  }
  Vec3<T> ft = -(cross(w, cross(w, inertia.mc) + 2.0 * Ct_rate) + body.m * a_bias + cross(alpha_bias, inertia.mc));
  Vec3<T> fw =
      -(cross(w, inertia.J * w + Cr_rate) + inertia.J_dot * w + cross(inertia.mc, a_bias) + inertia.J * alpha_bias);

  if constexpr (std::is_same_v<T, C>)
    if (field) add_gravity(body, *field, w_hub, w, q, inertia, Ct_rate, s, ft, fw);

  // Eliminate q_ddot, then Delta_ddot.
  s.t0 = {-inertia.mc.y, inertia.mc.x, T(0.0)};
  s.w0 = {inertia.J.zx, inertia.J.yz, inertia.J.zz};
  s.b0 = fw.z + hinge_torque(body, p[0], rate, closed);
  T J_left = inertia.J.zz;
  for (size_t k = 0; k < n; ++k) {
    s.Gw[k] = Vec3<T>{};
    s.g[k] = T(0.0);
    for (size_t l = body.row_begin(k); l < body.row_end(k); ++l) {
      s.Gw[k] += body.Me_inverse[k * n + l] * s.Cr[l];
      s.g[k] += body.Me_inverse[k * n + l] * s.b[l];
    }
    const T c = s.Cr[k].z;
    J_left -= c * s.Gw[k].z;
    s.t0 -= c * body.Gt[k];
    s.w0 -= c * s.Gw[k];
    s.b0 -= c * s.g[k];
  }
  s.inverse_J_left = T(1.0) / J_left;
  if (fixed_hub) return;

  Sym3<T> tt = {T(body.m - body.Ctt.xx), T(body.m - body.Ctt.yy), T(body.m - body.Ctt.zz),
                T(-body.Ctt.xy),         T(-body.Ctt.yz),         T(-body.Ctt.zx)};
  const Vec3<T>& mc = inertia.mc;
  const T zero(0.0);
  Mat3<T> tw = {{Vec3<T>{zero, mc.z, -mc.y}, Vec3<T>{-mc.z, zero, mc.x}, Vec3<T>{mc.y, -mc.x, zero}}};  // -tilde(mc)
  Sym3<T> ww = inertia.J;
  for (size_t k = 0; k < n; ++k) {
    subtract_product(tw, body.Ct[k], s.Gw[k]);
    const Vec3<T>& w_k = s.Cr[k];
    const Vec3<T>& g_k = s.Gw[k];
    ww.xx -= w_k.x * g_k.x, ww.yy -= w_k.y * g_k.y, ww.zz -= w_k.z * g_k.z;
    ww.xy -= w_k.x * g_k.y, ww.yz -= w_k.y * g_k.z, ww.zx -= w_k.z * g_k.x;
    ft -= s.g[k] * body.Ct[k];
    fw -= s.g[k] * w_k;
  }
  subtract_dyad(tt, s.inverse_J_left, s.t0);
  subtract_dyad(ww, s.inverse_J_left, s.w0);
  subtract_product(tw, s.t0, s.inverse_J_left * s.w0);
  const T b_scaled = s.b0 * s.inverse_J_left;
  ft -= b_scaled * s.t0;
  fw -= b_scaled * s.w0;

  // To hub axes and about the hub's origin: a = a_hub - d x omega_dot.
  const Sym3<T> TT = rotate(s.A, tt);
  const Mat3<T> TW = rotate(s.A, tw);
  const Vec3<T> FT = s.A * ft;
  hub.tt += TT;
  hub.ft += FT;
  hub.fw += s.A * fw + cross(body.d, FT);
  hub.ww += rotate(s.A, ww);
  const Mat3<T> T_full = {{Vec3<T>{TT.xx, TT.xy, TT.zx}, Vec3<T>{TT.xy, TT.yy, TT.yz}, Vec3<T>{TT.zx, TT.yz, TT.zz}}};
  // TT d~ has rows (d x row)..: (row . d~ v) = row . (d x v) = (row x d) . v
  Mat3<T> shifted = TW;  // tw - tt d~
  for (size_t i = 0; i < 3; ++i) {
    shifted.row[i] -= cross(T_full.row[i], body.d);
    hub.tw.row[i] += shifted.row[i];
  }
  // ww gains d~ tw + (d~ tw)^T - d~ tt d~ = d~ tw' + (d~ tw)^T with tw' = tw - tt d~, and (d~ tw)^T = -tw^T d~.
  // Column j of tw is (row0_j, row1_j, row2_j); (d~ X)_{ij} = (d x column_j)_i.
  const Vec3<C>& d = body.d;
  const auto shift = [&d](const Mat3<T>& X) {
    return Mat3<T>{{d.y * X.row[2] - d.z * X.row[1], d.z * X.row[0] - d.x * X.row[2], d.x * X.row[1] - d.y * X.row[0]}};
  };
  const Mat3<T> left = shift(shifted), right = shift(TW);
  hub.ww += Sym3<T>{left.row[0].x + right.row[0].x, left.row[1].y + right.row[1].y, left.row[2].z + right.row[2].z,
                    left.row[0].y + right.row[1].x, left.row[1].z + right.row[2].y, left.row[2].x + right.row[0].z};
}

/// Solves the 6 x 6 system of the hub by two 3 x 3 Cholesky factorisations in blocks (LDL^T of the whole, unrolled by a
/// loop).
template <class T>
void solve_hub(const HubSystem<T>& h, Vec3<T>& a, Vec3<T>& alpha) {
  const Mat3<T>& c = h.tw;
  T M[6][6] = {{h.tt.xx},
               {h.tt.xy, h.tt.yy},
               {h.tt.zx, h.tt.yz, h.tt.zz},
               {c.row[0].x, c.row[1].x, c.row[2].x, h.ww.xx},
               {c.row[0].y, c.row[1].y, c.row[2].y, h.ww.xy, h.ww.yy},
               {c.row[0].z, c.row[1].z, c.row[2].z, h.ww.zx, h.ww.yz, h.ww.zz}};
  T x[6] = {h.ft.x, h.ft.y, h.ft.z, h.fw.x, h.fw.y, h.fw.z};
  T inverse[6];
  for (int j = 0; j < 6; ++j) {  // LDL^T: M[i][j] holds L D until column j is done
    inverse[j] = T(1.0) / M[j][j];
    for (int i = j + 1; i < 6; ++i) {
      const T l = M[i][j] * inverse[j];
      for (int k = j + 1; k <= i; ++k) M[i][k] -= l * M[k][j];
      x[i] -= l * x[j];
    }
  }
  for (int j = 5; j >= 0; --j) {
    for (int i = j + 1; i < 6; ++i) x[j] -= M[i][j] * x[i];
    x[j] = x[j] * inverse[j];
  }
  a = {x[0], x[1], x[2]};
  alpha = {x[3], x[4], x[5]};
}

/// Second sweep: what accelerations of the hub add to Delta_ddot and q_ddot of one body.
template <class C, class T>
void respond(const BodyOf<C>& body, const BodyScratch<T>& s, const Vec3<double>& a_hub, const Vec3<double>& alpha_hub,
             T* out) {
  const Vec3<T> a = transposed_product(s.A, lift<C>(a_hub) - cross(body.d, alpha_hub));
  Vec3<T> alpha = transposed_product(s.A, alpha_hub);
  out[0] = -((dot(s.t0, a) + dot(s.w0, alpha)) * s.inverse_J_left);
  alpha.z += out[0];
  for (size_t k = 0; k < static_cast<size_t>(body.n); ++k) out[1 + k] = -(dot(body.Gt[k], a) + dot(s.Gw[k], alpha));
}

/// Second sweep: Delta_ddot and q_ddot of one body from the accelerations of the hub.
template <class C, class T>
void release(const BodyOf<C>& body, const BodyScratch<T>& s, const Vec3<double>& a_hub, const Vec3<double>& alpha_hub,
             T* out) {
  respond(body, s, a_hub, alpha_hub, out);
  const T own = s.b0 * s.inverse_J_left;
  out[0] += own;
  for (size_t k = 0; k < static_cast<size_t>(body.n); ++k) out[1 + k] += s.g[k] - own * s.Gw[k].z;
}

}  // namespace flexboom::equations
