#include "dynamics/relative/impl.hpp"
#include "dynamics/relative/loaded_bodies.hpp"
#include "dynamics/relative/momenta.hpp"
#include "fem/base/check.hpp"

#include <algorithm>

namespace flexboom {

using Eigen::Vector3d;
using Eigen::VectorXd;
using spatial::eigen;
using spatial::Vec3;

namespace {

/// Everything at (t, y), each link by itself.
tree::Scratch<double>& evaluated(const Tree& system, const tree::Model& model, double t, const VectorXd& y,
                                 std::span<const char> contact, TreeWorkspace& work, std::span<const LawBranch> laws) {
  require(y.size() == system.layout().size, "the state has the wrong size");
  if (work.alone == nullptr) work.alone = std::make_unique<tree::Scratch<double>>(model, false);
  tree::link_by_link(model, t, y, contact, laws, *work.alone);
  return *work.alone;
}

void add_joint_energy(const tree::Link& link, const Joint& joint, const Eigen::Ref<const VectorXd>& y,
                      EnergyLedger& to) {
  if (link.law) {
    const LawModel law(joint);
    to.springs += law.spring_energy(y[link.scalar]), to.stops += law.stop_energy(y[link.scalar]);
  } else if (link.kind == JointKind::hinge || link.kind == JointKind::slider) {
    const double in_stop = energy({.stop_stiffness = joint.mechanism.stop_stiffness}, y[link.scalar]);
    to.springs += energy(joint.mechanism, y[link.scalar]) - in_stop, to.stops += in_stop;
  }
}

}  // namespace

Balance Tree::balance(double t, const Eigen::Ref<const VectorXd>& state) const {
  VectorXd y = state;
  impose(t, y);
  return balance(t, y, *workspace());
}

Balance Tree::balance(double t, const Eigen::Ref<const VectorXd>& y, TreeWorkspace& work) const {
  require(y.size() == layout().size, "the state has the wrong size");
  const tree::Model& model = impl_->model;
  tree::Scratch<double>& scratch = work.scratch;
  tree::set_instant(model, t, work.instant);
  tree::Reference near;  // the first body that floats
  for (const TreeLayout::Joint& joint : impl_->layout.joints) {
    if (joint.position < 0) continue;
    const tree::Link& link = *std::ranges::find(model.links, joint.position, &tree::Link::position);
    if (link.parent >= 0) continue;
    const Vector3d R = y.segment<3>(joint.position), V = y.segment<3>(joint.velocity);
    near = {link.a.position + link.a.axes * spatial::vec3(R), link.a.axes * spatial::vec3(V)};
    break;
  }
  const tree::Totals all = tree::totals(model, y.data(), work.instant, near, scratch, {}, false);
  Balance b;
  const Vector3d P = eigen(all.momentum), V = eigen(near.velocity);
  b.bodies = all.kinetic;
  b.kinetic = all.kinetic + V.dot(P) + 0.5 * all.m * V.squaredNorm() + all.spinning;
  b.momentum = P + all.m * V;
  b.momentum_scale = all.momentum_scale;
  b.angular_momentum = eigen(all.angular_momentum_about_mass_centre());
  b.angular_momentum_scale = all.angular_momentum_scale;
  b.ledger.structures = all.strain;
  for (const tree::Link& link : model.links)
    add_joint_energy(link, impl_->scene.joints[static_cast<size_t>(link.joint)], y, b.ledger);
  for (const tree::SpringModel& spring : model.springs) {
    const auto from = tree::find_place(model, spring.a, y.data(), scratch, scratch.U);
    const auto to = tree::find_place(model, spring.b, y.data(), scratch, scratch.U);
    const double stretch = eigen(to.position - from.position).norm() - spring.free_length;
    b.ledger.springs += 0.5 * spring.stiffness * stretch * stretch;
  }
  b.elastic = b.ledger.stored();
  b.potential = 0 - impl_->scene.gravity.dot(eigen(all.first_moment) + all.m * eigen(near.position));
  b.ledger.elsewhere = y[impl_->layout.dissipated_elsewhere];
  for (const TreeLayout::Joint& joint : impl_->layout.joints) {
    b.dissipated_by_joint.push_back(y[joint.dissipated]);
    b.ledger.dampers += y[joint.dissipated];
    if (joint.losses < 0) continue;
    for (int k = 0; k < static_cast<int>(law_losses.size()); ++k) {
      b.dissipated_by_joint.back() += y[joint.losses + k];
      b.ledger.laws[static_cast<size_t>(k)] += y[joint.losses + k];
    }
  }
  for (const double d : b.dissipated_by_joint) b.dissipated += d;
  b.dissipated += b.ledger.elsewhere;
  b.work = y[impl_->layout.work];
  return b;
}

namespace {

/// A place, after the links have moved.
PlaceMotionInSpace in_space(const tree::Model& model, const Place& place, const VectorXd& y,
                            tree::Scratch<double>& scratch) {
  const tree::PlacedOn on = tree::packed_place(model, place, "place");
  const auto found = tree::find_place(model, on, y.data(), scratch, scratch.U);
  return {eigen(found.position), eigen(found.velocity), eigen(found.omega), eigen(found.axes)};
}

/// What the joint of a link exerts on place b, after the accelerations.
JointLoad load_on_b(const tree::LinkScratch<double>& s) {
  const tree::Twist<double> load = tree::joint_load(s);
  return {eigen(load.t), eigen(load.w), {}};
}

}  // namespace

PlaceMotionInSpace Tree::motion(double t, const Eigen::Ref<const VectorXd>& state, const Place& place) const {
  return motions(t, state, {&place, 1}).front();
}

std::vector<PlaceMotionInSpace> Tree::motions(double t, const Eigen::Ref<const VectorXd>& state,
                                              std::span<const Place> places) const {
  const tree::Model& model = impl_->model;
  VectorXd y = state;
  impose(t, y);
  tree::Scratch<double> scratch(model, false);
  tree::Instant instant(model);
  tree::set_instant(model, t, instant);
  tree::move_links(model, y.data(), instant, true, scratch);
  std::vector<PlaceMotionInSpace> r;
  r.reserve(places.size());
  for (const Place& place : places) r.push_back(in_space(model, place, y, scratch));
  return r;
}

std::vector<JointLoad> Tree::joint_loads(double t, const VectorXd& y, std::span<const char> contact,
                                         TreeWorkspace& work, std::span<const LawBranch> laws) const {
  const tree::Model& model = impl_->model;
  const tree::Scratch<double>& scratch = evaluated(*this, model, t, y, contact, work, laws);
  std::vector<JointLoad> loads(impl_->scene.joints.size());
  tree::Instant instant(model);
  tree::set_instant(model, t, instant);
  for (size_t i = 0; i < model.links.size(); ++i) {
    const tree::Link& link = model.links[i];
    if (link.kind == JointKind::free) continue;
    const tree::LinkScratch<double>& s = scratch.links[i];
    JointLoad& out = loads[static_cast<size_t>(link.joint)] = load_on_b(s);
    for (int k = 0; link.prescribed && k < joint_type(link.kind).scalars; ++k)
      out.drive.push_back(
          tree::drive_load(link, k, y.data(), instant.drives[i], {}, contact[static_cast<size_t>(link.joint)] != 0, s));
  }
  return loads;
}

std::vector<StiffeningEffect> Tree::stiffening_effect(double t, const VectorXd& y, std::span<const char> contact,
                                                      TreeWorkspace& work, std::span<const LawBranch> laws) const {
  const tree::Model& model = impl_->model;
  tree::Scratch<double>& scratch = evaluated(*this, model, t, y, contact, work, laws);
  LoadedBodies bodies(impl_->scene, [&](const Place& place) { return in_space(model, place, y, scratch); });
  std::vector<JointLoad> loads(impl_->scene.joints.size());
  for (size_t i = 0; i < model.links.size(); ++i) {
    const tree::Link& link = model.links[i];
    const tree::LinkScratch<double>& s = scratch.links[i];
    const Vec3<double>& o = link.brf_origin;
    const auto in_brf = [&](const Vec3<double>& v) { return eigen(transposed_product(link.brf_axes, v)); };
    const Vec3<double> a = s.acceleration.t + cross(s.acceleration.w, o) + cross(s.w, cross(s.w, o));
    bodies.move(static_cast<size_t>(link.index), in_brf(s.w), in_brf(a), in_brf(s.acceleration.w),
                VectorXd::Map(s.q_ddot.data(), link.body.n));
    bodies.bend(static_cast<size_t>(link.index), y.segment(link.q, link.body.n));
    loads[static_cast<size_t>(link.joint)] = load_on_b(s);
  }
  bodies.push_by_joints(loads);
  bodies.push_by_loads(t);
  bodies.push_by_springs();
  return bodies.effects();
}

}  // namespace flexboom
