#pragma once

// The equations of one flexible body, written once for constants C (of one body, or of four side by side)
// and a scalar T: C, or C with derivatives (README, "Equations of motion"). Internal to `dynamics`.

#include "dynamics/environment/gravity_terms.hpp"
#include "dynamics/numerics/dual.hpp"
#include "dynamics/numerics/spatial.hpp"
#include "fem/base/lanes.hpp"

#include <algorithm>
#include <tuple>
#include <type_traits>
#include <utility>
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

/// a . x, of n numbers each: in registers of four, as compilers do not change the order of a sum.
[[gnu::always_inline]] inline double dot_of_row(const double* a, const double* x, int n) {
  using Anywhere = Four::Anywhere;
  Four even{}, odd{};
  int i = 0;
  for (; i + 8 <= n; i += 8) {
    even.of += *reinterpret_cast<const Anywhere*>(a + i) * *reinterpret_cast<const Anywhere*>(x + i);
    odd.of += *reinterpret_cast<const Anywhere*>(a + i + 4) * *reinterpret_cast<const Anywhere*>(x + i + 4);
  }
  if (i + 4 <= n) {
    even.of += *reinterpret_cast<const Anywhere*>(a + i) * *reinterpret_cast<const Anywhere*>(x + i);
    i += 4;
  }
  double rest = 0;
  for (; i < n; ++i) rest += a[i] * x[i];
  even.of += odd.of;
  return (even.of[0] + even.of[1]) + (even.of[2] + even.of[3]) + rest;
}

/// A row of sums: entries `begin` to `end` of a `Rows`, whose sum is of `k` and `component`.
struct RowOf {
  int k = 0, component = 0, begin = 0, end = 0;
  int spread = -1, width = 0;  // its place among the spread ones, -1: it is not; from its first l to its last
};

/// Terms in rows, one for each k and component that has any: the sum over l of value * x[l] stays in registers. Rows of
/// many terms that lie close are also kept spread, each value at its l, so that they fill registers.
template <class C>
struct Rows {
  std::vector<RowOf> rows;
  std::vector<int> l;
  std::vector<C> value;
  std::vector<double> spread;  // of one body alone

  Rows() = default;
  explicit Rows(std::vector<TermOf<C>> terms) {
    std::ranges::sort(terms, {}, [](const TermOf<C>& t) { return std::tuple(t.k, t.component, t.l); });
    for (const TermOf<C>& t : terms) {
      const auto at = static_cast<int>(l.size());
      if (rows.empty() || rows.back().k != t.k || rows.back().component != t.component)
        rows.push_back({t.k, t.component, at, at});
      ++rows.back().end;
      l.push_back(t.l), value.push_back(t.value);
    }
    if constexpr (std::is_same_v<C, double>)
      for (RowOf& row : rows) spread_out(row);
  }

  template <class T>
  T sum(const RowOf& row, const T* x) const {
    if constexpr (std::is_same_v<C, double> && std::is_same_v<T, double>)
      if (row.spread >= 0)
        return dot_of_row(spread.data() + row.spread, x + l[static_cast<size_t>(row.begin)], row.width);
    T even(0.0), odd(0.0);  // two chains of additions at a time
    int i = row.begin;
    for (; i + 1 < row.end; i += 2) {
      const auto a = static_cast<size_t>(i);
      even += value[a] * x[l[a]];
      odd += value[a + 1] * x[l[a + 1]];
    }
    if (i < row.end) even += value[static_cast<size_t>(i)] * x[l[static_cast<size_t>(i)]];
    return even + odd;
  }

