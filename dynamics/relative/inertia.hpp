#pragma once

// Articulated inertia of one body of a tree at the place where it hangs, for a scalar T. Internal to `dynamics`.

#include "dynamics/relative/scratch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexboom::tree {

template <class T>
Twist<T> operator*(const ArticulatedInertia<T>& I, const Twist<T>& a) {
  return {I.tt * a.t + I.tw * a.w, transposed_product(I.tw, a.t) + I.ww * a.w};
}

template <class T>
T dot(const Twist<T>& a, const Twist<T>& b) {
  return dot(a.t, b.t) + dot(a.w, b.w);
}

/// I -= a b^T, a being a multiple of b: the product is symmetric.
template <class T>
void subtract_outer(ArticulatedInertia<T>& I, const Twist<T>& a, const Twist<T>& b) {
  I.tt.xx -= a.t.x * b.t.x, I.tt.yy -= a.t.y * b.t.y, I.tt.zz -= a.t.z * b.t.z;
  I.tt.xy -= a.t.x * b.t.y, I.tt.yz -= a.t.y * b.t.z, I.tt.zx -= a.t.z * b.t.x;
  I.ww.xx -= a.w.x * b.w.x, I.ww.yy -= a.w.y * b.w.y, I.ww.zz -= a.w.z * b.w.z;
  I.ww.xy -= a.w.x * b.w.y, I.ww.yz -= a.w.y * b.w.z, I.ww.zx -= a.w.z * b.w.x;
  equations::subtract_product(I.tw, a.t, b.w);
}

/// The inertia and force of I in other axes (A: of I -> those) and about another origin (arm: from there to that of I).
template <class T, class R>
ArticulatedInertia<T> shifted(const Mat3<T>& A, const R& arm, const ArticulatedInertia<T>& I) {
  ArticulatedInertia<T> r;
  const Sym3<T>& TT = r.tt = equations::rotate(A, I.tt);
  const Mat3<T> TW = equations::rotate(A, I.tw);
  r.ft = A * I.ft;
  r.fw = A * I.fw + cross(arm, r.ft);
  const Mat3<T> full = {{Vec3<T>{TT.xx, TT.xy, TT.zx}, Vec3<T>{TT.xy, TT.yy, TT.yz}, Vec3<T>{TT.zx, TT.yz, TT.zz}}};
  r.tw = TW;  // tw - tt arm~
  for (size_t i = 0; i < 3; ++i) r.tw.row[i] -= cross(full.row[i], arm);
  // ww + arm~ tw' + (arm~ tw)^T
  const auto left = [&arm](const Mat3<T>& X) {
    return Mat3<T>{{arm.y * X.row[2] - arm.z * X.row[1], arm.z * X.row[0] - arm.x * X.row[2],
                    arm.x * X.row[1] - arm.y * X.row[0]}};
  };
  const Mat3<T> a = left(r.tw), b = left(TW);
  r.ww = equations::rotate(A, I.ww);
  r.ww += Sym3<T>{a.row[0].x + b.row[0].x, a.row[1].y + b.row[1].y, a.row[2].z + b.row[2].z,
                  a.row[0].y + b.row[1].x, a.row[1].z + b.row[2].y, a.row[2].x + b.row[0].z};
  return r;
}

/// Q, Q_dot, Q_ddot and the slopes of a body with second-order displacements.
template <class T>
void follow_coordinates(const Link& link, const T* q, const T* q_dot, SecondOrderScratch<T>& s) {
  const auto n = static_cast<size_t>(link.body.n), r = link.followers();
  for (T& x : s.slope) x = T(0.0);
  for (T& x : s.Q_ddot) x = T(0.0);
  for (const equations::RowOf& row : link.follow.rows) {
    const auto a = static_cast<size_t>(row.component), k = static_cast<size_t>(row.k);
    s.slope[a * n + k] = link.follow.sum(row, q);
    s.Q_ddot[a] += link.follow.sum(row, q_dot) * q_dot[k];
  }
  for (size_t k = 0; k < n; ++k) s.Q[k] = q[k], s.Q_dot[k] = q_dot[k];
  for (size_t a = 0; a < r; ++a) {
    T Q(0.0), Q_dot(0.0);
    for (size_t k = 0; k < n; ++k) Q += s.slope[a * n + k] * q[k], Q_dot += s.slope[a * n + k] * q_dot[k];
    s.Q[n + a] = 0.5 * Q, s.Q_dot[n + a] = Q_dot;
  }
}

