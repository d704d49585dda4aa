#include "dynamics/relative/tree.hpp"

#include "dynamics/model/load_values.hpp"
#include "dynamics/numerics/inner_loop.hpp"
#include "dynamics/numerics/method_failure.hpp"
#include "dynamics/relative/impl.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace tree {

void set_instant(const Model& model, double t, Instant& instant) {
  instant.time = t;
  for (size_t i = 0; i < model.links.size(); ++i) {
    const Link& link = model.links[i];
    if (!link.prescribed) continue;
    const std::vector<TimeFunction>& functions = model.scene->joints[static_cast<size_t>(link.joint)].prescribed;
    for (size_t k = 0; k < functions.size(); ++k) {
      instant.drives[i].value[k] = functions[k].value(t) - link.threshold;
      instant.drives[i].rate[k] = functions[k].rate(t);
      instant.drives[i].acceleration[k] = functions[k].acceleration(t);
    }
  }
  for (size_t i = 0; i < model.loads.size(); ++i) {
    const ForceAndTorque load = load_in_own_axes(model.scene->loads[i], t);
    instant.loads[i] = {load.force, load.torque};
  }
  for (size_t i = 0; i < model.wheels.size(); ++i) {
    const std::function<double(double)>& torque = model.scene->wheels[i].torque;
    instant.wheels[i] = torque ? torque(t) : 0.0;
  }
}

void link_by_link(const Model& model, double t, const VectorXd& y, std::span<const char> contact,
                  std::span<const LawBranch> laws, Scratch<double>& scratch) {
  Instant instant(model);
  set_instant(model, t, instant);
  instant.laws = laws;
  VectorXd y_dot(y.size());
  derivative(model, y.data(), instant, contact, scratch, y_dot.data());
  move_links(model, y.data(), instant, true, scratch);
}

}  // namespace tree

namespace {

constexpr double too_little = 1e-12;  // of an inertia: what is left of it is round-off

/// Does freedom k of the link's joint move inertia?
bool moves_inertia(const tree::Link& link, const tree::LinkScratch<double>& s, int k) {
  const bool slides = joint_type(link.kind).freedom[static_cast<size_t>(k)] < Freedom::turn_x;
  const double scale = slides ? link.body.m : link.body.J0.xx + link.body.J0.yy + link.body.J0.zz;
  const double inverse_D = s.freedom[static_cast<size_t>(k)].inverse_D;
  return inverse_D > 0 && too_little * scale * inverse_D < 1;
}

/// Is the mass matrix over the coordinates of the body positive definite?
bool has_modal_mass(const tree::Link& link, const tree::LinkScratch<double>& s) {
  if (!link.b.moves()) return !link.second_order || s.second_order.least_pivot > 0;
  const auto n = static_cast<size_t>(link.body.n);
  for (size_t k = 0; k < n; ++k)
    if (!(s.M[k * (n + 1)] > 0)) return false;
  return true;
}

/// The first freedom of a link's joint that moves too little inertia, or -1.
int weightless_freedom(const tree::Link& link, const tree::LinkScratch<double>& s) {
  if (link.kind == JointKind::free || link.prescribed || s.held_joint) return -1;
  for (int k = 0; k < joint_type(link.kind).freedoms; ++k)
    if (!moves_inertia(link, s, k)) return k;
  return -1;
}

/// What is wrong with the mass matrix at the body of a link; empty where nothing is.
std::string mass_fault(const Multibody& scene, const tree::Link& link, const tree::LinkScratch<double>& s) {
  const JointType& type = joint_type(link.kind);
  const std::string& joint = scene.joints[static_cast<size_t>(link.joint)].name;
  const std::string& body = scene.bodies[static_cast<size_t>(link.index)].name;
  if (const int k = weightless_freedom(link, s); k >= 0) {
    const bool slides = type.freedom[static_cast<size_t>(k)] < Freedom::turn_x;
    return fmt::format(
        "joint {}: freedom {} of it moves an inertia of {:.3g} {}: too little to compute with; give body "
        "{} inertia there, or fewer modes",
        joint, k + 1, 1 / s.freedom[static_cast<size_t>(k)].inverse_D, slides ? "kg" : "kg m^2", body);
  }
  if (has_modal_mass(link, s)) return "";
  return fmt::format("joint {}: the mass matrix of the coordinates of body {} is not positive definite", joint, body);
}

/// A joint must move inertia, else its acceleration is noise. At the state where all coordinates are zero.
void check_inertia(const Tree& system, const tree::Model& model) {
  const VectorXd y = system.pack(system.at_rest());
  const std::vector<char> open(system.scene().joints.size(), 0);
  tree::Scratch<double> scratch(model, false);
  tree::link_by_link(model, 0, y, open, {}, scratch);
  for (size_t i = model.links.size(); i-- > 0;) {  // tips first: what is bad there spoils all before
    const tree::Link& link = model.links[i];
    const tree::LinkScratch<double>& s = scratch.links[i];
    const std::string fault = mass_fault(system.scene(), link, s);
    require(fault.empty(), fault);
    if (link.kind != JointKind::free) continue;
    const Matrix3d mass = spatial::eigen(s.I.tt), J = spatial::eigen(s.I.ww), c = spatial::eigen(s.I.tw);
    const Matrix3d left = J - c.transpose() * mass.ldlt().solve(c);
    const double least =
        Eigen::SelfAdjointEigenSolver<Matrix3d>(Matrix3d((left + left.transpose()) / 2)).eigenvalues()(0);
    require(least > too_little * J.trace() && mass.allFinite(),
            fmt::format("joint {}: with everything on it, body {} has an inertia of {:.3g} of {:.3g} kg m^2 about one "
                        "axis: too little to compute with",
                        system.scene().joints[static_cast<size_t>(link.joint)].name,
                        system.scene().bodies[static_cast<size_t>(link.index)].name, std::max(0.0, least), J.trace()));
  }
}

/// Do the hinges of all leaves move inertia?
bool leaves_move_inertia(const tree::Leaves& leaves, const tree::LinkScratch<Quad>& s) {
  if (leaves.kind != JointKind::hinge) return true;
  const Quad& inverse_D = s.freedom[0].inverse_D;
  const Quad part = too_little * (leaves.body.J0.xx + leaves.body.J0.yy + leaves.body.J0.zz) * inverse_D;
  bool all = true;
  for (int i = 0; i < leaves.count; ++i) all = all && lane(inverse_D, i) > 0 && lane(part, i) < 1;
  return all;
}

/// Is no mass matrix singular or indefinite?
bool is_sound(const tree::Model& model, const tree::Scratch<double>& scratch) {
  bool sound = true;
  for (size_t i = 0; i < scratch.leaves.size(); ++i)
    sound = sound && leaves_move_inertia(model.leaves[i], scratch.leaves[i].link);
  for (const size_t i : scratch.singles) {
    const tree::Link& link = model.links[i];
    const tree::LinkScratch<double>& s = scratch.links[i];
    sound = sound && has_modal_mass(link, s) && weightless_freedom(link, s) < 0;
  }
  return sound;
}

/// @throws UnfitState naming the first body, from the tips inwards, whose mass matrix is singular or indefinite.
void report_mass(const tree::Model& model, double t, const VectorXd& y, std::span<const char> contact,
                 std::span<const LawBranch> laws) {
  if (!y.allFinite()) return;
  tree::Scratch<double> scratch(model, false);
  tree::link_by_link(model, t, y, contact, laws, scratch);
  for (size_t i = model.links.size(); i-- > 0;) {
    const std::string fault = mass_fault(*model.scene, model.links[i], scratch.links[i]);
    if (!fault.empty()) throw UnfitState(fmt::format("t = {:.9g} s: {}", t, fault));
  }
}

}  // namespace

