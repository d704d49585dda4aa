#pragma once

// Outward sweep: how the bodies of a tree move, for a scalar T. Internal to `dynamics`.

#include "dynamics/tree_scratch.hpp"

namespace flexboom::tree {

template <class T>
Vec3<T> column_z(const Mat3<T>& E) {
  return {E.row[0].z, E.row[1].z, E.row[2].z};
}

/// E Rz and E Ry.
template <class T>
Mat3<T> turned_z(const Mat3<T>& E, const T& c, const T& s) {
  Mat3<T> A;
  for (size_t i = 0; i < 3; ++i) {
    const Vec3<T>& e = E.row[i];
    A.row[i] = {e.x * c + e.y * s, e.y * c - e.x * s, e.z};
  }
  return A;
}
template <class T>
Mat3<T> turned_y(const Mat3<T>& E, const T& c, const T& s) {
  Mat3<T> A;
  for (size_t i = 0; i < 3; ++i) {
    const Vec3<T>& e = E.row[i];
    A.row[i] = {e.x * c - e.z * s, e.y, e.x * s + e.z * c};
  }
  return A;
}

/// Coordinates of a joint and their rates: unknowns, or given.
template <class T>
struct JointCoordinates {
  std::array<T, 2> x{}, rate{};

  JointCoordinates(const Link& link, const T* y, const Instant::Drive& drive) {
    const auto n = static_cast<size_t>(joint_type(link.kind).scalars);
    for (size_t i = 0; i < n; ++i) {
      x[i] = link.prescribed ? T(drive.value[i]) : y[link.scalar + static_cast<int>(i)];
      rate[i] = link.prescribed ? T(drive.rate[i]) : y[link.rate + static_cast<int>(i)];
    }
  }
};

/// Motion of place b relative to place a.
template <class T>
struct RelativeMotion {
  Vec3<T> w{}, alpha{};  // axes of b; acceleration with those of the coordinates zero
};

/// Sets A, lever, lever_dot of s from the joint's coordinates.
template <class T>
RelativeMotion<T> move_joint(const Link& link, const T* y, const Instant::Drive& drive, LinkScratch<T>& s) {
  using std::cos;
  using std::sin;
  const Mat3<T>& E = s.a.E;
  RelativeMotion<T> r;
  const JointCoordinates<T> j(link, y, drive);
  switch (link.kind) {
    case JointKind::fixed:
      s.A = E;
      break;
    case JointKind::hinge: {  // angle = threshold + gap
      const equations::Body& b = link.body;
      const T cd = cos(j.x[0]), sd = sin(j.x[0]);
      s.A = turned_z<T>(E, b.cos_threshold * cd - b.sin_threshold * sd, b.sin_threshold * cd + b.cos_threshold * sd);
      r.w.z = j.rate[0];
      break;
    }
    case JointKind::slider: {
      s.A = E;
      const Vec3<T> z = column_z(E);
      s.lever = (T(link.threshold) + j.x[0]) * z;
      s.lever_dot = j.rate[0] * z;
      break;
    }
    case JointKind::universal: {
      const T c = cos(j.x[1]), sine = sin(j.x[1]), product = j.rate[0] * j.rate[1];
      s.A = turned_y<T>(turned_z<T>(E, cos(j.x[0]), sin(j.x[0])), c, sine);
      s.turn_z_of_a = {-sine, T(0.0), c};
      r.w = j.rate[0] * s.turn_z_of_a;
      r.w.y += j.rate[1];
      r.alpha = {-(product * c), T(0.0), -(product * sine)};
      break;
    }
    case JointKind::free: {
      const T *x = y + link.position, *v = y + link.velocity;
      s.lever = E * Vec3<T>{x[0], x[1], x[2]};
      s.lever_dot = E * Vec3<T>{v[0], v[1], v[2]};
      [[fallthrough]];
    }
    case JointKind::spherical: {
      s.A = product(E, rotation_of(y + link.attitude));
      const T* w = y + link.omega;
      r.w = {w[0], w[1], w[2]};
      break;
    }
  }
  return r;
}

/// Accelerations that a prescribed motion gives place b.
template <class T>
void add_drive(const Link& link, const Instant::Drive& drive, LinkScratch<T>& s) {
  switch (link.kind) {
    case JointKind::hinge:
      s.bias.w.z += drive.acceleration[0];
      break;
    case JointKind::slider:
      s.bias.t.z += drive.acceleration[0];
      break;
    case JointKind::universal:
      s.bias.w += drive.acceleration[0] * s.turn_z_of_a;
      s.bias.w.y += drive.acceleration[1];
      break;
    default:
      break;
  }
}

/// One link after its parent.
template <class T>
void move_link(const Model& model, const Link& link, const T* y, const Instant::Drive& drive, LinkScratch<T>* parent,
               LinkScratch<T>& s) {
  if (link.hung_on_moving_place) {
    const Link& p = model.links[static_cast<size_t>(link.parent)];
    const auto slot = static_cast<size_t>(link.slot);
    move_place(link.a, y + p.q, y + p.q_dot, s.a, parent->U.data() + slot * static_cast<size_t>(p.body.n));
    parent->place[slot] = s.a.r;
    parent->hung[slot] = {};
  }
  if (link.kind == JointKind::slider || link.kind == JointKind::free) s.lever = s.lever_dot = Vec3<T>{};
  const RelativeMotion<T> r = move_joint(link, y, drive, s);
  Vec3<T> w = r.w;
  s.bias.w = r.alpha;
  if (parent != nullptr) {
    const Vec3<T> w_a = link.hung_on_moving_place ? parent->w + s.a.w : parent->w;
    const Vec3<T> carried = transposed_product(s.A, w_a);
    w += carried;
    s.bias.w += cross(carried, r.w);
    s.arm = s.a.r + s.lever;
    if (link.hung_on_moving_place) {
      const Vec3<T> alpha_a = s.a.angular_acceleration(parent->w);
      s.bias.w += transposed_product(s.A, alpha_a);
      s.bias.t = transposed_product(s.A, s.a.acceleration(parent->w) + cross(alpha_a, s.lever) +
                                             cross(w_a, cross(w_a, s.lever) + 2.0 * s.lever_dot));
    } else {
      s.bias.t = transposed_product(s.A, cross(w_a, cross(w_a, s.arm) + 2.0 * s.lever_dot));
    }
  } else {
    s.arm = s.a.r + s.lever;
    s.bias.t = -transposed_product(s.A, model.gravity);
  }
  if (link.prescribed) add_drive(link, drive, s);
  if (link.b.moves()) {
    move_place(link.b, y + link.q, y + link.q_dot, s.b, s.held.data());
    w = s.b.turn * w - s.b.w;
  }
  s.w = w;
}

/// Where it is in space.
template <class T>
void pose_link(const Link& link, const LinkScratch<T>* parent, LinkScratch<T>& s) {
  Mat3<T> A = s.A;
  Vec3<T> R = s.arm, v = s.lever_dot;
  if (parent != nullptr) {
    v += cross(parent->w, s.arm);
    if (link.hung_on_moving_place) v += s.a.r_dot + cross(s.a.w, s.lever);
    A = product(parent->A0, s.A);
    R = parent->R0 + parent->A0 * R;
    v = parent->v0 + parent->A0 * v;
  }
  s.v_handle = v;
  if (link.b.moves()) {
    Mat3<T> back;
    for (size_t i = 0; i < 3; ++i) back.row[i] = s.b.turn * A.row[i];  // A turn^T
    A = back;
    R -= A * s.b.r;
    v -= A * (s.b.r_dot + cross(s.w, s.b.r));
  }
  s.A0 = A, s.R0 = R, s.v0 = v;
}

template <class T>
void move_links(const Model& model, const T* y, const Instant& instant, bool poses, Scratch<T>& scratch) {
  for (size_t i = 0; i < model.links.size(); ++i) {
    const Link& link = model.links[i];
    LinkScratch<T>* parent = link.parent < 0 ? nullptr : &scratch.links[static_cast<size_t>(link.parent)];
    move_link(model, link, y, instant.drives[i], parent, scratch.links[i]);
    if (poses) pose_link(link, parent, scratch.links[i]);
  }
}

}  // namespace flexboom::tree
