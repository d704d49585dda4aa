#include "dynamics/relative/constants.hpp"

#include "dynamics/model/multibody_check.hpp"
#include "dynamics/model/second_order_shapes.hpp"
#include "dynamics/relative/body_constants.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexboom::tree {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using spatial::eigen;
using spatial::mat3;
using spatial::vec3;

namespace {

std::vector<Vec3<double>> columns(const Matrix3Xd& m) {
  std::vector<Vec3<double>> r;
  for (Eigen::Index k = 0; k < m.cols(); ++k) r.push_back(vec3(m.col(k)));
  return r;
}

/// Does a marker's motion exceed round-off? Against the motion that mass and shape of the body speak of.
bool moves(const ReducedBody& b, const Marker& m) {
  const double length = std::sqrt(b.J0.trace() / b.m);
  for (Eigen::Index k = 0; k < b.n(); ++k) {
    const double typical = 1e-13 * std::sqrt(b.Me(k, k) / b.m);
    if (m.S.col(k).norm() > typical || m.S_theta.col(k).norm() * length > typical) return true;
  }
  return false;
}

/// Shapes of the place, in the axes of the link.
void set_shapes(const ReducedBody& b, const std::string& name, const Matrix3d& to_link, bool second_order,
                PlaceModel& place) {
  if (name.empty() || b.n() == 0 || !moves(b, marker(b, name))) return;
  const Marker& m = marker(b, name);
  place.S = columns(to_link * m.S);
  place.S_theta = columns(to_link * m.S_theta);
  if (!second_order) return;
  for (const MarkerStiffness& s : b.Kg.markers) {
    if (s.marker != name) continue;
    const auto slope = [&](const std::vector<MatrixXd>& Kg) {  // u2 = -1/2 q^T Kg q
      std::vector<MatrixXd> r(Kg.size(), MatrixXd::Zero(b.n(), b.n()));
      for (size_t i = 0; i < Kg.size(); ++i)
        for (size_t j = 0; j < Kg.size(); ++j) r[i] -= to_link(static_cast<int>(i), static_cast<int>(j)) * Kg[j];
      return equations::Rows<double>(packed_vector_family(r));
    };
    place.S_slope = slope(s.force);
    place.theta_slope = slope(s.torque);
  }
}

/// The tree joint that carries each body.
std::vector<int> carriers(const Multibody& scene) {
  std::vector<int> carrier(scene.bodies.size(), -1);
  for (size_t j = 0; j < scene.joints.size(); ++j) {
    const Joint& joint = scene.joints[j];
    require(!joint.closes_loop, fmt::format("joint {} closes a loop: a tree has none; such scenes need the formulation "
                                            "with multipliers",
                                            joint.name));
    require(joint.b.body >= 0, fmt::format("joint {}: its place b must be on a body, place a on the one nearer to the "
                                           "inertial frame",
                                           joint.name));
    int& by = carrier[static_cast<size_t>(joint.b.body)];
    const std::string& body = scene.bodies[static_cast<size_t>(joint.b.body)].name;
    require(by < 0, fmt::format("body {} hangs on two joints, {} and {}: one of them closes a loop", body,
                                by < 0 ? "" : scene.joints[static_cast<size_t>(by)].name, joint.name));
    by = static_cast<int>(j);
  }
  for (size_t i = 0; i < carrier.size(); ++i)
    require(carrier[i] >= 0, fmt::format("body {} hangs on no joint; if it flies, give it a free joint to the inertial "
                                         "frame",
                                         scene.bodies[i].name));
  return carrier;
}

/// Bodies with parents first, else as given.
std::vector<int> order_of(const Multibody& scene, const std::vector<int>& carrier) {
  std::vector<int> order, depth(scene.bodies.size(), 0);
  std::vector<char> placed(scene.bodies.size(), 0);
  for (int i = 0; i < std::ssize(scene.bodies); ++i) {
    std::vector<int> path;
    for (int b = i; b >= 0 && !placed[static_cast<size_t>(b)];
         b = scene.joints[static_cast<size_t>(carrier[static_cast<size_t>(b)])].a.body) {
      require(path.size() < scene.bodies.size(),
              fmt::format("body {} hangs on itself in a circle of joints, none of which leads to the inertial frame",
                          scene.bodies[static_cast<size_t>(i)].name));
      path.push_back(b);
    }
    std::ranges::reverse(path);
    for (const int b : path) order.push_back(b), placed[static_cast<size_t>(b)] = 1;
  }
  return order;
}

void set_mechanism(const Joint& joint, Link& link) {
  const HingeMechanism& m = joint.mechanism;
  const bool has_one = joint.kind == JointKind::hinge || joint.kind == JointKind::slider;
  link.threshold = has_one ? m.threshold : 0;
  link.body.cos_threshold = std::cos(m.threshold);
  link.body.sin_threshold = std::sin(m.threshold);
  link.body.stiffness = m.stiffness;
  link.body.preload = m.stiffness * (m.rest - m.threshold);
  link.body.damping = m.damping;
  link.body.stop_stiffness = m.stop_stiffness;
  link.prescribed = !joint.prescribed.empty();
  link.law = joint.law.given();
  if (link.law) link.body.stiffness = link.body.preload = link.body.damping = link.body.stop_stiffness = 0;
}

void set_second_order(const SecondOrderShapes& body, const Vector3d& origin, const Matrix3d& axes, Link& link) {
  const ReducedBody own = seen_from(body.body, origin, axes);
  pack_integrals(own, link.shapes);
  link.follow = equations::Rows<double>(packed_vector_family(body.follow));
  const auto r = std::ssize(body.follow), n = own.n() - r;
  for (Eigen::Index a = n; a < own.n(); ++a)
    for (Eigen::Index k = 0; k < n; ++k) link.Me_follow.push_back(own.Me(a, k));
}

Link make_link(const Multibody& scene, int index, int joint_index, Stiffening stiffening) {
  const Joint& joint = scene.joints[static_cast<size_t>(joint_index)];
  const ReducedBody& body = scene.bodies[static_cast<size_t>(index)];
  Link link;
  link.index = index;
  link.joint = joint_index;
  link.kind = joint.kind;
  const Vector3d origin = position_of(scene, joint.b);
  const Matrix3d to_link = joint.b.axes.transpose();
  link.brf_axes = mat3(to_link);
  link.brf_origin = vec3(-to_link * origin);
  const ReducedBody own = seen_from(body, origin, joint.b.axes);
  link.second_order = stiffening == Stiffening::on && body.n() > 0;
  if (link.second_order) set_second_order(with_second_order_shapes(body), origin, joint.b.axes, link);
  set_shapes(body, joint.b.marker, to_link, link.second_order, link.b);
  link.b.axes = mat3(Matrix3d::Identity());
  pack_invariants(own, link.body);
  set_mechanism(joint, link);
  return link;
}

/// Gives every part of the state its place in y.
void lay_out(const Multibody& scene, Model& model, TreeLayout& l) {
  l.joints.resize(scene.joints.size());
  l.q.resize(scene.bodies.size());
  for (Link& link : model.links) {
    const JointType& type = joint_type(link.kind);
    TreeLayout::Joint& joint = l.joints[static_cast<size_t>(link.joint)];
    if (type.scalars) joint.scalar = l.p;
    l.p += type.scalars;
    l.q[static_cast<size_t>(link.index)] = l.p;
    l.p += link.body.n;
    l.base += type.turns ? 3 : 0;
  }
  l.u = l.base + l.p;
  l.spin = l.p + l.u;
  int omega = l.p, next = l.spin + static_cast<int>(scene.wheels.size());
  for (Link& link : model.links) {
    const JointType& type = joint_type(link.kind);
    TreeLayout::Joint& joint = l.joints[static_cast<size_t>(link.joint)];
    if (type.turns) joint.omega = omega, omega += 3;
    if (type.floats) joint.position = next, next += 3;
    if (type.turns) joint.attitude = next, next += 4;
    if (type.floats) joint.velocity = next, next += 3;
  }
  l.dissipated = next;
  for (TreeLayout::Joint& joint : l.joints) joint.dissipated = next++;
  l.dissipated_elsewhere = next++;
  l.work = next++;
  for (size_t i = 0; i < scene.joints.size(); ++i)
    if (scene.joints[i].law.given()) l.joints[i].losses = next, next += static_cast<int>(law_losses.size());
  l.size = next;
  for (Link& link : model.links) {
    const TreeLayout::Joint& joint = l.joints[static_cast<size_t>(link.joint)];
    link.scalar = joint.scalar;
    link.rate = joint.scalar < 0 ? -1 : l.rate(joint.scalar);
    link.q = l.q[static_cast<size_t>(link.index)];
    link.q_dot = l.rate(link.q);
    link.omega = joint.omega, link.position = joint.position, link.attitude = joint.attitude;
    link.velocity = joint.velocity, link.dissipated = joint.dissipated;
    link.losses = joint.losses;
  }
  model.spin = l.spin, model.losses = l.dissipated_elsewhere, model.work = l.work;
}

void add_forces(const Multibody& scene, Model& model) {
  for (const Load& load : scene.loads) model.loads.push_back(packed_place(model, load.at, "load " + load.name));
  for (const SpringDamper& s : scene.springs)
    model.springs.push_back({packed_place(model, s.a, "spring " + s.name + ", place a"),
                             packed_place(model, s.b, "spring " + s.name + ", place b"), s.stiffness, s.free_length,
                             s.damping});
  for (const ReactionWheel& w : scene.wheels) {
    PlacedOn on = packed_place(model, {.body = w.body, .marker = {}}, "wheel " + w.name);
    const Link& link = model.links[static_cast<size_t>(on.link)];
    on.at.position = link.brf_axes * vec3(w.axis);
    model.wheels.push_back(on);
  }
  model.poses = !scene.loads.empty() || !scene.springs.empty() || scene.field;
  model.forces = model.poses || !scene.wheels.empty();
}

}  // namespace

