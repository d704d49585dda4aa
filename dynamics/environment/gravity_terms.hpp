#pragma once

// Gravity in the inner loop of the equations of motion. Internal to `dynamics`.

#include "dynamics/numerics/spatial.hpp"

namespace flexboom::equations {

using spatial::Mat3;
using spatial::Sym3;
using spatial::Vec3;

/// Gravity about a point: acceleration + gradient u at a small distance u, in one set of axes.
template <class T>
struct Gravity {
  Vec3<T> acceleration;
  Sym3<T> gradient;  // trace zero

  /// About a point at a distance d, in axes whose columns are A.
  template <class S>
  Gravity<S> at(const Vec3<S>& d, const Mat3<S>& A) const {
    const Sym3<T>& G = gradient;
    const auto column = [&A](S Vec3<S>::*c) { return Vec3<S>{A.row[0].*c, A.row[1].*c, A.row[2].*c}; };
    const Vec3<S> x = column(&Vec3<S>::x), y = column(&Vec3<S>::y), z = column(&Vec3<S>::z);
    const Vec3<S> Gx = G * x, Gy = G * y, Gz = G * z;
    const Vec3<S> a = {acceleration.x, acceleration.y, acceleration.z};
    return {transposed_product(A, G * d + a), {dot(x, Gx), dot(y, Gy), dot(z, Gz), dot(x, Gy), dot(y, Gz), dot(z, Gx)}};
  }
};

/// Torque of a gradient on a body of inertia J: the axial part of G J (of a point mass far away, 3 mu/r^3 c x J c).
template <class T>
Vec3<T> gradient_torque(const Sym3<T>& G, const Sym3<T>& J) {
  const Vec3<T> g[] = {{G.xx, G.xy, G.zx}, {G.xy, G.yy, G.yz}, {G.zx, G.yz, G.zz}};
  const Vec3<T> j[] = {{J.xx, J.xy, J.zx}, {J.xy, J.yy, J.yz}, {J.zx, J.yz, J.zz}};
  return {dot(g[1], j[2]) - dot(g[2], j[1]), dot(g[2], j[0]) - dot(g[0], j[2]), dot(g[0], j[1]) - dot(g[1], j[0])};
}

/// G : S.
template <class T>
T contraction(const Sym3<T>& G, const Sym3<T>& S) {
  return G.xx * S.xx + G.yy * S.yy + G.zz * S.zz + 2.0 * (G.xy * S.xy + G.yz * S.yz + G.zx * S.zx);
}

}  // namespace flexboom::equations