/// The inverse of a symmetric positive definite matrix, n x n, by sweeps of its diagonal: loops over whole rows, which
/// fill registers. `row`: n. Returns the least pivot, which is that of L D L^T, over the element of the diagonal that
/// it came from.
template <class T>
double invert(size_t n, const std::vector<T>& matrix, std::vector<T>& row, std::vector<T>& inverse) {
  double least = 1;
  for (size_t i = 0; i < n * n; ++i) inverse[i] = -matrix[i];  // all swept, it is the inverse
  for (size_t j = 0; j < n; ++j) {
    T* const A_j = inverse.data() + j * n;
    least = std::min(least, value_of(A_j[j]) / -value_of(matrix[j * n + j]));
    const T of_pivot = T(-1.0) / A_j[j];
    for (size_t k = 0; k < n; ++k) row[k] = A_j[k];
    for (size_t i = 0; i < n; ++i) {
      if (i == j) continue;
      T* const A_i = inverse.data() + i * n;
      const T share = row[i] * of_pivot;
#pragma GCC ivdep
      for (size_t k = 0; k < n; ++k) A_i[k] += share * row[k];
      A_i[j] = share;
    }
    for (size_t k = 0; k < n; ++k) A_j[k] = row[k] * of_pivot;
    A_j[j] = of_pivot;
  }
  return least;
}

/// Forces on the body about its origin that its own motion causes, beside those of constant shapes.
template <class T>
struct BiasForce {
  Vec3<T> t{}, w{};
};

/// Inertia, Ct(q), Cr(q), Me(q) and modal forces of a body with second-order displacements: those of all its shapes,
/// projected on the coordinates that they follow. So its kinetic energy is a square.
template <class T>
equations::Inertia<T> second_order_body(const Link& link, const Vec3<T>& w, const T* q, const T* q_dot,
                                        SecondOrderScratch<T>& s, equations::BodyScratch<T>& modes,
                                        BiasForce<T>& bias) {
  const auto n = static_cast<size_t>(link.body.n), r = link.followers();
  follow_coordinates(link, q, q_dot, s);
  const equations::Inertia<T> inertia = equations::inertia_at(link.shapes, s.Q.data(), s.Q_dot.data(), s.shapes);
  equations::elastic_forces(link.body, q, q_dot, modes.b.data());
  for (T& f : s.shapes.b) f = T(0.0);
  equations::add_inertial_forces(link.shapes, w, s.Q_dot.data(), s.shapes, s.shapes.b.data());
  for (size_t k = 0; k < n; ++k) {
    s.Ct[k] = equations::lift<T>(link.shapes.Ct[k]);
    modes.Cr[k] = s.shapes.Cr[k];
    modes.b[k] += s.shapes.b[k];
    for (size_t l = 0; l < n; ++l) s.Me[k * n + l] = T(link.body.Me[k * n + l]);
  }
  for (size_t a = 0; a < r; ++a) {
    const Vec3<double>& Ct = link.shapes.Ct[n + a];
    const Vec3<T>& Cr = s.shapes.Cr[n + a];
    const T* slope = s.slope.data() + a * n;
    const double *Me = link.Me_follow.data() + a * n, m = link.body.m;  // followers are orthogonal, mean square 1
    const T force = s.shapes.b[n + a] - m * s.Q_ddot[a];
    bias.t -= s.Q_ddot[a] * Ct;
    bias.w -= s.Q_ddot[a] * Cr;
    for (size_t k = 0; k < n; ++k) {
      s.Ct[k] += slope[k] * Ct;
      modes.Cr[k] += slope[k] * Cr;
      modes.b[k] += slope[k] * force - Me[k] * s.Q_ddot[a];
      const T with_all = Me[k] + m * slope[k], with_own = slope[k];
      T* const Me_k = s.Me.data() + k * n;
#pragma GCC ivdep
      for (size_t l = 0; l <= k; ++l) Me_k[l] += with_all * slope[l] + with_own * Me[l];
    }
  }
  for (size_t k = 0; k < n; ++k)
    for (size_t l = 0; l < k; ++l) s.Me[l * n + k] = s.Me[k * n + l];
  return inertia;
}

