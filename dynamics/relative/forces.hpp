#pragma once

// Loads, springs and wheels of a tree, and what follows from its motion, for a scalar T. Internal to `dynamics`.

#include "dynamics/relative/equations.hpp"

namespace flexboom::tree {

/// A place in space: inertial axes, and what a load there does to the body.
template <class T>
struct PlaceInSpace {
  LinkScratch<T>* link = nullptr;  // nullptr: the inertial frame
  Twist<T>* U = nullptr;
  size_t n = 0;
  PlaceMotion<T> place;
  Mat3<T> axes;
  Vec3<T> position, velocity, omega;

  /// Adds a force and a torque (inertial axes).
  void push(const Vec3<T>& force, const Vec3<T>& torque) const {
    if (link == nullptr) return;
    const Vec3<T> F = transposed_product(link->A0, force), M = transposed_product(link->A0, torque);
    link->external += Twist<T>{F, cross(place.r, F) + M};
    for (size_t k = 0; k < n; ++k) link->external_modal[k] += dot(U[k].t, F) + dot(U[k].w, M);
  }
};

/// U: room for the motion of the place by each coordinate.
template <class T>
PlaceInSpace<T> find_place(const Model& model, const PlacedOn& on, const T* y, Scratch<T>& scratch,
                           std::vector<Twist<T>>& U) {
  PlaceInSpace<T> p;
  if (on.link < 0) {
    p.position = equations::lift<T>(on.at.position);
    p.axes = lift<T>(on.at.axes);
    return p;
  }
  const Link& link = model.links[static_cast<size_t>(on.link)];
  LinkScratch<T>& s = scratch.links[static_cast<size_t>(on.link)];
  p.link = &s;
  if (on.at.moves()) {
    p.U = U.data();
    p.n = static_cast<size_t>(link.body.n);
    move_place(on.at, y + link.q, y + link.q_dot, p.place, p.U);
  } else {
    fix_place(on.at, p.place);
  }
  p.axes = product(s.A0, p.place.E);
  p.position = s.R0 + s.A0 * p.place.r;
  p.velocity = s.v0 + s.A0 * (p.place.r_dot + cross(s.w, p.place.r));
  p.omega = s.A0 * (s.w + p.place.w);
  return p;
}

template <class T>
void pull_spring(const Model& model, const SpringModel& spring, const T* y, Scratch<T>& scratch) {
  using std::sqrt;
  const PlaceInSpace<T> a = find_place(model, spring.a, y, scratch, scratch.U);
  const PlaceInSpace<T> b = find_place(model, spring.b, y, scratch, scratch.U_other);
  const Vec3<T> d = b.position - a.position;
  const T squared = dot(d, d);
  if (!(value_of(squared) > 0)) return;  // no direction
  const T length = sqrt(squared), inverse = T(1.0) / length;
  const T rate = dot(d, b.velocity - a.velocity) * inverse;
  const T pull = spring.stiffness * (length - T(spring.free_length)) + spring.damping * rate;
  const Vec3<T> force = (pull * inverse) * d;
  a.push(force, Vec3<T>{});
  b.push(-force, Vec3<T>{});
  scratch.loss += spring.damping * (rate * rate);
}

/// The field at a place, or at four.
inline equations::Gravity<double> gravity_at(const OrbitalField& field, double t, const Vec3<double>& place) {
  const LocalGravity g = field.at(t, spatial::eigen(place));
  return {spatial::vec3(g.acceleration), spatial::sym3(g.gradient)};
}
inline equations::Gravity<Quad> gravity_at(const OrbitalField& field, double t, const Vec3<Quad>& places) {
  equations::Gravity<Quad> r;
  for (int i = 0; i < Quad::width; ++i) {
    equations::Gravity<double> g =
        gravity_at(field, t, Vec3<double>{lane(places.x, i), lane(places.y, i), lane(places.z, i)});
    for (int c = 0; c < 3; ++c) set_lane(component(r.acceleration, c), i, component(g.acceleration, c));
    for (int c = 0; c < 6; ++c) set_lane(component(r.gradient, c), i, component(g.gradient, c));
  }
  return r;
}

/// Gravity of a field on a body: m a + G mc, mc x a + axial(G J), Ct^T a - 1/2 G : dJ/dq_k. The field is linear about
/// the mass centre of the undeformed body. In derivatives it stays what it is there: it changes over the size of an
/// orbit.
template <class C, class T>
void pull_by_field(const equations::BodyOf<C>& body, const OrbitalField& field, double t, const T* q, const T* q_dot,
                   LinkScratch<T>& s, T& power) {
  const auto value = [](const Vec3<T>& v) { return Vec3<C>{value_of(v.x), value_of(v.y), value_of(v.z)}; };
  const Vec3<C> in_body = (C(1.0) / body.m) * body.mc0,
                centre = {dot(value(s.A0.row[0]), in_body), dot(value(s.A0.row[1]), in_body),
                          dot(value(s.A0.row[2]), in_body)};
  auto gravity = gravity_at(field, t, value(s.R0) + centre);
  gravity.acceleration = gravity.acceleration - gravity.gradient * centre;
  const equations::Gravity<T> in_space = {equations::lift<T>(gravity.acceleration),
                                          equations::lift<T>(gravity.gradient)};
  const equations::Gravity<T> here = in_space.at(Vec3<T>{}, s.A0);
  const Vec3<T>& a = here.acceleration;
  const Sym3<T>& G = here.gradient;
  const equations::Inertia<T> inertia = equations::inertia_at(body, q, q_dot, s.modes);
  const Vec3<T> force = T(body.m) * a + G * inertia.mc;
  const Vec3<T> torque = cross(inertia.mc, a) + equations::gradient_torque(G, inertia.J);
  s.external += Twist<T>{force, torque};
  power += dot(s.A0 * force, s.v0) + dot(torque, s.w) - 0.5 * equations::contraction(G, inertia.J_dot);
  for (size_t k = 0; k < static_cast<size_t>(body.n); ++k) {
    const T modal = dot(a, equations::lift<T>(body.Ct[k]));
    s.external_modal[k] += modal;
    power += modal * q_dot[k];
  }
  equations::add_inertia_slope(body, -1.0, {G.xx, G.yy, G.zz, 2.0 * G.xy, 2.0 * G.yz, 2.0 * G.zx}, s.modes,
                               s.external_modal.data());
}

/// On all bodies.
template <class T>
void pull_by_field(const Model& model, const OrbitalField& field, double t, const T* y, Scratch<T>& scratch) {
  for (const size_t i : scratch.singles) {
    const Link& link = model.links[i];
    pull_by_field(link.body, field, t, y + link.q, y + link.q_dot, scratch.links[i], scratch.power);
  }
  if constexpr (has_leaves<T>) {
    for (size_t i = 0; i < scratch.leaves.size(); ++i) {
      LeavesScratch& s = scratch.leaves[i];
      Quad power;
      s.link.external = {};
      for (Quad& f : s.link.external_modal) f = 0;
      pull_by_field(model.leaves[i].body, field, t, s.q.data(), s.q_dot.data(), s.link, power);
      scratch.power += sum(power, model.leaves[i].count);
    }
  }
}

/// Sums all external loads of the links.
template <class T>
void apply_forces(const Model& model, const T* y, const Instant& instant, Scratch<T>& scratch) {
  for (const size_t i : scratch.singles) {
    scratch.links[i].external = {};
    for (T& f : scratch.links[i].external_modal) f = T(0.0);
  }
  for (size_t i = 0; i < model.loads.size(); ++i) {
    const PlaceInSpace<T> at = find_place(model, model.loads[i], y, scratch, scratch.U);
    Vec3<T> force = equations::lift<T>(instant.loads[i].t), torque = equations::lift<T>(instant.loads[i].w);
    if (!model.scene->loads[i].inertial_axes) force = at.axes * force, torque = at.axes * torque;
    at.push(force, torque);
    scratch.power += dot(force, at.velocity) + dot(torque, at.omega);
  }
  if (const auto& field = model.scene->field) pull_by_field(model, *field, instant.time, y, scratch);
  for (const SpringModel& spring : model.springs) pull_spring(model, spring, y, scratch);
  for (size_t i = 0; i < model.wheels.size(); ++i) {  // torque of the rotor, and its momentum turned with the body
    LinkScratch<T>& s = scratch.links[static_cast<size_t>(model.wheels[i].link)];
    const Vec3<double>& axis = model.wheels[i].at.position;
    const T spin = y[model.spin + static_cast<int>(i)];
    const T momentum = model.scene->wheels[i].inertia * (spin + dot(axis, s.w));
    s.external.w -= instant.wheels[i] * equations::lift<T>(axis) + cross(s.w, momentum * axis);
    scratch.power += instant.wheels[i] * spin;
  }
}

/// 1/2 quaternion * (0, omega).
template <class T>
void quaternion_rate(const T* q, const T* w, T* q_dot) {
  q_dot[0] = -0.5 * (q[1] * w[0] + q[2] * w[1] + q[3] * w[2]);
  q_dot[1] = 0.5 * (q[0] * w[0] + q[2] * w[2] - q[3] * w[1]);
  q_dot[2] = 0.5 * (q[0] * w[1] + q[3] * w[0] - q[1] * w[2]);
  q_dot[3] = 0.5 * (q[0] * w[2] + q[1] * w[1] - q[2] * w[0]);
}

/// What drives a prescribed joint or holds one that its law holds: the joint's load less the mechanism's.
template <class T>
T drive_load(const Link& link, int i, const T* y, const Instant::Drive& drive, const LawBranch& law, bool contact,
             const LinkScratch<T>& s) {
  const T load = along(joint_type(link.kind).freedom[static_cast<size_t>(i)], s.turn_z_of_a, joint_load(s));
  return i == 0 ? load - mechanism_load(link, y, drive, law, contact) : load;
}

/// Power that structural damping takes.
template <class C, class T>
T structural_loss(const equations::BodyOf<C>& b, const T* q_dot) {
  const auto n = static_cast<size_t>(b.n);
  T loss(0.0);
  for (size_t k = 0; k < n; ++k) {
    T force(0.0);
    for (size_t l = b.row_begin(k); l < b.row_end(k); ++l) force += b.De[k * n + l] * q_dot[l];
    loss += q_dot[k] * force;
  }
  return loss;
}

/// The rates of what leaves have beside accelerations.
inline void follow_leaves(const Leaves& leaves, const Model& model, const LeavesScratch& s, double* y_dot,
                          double& loss) {
  const Quad in_dampers = leaves.body.damping * (s.rate * s.rate);
  for (int i = 0; i < leaves.count; ++i) {
    const Link& link = model.links[static_cast<size_t>(leaves.link[static_cast<size_t>(i)])];
    if (link.scalar >= 0) y_dot[link.scalar] = lane(s.rate, i);
    y_dot[link.dissipated] = lane(in_dampers, i);
    for (size_t k = 0; k < s.q.size(); ++k) y_dot[static_cast<size_t>(link.q) + k] = lane(s.q_dot[k], i);
  }
  loss += sum(structural_loss(leaves.body, s.q_dot.data()), leaves.count);
}

/// The rates of everything that is no acceleration.
template <class T>
void follow(const Model& model, const T* y, const Instant& instant, std::span<const char> contact, Scratch<T>& scratch,
            T* y_dot) {
  if constexpr (has_leaves<T>)
    for (size_t i = 0; i < scratch.leaves.size(); ++i)
      follow_leaves(model.leaves[i], model, scratch.leaves[i], y_dot, scratch.loss);
  for (const size_t i : scratch.singles) {
    const Link& link = model.links[i];
    const LinkScratch<T>& s = scratch.links[i];
    const equations::Body& b = link.body;
    const JointType& type = joint_type(link.kind);
    const JointCoordinates<T> joint(link, y, instant.drives[i]);
    for (int k = 0; k < type.scalars; ++k) {
      y_dot[link.scalar + k] = joint.rate[static_cast<size_t>(k)];
      if (!link.prescribed) continue;
      y_dot[link.rate + k] = T(instant.drives[i].acceleration[static_cast<size_t>(k)]);
      const bool closed = contact[static_cast<size_t>(link.joint)] != 0;
      scratch.power += joint.rate[static_cast<size_t>(k)] * drive_load(link, k, y, instant.drives[i], {}, closed, s);
    }
    if (type.turns) quaternion_rate(y + link.attitude, y + link.omega, y_dot + link.attitude);
    if (type.floats)
      for (int k = 0; k < 3; ++k) y_dot[link.position + k] = y[link.velocity + k];
    const bool damped = link.kind == JointKind::hinge || link.kind == JointKind::slider;
    y_dot[link.dissipated] = damped ? b.damping * (joint.rate[0] * joint.rate[0]) : T(0.0);
    if (link.law) {
      const LawBranch& law = instant.law(link);
      y_dot[link.dissipated] = law.damper_power(joint.rate[0]);
      for (int k = 0; k < static_cast<int>(law_losses.size()); ++k)
        y_dot[link.losses + k] = law.power(static_cast<LawLoss>(k), joint.x[0], joint.rate[0]);
    }
    for (int k = 0; k < b.n; ++k) y_dot[link.q + k] = y[link.q_dot + k];
    scratch.loss += structural_loss(b, y + link.q_dot);
  }
  for (size_t i = 0; i < model.wheels.size(); ++i) {
    const LinkScratch<T>& s = scratch.links[static_cast<size_t>(model.wheels[i].link)];
    y_dot[model.spin + static_cast<int>(i)] =
        T(instant.wheels[i] / model.scene->wheels[i].inertia) - dot(model.wheels[i].at.position, s.acceleration.w);
  }
  y_dot[model.losses] = scratch.loss;
  y_dot[model.work] = scratch.power;
}

/// f(t, y).
template <class T>
void derivative(const Model& model, const T* y, const Instant& instant, std::span<const char> contact,
                Scratch<T>& scratch, T* y_dot) {
  scratch.loss = scratch.power = T(0.0);
  move_links(model, y, instant, model.poses, scratch);
  if (model.forces) apply_forces(model, y, instant, scratch);
  accelerate(model, y, instant, contact, scratch, y_dot);
  follow(model, y, instant, contact, scratch, y_dot);
}

}  // namespace flexboom::tree
