#include "dynamics/tree_impl.hpp"
#include "dynamics/tree_momenta.hpp"
#include "fem/check.hpp"
#include "reduction/geometric_stiffness.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using spatial::eigen;
using spatial::Vec3;

namespace {

/// Everything at (t, y), poses included.
TreeWorkspaceHandle evaluated(const Tree& system, const tree::Model& model, double t,
                              const Eigen::Ref<const VectorXd>& y, std::span<const char> contact,
                              std::span<const LawBranch> laws = {}) {
  require(y.size() == system.layout().size, "the state has the wrong size");
  TreeWorkspaceHandle work = system.workspace();
  VectorXd y_dot(y.size());
  const VectorXd state = y;
  system.derivative(t, state.data(), contact, *work, y_dot.data(), laws);
  tree::move_links(model, state.data(), work->instant, true, work->scratch);
  return work;
}

void add_elastic_energy(const tree::Link& link, const Joint& joint, const ReducedBody& body,
                        const Eigen::Ref<const VectorXd>& y, EnergyLedger& to) {
  if (link.law) {
    const LawModel law(joint);
    to.springs += law.spring_energy(y[link.scalar]), to.stops += law.stop_energy(y[link.scalar]);
  } else if (link.kind == JointKind::hinge || link.kind == JointKind::slider) {
    const double in_stop = energy({.stop_stiffness = joint.mechanism.stop_stiffness}, y[link.scalar]);
    to.springs += energy(joint.mechanism, y[link.scalar]) - in_stop, to.stops += in_stop;
  }
  const auto q = y.segment(link.q, link.body.n);
  if (link.body.n) to.structures += 0.5 * q.dot(body.Ke * q);
}

/// Sums over the bodies, about the inertial origin.
struct Totals {
  TreeBalance balance;
  double m = 0;
  Vector3d first_moment = Vector3d::Zero();

  void add(const tree::Link& link, const tree::LinkScratch<double>& s, const Eigen::Ref<const VectorXd>& y) {
    const tree::LinkMomenta own = tree::momenta(link, s, y.data() + link.q_dot);
    balance.kinetic += own.kinetic;
    add_momenta(eigen(s.A0 * own.linear), eigen(s.A0 * own.angular), eigen(s.R0));
    m += link.body.m;
    first_moment += link.body.m * eigen(s.R0) + eigen(s.A0 * s.mc);
  }

  void add_momenta(const Vector3d& P, const Vector3d& H, const Vector3d& R) {
    balance.momentum += P;
    balance.momentum_scale += P.norm();
    balance.angular_momentum += H + R.cross(P);
    balance.angular_momentum_scale += H.norm();
  }
};

}  // namespace

TreeBalance Tree::balance(double t, const Eigen::Ref<const VectorXd>& state) const {
  VectorXd y = state;
  impose(t, y);
  return balance(t, y, *workspace());
}