PlacedOn packed_place(const Model& model, const Place& place, const std::string& of) {
  const Multibody& scene = *model.scene;
  check_place(scene, place, of);
  PlacedOn r;
  r.at.position = vec3(place.position);
  r.at.axes = mat3(place.axes);
  if (place.body < 0) return r;
  const auto found =
      std::find_if(model.links.begin(), model.links.end(), [&](const Link& link) { return link.index == place.body; });
  r.link = static_cast<int>(found - model.links.begin());
  r.at.position = found->brf_origin + found->brf_axes * vec3(position_of(scene, place));
  r.at.axes = mat3(eigen(found->brf_axes) * place.axes);
  set_shapes(scene.bodies[static_cast<size_t>(place.body)], place.marker, eigen(found->brf_axes), found->second_order,
             r.at);
  return r;
}

Model packed_model(const Multibody& scene, const std::vector<Stiffening>& stiffening, TreeLayout& layout) {
  require(stiffening.size() == 1 || stiffening.size() == scene.bodies.size(),
          "geometric stiffness: one choice for all bodies or one per body is needed");
  require(!scene.bodies.empty(), "there is no body: nothing moves");
  check(scene);
  const std::vector<int> carrier = carriers(scene), order = order_of(scene, carrier);
  Model model;
  model.scene = &scene;
  model.gravity = vec3(scene.gravity);
  std::vector<int> link_of(scene.bodies.size(), -1);
  for (const int body : order) {
    const int joint_index = carrier[static_cast<size_t>(body)];
    const Joint& joint = scene.joints[static_cast<size_t>(joint_index)];
    Link link = make_link(scene, body, joint_index, stiffening[stiffening.size() == 1 ? 0 : static_cast<size_t>(body)]);
    PlacedOn a = packed_place(model, joint.a, fmt::format("joint {}, place a", joint.name));
    link.parent = a.link;
    link.a = std::move(a.at);
    link.hung_on_moving_place = link.a.moves();
    if (link.hung_on_moving_place) link.slot = model.links[static_cast<size_t>(link.parent)].slots++;
    model.links.push_back(std::move(link));
  }
  lay_out(scene, model, layout);
  add_forces(scene, model);
  place_side_by_side(model);
  return model;
}

}  // namespace flexboom::tree