 private:
  void spread_out(RowOf& row) {
    constexpr int many = 8, close = 3;  // fewer or further apart, a sum one by one is as fast
    const auto at = [&](int i) {
      return static_cast<size_t>(l[static_cast<size_t>(i)] - l[static_cast<size_t>(row.begin)]);
    };
    const auto width = at(row.end - 1) + 1;
    const int count = row.end - row.begin;
    if (count < many || static_cast<int>(width) > close * count) return;
    row.spread = static_cast<int>(spread.size()), row.width = static_cast<int>(width);
    spread.resize(spread.size() + width);
    for (int i = row.begin; i < row.end; ++i)
      spread[static_cast<size_t>(row.spread) + at(i)] = value[static_cast<size_t>(i)];
  }
};

/// Constants of one body, packed for the inner loop. Arrays over modes are contiguous.
template <class C>
struct BodyOf {
  int n = 0;
  C m = 0;
  Vec3<C> mc0;
  Sym3<C> J0;
  std::vector<Vec3<C>> Ct, Cr0;  // n
  Rows<C> J1, J2;                // J1: a row per component, over k in the place of l
  Rows<C> Cr1, Cr1_by_l;         // sums over l; over k, for each l in the place of k
  std::vector<C> Ke, De, Me;     // n x n
  std::vector<C> Me_inverse;     // n x n
  bool diagonal = false;         // Ke, De and Me are diagonal: modes, no constraint shapes
  std::vector<Vec3<C>> Gt;       // Me^-1 Ct^T, n
  Sym3<C> Ctt;                   // Ct Me^-1 Ct^T

  size_t row_begin(size_t k) const { return diagonal ? k : 0; }
  size_t row_end(size_t k) const { return diagonal ? k + 1 : static_cast<size_t>(n); }

  C cos_threshold = 0, sin_threshold = 0;
  C stiffness = 0, preload = 0;  // spring torque = preload - stiffness Delta
  C damping = 0, stop_stiffness = 0;
};
using Body = BodyOf<double>;

/// Quantities of one body that later sweeps need.
template <class T>
struct BodyScratch {
  std::vector<Vec3<T>> Cr;  // Cr(q), n
  std::vector<Vec3<T>> Gw;  // Me^-1 Cr^T, n
  std::vector<T> b, g;      // modal force and Me^-1 of it, n
  std::vector<T> J2_q;      // the rows of J2 times q

  explicit BodyScratch(size_t n = 0, size_t rows = 0) : Cr(n), Gw(n), b(n), g(n), J2_q(rows) {}
};

/// Mass matrix (symmetric, in blocks of translation and rotation) and force of a body, axes of the body. Everything
/// that hangs on the body is condensed to it.
template <class T>
struct ArticulatedInertia {
  Sym3<T> tt, ww;
  Mat3<T> tw;
  Vec3<T> ft, fw;

