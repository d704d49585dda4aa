#pragma once

// The equations of motion of a tree, written once for a scalar T (README, "Trees"). Internal to `dynamics`.

#include "dynamics/relative/inertia.hpp"
#include "dynamics/relative/motion.hpp"

namespace flexboom::tree {

/// Held at a moving place: in the unknowns A^r (of the body as if rigidly fixed to that place) and q_ddot, where the
/// body's A = A^r - Y q_ddot - beta. Children on moving places are added as they are; q_ddot goes by a dense
/// factorisation, LDL^T. Leaves the inertia at place b in its axes.
template <class T>
void condense_held(const Link& link, LinkScratch<T>& s) {
  const equations::Body& b = link.body;
  const auto n = static_cast<size_t>(b.n);
  ArticulatedInertia<T>& I = s.I;
  for (size_t k = 0; k < n; ++k) {
    s.C[k] = {link.second_order ? s.second_order.Ct[k] : equations::lift<T>(b.Ct[k]), s.modes.Cr[k]};
    s.v[k] = s.modes.b[k];
    for (size_t l = 0; l < n; ++l)
      s.M[k * n + l] = link.second_order ? s.second_order.Me[k * n + l] : T(b.Me[k * n + l]);
  }
  for (size_t i = 0; i < s.hung.size(); ++i) {
    const ArticulatedInertia<T>& W = s.hung[i];
    const Vec3<T>& r = s.place[i];
    for (size_t k = 0; k < n; ++k) {
      const Twist<T>& U = s.U[i * n + k];
      Twist<T> F = W * U;
      for (size_t l = 0; l <= k; ++l) s.M[k * n + l] += dot(s.U[i * n + l], F);
      F.w += cross(r, F.t);
      s.C[k] += F;
      s.v[k] += dot(U.t, W.ft) + dot(U.w, W.fw);
    }
    const T one(1.0), zero(0.0);
    I += shifted(Mat3<T>{{Vec3<T>{one, zero, zero}, Vec3<T>{zero, one, zero}, Vec3<T>{zero, zero, one}}}, r, W);
  }
  const Vec3<T>& r = s.b.r;
  s.beta.w = s.b.angular_acceleration(s.w);
  s.beta.t = s.b.acceleration(s.w) + cross(r, s.beta.w);
  for (size_t k = 0; k < n; ++k) s.Y[k] = {s.held[k].t + cross(r, s.held[k].w), s.held[k].w};
  const Twist<T> f0 = {I.ft, I.fw};
  for (size_t k = 0; k < n; ++k) {
    const Twist<T> IY = I * s.Y[k];
    s.V[k] = {s.C[k].t - IY.t, s.C[k].w - IY.w};
    s.v[k] += dot(s.V[k], s.beta) - dot(s.Y[k], f0);
    for (size_t l = 0; l <= k; ++l) s.M[k * n + l] -= dot(s.Y[k], s.C[l]) + dot(s.V[k], s.Y[l]);
  }
  const Twist<T> f_beta = I * s.beta;
  I.ft += f_beta.t;
  I.fw += f_beta.w;
  // M = L D L^T; V = L^-1 C', v = L^-1 b'.
  for (size_t j = 0; j < n; ++j) {
    const T inverse = T(1.0) / s.M[j * n + j];
    for (size_t i = j + 1; i < n; ++i) {
      const T l = s.M[i * n + j] * inverse;
      for (size_t k = j + 1; k <= i; ++k) s.M[i * n + k] -= l * s.M[k * n + j];
      s.V[i].t -= l * s.V[j].t;
      s.V[i].w -= l * s.V[j].w;
      s.v[i] -= l * s.v[j];
    }
    s.M[j * n + j] = inverse;
    subtract_outer(I, s.V[j], Twist<T>{inverse * s.V[j].t, inverse * s.V[j].w});
    I.ft -= (inverse * s.v[j]) * s.V[j].t;
    I.fw -= (inverse * s.v[j]) * s.V[j].w;
  }
  for (size_t i = 0; i < n; ++i)  // L D -> L
    for (size_t j = 0; j < i; ++j) s.M[i * n + j] = s.M[i * n + j] * s.M[j * n + j];
  const Mat3<T> back = transposed(s.b.turn);
  I = shifted(back, -(back * r), I);
}

/// Articulated inertia of the link at its place b.
template <class T>
void condense_link(const Link& link, const T* y, LinkScratch<T>& s, bool forces) {
  add_body(link, y, s);
  if (forces) {
    s.I.ft += s.external.t;
    s.I.fw += s.external.w;
    for (size_t k = 0; k < static_cast<size_t>(link.body.n); ++k) s.modes.b[k] += s.external_modal[k];
  }
  if (link.body.n == 0) return;
  if (link.b.moves()) {
    condense_held(link, s);
  } else if (link.second_order) {
    SecondOrderScratch<T>& o = s.second_order;
    const auto n = static_cast<size_t>(link.body.n);
    o.least_pivot = invert(n, o.Me, o.row, o.Me_inverse);
    const InverseOfMe<T> inverse = {o.Me_inverse.data(), n, false};
    for (size_t k = 0; k < n; ++k) {
      o.Gt[k] = Vec3<T>{};
      for (size_t l = 0; l < n; ++l) o.Gt[k] += inverse.row(k)[l] * o.Ct[l];
    }
    eliminate_modes<T, T>(inverse, o.Ct, o.Gt, nullptr, s);
    if (link.slots) add_hung_children(link, inverse, o.Gt, s);
  } else {
    const InverseOfMe<double> inverse = inverse_of_Me(link.body);
    eliminate_modes(inverse, link.body.Ct, link.body.Gt, &link.body.Ctt, s);
    if (link.slots) add_hung_children(link, inverse, link.body.Gt, s);
  }
}

/// I times the unit motion of a freedom.
template <class T>
Twist<T> motion_column(Freedom freedom, const Vec3<T>& turn_z_of_a, const ArticulatedInertia<T>& I) {
  const Mat3<T>& c = I.tw;
  switch (freedom) {
    case Freedom::x:
      return {{I.tt.xx, I.tt.xy, I.tt.zx}, c.row[0]};
    case Freedom::y:
      return {{I.tt.xy, I.tt.yy, I.tt.yz}, c.row[1]};
    case Freedom::z:
      return {{I.tt.zx, I.tt.yz, I.tt.zz}, c.row[2]};
    case Freedom::turn_x:
      return {transposed(c).row[0], {I.ww.xx, I.ww.xy, I.ww.zx}};
    case Freedom::turn_y:
      return {transposed(c).row[1], {I.ww.xy, I.ww.yy, I.ww.yz}};
    case Freedom::turn_z:
      return {transposed(c).row[2], {I.ww.zx, I.ww.yz, I.ww.zz}};
    default:
      return {c * turn_z_of_a, I.ww * turn_z_of_a};
  }
}

/// The component of a load along a freedom.
template <class T>
T along(Freedom freedom, const Vec3<T>& turn_z_of_a, const Twist<T>& f) {
  switch (freedom) {
    case Freedom::x:
      return f.t.x;
    case Freedom::y:
      return f.t.y;
    case Freedom::z:
      return f.t.z;
    case Freedom::turn_x:
      return f.w.x;
    case Freedom::turn_y:
      return f.w.y;
    case Freedom::turn_z:
      return f.w.z;
    default:
      return dot(turn_z_of_a, f.w);
  }
}

/// a += the unit motion of a freedom, times s.
template <class T>
void add_motion(Freedom freedom, const Vec3<T>& turn_z_of_a, const T& s, Twist<T>& a) {
  switch (freedom) {
    case Freedom::x:
      a.t.x += s;
      break;
    case Freedom::y:
      a.t.y += s;
      break;
    case Freedom::z:
      a.t.z += s;
      break;
    case Freedom::turn_x:
      a.w.x += s;
      break;
    case Freedom::turn_y:
      a.w.y += s;
      break;
    case Freedom::turn_z:
      a.w.z += s;
      break;
    default:
      a.w += s * turn_z_of_a;
  }
}

/// Torque or force of the mechanism, or of the law that holds it, along the joint's first coordinate.
template <class T>
T mechanism_load(const Link& link, const T* y, const Instant::Drive& drive, const LawBranch& law, bool contact) {
  if (link.kind != JointKind::hinge && link.kind != JointKind::slider) return T(0.0);
  const JointCoordinates<T> j(link, y, drive);
  if (link.law) return law.load(j.x[0], j.rate[0]);
  return equations::hinge_torque(link.body, j.x[0], j.rate[0], contact ? 1.0 : 0.0);
}

/// Eliminates freedom i of the joint, which has this force along it.
template <class T>
void eliminate_freedom(Freedom freedom, int i, const T& load, LinkScratch<T>& s) {
  ArticulatedInertia<T> I = s.I;
  Eliminated<T> e;
  e.U = motion_column(freedom, s.turn_z_of_a, I);
  e.inverse_D = T(1.0) / along(freedom, s.turn_z_of_a, e.U);
  e.u = along(freedom, s.turn_z_of_a, Twist<T>{I.ft, I.fw}) + load;
  const Twist<T> scaled = {e.inverse_D * e.U.t, e.inverse_D * e.U.w};
  subtract_outer(I, e.U, scaled);
  I.ft -= e.u * scaled.t;
  I.fw -= e.u * scaled.w;
  s.freedom[static_cast<size_t>(i)] = e;
  s.I = I;
}

/// Eliminates the freedoms of the joint one after the other.
template <class T>
void eliminate_freedoms(const Link& link, const T& load, LinkScratch<T>& s) {
  if (link.prescribed || s.held_joint) return;
  if (link.kind == JointKind::hinge) return eliminate_freedom(Freedom::turn_z, 0, load, s);  // nearly all joints are
  const JointType& type = joint_type(link.kind);
  for (int i = 0; i < type.freedoms; ++i)
    eliminate_freedom(type.freedom[static_cast<size_t>(i)], i, i == 0 ? load : T(0.0), s);
}

/// The load of the joint on place b, its mechanism's included.
template <class T>
Twist<T> joint_load(const LinkScratch<T>& s) {
  const Twist<T> f = s.I * s.base;
  return {f.t - s.I.ft, f.w - s.I.fw};
}

/// Adds what hangs on the parent through the link's joint.
template <class T>
void hand_to_parent(const Link& link, LinkScratch<T>& s, LinkScratch<T>& parent) {
  ArticulatedInertia<T> I = s.I;
  const Twist<T> f = I * s.bias;
  I.ft -= f.t;
  I.fw -= f.w;
  if (link.hung_on_moving_place)
    parent.hung[static_cast<size_t>(link.slot)] += shifted(s.A, s.lever, I);
  else if (link.kind == JointKind::slider)
    parent.I += shifted(s.A, s.arm, I);
  else
    parent.I += shifted(s.A, link.a.position, I);
}

/// Accelerations of the modes from that of the body's origin, where place b does not move.
template <class C, class T>
void release_fixed(const std::vector<Vec3<C>>& Gt, LinkScratch<T>& s) {
  s.acceleration = s.handle;
  const Vec3<T> a = s.acceleration.t, alpha = s.acceleration.w;
  for (size_t k = 0; k < Gt.size(); ++k) s.q_ddot[k] = s.modes.g[k] - (dot(Gt[k], a) + dot(s.modes.Gw[k], alpha));
}

/// Accelerations of the modes and of the body's origin from that of place b.
template <class T>
void release_modes(const Link& link, LinkScratch<T>& s) {
  const auto n = static_cast<size_t>(link.body.n);
  if (!link.b.moves()) {
    if (link.second_order)
      release_fixed(s.second_order.Gt, s);
    else
      release_fixed(link.body.Gt, s);
    const std::array<T, 6> A = entries(s.acceleration);
    for (size_t i = 0; i < static_cast<size_t>(link.slots); ++i) {
      std::array<T, 6> F;
      for (size_t r = 0; r < 6; ++r) {
        const T* z = s.Z.data() + (6 * i + r) * 7;
        F[r] = z[6];
        for (size_t c = 0; c < 6; ++c) F[r] += z[c] * A[c];
      }
      const Twist<T> load = {{F[0], F[1], F[2]}, {F[3], F[4], F[5]}};
      for (size_t k = 0; k < n; ++k) s.q_ddot[k] -= dot(s.P[i * n + k], load);
    }
    return;
  }
  const Mat3<T>& E = s.b.turn;
  Twist<T> A = {E * s.handle.t, E * s.handle.w};
  A.t -= cross(A.w, s.b.r);
  for (size_t k = 0; k < n; ++k) s.q_ddot[k] = s.M[k * n + k] * (s.v[k] - dot(s.V[k], A));
  for (size_t k = n; k-- > 0;)
    for (size_t l = k + 1; l < n; ++l) s.q_ddot[k] -= s.M[l * n + k] * s.q_ddot[l];
  for (size_t k = 0; k < n; ++k) {
    A.t -= s.q_ddot[k] * s.Y[k].t;
    A.w -= s.q_ddot[k] * s.Y[k].w;
  }
  s.acceleration = {A.t - s.beta.t, A.w - s.beta.w};
}

/// The acceleration of freedom i, added to that of place b.
template <class T>
T release_freedom(Freedom freedom, int i, LinkScratch<T>& s) {
  const Eliminated<T>& e = s.freedom[static_cast<size_t>(i)];
  const T acceleration = (e.u - dot(e.U, s.handle)) * e.inverse_D;
  add_motion(freedom, s.turn_z_of_a, acceleration, s.handle);
  return acceleration;
}

/// One link after its parent: its accelerations.
template <class T>
void release_link(const Model& model, const Link& link, const LinkScratch<T>* parent, LinkScratch<T>& s, T* y_dot) {
  s.base = s.bias;
  if (parent != nullptr) {
    Twist<T> at = parent->acceleration;  // of the place in the parent's axes
    if (link.hung_on_moving_place) {
      const auto n = static_cast<size_t>(model.links[static_cast<size_t>(link.parent)].body.n);
      const Twist<T>* U = parent->U.data() + static_cast<size_t>(link.slot) * n;
      at.t -= cross(s.a.r, at.w);
      for (size_t k = 0; k < n; ++k) {
        at.t += parent->q_ddot[k] * U[k].t;
        at.w += parent->q_ddot[k] * U[k].w;
      }
      at.t -= cross(s.lever, at.w);
    } else {
      at.t -= cross(s.arm, at.w);
    }
    s.base.t += transposed_product(s.A, at.t);
    s.base.w += transposed_product(s.A, at.w);
  }
  const JointType& type = joint_type(link.kind);
  if (link.kind == JointKind::free) {
    equations::solve_free_body(s.I, s.handle.t, s.handle.w);
    const Vec3<T> alpha = s.handle.w - s.base.w;
    y_dot[link.omega] = alpha.x, y_dot[link.omega + 1] = alpha.y, y_dot[link.omega + 2] = alpha.z;
    const Vec3<T> a = transposed_product(s.a.E, s.A * (s.handle.t - s.base.t));
    y_dot[link.velocity] = a.x, y_dot[link.velocity + 1] = a.y, y_dot[link.velocity + 2] = a.z;
  } else {
    s.handle = s.base;
    if (s.held_joint)
      y_dot[link.rate] = T(0.0);
    else if (link.kind == JointKind::hinge && !link.prescribed)
      y_dot[link.rate] = release_freedom(Freedom::turn_z, 0, s);
    else if (!link.prescribed)
      for (int i = type.freedoms - 1; i >= 0; --i)
        y_dot[(type.turns ? link.omega : link.rate) + i] = release_freedom(type.freedom[static_cast<size_t>(i)], i, s);
  }
  release_modes(link, s);
  for (size_t k = 0; k < static_cast<size_t>(link.body.n); ++k) y_dot[link.q_dot + static_cast<int>(k)] = s.q_ddot[k];
}

/// Articulated inertia of leaves with their joints, handed to their parent.
inline void condense_leaves(const Leaves& leaves, const Model& model, std::span<const char> contact,
                            std::vector<LinkScratch<double>>& links, LeavesScratch& scratch) {
  LinkScratch<Quad>& s = scratch.link;
  const equations::BodyOf<Quad>& b = leaves.body;
  s.I = {};
  add_body(b, scratch.q.data(), scratch.q_dot.data(), s);
  if (model.scene->field) {
    s.I.ft += s.external.t;
    s.I.fw += s.external.w;
    for (size_t k = 0; k < scratch.q.size(); ++k) s.modes.b[k] += s.external_modal[k];
  }
  if (b.n) eliminate_modes(inverse_of_Me(b), b.Ct, b.Gt, &b.Ctt, s);
  if (leaves.kind == JointKind::hinge) {
    Quad closed;
    for (int i = 0; i < Quad::width; ++i) {
      const Link& link = model.links[static_cast<size_t>(leaves.link[static_cast<size_t>(i)])];
      set_lane(closed, i, contact[static_cast<size_t>(link.joint)] ? 1.0 : 0.0);
    }
    eliminate_freedom(Freedom::turn_z, 0, equations::hinge_torque(b, scratch.gap, scratch.rate, closed), s);
  }
  if (leaves.parent < 0) return;
  const Twist<Quad> f = s.I * s.bias;
  s.I.ft -= f.t;
  s.I.fw -= f.w;
  links[static_cast<size_t>(leaves.parent)].I += sum(shifted(s.A, leaves.position, s.I), leaves.count);
}

/// Leaves after their parent: their accelerations.
inline void release_leaves(const Leaves& leaves, const Model& model, const std::vector<LinkScratch<double>>& links,
                           LeavesScratch& scratch, double* y_dot) {
  LinkScratch<Quad>& s = scratch.link;
  s.base = s.bias;
  if (leaves.parent >= 0) {
    const Twist<double>& parent = links[static_cast<size_t>(leaves.parent)].acceleration;
    const Vec3<Quad> alpha = four(parent.w);
    s.base.t += transposed_product(s.A, four(parent.t) - cross(leaves.position, alpha));
    s.base.w += transposed_product(s.A, alpha);
  }
  s.handle = s.base;
  Quad acceleration;
  if (leaves.kind == JointKind::hinge) acceleration = release_freedom(Freedom::turn_z, 0, s);
  release_fixed(leaves.body.Gt, s);
  for (int i = 0; i < leaves.count; ++i) {
    const Link& link = model.links[static_cast<size_t>(leaves.link[static_cast<size_t>(i)])];
    if (link.rate >= 0) y_dot[link.rate] = lane(acceleration, i);
    for (size_t k = 0; k < s.q_ddot.size(); ++k) y_dot[static_cast<size_t>(link.q_dot) + k] = lane(s.q_ddot[k], i);
  }
}

/// All accelerations, from what move_links left; external loads already in the scratch.
template <class T>
void accelerate(const Model& model, const T* y, const Instant& instant, std::span<const char> contact,
                Scratch<T>& scratch, T* y_dot) {
  for (const size_t i : scratch.singles) scratch.links[i].I = {};
  if constexpr (has_leaves<T>)
    for (size_t i = 0; i < scratch.leaves.size(); ++i)
      condense_leaves(model.leaves[i], model, contact, scratch.links, scratch.leaves[i]);
  for (size_t place = scratch.singles.size(); place-- > 0;) {
    const size_t i = scratch.singles[place];
    const Link& link = model.links[i];
    LinkScratch<T>& s = scratch.links[i];
    condense_link(link, y, s, model.forces);
    if (link.kind == JointKind::free) continue;
    const bool closed = contact[static_cast<size_t>(link.joint)] != 0;
    const LawBranch& law = instant.law(link);
    s.held_joint = law.held;
    eliminate_freedoms(link, mechanism_load(link, y, instant.drives[i], law, closed), s);
    if (link.parent >= 0) hand_to_parent(link, s, scratch.links[static_cast<size_t>(link.parent)]);
  }
  for (const size_t i : scratch.singles) {
    const Link& link = model.links[i];
    release_link(model, link, link.parent < 0 ? nullptr : &scratch.links[static_cast<size_t>(link.parent)],
                 scratch.links[i], y_dot);
  }
  if constexpr (has_leaves<T>)
    for (size_t i = 0; i < scratch.leaves.size(); ++i)
      release_leaves(model.leaves[i], model, scratch.links, scratch.leaves[i], y_dot);
}

}  // namespace flexboom::tree