Tree::Tree(Multibody scene, std::vector<Stiffening> stiffening) : impl_(std::make_unique<Impl>()) {
  impl_->scene = std::move(scene);
  impl_->model = tree::packed_model(impl_->scene, stiffening, impl_->layout);
  stiffening.resize(impl_->scene.bodies.size(), stiffening[0]);
  impl_->stiffening = std::move(stiffening);
  for (const tree::Link& link : impl_->model.links) {
    const bool stops = link.kind == JointKind::hinge || link.kind == JointKind::slider;
    if (stops && link.body.stop_stiffness > 0 && !link.prescribed) impl_->stops.push_back(link.joint);
  }
  check_inertia(*this, impl_->model);
}

Tree::~Tree() = default;
Tree::Tree(Tree&&) noexcept = default;

const Multibody& Tree::scene() const { return impl_->scene; }
const TreeLayout& Tree::layout() const { return impl_->layout; }
const std::vector<int>& Tree::stops() const { return impl_->stops; }
Stiffening Tree::stiffening(int body) const { return impl_->stiffening[static_cast<size_t>(body)]; }

void TreeWorkspaceDeleter::operator()(TreeWorkspace* w) const { delete w; }

TreeWorkspaceHandle Tree::workspace() const {
  return TreeWorkspaceHandle(new TreeWorkspace(impl_->model, impl_->layout.size));
}

TreeState Tree::at_rest() const {
  TreeState s;
  for (const Joint& joint : impl_->scene.joints) {
    JointState state;
    const auto n = static_cast<size_t>(joint_type(joint.kind).scalars);
    state.coordinate.assign(n, n == 1 && joint.mechanism.stiffness > 0 ? joint.mechanism.rest : 0.0);
    state.rate.assign(n, 0.0);
    s.joints.push_back(std::move(state));
  }
  for (const ReducedBody& body : impl_->scene.bodies) {
    s.q.emplace_back(VectorXd::Zero(body.n()));
    s.q_dot.emplace_back(VectorXd::Zero(body.n()));
  }
  for (const ReactionWheel& wheel : impl_->scene.wheels) s.spin.push_back(wheel.spin);
  return s;
}