  ArticulatedInertia& operator+=(const ArticulatedInertia& b) {
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

/// Torque of the hinge along +Theta (eqs. 16-19). `closed`: 1 where the stop is, else 0.
template <class C, class T>
T hinge_torque(const BodyOf<C>& body, const T& gap, const T& rate, const C& closed) {
  const C k = body.stiffness + closed * body.stop_stiffness;
  return body.preload - k * gap - body.damping * rate;
}

/// Inertia of the deformed body: mc(q), J(q), Jdot; Cr(q) and J2 q go to the scratch.
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
  for (const RowOf& row : body.Cr1_by_l.rows)
    component(s.Cr[static_cast<size_t>(row.k)], row.component) += body.Cr1_by_l.sum(row, q);
  for (const RowOf& row : body.J1.rows) {
    component(r.J, row.component) += body.J1.sum(row, q);
    component(r.J_dot, row.component) += body.J1.sum(row, q_dot);
  }
  for (size_t i = 0; i < body.J2.rows.size(); ++i) {  // symmetric in k, l: d/dt(q_k q_l) over both is 2 q_dot_k q_l
    const RowOf& row = body.J2.rows[i];
    const T v = s.J2_q[i] = body.J2.sum(row, q);
    component(r.J, row.component) += v * q[row.k];
    component(r.J_dot, row.component) += 2.0 * (v * q_dot[row.k]);
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

/// Adds scale * 1/2 g : dJ/dq_k to b, g a symmetric matrix by xx, yy, zz, 2 xy, 2 yz, 2 zx. After `inertia_at`.
template <class C, class T>
void add_inertia_slope(const BodyOf<C>& body, double scale, const T (&g)[6], const BodyScratch<T>& s, T* b) {
  for (const RowOf& row : body.J1.rows) {
    const T half = (0.5 * scale) * g[row.component];
    for (int i = row.begin; i < row.end; ++i)
      b[body.J1.l[static_cast<size_t>(i)]] += body.J1.value[static_cast<size_t>(i)] * half;
  }
  for (size_t i = 0; i < body.J2.rows.size(); ++i)
    b[body.J2.rows[i].k] += s.J2_q[i] * (scale * g[body.J2.rows[i].component]);
}

/// Adds the modal forces of the motion, 1/2 w^T dJ/dq_k w + 2 w . (Cr1[k] q_dot) (README, "Equations of motion"), of
/// one body with angular velocity w in its own axes. After `inertia_at`.
template <class C, class T>
void add_inertial_forces(const BodyOf<C>& body, const Vec3<T>& w, const T* q_dot, const BodyScratch<T>& s, T* b) {
  add_inertia_slope(body, 1.0,
                    {w.x * w.x, w.y * w.y, w.z * w.z, 2.0 * (w.x * w.y), 2.0 * (w.y * w.z), 2.0 * (w.z * w.x)}, s, b);
  const T* const wi[] = {&w.x, &w.y, &w.z};
  for (const RowOf& row : body.Cr1.rows) b[row.k] += (2.0 * *wi[row.component]) * body.Cr1.sum(row, q_dot);
}

/// Both, to the scratch.
template <class C, class T>
void modal_forces(const BodyOf<C>& body, const Vec3<T>& w, const T* q, const T* q_dot, BodyScratch<T>& s) {
  elastic_forces(body, q, q_dot, s.b.data());
  add_inertial_forces(body, w, q_dot, s, s.b.data());
}

/// Accelerations of a body that nothing holds, by LDL^T of its 6 x 6 system.
template <class T>
void solve_free_body(const ArticulatedInertia<T>& h, Vec3<T>& a, Vec3<T>& alpha) {
  const Mat3<T>& c = h.tw;
  T M[6][6] = {{h.tt.xx},
               {h.tt.xy, h.tt.yy},
               {h.tt.zx, h.tt.yz, h.tt.zz},
               {c.row[0].x, c.row[1].x, c.row[2].x, h.ww.xx},
               {c.row[0].y, c.row[1].y, c.row[2].y, h.ww.xy, h.ww.yy},
               {c.row[0].z, c.row[1].z, c.row[2].z, h.ww.zx, h.ww.yz, h.ww.zz}};
  T x[6] = {h.ft.x, h.ft.y, h.ft.z, h.fw.x, h.fw.y, h.fw.z};
  T inverse[6];
#pragma GCC unroll 6
  for (int j = 0; j < 6; ++j) {  // LDL^T: M[i][j] holds L D until column j is done
    inverse[j] = T(1.0) / M[j][j];
#pragma GCC unroll 6
    for (int i = j + 1; i < 6; ++i) {
      const T l = M[i][j] * inverse[j];
#pragma GCC unroll 6
      for (int k = j + 1; k <= i; ++k) M[i][k] -= l * M[k][j];
      x[i] -= l * x[j];
    }
  }
#pragma GCC unroll 6
  for (int j = 5; j >= 0; --j) {
#pragma GCC unroll 6
    for (int i = j + 1; i < 6; ++i) x[j] -= M[i][j] * x[i];
    x[j] = x[j] * inverse[j];
  }
  a = {x[0], x[1], x[2]};
  alpha = {x[3], x[4], x[5]};
}

}  // namespace flexboom::equations
