#pragma once

// Outward sweep: how the bodies of a tree move, for a scalar T. Internal to `dynamics`.

#include "dynamics/relative/scratch.hpp"

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

/// Takes the state of leaves.
inline void load(const Leaves& leaves, const Model& model, const double* y, LeavesScratch& s) {
  for (int i = 0; i < Quad::width; ++i) {
    const Link& link = model.links[static_cast<size_t>(leaves.link[static_cast<size_t>(i)])];
    if (link.scalar >= 0) set_lane(s.gap, i, y[link.scalar]), set_lane(s.rate, i, y[link.rate]);
    for (size_t k = 0; k < s.q.size(); ++k) {
      set_lane(s.q[k], i, y[static_cast<size_t>(link.q) + k]);
      set_lane(s.q_dot[k], i, y[static_cast<size_t>(link.q_dot) + k]);
    }
  }
}

/// Leaves after their parent, as move_link.
inline void move_leaves(const Leaves& leaves, const Model& model, const LinkScratch<double>* parent,
                        LeavesScratch& scratch) {
  LinkScratch<Quad>& s = scratch.link;
  s.arm = leaves.position;
  s.A = leaves.axes;
  if (leaves.kind == JointKind::hinge) {
    const equations::BodyOf<Quad>& b = leaves.body;
    const Quad c = cos(scratch.gap), sine = sin(scratch.gap);
    s.A = turned_z(s.A, b.cos_threshold * c - b.sin_threshold * sine, b.sin_threshold * c + b.cos_threshold * sine);
  }
  if (parent == nullptr) {
    s.w = s.bias.w = {};
    s.bias.t = -transposed_product(s.A, four(model.gravity));
  } else {
    const Vec3<Quad> w = four(parent->w);
    s.w = transposed_product(s.A, w);
    s.bias.t = transposed_product(s.A, cross(w, cross(w, leaves.position)));
    s.bias.w = {scratch.rate * s.w.y, -(scratch.rate * s.w.x), 0.0};
  }
  s.w.z += scratch.rate;
}

/// As pose_link.
inline void pose_leaves(const LinkScratch<double>* parent, LinkScratch<Quad>& s) {
  s.A0 = s.A, s.R0 = s.arm, s.v0 = {};
  if (parent == nullptr) return;
  const Mat3<Quad> A = four(parent->A0);
  s.A0 = product(A, s.A);
  s.R0 = four(parent->R0) + A * s.arm;
  s.v0 = four(parent->v0) + A * cross(four(parent->w), s.arm);
}

template <class T>
void move_links(const Model& model, const T* y, const Instant& instant, bool poses, Scratch<T>& scratch) {
  const auto parent_of = [&scratch](int parent) {
    return parent < 0 ? nullptr : &scratch.links[static_cast<size_t>(parent)];
  };
  for (const size_t i : scratch.singles) {
    const Link& link = model.links[i];
    move_link(model, link, y, instant.drives[i], parent_of(link.parent), scratch.links[i]);
    if (poses) pose_link(link, parent_of(link.parent), scratch.links[i]);
  }
  if constexpr (has_leaves<T>) {
    for (size_t i = 0; i < scratch.leaves.size(); ++i) {
      const Leaves& leaves = model.leaves[i];
      load(leaves, model, y, scratch.leaves[i]);
      move_leaves(leaves, model, parent_of(leaves.parent), scratch.leaves[i]);
      if (poses) pose_leaves(parent_of(leaves.parent), scratch.leaves[i].link);
    }
  }
}

}  // namespace flexboom::tree