VectorXd Tree::pack(const TreeState& s) const {
  const Multibody& scene = impl_->scene;
  require(s.joints.size() == scene.joints.size() && s.q.size() == scene.bodies.size() &&
              s.q_dot.size() == scene.bodies.size() && s.spin.size() == scene.wheels.size(),
          "the state has not as many joints, bodies and wheels as the scene");
  VectorXd y = VectorXd::Zero(impl_->layout.size);
  for (const tree::Link& link : impl_->model.links) {
    const JointState& joint = s.joints[static_cast<size_t>(link.joint)];
    const JointType& type = joint_type(link.kind);
    const auto scalars = static_cast<size_t>(type.scalars), body = static_cast<size_t>(link.index);
    require(
        joint.coordinate.size() == scalars && joint.rate.size() == scalars && s.q[body].size() == link.body.n &&
            s.q_dot[body].size() == link.body.n,
        fmt::format("joint {} needs {} coordinates and rates, body {} {} elastic ones",
                    scene.joints[static_cast<size_t>(link.joint)].name, scalars, scene.bodies[body].name, link.body.n));
    for (int i = 0; i < type.scalars; ++i) {
      y[link.scalar + i] = joint.coordinate[static_cast<size_t>(i)] - link.threshold;
      y[link.rate + i] = joint.rate[static_cast<size_t>(i)];
    }
    if (type.turns) y.segment<4>(link.attitude) = joint.attitude.normalized();
    if (type.turns) y.segment<3>(link.omega) = joint.omega;
    if (type.floats) y.segment<3>(link.position) = joint.position;
    if (type.floats) y.segment<3>(link.velocity) = joint.velocity;
    y.segment(link.q, link.body.n) = s.q[static_cast<size_t>(link.index)];
    y.segment(link.q_dot, link.body.n) = s.q_dot[static_cast<size_t>(link.index)];
  }
  for (size_t i = 0; i < s.spin.size(); ++i) y[impl_->layout.spin + static_cast<int>(i)] = s.spin[i];
  return y;
}

TreeState Tree::unpack(const Eigen::Ref<const VectorXd>& y) const {
  TreeState s;
  unpack(y, s);
  return s;
}

void Tree::unpack(const Eigen::Ref<const VectorXd>& y, TreeState& s) const {
  if (s.joints.empty()) s = at_rest();
  for (const tree::Link& link : impl_->model.links) {
    JointState& joint = s.joints[static_cast<size_t>(link.joint)];
    const JointType& type = joint_type(link.kind);
    for (int i = 0; i < type.scalars; ++i) {
      joint.coordinate[static_cast<size_t>(i)] = y[link.scalar + i] + link.threshold;
      joint.rate[static_cast<size_t>(i)] = y[link.rate + i];
    }
    if (type.turns) joint.attitude = y.segment<4>(link.attitude);
    if (type.turns) joint.omega = y.segment<3>(link.omega);
    if (type.floats) joint.position = y.segment<3>(link.position);
    if (type.floats) joint.velocity = y.segment<3>(link.velocity);
    s.q[static_cast<size_t>(link.index)] = y.segment(link.q, link.body.n);
    s.q_dot[static_cast<size_t>(link.index)] = y.segment(link.q_dot, link.body.n);
  }
  for (size_t i = 0; i < s.spin.size(); ++i) s.spin[i] = y[impl_->layout.spin + static_cast<int>(i)];
}

void Tree::impose(double t, Eigen::Ref<VectorXd> y) const {
  for (const tree::Link& link : impl_->model.links) {
    if (!link.prescribed) continue;
    const std::vector<TimeFunction>& f = impl_->scene.joints[static_cast<size_t>(link.joint)].prescribed;
    for (size_t k = 0; k < f.size(); ++k) {
      y[link.scalar + static_cast<int>(k)] = f[k].value(t) - link.threshold;
      y[link.rate + static_cast<int>(k)] = f[k].rate(t);
    }
  }
}

FLEXBOOM_INNER_LOOP
void Tree::derivative(double t, const double* y, std::span<const char> contact, TreeWorkspace& w, double* y_dot,
                      std::span<const LawBranch> laws) const {
  tree::set_instant(impl_->model, t, w.instant);
  w.instant.laws = laws;
  tree::derivative(impl_->model, y, w.instant, contact, w.scratch, y_dot);
  if (!is_sound(impl_->model, w.scratch))
    report_mass(impl_->model, t, Eigen::Map<const VectorXd>(y, impl_->layout.size), contact, laws);
}

double Tree::hold_load(int joint, const double* y, const TreeWorkspace& w) const {
  const auto& links = impl_->model.links;
  const auto link = std::ranges::find(links, joint, &tree::Link::joint);
  const auto i = static_cast<size_t>(link - links.begin());
  return tree::drive_load(*link, 0, y, w.instant.drives[i], w.instant.law(*link), false, w.scratch.links[i]);
}

}  // namespace flexboom
