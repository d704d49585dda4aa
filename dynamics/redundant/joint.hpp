#pragma once

// What acts between two places: constraint rows of a joint, its mechanism, springs. Internal to the redundant
// coordinates.

#include "dynamics/model/multibody.hpp"
#include "dynamics/redundant/place.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <type_traits>
#include <vector>

namespace flexboom::redundant {

/// One constraint row: e . (r_b - r_a) - shift = 0 ("along") or e . f = 0 ("across"); e is fixed in the axes of a, f in
/// those of b. A prescribed freedom shifts, or turns e about +z, or f about -y, by its value.
struct Row {
  enum class Kind { along, across } kind = Kind::along;
  enum class Drive { none, shift, turn_e, turn_f } drive = Drive::none;
  Vec3<double> e, f;
  size_t freedom = 0;        // which prescribed function drives it
  const char* what = "";     // for messages
  bool kept = true;          // false: redundant, left out
  bool holds = false;        // only there while the joint's law holds it
  int lambda = -1, mu = -1;  // unknowns of a kept row
};

struct JointData {
  PlaceData a, b;
  std::vector<Row> rows;
  bool mechanism = false, stop = false, law = false;
  std::optional<double> held_at{};  // by its law: angle [rad] or way [m]

  bool is_there(const Row& row) const { return !row.holds || held_at; }
};

/// The rows of each kind of joint, prescribed freedoms included.
std::vector<Row> joint_rows(const Joint&);

/// Value and rate of a prescribed freedom.
template <class T>
struct DriveMotion {
  T value{}, rate{};
};

template <class T>
struct PairMotion {
  Frame<T> frame_a, frame_b;
  Elastic<T> elastic_a, elastic_b;
  std::array<DriveMotion<T>, 2> drive;
};

template <class T>
struct PairForces {
  PlaceForce<T> a, b;
};

template <class T>
struct RowVectors {
  Vec3<T> e, f, e_dot, f_dot;  // inertial axes; rates include those of the places
  T shift{}, shift_dot{};
  T power{};  // of a unit multiplier, by the prescribed motion: - dg/dt at fixed bodies
};

template <class T>
Vec3<T> lifted(const Vec3<double>& a) {
  return {T(a.x), T(a.y), T(a.z)};
}

/// The two places of a joint or a spring, and how they move.
template <class T>
struct JoinedPlaces {
  JoinedPlaces(const JointData& of, const PairMotion<T>& motion)
      : joint(of),
        x(motion),
        a(place_motion(of.a, motion.frame_a, motion.elastic_a)),
        b(place_motion(of.b, motion.frame_b, motion.elastic_b)) {}
  JoinedPlaces(const JointData&, PairMotion<T>&&) = delete;  // it is kept by reference