/// Adds mass m, inertia and the forces of the motion to s.I; fills mc and J. After Cr.
template <class C, class T>
void add_inertia(const C& mass, const equations::Inertia<T>& inertia, const std::vector<Vec3<C>>& Ct, const T* q_dot,
                 const BiasForce<T>& bias, LinkScratch<T>& s) {
  const Vec3<T>& w = s.w;
  Vec3<T> Ct_rate{}, Cr_rate{};
  for (size_t k = 0; k < Ct.size(); ++k) {
    Ct_rate += q_dot[k] * Ct[k];
    Cr_rate += q_dot[k] * s.modes.Cr[k];
  }
  s.mc = inertia.mc;
  s.J = inertia.J;
  const Vec3<T>& c = s.mc;
  const T zero(0.0), m(mass);
  ArticulatedInertia<T> I = s.I;  // a copy, so that the compiler may keep it in registers
  I.tt += Sym3<T>{m, m, m, zero, zero, zero};
  I.ww += inertia.J;
  I.tw.row[0] += Vec3<T>{zero, c.z, -c.y};  // -tilde(mc)
  I.tw.row[1] += Vec3<T>{-c.z, zero, c.x};
  I.tw.row[2] += Vec3<T>{c.y, -c.x, zero};
  I.ft += bias.t - cross(w, cross(w, c) + 2.0 * Ct_rate);
  I.fw += bias.w - (cross(w, inertia.J * w + Cr_rate) + inertia.J_dot * w);
  s.I = I;
}

/// A body at rest of its modes, by shapes that are constant: inertia, and the forces of its motion; fills mc, J, Cr and
/// the modal forces.
template <class C, class T>
void add_body(const equations::BodyOf<C>& b, const T* q, const T* q_dot, LinkScratch<T>& s) {
  const equations::Inertia<T> inertia = equations::inertia_at(b, q, q_dot, s.modes);
  equations::modal_forces(b, s.w, q, q_dot, s.modes);
  add_inertia(b.m, inertia, b.Ct, q_dot, BiasForce<T>{}, s);
}

/// The same of a link, whatever its shapes.
template <class T>
void add_body(const Link& link, const T* y, LinkScratch<T>& s) {
  const T *q = y + link.q, *q_dot = y + link.q_dot;
  if (!link.second_order) return add_body(link.body, q, q_dot, s);
  BiasForce<T> bias;
  const equations::Inertia<T> inertia = second_order_body(link, s.w, q, q_dot, s.second_order, s.modes, bias);
  add_inertia(T(link.body.m), inertia, s.second_order.Ct, q_dot, bias, s);
}

/// The inverse of a mass matrix Me, n x n: constant, or that of this moment. Row k of it is zero outside begin .. end.
template <class C>
struct InverseOfMe {
  const C* values;
  size_t n;
  bool diagonal;

  size_t begin(size_t k) const { return diagonal ? k : 0; }
  size_t end(size_t k) const { return diagonal ? k + 1 : n; }
  const C* row(size_t k) const { return values + k * n; }
};

template <class C>
InverseOfMe<C> inverse_of_Me(const equations::BodyOf<C>& b) {
  return {b.Me_inverse.data(), static_cast<size_t>(b.n), b.diagonal};
}

/// Eliminates q_ddot by Me^-1. `Ctt`: Ct Me^-1 Ct^T where it is constant, else null.
template <class T, class C>
void eliminate_modes(const InverseOfMe<C>& inverse, const std::vector<Vec3<C>>& Ct, const std::vector<Vec3<C>>& Gt,
                     const Sym3<C>* Ctt, LinkScratch<T>& s) {
  const size_t n = inverse.n;
  equations::BodyScratch<T>& modes = s.modes;
  ArticulatedInertia<T> I = s.I;
  for (size_t k = 0; k < n; ++k) {
    Vec3<T> G{};
    T g = T(0.0);
    const C* row = inverse.row(k);
    for (size_t l = inverse.begin(k); l < inverse.end(k); ++l) {
      G += row[l] * modes.Cr[l];
      g += row[l] * modes.b[l];
    }
    modes.Gw[k] = G;
    modes.g[k] = g;
    const Vec3<T>& w = modes.Cr[k];
    equations::subtract_product(I.tw, Ct[k], G);
    I.ww.xx -= w.x * G.x, I.ww.yy -= w.y * G.y, I.ww.zz -= w.z * G.z;
    I.ww.xy -= w.x * G.y, I.ww.yz -= w.y * G.z, I.ww.zx -= w.z * G.x;
    I.ft -= g * Ct[k];
    I.fw -= g * w;
  }
  if (Ctt != nullptr) {
    const Sym3<C>& c = *Ctt;
    I.tt += Sym3<T>{T(-c.xx), T(-c.yy), T(-c.zz), T(-c.xy), T(-c.yz), T(-c.zx)};
  } else {
    for (size_t k = 0; k < n; ++k) {
      const Vec3<C>&t = Ct[k], &g = Gt[k];
      I.tt +=
          Sym3<T>{T(-(t.x * g.x)), T(-(t.y * g.y)), T(-(t.z * g.z)), T(-(t.x * g.y)), T(-(t.y * g.z)), T(-(t.z * g.x))};
    }
  }
  s.I = I;
}

