#pragma once

// What Tree computes with: the scene packed for the inner loop. Internal to `dynamics`.

#include "dynamics/numerics/quad.hpp"
#include "dynamics/relative/body_equations.hpp"
#include "dynamics/relative/tree.hpp"

#include <array>
#include <vector>

namespace flexboom::tree {

using spatial::Mat3;
using spatial::Sym3;
using spatial::Vec3;

/// A place on a body, in the body's own frame (its place b, undeformed). With shapes it moves by S q + u2 and turns by
/// the rotation vector S_theta q + theta2, second order only with geometric stiffness.
struct PlaceModel {
  Vec3<double> position;
  Mat3<double> axes;
  std::vector<Vec3<double>> S, S_theta;          // n; empty: fixed in the body
  equations::Rows<double> S_slope, theta_slope;  // d S_k / d q_l

  bool moves() const { return !S.empty(); }
};

/// A body with the joint that carries it. Its frame is place b, undeformed.
struct Link {
  equations::Body body;
  /// With geometric stiffness: integrals of n + r shapes, the last r of which follow the coordinates: they move by
  /// Q_a = 1/2 q^T H_a q, H_a the terms of component a. Together they move the points by S q + u2(q).
  equations::Body shapes;
  equations::Rows<double> follow;
  std::vector<double> Me_follow;  // r x n, integral of rho S_a . S_k
  bool second_order = false;

  size_t followers() const { return second_order ? static_cast<size_t>(shapes.n - body.n) : 0; }

  int index = 0, joint = 0;  // in the scene
  int parent = -1;           // link; -1: the inertial frame
  JointKind kind = JointKind::free;
  PlaceModel a, b;  // a in the parent's frame
  bool hung_on_moving_place = false;
  int slot = -1;  // among the children of the parent that hang on moving places
  int slots = 0;  // own children there
  double threshold = 0;
  bool prescribed = false;
  bool law = false;  // beside the mechanism, which is then part of it

  // Places in y, -1: none.
  int scalar = -1, rate = -1, q = 0, q_dot = 0, omega = -1, position = -1, attitude = -1, velocity = -1,
      dissipated = -1, losses = -1;
  Vec3<double> brf_origin;  // of the body's BRF in its frame, and the axes of the BRF there
  Mat3<double> brf_axes;
};

/// Two to four bodies that are computed side by side. They hang on one parent by joints of one kind, hinges or fixed
/// ones. They carry nothing, and have equally many modes.
struct Leaves {
  equations::BodyOf<Quad> body;
  JointKind kind = JointKind::hinge;
  int parent = -1;      // link; -1: the inertial frame
  Vec3<Quad> position;  // places a, in the parent's frame
  Mat3<Quad> axes;
  std::array<int, Quad::width> link{};  // lanes that are left over repeat the last body
  int count = 0;
};

struct PlacedOn {
  int link = -1;
  PlaceModel at;
};

struct SpringModel {
  PlacedOn a, b;
  double stiffness = 0, free_length = 0, damping = 0;
};

struct Model {
  std::vector<Link> links;              // parents first
  std::vector<Leaves> leaves;           // some of them again
  std::vector<size_t> singles;          // the others
  std::vector<PlacedOn> loads, wheels;  // a wheel's axis is at.position
  std::vector<SpringModel> springs;
  Vec3<double> gravity;
  int spin = 0, losses = 0, work = 0;  // places in y
  bool forces = false;                 // is there anything beside joints, structures and gravity?
  bool poses = false;                  // do forces need where bodies are in space?
  const Multibody* scene = nullptr;
};

/// @throws InputError as Tree::Tree.
Model packed_model(const Multibody&, const std::vector<Stiffening>&, TreeLayout&);

/// Sets `leaves` and `singles`.
void place_side_by_side(Model&);

/// A place in the frame of its link.
PlacedOn packed_place(const Model&, const Place&, const std::string& of);

}  // namespace flexboom::tree
