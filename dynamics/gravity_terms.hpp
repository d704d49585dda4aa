#pragma once

// Gravity in the inner loop of the equations of motion. Internal to `dynamics`.

#include "dynamics/spatial.hpp"

namespace flexboom::equations {

using spatial::Mat3;
using spatial::Sym3;
using spatial::Vec3;

/// Gravity about a point: acceleration + gradient u at a small distance u, in one set of axes.
struct Gravity {
  Vec3<double> acceleration;
  Sym3<double> gradient;  // trace zero

  /// About a point at a distance d, in axes whose columns are A.
  Gravity at(const Vec3<double>& d, const Mat3<double>& A) const {
    const Sym3<double>& G = gradient;
    const auto column = [&A](double Vec3<double>::*c) { return Vec3<double>{A.row[0].*c, A.row[1].*c, A.row[2].*c}; };
    const Vec3<double> x = column(&Vec3<double>::x), y = column(&Vec3<double>::y), z = column(&Vec3<double>::z);
    const Vec3<double> Gx = G * x, Gy = G * y, Gz = G * z;
    return {transposed_product(A, acceleration + G * d),
            {dot(x, Gx), dot(y, Gy), dot(z, Gz), dot(x, Gy), dot(y, Gz), dot(z, Gx)}};
  }
};

/// Torque of a gradient on a body of inertia J: the axial part of G J (of a point mass far away, 3 mu/r^3 c x J c).
inline Vec3<double> gradient_torque(const Sym3<double>& G, const Sym3<double>& J) {
  const Vec3<double> g[] = {{G.xx, G.xy, G.zx}, {G.xy, G.yy, G.yz}, {G.zx, G.yz, G.zz}};
  const Vec3<double> j[] = {{J.xx, J.xy, J.zx}, {J.xy, J.yy, J.yz}, {J.zx, J.yz, J.zz}};
  return {dot(g[1], j[2]) - dot(g[2], j[1]), dot(g[2], j[0]) - dot(g[0], j[2]), dot(g[0], j[1]) - dot(g[1], j[0])};
}

/// G : S.
inline double contraction(const Sym3<double>& G, const Sym3<double>& S) {
  return G.xx * S.xx + G.yy * S.yy + G.zz * S.zz + 2 * (G.xy * S.xy + G.yz * S.yz + G.zx * S.zx);
}

/// Gravity on one body.
struct GravityLoad {
  Vec3<double> force;  // hub axes [N]
  double power = 0;    // without the velocity of the hub's origin [W]
};

}  // namespace flexboom::equations