/// Solves K X = B in place, X over B (rows x columns, by rows); by Gauss, largest pivot of a column.
template <class T>
void solve_in_place(T* K, T* B, size_t rows, size_t columns) {
  using std::abs;
  for (size_t j = 0; j < rows; ++j) {
    size_t pivot = j;
    for (size_t i = j + 1; i < rows; ++i)
      if (abs(value_of(K[i * rows + j])) > abs(value_of(K[pivot * rows + j]))) pivot = i;
    if (pivot != j) {
      for (size_t c = j; c < rows; ++c) std::swap(K[j * rows + c], K[pivot * rows + c]);
      for (size_t c = 0; c < columns; ++c) std::swap(B[j * columns + c], B[pivot * columns + c]);
    }
    const T inverse = T(1.0) / K[j * rows + j];
    for (size_t i = j + 1; i < rows; ++i) {
      const T l = K[i * rows + j] * inverse;
      for (size_t c = j + 1; c < rows; ++c) K[i * rows + c] -= l * K[j * rows + c];
      for (size_t c = 0; c < columns; ++c) B[i * columns + c] -= l * B[j * columns + c];
    }
    K[j * rows + j] = inverse;
  }
  for (size_t j = rows; j-- > 0;)
    for (size_t c = 0; c < columns; ++c) {
      T& x = B[j * columns + c];
      for (size_t i = j + 1; i < rows; ++i) x -= K[j * rows + i] * B[i * columns + c];
      x = x * K[j * rows + j];
    }
}

template <class T>
std::array<T, 6> entries(const Twist<T>& a) {
  return {a.t.x, a.t.y, a.t.z, a.w.x, a.w.y, a.w.z};
}

