#include "dynamics/simulation/formulations.hpp"

#include "dynamics/numerics/rotation.hpp"
#include "dynamics/redundant/equations.hpp"
#include "dynamics/redundant/scratch.hpp"
#include "dynamics/relative/loaded_bodies.hpp"

#include <algorithm>
#include <cmath>

namespace flexboom {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using namespace redundant;
using spatial::eigen;
using spatial::vec3;

std::vector<BodyState> body_states(const Tree& tree, double t, const Eigen::Ref<const VectorXd>& y) {
  const TreeState of = tree.unpack(y);
  std::vector<Place> origins(of.q.size());
  for (size_t i = 0; i < origins.size(); ++i) origins[i].body = static_cast<int>(i);
  const std::vector<PlaceMotionInSpace> motions = tree.motions(t, y, origins);
  std::vector<BodyState> states;
  for (size_t i = 0; i < origins.size(); ++i) {
    const PlaceMotionInSpace& brf = motions[i];
    const Eigen::Quaterniond turn(brf.axes);
    BodyState s;
    s.position = brf.position, s.velocity = brf.velocity;
    s.attitude = {turn.w(), turn.x(), turn.y(), turn.z()};
    s.omega = brf.axes.transpose() * brf.omega;
    s.q = of.q[i], s.q_dot = of.q_dot[i];
    states.push_back(std::move(s));
  }
  return states;
}

namespace {

/// A place in space, inertial axes.
PlaceMotionInSpace motion_of(const PlaceData& place, const std::vector<BodyState>& bodies) {
  Frame<double> frame;
  frame.A.row = {Vec3<double>{1, 0, 0}, Vec3<double>{0, 1, 0}, Vec3<double>{0, 0, 1}};
  Elastic<double> elastic;
  if (place.body >= 0) {
    const BodyState& s = bodies[static_cast<size_t>(place.body)];
    frame = {vec3(s.position), vec3(s.velocity), vec3(s.omega), rotation(s.attitude.data())};
    if (place.flexible) elastic = elastic_at(place, s.q.data(), s.q_dot.data());
  }
  const PlaceMotion<double> m = place_motion(place, frame, elastic);
  return {eigen(m.r), eigen(m.r_dot), eigen(m.omega), eigen(m.axes)};
}

/// The two places of a joint.
struct Pair {
  PlaceMotionInSpace a, b;

  Pair(const JointData& joint, const std::vector<BodyState>& bodies)
      : a(motion_of(joint.a, bodies)), b(motion_of(joint.b, bodies)) {}
  Matrix3d turn() const { return a.axes.transpose() * b.axes; }                    // axes of b -> of a
  Vector3d omega() const { return b.axes.transpose() * (b.omega - a.omega); }      // of b against a, axes of b
  Vector3d way() const { return a.axes.transpose() * (b.position - a.position); }  // axes of a
};

/// Turn about z of a, then y of b: R = Rz(first) Ry(second), omega = first_dot Ry^T z + second_dot y.
void set_angles(const Pair& pair, JointState& s) {
  const Matrix3d R = pair.turn();
  const Vector3d w = pair.omega();
  const double first = std::atan2(-R(0, 1), R(1, 1));
  const Vector3d x(std::cos(first), std::sin(first), 0);
  const double second = std::atan2(x.dot(R.col(2)), x.dot(R.col(0)));
  s.coordinate = {first, second};
  s.rate = {std::cos(second) * w.z() - std::sin(second) * w.x(), w.y()};
}

JointState joint_state(JointKind kind, const Pair& pair, double coordinate, double rate) {
  JointState s;
  const JointType& type = joint_type(kind);
  if (type.scalars == 1) s.coordinate = {coordinate}, s.rate = {rate};
  if (kind == JointKind::universal) set_angles(pair, s);
  if (type.turns) {
    const Eigen::Quaterniond turn(pair.turn());
    s.attitude = {turn.w(), turn.x(), turn.y(), turn.z()};
    s.omega = pair.omega();
  }
  if (type.floats) {
    s.position = pair.way();
    s.velocity = pair.a.axes.transpose() *
                 (pair.b.velocity - pair.a.velocity - pair.a.omega.cross(pair.b.position - pair.a.position));
  }
  return s;
}

}  // namespace

TreeState tree_state(const Multipliers& system, const MultibodyState& s) {
  const Prepared& p = system.impl();
  TreeState r;
  for (size_t i = 0; i < p.joints.size(); ++i)
    r.joints.push_back(joint_state(p.scene.joints[i].kind, Pair(p.joints[i], s.bodies), s.coordinate[i], s.rate[i]));
  for (const BodyState& b : s.bodies) r.q.push_back(b.q), r.q_dot.push_back(b.q_dot);
  r.spin = s.spin;
  return r;
}

namespace {

/// What spring, damper and stop of a hinge or a slider push b with, along +z of a.
double mechanism_load(const HingeMechanism& m, double coordinate, double rate) {
  const double depth = std::max(0.0, coordinate - m.threshold);
  return m.stiffness * (m.rest - coordinate) - m.damping * rate - m.stop_stiffness * depth;
}

}  // namespace

std::vector<JointLoad> joint_loads(const Multipliers& system, const MultibodyState& s) {
  const Prepared& p = system.impl();
  std::vector<JointLoad> loads;
  for (size_t i = 0; i < p.joints.size(); ++i) {
    const Joint& joint = p.scene.joints[i];
    const Matrix3d turn = Pair(p.joints[i], s.bodies).turn();
    Vector3d force = s.loads[i].force, torque = s.loads[i].torque;
    JointLoad load;
    if (!joint.prescribed.empty()) load.drive = {joint.kind == JointKind::slider ? force.z() : torque.z()};
    if (load.drive.size() < joint.prescribed.size()) load.drive.push_back(torque.dot(turn.col(1)));
    if (p.joints[i].mechanism)
      (joint.kind == JointKind::hinge ? torque : force).z() +=
          p.joints[i].law && !s.laws.empty() ? s.laws[i].load(s.coordinate[i] - joint.mechanism.threshold, s.rate[i])
                                             : mechanism_load(joint.mechanism, s.coordinate[i], s.rate[i]);
    load.force = turn.transpose() * force, load.torque = turn.transpose() * torque;
    loads.push_back(std::move(load));
  }
  return loads;
}

std::vector<StiffeningEffect> stiffening_effect(const Multipliers& system, double t, const MultibodyState& s) {
  const Prepared& p = system.impl();
  LoadedBodies bodies(
      p.scene, [&](const Place& place) { return motion_of(place_data(p.scene, p.stiffening, place), s.bodies); });
  for (size_t i = 0; i < s.bodies.size(); ++i) {
    const Matrix3d to_body = rotation_matrix(s.bodies[i].attitude).transpose();
    bodies.move(i, s.bodies[i].omega, to_body * (s.accelerations[i].of_origin - p.scene.gravity),
                s.accelerations[i].angular, s.accelerations[i].of_q);
    bodies.bend(i, s.bodies[i].q);
  }
  bodies.push_by_joints(joint_loads(system, s));
  bodies.push_by_loads(t);
  bodies.push_by_springs();
  return bodies.effects();
}

}  // namespace flexboom
