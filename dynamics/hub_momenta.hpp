#pragma once

// Masses, momenta and energies of a hub with hinged flexible bodies. Internal to `dynamics`.

#include "dynamics/hub_equations.hpp"

namespace flexboom::equations {

/// All bodies together about the hub's origin as though that were at rest, hub axes.
struct Together {
  double m = 0;
  Vec3<double> first_moment, momentum, angular_momentum;
  Sym3<double> inertia;
  double kinetic = 0, strain = 0;  // strain: of the modes, without the hinges
  // Sums over the bodies of |momentum| and of |angular momentum| about each one's own origin.
  double momentum_scale = 0, angular_momentum_scale = 0;
};

inline double length(const Vec3<double>& a) { return std::sqrt(dot(a, a)); }

/// Adds bodies that are computed side by side; w_hub: angular velocity of the hub.
template <class C>
void add(const SideBySide<C>& bodies, const double* p, const double* rates, const Vec3<double>& w_hub,
         SideBySideScratch<C>& s, Together& to) {
  const BodyOf<C>& b = bodies.body;
  load(bodies, p, rates, s);
  const C *q = s.p.data() + 1, *q_dot = s.u.data() + 1;
  const Mat3<C> A = boom_axes(b, s.p[0]);
  const Inertia<C> inertia = inertia_at(b, q, q_dot, s.body);
  const Vec3<C>& mc = inertia.mc;
  Vec3<C> slid{}, turned{};  // Ct q_dot, Cr q_dot
  C twice_modal = 0, twice_strain = 0;
  const auto n = static_cast<size_t>(b.n);
  for (size_t k = 0; k < n; ++k) {
    slid += q_dot[k] * b.Ct[k];
    turned += q_dot[k] * s.body.Cr[k];
    for (size_t l = b.row_begin(k); l < b.row_end(k); ++l) {
      twice_modal += q_dot[k] * b.Me[k * n + l] * q_dot[l];
      twice_strain += q[k] * b.Ke[k * n + l] * q[l];
    }
  }
  const Vec3<C> v = transposed_product(A, cross(w_hub, b.d));
  Vec3<C> w = transposed_product(A, w_hub);
  w.z += s.u[0];
  // P = m v + w x mc + Ct q_dot, H = mc x v + J w + Cr q_dot,
  // 2 T = v . P + w . H + q_dot . (Ct^T v + Cr^T w + Me q_dot)
  const Vec3<C> linear = b.m * v + cross(w, mc) + slid, angular = cross(mc, v) + inertia.J * w + turned;
  const C twice_kinetic = dot(v, linear) + dot(w, angular) + dot(v, slid) + dot(w, turned) + twice_modal;
  const Vec3<C> P = A * linear, H = A * angular;
  // |d + r|^2 I - (d + r) (d + r)^T beside that of r
  const Vec3<C>& d = b.d;
  const Vec3<C> from_hinge = A * mc, moment = from_hinge + b.m * d;
  const C trace = dot(d, from_hinge + moment);
  Sym3<C> J = rotate(A, inertia.J);
  J.xx += trace - d.x * (from_hinge.x + moment.x);
  J.yy += trace - d.y * (from_hinge.y + moment.y);
  J.zz += trace - d.z * (from_hinge.z + moment.z);
  J.xy -= d.x * from_hinge.y + d.y * moment.x;
  J.yz -= d.y * from_hinge.z + d.z * moment.y;
  J.zx -= d.z * from_hinge.x + d.x * moment.z;
  const int count = bodies.count;
  to.m += sum(b.m, count);
  to.first_moment += sum(moment, count);
  to.momentum += sum(P, count);
  to.angular_momentum += sum(H + cross(d, P), count);
  to.inertia += sum(J, count);
  to.kinetic += 0.5 * sum(twice_kinetic, count);
  to.strain += 0.5 * sum(twice_strain, count);
  for (int i = 0; i < count; ++i) {
    const auto one = [i](const Vec3<C>& a) { return Vec3<double>{lane(a.x, i), lane(a.y, i), lane(a.z, i)}; };
    to.momentum_scale += length(one(P));
    to.angular_momentum_scale += length(one(H));
  }
}

/// From p = (Delta, q)... and u = (omega, Delta_dot, q_dot...); the scratch keeps nothing that is needed later.
inline Together together(const Model& model, const double* p, const double* u, Scratch<double, Quad>& scratch) {
  const Vec3<double> w = model.fixed_hub ? Vec3<double>{} : Vec3<double>{u[0], u[1], u[2]};
  Together all;
  if (!model.fixed_hub) {
    all.m = model.hub_m;
    all.first_moment = model.hub_mc;
    all.inertia = model.hub_J;
    all.momentum = cross(w, model.hub_mc);
    all.angular_momentum = model.hub_J * w;
    all.kinetic = 0.5 * dot(w, all.angular_momentum);
    all.momentum_scale = length(all.momentum);
    all.angular_momentum_scale = length(all.angular_momentum);
  }
  for_each_side_by_side(model, scratch, [&]<class C>(const SideBySide<C>& bodies, SideBySideScratch<C>& s) {
    add(bodies, p, u + model.base(), w, s, all);
  });
  return all;
}

}  // namespace flexboom::equations