/// Children that hang on moving places of a body whose modes are already eliminated. Place and child exchange the force
/// F = W' (X A + h) - f'. A is the acceleration of the body, X A + h that of the place without F. W' = (1 + W G)^-1 W
/// is the child's inertia W behind the compliance G of the modes. These are sums of positive terms, however heavy the
/// child.
template <class T, class C>
void add_hung_children(const Link& link, const InverseOfMe<C>& inverse, const std::vector<Vec3<C>>& Gt,
                       LinkScratch<T>& s) {
  const size_t n = inverse.n, slots = static_cast<size_t>(link.slots), size = 6 * slots, columns = size + 1;
  for (size_t i = 0; i < slots; ++i)
    for (size_t k = 0; k < n; ++k) {
      Twist<T>& P = s.P[i * n + k];
      P = {};
      const C* row = inverse.row(k);
      for (size_t l = inverse.begin(k); l < inverse.end(k); ++l) {
        P.t += row[l] * s.U[i * n + l].t;
        P.w += row[l] * s.U[i * n + l].w;
      }
    }
  for (T& w : s.W) w = T(0.0);
  for (size_t i = 0; i < slots; ++i) {
    const ArticulatedInertia<T>& I = s.hung[i];
    const T blocks[6][6] = {
        {I.tt.xx, I.tt.xy, I.tt.zx, I.tw.row[0].x, I.tw.row[0].y, I.tw.row[0].z},
        {I.tt.xy, I.tt.yy, I.tt.yz, I.tw.row[1].x, I.tw.row[1].y, I.tw.row[1].z},
        {I.tt.zx, I.tt.yz, I.tt.zz, I.tw.row[2].x, I.tw.row[2].y, I.tw.row[2].z},
        {I.tw.row[0].x, I.tw.row[1].x, I.tw.row[2].x, I.ww.xx, I.ww.xy, I.ww.zx},
        {I.tw.row[0].y, I.tw.row[1].y, I.tw.row[2].y, I.ww.xy, I.ww.yy, I.ww.yz},
        {I.tw.row[0].z, I.tw.row[1].z, I.tw.row[2].z, I.ww.zx, I.ww.yz, I.ww.zz},
    };
    const std::array<T, 6> f = entries(Twist<T>{I.ft, I.fw});
    for (size_t r = 0; r < 6; ++r) {
      T* row = s.W.data() + (6 * i + r) * columns;
      for (size_t c = 0; c < 6; ++c) row[6 * i + c] = blocks[r][c];
      row[size] = f[r];
    }
    for (size_t j = 0; j < slots; ++j) {  // 1 + W_i G_ij, G_ij = U_i Me^-1 U_j^T
      T G[6][6] = {};
      for (size_t k = 0; k < n; ++k) {
        const std::array<T, 6> u = entries(s.U[i * n + k]), p = entries(s.P[j * n + k]);
        for (size_t r = 0; r < 6; ++r)
          for (size_t c = 0; c < 6; ++c) G[r][c] += u[r] * p[c];
      }
      for (size_t r = 0; r < 6; ++r)
        for (size_t c = 0; c < 6; ++c) {
          T sum = T(i == j && r == c ? 1.0 : 0.0);
          for (size_t m = 0; m < 6; ++m) sum += blocks[r][m] * G[m][c];
          s.K[(6 * i + r) * size + 6 * j + c] = sum;
        }
    }
  }
  solve_in_place(s.K.data(), s.W.data(), size, columns);  // W = [W' | f']

  // [X | h], 6 slots x 7, where X = (1, -tilde(r); 0, 1) - U Me^-1 C^T.
  const auto X = [&](size_t r, size_t c) -> T& { return s.F[r * 7 + c]; };
  for (size_t i = 0; i < slots; ++i) {
    const Vec3<T>& r = s.place[i];
    const T zero(0.0), one(1.0);
    const T rigid[6][7] = {{one, zero, zero, zero, r.z, -r.y, zero},  {zero, one, zero, -r.z, zero, r.x, zero},
                           {zero, zero, one, r.y, -r.x, zero, zero},  {zero, zero, zero, one, zero, zero, zero},
                           {zero, zero, zero, zero, one, zero, zero}, {zero, zero, zero, zero, zero, one, zero}};
    for (size_t a = 0; a < 6; ++a)
      for (size_t c = 0; c < 7; ++c) X(6 * i + a, c) = rigid[a][c];
    for (size_t k = 0; k < n; ++k) {
      const Vec3<T>& w = s.modes.Gw[k];
      const T c[7] = {T(-1.0 * Gt[k].x), T(-1.0 * Gt[k].y), T(-1.0 * Gt[k].z), -w.x, -w.y, -w.z, s.modes.g[k]};
      const std::array<T, 6> u = entries(s.U[i * n + k]);
      for (size_t a = 0; a < 6; ++a)
        for (size_t j = 0; j < 7; ++j) X(6 * i + a, j) += u[a] * c[j];
    }
  }
  // Z = [W' X | W' h - f'], so that F = Z (A, 1); the body feels -X^T F.
  T I[6][7] = {};
  for (size_t r = 0; r < size; ++r)
    for (size_t c = 0; c < 7; ++c) {
      T sum = c == 6 ? -s.W[r * columns + size] : T(0.0);
      for (size_t m = 0; m < size; ++m) sum += s.W[r * columns + m] * X(m, c);
      s.Z[r * 7 + c] = sum;
      for (size_t a = 0; a < 6; ++a) I[a][c] += X(r, a) * sum;
    }
  ArticulatedInertia<T>& to = s.I;
  to.tt += Sym3<T>{I[0][0], I[1][1], I[2][2], I[0][1], I[1][2], I[2][0]};
  to.ww += Sym3<T>{I[3][3], I[4][4], I[5][5], I[3][4], I[4][5], I[5][3]};
  for (size_t r = 0; r < 3; ++r) to.tw.row[r] += Vec3<T>{I[r][3], I[r][4], I[r][5]};
  to.ft -= Vec3<T>{I[0][6], I[1][6], I[2][6]};
  to.fw -= Vec3<T>{I[3][6], I[4][6], I[5][6]};
}

}  // namespace flexboom::tree