  const JointData& joint;
  const PairMotion<T>& x;
  PlaceMotion<T> a, b;
};

template <class T>
RowVectors<T> row_vectors(const Row& row, const JoinedPlaces<T>& at) {
  using std::cos;
  using std::sin;
  RowVectors<T> r;
  const PlaceMotion<T>&a = at.a, &b = at.b;
  const DriveMotion<T>& d = at.x.drive[row.freedom];
  Vec3<T> e = lifted<T>(row.e), f = lifted<T>(row.f), e_turn{}, f_turn{};
  if (row.drive == Row::Drive::turn_e) {
    const T c = cos(d.value), s = sin(d.value);
    e = {c * row.e.x - s * row.e.y, s * row.e.x + c * row.e.y, T(row.e.z)};
    e_turn = d.rate * Vec3<T>{-e.y, e.x, T(0.0)};
  } else if (row.drive == Row::Drive::turn_f) {
    const T c = cos(d.value), s = sin(d.value);
    f = {c * row.f.x - s * row.f.z, T(row.f.y), s * row.f.x + c * row.f.z};
    f_turn = d.rate * Vec3<T>{-f.z, T(0.0), f.x};
  } else if (row.drive == Row::Drive::shift) {
    r.shift = d.value, r.shift_dot = d.rate;
  }
  r.e = a.axes * e;
  r.e_dot = cross(a.omega, r.e);
  if (row.kind == Row::Kind::across) {
    r.f = b.axes * f;
    r.f_dot = cross(b.omega, r.f);
  }
  r.power = r.shift_dot;
  if (row.drive == Row::Drive::turn_e) {
    const Vec3<T> turn = a.axes * e_turn;
    r.e_dot += turn;
    r.power -= dot(turn, r.f);
  } else if (row.drive == Row::Drive::turn_f) {
    const Vec3<T> turn = b.axes * f_turn;
    r.f_dot += turn;
    r.power -= dot(turn, r.e);
  }
  return r;
}

/// Force at b's place and torque, inertial axes, on b and the opposite on a: the force acts at b's place on both.
template <class T>
void add_pair(const JoinedPlaces<T>& at, const Vec3<T>& force, const Vec3<T>& torque, PairForces<T>& out) {
  add_force(at.joint.b, at.x.frame_b, at.b, force, torque, out.b);
  add_force(at.joint.a, at.x.frame_a, at.a, -force, -(torque + cross(at.b.r - at.a.r, force)), out.a);
}

/// Multipliers of a joint's rows, zero of those left out: forces, and corrections of positions.
struct RowMultipliers {
  std::array<double, 6> lambda{}, mu{};
};

/// Values and rates of the rows; adds lambda times their gradient to `out`, mu times it to `correction`.
template <class T>
void constrain(const JoinedPlaces<T>& at, const RowMultipliers& of, T* g, T* g_dot, PairForces<T>& out,
               std::type_identity_t<PairForces<T>>* correction, T& power) {
  const JointData& joint = at.joint;
  const Vec3<T> d = at.b.r - at.a.r, d_dot = at.b.r_dot - at.a.r_dot;
  Vec3<T> force{}, torque{}, mu_force{}, mu_torque{};
  for (size_t i = 0; i < joint.rows.size(); ++i) {
    const Row& row = joint.rows[i];
    if (!joint.is_there(row)) {
      g[i] = g_dot[i] = T(0.0);
      continue;
    }
    const RowVectors<T> v = row_vectors(row, at);
    if (row.kind == Row::Kind::along) {
      g[i] = dot(v.e, d) - v.shift;
      g_dot[i] = dot(v.e_dot, d) + dot(v.e, d_dot) - v.shift_dot;
      force += of.lambda[i] * v.e;
      mu_force += of.mu[i] * v.e;
    } else {
      g[i] = dot(v.e, v.f);
      g_dot[i] = dot(v.e_dot, v.f) + dot(v.e, v.f_dot);
      const Vec3<T> axis = cross(v.f, v.e);
      torque += of.lambda[i] * axis;
      mu_torque += of.mu[i] * axis;
    }
    power += of.lambda[i] * v.power;
  }
  add_pair(at, force, torque, out);
  if (correction != nullptr) add_pair(at, mu_force, mu_torque, *correction);
}

/// Angle of b about +z of a [rad], or way along it [m], less `threshold`, and its rate; of angles the turn nearest to
/// `near`. Near zero it keeps its digits.
template <class T>
DriveMotion<T> joint_gap(bool hinge, double threshold, const JoinedPlaces<T>& at, double near) {
  using std::atan2;
  const PlaceMotion<T>&a = at.a, &b = at.b;
  const Mat3<T> axes = transposed(a.axes);
  const Vec3<T>& z = axes.row[2];
  if (!hinge) {
    const Vec3<T> d = b.r - a.r;
    return {dot(z, d) - threshold, dot(z, b.r_dot - a.r_dot) + dot(cross(a.omega, z), d)};
  }
  const Vec3<T> x = transposed(b.axes).row[0];
  const T s = dot(axes.row[1], x), c = dot(axes.row[0], x);
  const double st = std::sin(threshold), ct = std::cos(threshold);
  T angle = atan2(ct * s - st * c, ct * c + st * s);
  constexpr double turn = 2 * std::numbers::pi;
  const double turns = std::round((near - value(angle)) / turn);
  if (turns != 0) angle += T(turns * turn);
  return {angle, dot(z, b.omega - a.omega)};
}

/// In what state the mechanism or the law of a joint is.
struct MechanismState {
  bool contact = false;
  double near = 0;  // gap near which the hinge is [rad]
  LawBranch law{};
};

/// Spring, damper and stop of a hinge or slider, or its law; adds what the damper takes. Returns the gap.
template <class T>
DriveMotion<T> act_mechanism(const JoinedPlaces<T>& at, const HingeMechanism& m, bool hinge,
                             const MechanismState& state, PairForces<T>& out, T& loss) {
  const DriveMotion<T> c = joint_gap(hinge, m.threshold, at, state.near);
  T push;
  if (at.joint.law) {
    push = state.law.load(c.value, c.rate);
    loss += state.law.damper_power(c.rate);
  } else {
    push = m.stiffness * ((m.rest - m.threshold) - c.value) - m.damping * c.rate;
    if (state.contact) push -= m.stop_stiffness * c.value;
    loss += m.damping * (c.rate * c.rate);
  }
  const Vec3<T> along = push * transposed(at.a.axes).row[2];
  add_pair(at, hinge ? Vec3<T>{} : along, hinge ? along : Vec3<T>{}, out);
  return c;
}

/// Spring and damper along the line between the places; adds what the damper takes.
template <class T>
void act_spring(const JoinedPlaces<T>& at, const SpringDamper& spring, PairForces<T>& out, T& loss) {
  using std::sqrt;
  const Vec3<T> d = at.b.r - at.a.r;
  const T squared = dot(d, d);
  if (!(value(squared) > 0)) return;  // no direction
  const T length = sqrt(squared);
  const T rate = dot(d, at.b.r_dot - at.a.r_dot) / length;
  const T pull = (spring.stiffness * (length - spring.free_length) + spring.damping * rate) / length;
  add_pair(at, -(pull * d), Vec3<T>{}, out);
  loss += spring.damping * (rate * rate);
}

}  // namespace flexboom::redundant