TreeBalance Tree::balance(double t, const Eigen::Ref<const VectorXd>& y, TreeWorkspace& work) const {
  require(y.size() == layout().size, "the state has the wrong size");
  const tree::Model& model = impl_->model;
  tree::Scratch<double>& scratch = work.scratch;
  tree::set_instant(model, t, work.instant);
  tree::move_links(model, y.data(), work.instant, true, scratch);
  Totals totals;
  TreeBalance& b = totals.balance;
  for (size_t i = 0; i < model.links.size(); ++i) {
    const tree::Link& link = model.links[i];
    tree::add_body(link, y.data(), scratch.links[i]);
    totals.add(link, scratch.links[i], y);
    add_elastic_energy(link, impl_->scene.joints[static_cast<size_t>(link.joint)],
                       impl_->scene.bodies[static_cast<size_t>(link.index)], y, b.ledger);
  }
  for (size_t i = 0; i < model.wheels.size(); ++i) {
    const tree::LinkScratch<double>& s = scratch.links[static_cast<size_t>(model.wheels[i].link)];
    const Vec3<double>& axis = model.wheels[i].at.position;
    const double J = impl_->scene.wheels[i].inertia;
    const double spin = y[model.spin + static_cast<int>(i)] + dot(axis, s.w);
    b.kinetic += 0.5 * J * spin * spin;
    totals.add_momenta(Vector3d::Zero(), eigen(s.A0 * ((J * spin) * axis)), Vector3d::Zero());
  }
  for (const tree::SpringModel& spring : model.springs) {
    const auto from = tree::find_place(model, spring.a, y.data(), scratch, scratch.U);
    const auto to = tree::find_place(model, spring.b, y.data(), scratch, scratch.U);
    const double stretch = eigen(to.position - from.position).norm() - spring.free_length;
    b.ledger.springs += 0.5 * spring.stiffness * stretch * stretch;
  }
  b.elastic = b.ledger.stored();
  b.potential = -impl_->scene.gravity.dot(totals.first_moment);
  b.angular_momentum -= (totals.first_moment / totals.m).cross(b.momentum);
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

PlaceMotionInSpace Tree::motion(double t, const Eigen::Ref<const VectorXd>& state, const Place& place) const {
  const tree::Model& model = impl_->model;
  VectorXd y = state;
  impose(t, y);
  const TreeWorkspaceHandle work = workspace();
  tree::set_instant(model, t, work->instant);
  tree::move_links(model, y.data(), work->instant, true, work->scratch);
  const tree::PlacedOn on = tree::packed_place(model, place, "place");
  const auto found = tree::find_place(model, on, y.data(), work->scratch, work->scratch.U);
  PlaceMotionInSpace m{eigen(found.position), eigen(found.velocity), eigen(found.omega), {}};
  for (int i = 0; i < 3; ++i) m.axes.row(i) = eigen(found.axes.row[static_cast<size_t>(i)]).transpose();
  return m;
}

std::vector<JointLoad> Tree::joint_loads(double t, const Eigen::Ref<const VectorXd>& y, std::span<const char> contact,
                                         std::span<const LawBranch> laws) const {
  const tree::Model& model = impl_->model;
  const TreeWorkspaceHandle work = evaluated(*this, model, t, y, contact, laws);
  std::vector<JointLoad> loads(impl_->scene.joints.size());
  const VectorXd state = y;
  for (size_t i = 0; i < model.links.size(); ++i) {
    const tree::Link& link = model.links[i];
    if (link.kind == JointKind::free) continue;
    const tree::LinkScratch<double>& s = work->scratch.links[i];
    const tree::Twist<double> load = tree::joint_load(s);
    JointLoad& out = loads[static_cast<size_t>(link.joint)];
    out.force = eigen(load.t), out.torque = eigen(load.w);
    for (int k = 0; link.prescribed && k < joint_type(link.kind).scalars; ++k)
      out.drive.push_back(tree::drive_load(link, k, state.data(), work->instant.drives[i], {},
                                           contact[static_cast<size_t>(link.joint)] != 0, s));
  }
  return loads;
}

namespace {

/// Kg of the motion of a body; s: what the sweeps left.
MatrixXd stiffness_of_motion(const ReducedBody& body, const tree::Link& link, const tree::LinkScratch<double>& s) {
  const Vec3<double>& o = link.brf_origin;
  const auto& A = link.brf_axes;
  const Vec3<double> a = s.acceleration.t + cross(s.acceleration.w, o) + cross(s.w, cross(s.w, o));
  return motion_stiffness(body, eigen(transposed_product(A, s.w)), eigen(transposed_product(A, a)),
                          eigen(transposed_product(A, s.acceleration.w)));
}

}  // namespace

StiffeningEffect stiffening_effect(const ReducedBody& body, const MatrixXd& Kg) {
  const auto [least, most] = relative_stiffness(body, Kg);
  return {std::max(-least, most), std::max(-least, 0.0)};
}

std::vector<StiffeningEffect> Tree::stiffening_effect(double t, const Eigen::Ref<const VectorXd>& y,
                                                      std::span<const char> contact,
                                                      std::span<const LawBranch> laws) const {
  const tree::Model& model = impl_->model;
  const TreeWorkspaceHandle work = evaluated(*this, model, t, y, contact, laws);
  std::vector<MatrixXd> K(impl_->scene.bodies.size());
  for (size_t i = 0; i < model.links.size(); ++i) {
    const tree::Link& link = model.links[i];
    const tree::LinkScratch<double>& s = work->scratch.links[i];
    K[static_cast<size_t>(link.index)] =
        stiffness_of_motion(impl_->scene.bodies[static_cast<size_t>(link.index)], link, s);
    if (!link.hung_on_moving_place) continue;
    const tree::Link& parent = model.links[static_cast<size_t>(link.parent)];
    const tree::Twist<double> load = tree::joint_load(s);
    const Vec3<double> F = -(s.A * load.t), M = -(s.A * load.w) + cross(s.lever, F);
    K[static_cast<size_t>(parent.index)] +=
        marker_stiffness(impl_->scene.bodies[static_cast<size_t>(parent.index)],
                         impl_->scene.joints[static_cast<size_t>(link.joint)].a.marker,
                         eigen(transposed_product(parent.brf_axes, F)), eigen(transposed_product(parent.brf_axes, M)));
  }
  std::vector<StiffeningEffect> effect;
  for (size_t i = 0; i < K.size(); ++i) effect.push_back(flexboom::stiffening_effect(impl_->scene.bodies[i], K[i]));
  return effect;
}

}  // namespace flexboom
