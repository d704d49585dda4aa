#include "dynamics/relative/momenta.hpp"

#include "dynamics/numerics/inner_loop.hpp"

#include <cmath>

namespace flexboom::tree {

namespace {

double length(const Vec3<double>& a) { return std::sqrt(dot(a, a)); }
Vec3<double> lane(const Vec3<double>& a, int) { return a; }
Vec3<double> lane(const Vec3<Quad>& a, int i) {
  return {flexboom::lane(a.x, i), flexboom::lane(a.y, i), flexboom::lane(a.z, i)};
}
/// The sum of what is computed side by side.
double together(double a, int) { return a; }
double together(const Quad& a, int count) { return flexboom::sum(a, count); }
template <template <class> class V>
V<double> together(const V<double>& a, int) {
  return a;
}
template <template <class> class V>
V<double> together(const V<Quad>& a, int count) {
  return sum(a, count);
}

/// m (2 a . b 1 - a b^T - b a^T) / 2: what mass at a distance adds to an inertia.
template <class C>
void add_spread(const C& m, const Vec3<C>& a, const Vec3<C>& b, Sym3<C>& J) {
  const C diagonal = m * dot(a, b), half = 0.5 * m;
  J.xx += diagonal - m * a.x * b.x, J.yy += diagonal - m * a.y * b.y, J.zz += diagonal - m * a.z * b.z;
  J.xy -= half * (a.x * b.y + a.y * b.x);
  J.yz -= half * (a.y * b.z + a.z * b.y);
  J.zx -= half * (a.z * b.x + a.x * b.z);
}

/// Adds one body, or `count` side by side, after `add_body` and poses: P = m v + w x mc + Ct q_dot,
/// H = mc x v + J w + Cr q_dot, 2 T = v . P + w . H + q_dot . (Ct^T v + Cr^T w + Me q_dot).
template <class C>
void add(const equations::BodyOf<C>& b, const std::vector<Vec3<C>>& Ct, const std::vector<C>& Me, bool diagonal,
         const LinkScratch<C>& s, const C* q, const C* q_dot, const Reference& reference, int count, bool with_inertia,
         Totals& to) {
  const auto n = static_cast<size_t>(b.n);
  const Vec3<C> v = transposed_product(s.A0, s.v0 - equations::lift<C>(reference.velocity)), &w = s.w;
  Vec3<C> slid{}, turned{};  // Ct q_dot, Cr q_dot
  C twice_modal(0.0), twice_strain(0.0);
  for (size_t k = 0; k < n; ++k) {
    slid += q_dot[k] * Ct[k];
    turned += q_dot[k] * s.modes.Cr[k];
    C p(0.0), force(0.0);
    for (size_t l = diagonal ? k : 0; l < (diagonal ? k + 1 : n); ++l) p += Me[k * n + l] * q_dot[l];
    for (size_t l = b.row_begin(k); l < b.row_end(k); ++l) force += b.Ke[k * n + l] * q[l];
    twice_modal += q_dot[k] * p;
    twice_strain += q[k] * force;
  }
  const Vec3<C> linear = b.m * v + cross(w, s.mc) + slid, angular = cross(s.mc, v) + s.J * w + turned;
  const C twice_kinetic = dot(v, linear) + dot(w, angular) + dot(v, slid) + dot(w, turned) + twice_modal;
  const Vec3<C> P = s.A0 * linear, H = s.A0 * angular, c = s.A0 * s.mc;
  const Vec3<C> R = s.R0 - equations::lift<C>(reference.position);
  if (with_inertia) {
    Sym3<C> J = equations::rotate(s.A0, s.J);
    add_spread(b.m, R, R, J);
    add_spread(C(2.0), R, c, J);
    to.inertia += together(J, count);
  }
  to.m += together(b.m, count);
  to.first_moment += together(b.m * R + c, count);
  to.momentum += together(P, count);
  to.angular_momentum += together(H + cross(R, P), count);
  to.kinetic += 0.5 * together(twice_kinetic, count);
  to.strain += 0.5 * together(twice_strain, count);
  for (int i = 0; i < count; ++i) {
    to.momentum_scale += length(lane(P, i) + flexboom::lane(b.m, i) * reference.velocity);
    to.angular_momentum_scale += length(lane(H, i));
  }
}

void add(const Model& model, size_t i, const double* y, const Reference& reference, bool with_inertia,
         LinkScratch<double>& s, Totals& to) {
  const Link& link = model.links[i];
  s.I = {};
  add_body(link, y, s);
  const equations::Body& b = link.body;
  const double *q = y + link.q, *q_dot = y + link.q_dot;
  if (link.second_order)
    add(b, s.second_order.Ct, s.second_order.Me, false, s, q, q_dot, reference, 1, with_inertia, to);
  else
    add(b, b.Ct, b.Me, b.diagonal, s, q, q_dot, reference, 1, with_inertia, to);
}

/// Adds one body, or `count` side by side, by its shapes Q, after poses.
template <class C>
void add_mass(const equations::BodyOf<C>& b, const LinkScratch<C>& s, const C* Q, const C* Q_dot,
              const Reference& reference, int count, MassMotion& to) {
  Vec3<C> mc = b.mc0, slid{};
  for (size_t k = 0; k < b.Ct.size(); ++k) mc += Q[k] * b.Ct[k], slid += Q_dot[k] * b.Ct[k];
  to.m += together(b.m, count);
  to.first_moment += together(b.m * (s.R0 - equations::lift<C>(reference.position)) + s.A0 * mc, count);
  to.momentum +=
      together(b.m * (s.v0 - equations::lift<C>(reference.velocity)) + s.A0 * (cross(s.w, mc) + slid), count);
}

}  // namespace

FLEXBOOM_INNER_LOOP
MassMotion mass_motion(const Model& model, const double* y, const Instant& instant, const Reference& reference,
                       Scratch<double>& scratch, HungOn bodies) {
  move_links(model, y, instant, true, scratch);
  MassMotion r;
  for (const size_t i : scratch.singles) {
    if (!bodies.counts(i)) continue;
    const Link& link = model.links[i];
    LinkScratch<double>& s = scratch.links[i];
    const double *q = y + link.q, *q_dot = y + link.q_dot;
    if (link.second_order) {
      follow_coordinates(link, q, q_dot, s.second_order);
      add_mass(link.shapes, s, s.second_order.Q.data(), s.second_order.Q_dot.data(), reference, 1, r);
    } else {
      add_mass(link.body, s, q, q_dot, reference, 1, r);
    }
  }
  for (size_t i = 0; i < scratch.leaves.size(); ++i) {
    const Leaves& leaves = model.leaves[i];
    if (!bodies.counts(static_cast<size_t>(leaves.link[0]))) continue;
    const LeavesScratch& s = scratch.leaves[i];
    add_mass(leaves.body, s.link, s.q.data(), s.q_dot.data(), reference, leaves.count, r);
  }
  return r;
}

FLEXBOOM_INNER_LOOP
Totals totals(const Model& model, const double* y, const Instant& instant, const Reference& reference,
              Scratch<double>& scratch, HungOn bodies, bool with_inertia) {
  move_links(model, y, instant, true, scratch);
  Totals r;
  for (const size_t i : scratch.singles)
    if (bodies.counts(i)) add(model, i, y, reference, with_inertia, scratch.links[i], r);
  for (size_t i = 0; i < scratch.leaves.size(); ++i) {
    const Leaves& leaves = model.leaves[i];
    if (!bodies.counts(static_cast<size_t>(leaves.link[0]))) continue;
    LeavesScratch& s = scratch.leaves[i];
    const equations::BodyOf<Quad>& b = leaves.body;
    s.link.I = {};
    add_body(b, s.q.data(), s.q_dot.data(), s.link);
    add(b, b.Ct, b.Me, b.diagonal, s.link, s.q.data(), s.q_dot.data(), reference, leaves.count, with_inertia, r);
  }
  for (size_t i = 0; i < model.wheels.size(); ++i) {  // rotors have no mass of their own
    const auto link = static_cast<size_t>(model.wheels[i].link);
    if (!bodies.counts(link)) continue;
    const LinkScratch<double>& s = scratch.links[link];
    const Vec3<double>& axis = model.wheels[i].at.position;
    const double J = model.scene->wheels[i].inertia, spin = y[model.spin + static_cast<int>(i)] + dot(axis, s.w);
    const Vec3<double> in_space = s.A0 * axis;
    r.spinning += 0.5 * J * spin * spin;
    r.angular_momentum += (J * spin) * in_space;
    r.angular_momentum_scale += std::abs(J * spin);
    if (with_inertia) subtract_dyad(r.inertia, -J, in_space);
  }
  return r;
}

}  // namespace flexboom::tree
