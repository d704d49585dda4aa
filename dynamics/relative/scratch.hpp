#pragma once

// What the sweeps over a tree leave behind for each other, for a scalar T. Internal to `dynamics`.

#include "dynamics/relative/places.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <span>
#include <type_traits>
#include <vector>

namespace flexboom::tree {

using equations::ArticulatedInertia;

/// A freedom after its elimination: its acceleration is (u - U . A) / D, A that of place b without it.
template <class T>
struct Eliminated {
  Twist<T> U;
  T u, inverse_D;
};

/// Of a body with second-order displacements: n coordinates, r shapes that follow them.
template <class T>
struct SecondOrderScratch {
  std::vector<T> Q, Q_dot, Q_ddot;     // of all shapes, n + r; of the r alone, what q_ddot does not give
  std::vector<T> slope;                // dQ_a/dq_k, r x n
  equations::BodyScratch<T> shapes;    // of all shapes
  std::vector<Vec3<T>> Ct, Gt;         // Ct(q), Me(q)^-1 Ct(q)^T, n
  std::vector<T> Me, Me_inverse, row;  // Me(q) and its inverse, n x n; n of them while it is inverted
  double least_pivot = 1;              // of Me(q), over the element of its diagonal
};

template <class T>
struct LinkScratch {
  PlaceMotion<T> a, b;  // relative to the frames of parent and body
  Mat3<T> A;            // place b -> axes of the parent
  Vec3<T> lever, arm;   // place b from place a, and from the parent's origin; axes of the parent
  Vec3<T> lever_dot;    // relative to place a
  Vec3<T> turn_z_of_a;  // of a universal joint: the first axis, in axes of b
  Vec3<T> w;            // of the body
  Twist<T> bias;        // acceleration of place b that remains when those of all unknowns and of the parent are zero

  Mat3<T> A0;        // body -> inertial
  Vec3<T> R0, v0;    // origin of the body and its velocity, inertial axes
  Vec3<T> v_handle;  // velocity of place b, inertial axes

  equations::BodyScratch<T> modes;
  Vec3<T> mc;
  Sym3<T> J;
  SecondOrderScratch<T> second_order;
  Twist<T> external;  // forces on the body about its origin
  std::vector<T> external_modal;

  bool held_joint = false;  // by its law

  ArticulatedInertia<T> I;  // of the body and all that hangs on it; in the end at place b, freedoms eliminated
  std::array<Eliminated<T>, 3> freedom;
  Twist<T> base, handle, acceleration;  // of place b without the joint's freedoms; of place b; of the body's origin
  std::vector<T> q_ddot;

  // Children on moving places, slot by slot.
  std::vector<ArticulatedInertia<T>> hung;  // at their places, axes of the body
  std::vector<Vec3<T>> place;               // where they are
  std::vector<Twist<T>> U, P;               // motion per q_dot_k, and per modal force k
  std::vector<T> K, W, Z, F;                // 6s x 6s, 6s x (6s + 1), 6s x 7, 6s x 7

  // A body that hangs on a moving place of its own.
  std::vector<Twist<T>> held, C, Y, V;
  std::vector<T> M, v;
  Twist<T> beta;
};

/// What is given at an instant.
struct Instant {
  struct Drive {
    std::array<double, 2> value{}, rate{}, acceleration{};
  };
  double time = 0;                   // [s]
  std::vector<Drive> drives;         // per link
  std::vector<Twist<double>> loads;  // in their own axes
  std::vector<double> wheels;        // torques
  std::span<const LawBranch> laws;   // per joint; empty: none does anything

  explicit Instant(const Model& model)
      : drives(model.links.size()), loads(model.loads.size()), wheels(model.wheels.size()) {}

  const LawBranch& law(const Link& link) const {
    static constexpr LawBranch nothing;
    return !link.law || laws.empty() ? nothing : laws[static_cast<size_t>(link.joint)];
  }
};

/// Of bodies side by side: their part of the state, and what a link has.
struct LeavesScratch {
  Quad gap, rate;              // of their hinges
  std::vector<Quad> q, q_dot;  // n
  LinkScratch<Quad> link;

  explicit LeavesScratch(const equations::BodyOf<Quad>& body) : q(static_cast<size_t>(body.n)), q_dot(q.size()) {
    link.modes = equations::BodyScratch<Quad>(q.size(), body.J2.rows.size());
    link.external_modal.resize(q.size()), link.q_ddot.resize(q.size());
  }
};

/// Leaves are computed side by side for values alone: derivatives have their own registers.
template <class T>
inline constexpr bool has_leaves = std::is_same_v<T, double>;

template <class T>
struct Scratch {
  std::vector<LinkScratch<T>> links;
  std::vector<size_t> singles;        // links that are computed one by one
  std::vector<LeavesScratch> leaves;  // the others
  std::vector<Twist<T>> U, U_other;   // of a place
  T loss{}, power{};                  // outside the joints; of loads, wheels and drives [W]

  /// side_by_side: are leaves? Then their links have nothing.
  explicit Scratch(const Model& model, bool side_by_side = has_leaves<T>) : links(model.links.size()) {
    if (side_by_side) {
      singles = model.singles;
      for (const Leaves& l : model.leaves) leaves.emplace_back(l.body);
    } else {
      singles.resize(links.size());
      std::iota(singles.begin(), singles.end(), size_t{0});
    }
    size_t most = 0;
    for (const size_t i : singles) {
      const Link& link = model.links[i];
      LinkScratch<T>& s = links[i];
      const auto n = static_cast<size_t>(link.body.n), k = static_cast<size_t>(link.slots);
      most = std::max(most, n);
      s.modes = equations::BodyScratch<T>(n, link.body.J2.rows.size());
      s.external_modal.resize(n), s.q_ddot.resize(n);
      if (!link.hung_on_moving_place) fix_place(link.a, s.a);
      if (link.second_order) {
        SecondOrderScratch<T>& o = s.second_order;
        const size_t r = link.followers();
        o.Q.resize(n + r), o.Q_dot.resize(n + r), o.Q_ddot.resize(r), o.slope.resize(r * n);
        o.shapes = equations::BodyScratch<T>(n + r, link.shapes.J2.rows.size());
        o.Ct.resize(n), o.Gt.resize(n), o.Me.resize(n * n), o.row.resize(n), o.Me_inverse.resize(n * n);
      }
      s.hung.resize(k), s.place.resize(k);
      s.U.resize(k * n), s.P.resize(k * n);
      s.K.resize(36 * k * k), s.W.resize(6 * k * (6 * k + 1)), s.Z.resize(42 * k), s.F.resize(42 * k);
      if (link.b.moves())
        s.held.resize(n), s.C.resize(n), s.Y.resize(n), s.V.resize(n), s.M.resize(n * n), s.v.resize(n);
    }
    U.resize(most), U_other.resize(most);
  }
};

}  // namespace flexboom::tree
