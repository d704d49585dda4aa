#pragma once

// Momenta of a link, from what the sweeps left. Internal to `dynamics`.

#include "dynamics/tree_scratch.hpp"

namespace flexboom::tree {

/// In axes of the body, about the origin of its frame.
struct LinkMomenta {
  Vec3<double> linear, angular;  // [kg m/s], [N m s]
  double kinetic = 0;            // energy [J]
};

/// After `add_body` and poses: P = m v + w x mc + Ct q_dot, H = mc x v + J w + Cr q_dot,
/// 2 T = v . P + w . H + q_dot . (Ct^T v + Cr^T w + Me q_dot).
inline LinkMomenta momenta(const Link& link, const LinkScratch<double>& s, const double* q_dot) {
  const Vec3<double> v = transposed_product(s.A0, s.v0), &w = s.w;
  const auto n = static_cast<size_t>(link.body.n);
  LinkMomenta r{link.body.m * v + cross(w, s.mc), cross(s.mc, v) + s.J * w, 0};
  double modal = 0;
  const std::vector<double>& Me = link.second_order ? s.second_order.Me : link.body.Me;
  for (size_t k = 0; k < n; ++k) {
    const Vec3<double>& Ct = link.second_order ? s.second_order.Ct[k] : link.body.Ct[k];
    r.linear += q_dot[k] * Ct;
    r.angular += q_dot[k] * s.modes.Cr[k];
    double p = dot(Ct, v) + dot(s.modes.Cr[k], w);
    for (size_t l = 0; l < n; ++l) p += Me[k * n + l] * q_dot[l];
    modal += q_dot[k] * p;
  }
  r.kinetic = 0.5 * (dot(v, r.linear) + dot(w, r.angular) + modal);
  return r;
}

}  // namespace flexboom::tree
