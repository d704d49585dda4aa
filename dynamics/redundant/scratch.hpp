#pragma once

// Small helpers of the redundant coordinates' equations.

#include "dynamics/model/load_values.hpp"
#include "dynamics/redundant/equations.hpp"

#include <array>
#include <cmath>
#include <vector>

namespace flexboom::redundant {

struct BodyScratch {
  DeformedBody deformed;
  std::vector<double> on_q;

  explicit BodyScratch(const BodyData& b) : deformed(b), on_q(b.n) {}
};

struct EquationScratch {
  std::vector<BodyScratch> bodies;

  explicit EquationScratch(const std::vector<BodyData>& data) {
    for (const BodyData& b : data) bodies.emplace_back(b);
  }
};

inline Vec3<double> three(const double* a) { return {a[0], a[1], a[2]}; }
inline void subtract(const Vec3<double>& a, double* from) { from[0] -= a.x, from[1] -= a.y, from[2] -= a.z; }

/// Body -> inertial of a quaternion (w, x, y, z) that need not have length 1.
inline Mat3<double> rotation(const double* p) {
  const double s = 2 / (p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
  const double xx = s * p[1] * p[1], yy = s * p[2] * p[2], zz = s * p[3] * p[3], xy = s * p[1] * p[2],
               yz = s * p[2] * p[3], zx = s * p[3] * p[1], wx = s * p[0] * p[1], wy = s * p[0] * p[2],
               wz = s * p[0] * p[3];
  return {{Vec3<double>{1 - yy - zz, xy - wz, zx + wy}, Vec3<double>{xy + wz, 1 - xx - zz, yz - wx},
           Vec3<double>{zx - wy, yz + wx, 1 - xx - yy}}};
}

/// 1/2 p (0, w): the rate of a quaternion with angular velocity w in body axes.
inline std::array<double, 4> half_product(const double* p, const Vec3<double>& w) {
  return {-0.5 * (p[1] * w.x + p[2] * w.y + p[3] * w.z), 0.5 * (p[0] * w.x + p[2] * w.z - p[3] * w.y),
          0.5 * (p[0] * w.y + p[3] * w.x - p[1] * w.z), 0.5 * (p[0] * w.z + p[1] * w.y - p[2] * w.x)};
}

/// A load in inertial axes.
inline ForceAndTorque load_at(const Load& load, const PlaceMotion<double>& m, double t) {
  const ForceAndTorque own = load_in_own_axes(load, t);
  if (load.inertial_axes) return own;
  return {m.axes * own.force, m.axes * own.torque};
}

}  // namespace flexboom::redundant
