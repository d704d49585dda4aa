#include "dynamics/events/conservation.hpp"
#include "dynamics/relative/impl.hpp"
#include "dynamics/relative/momenta.hpp"
#include "dynamics/relative/split.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using spatial::eigen;
using spatial::Vec3;

namespace {

SplitLayout layout_of(const Tree& tree) {
  const TreeLayout& l = tree.layout();
  const tree::Model& model = tree.impl().model;
  SplitLayout r;
  r.x = l.p + l.u + static_cast<int>(model.wheels.size()), r.energies = l.dissipated, r.size = l.size;
  for (size_t i = 0; i < model.wheels.size(); ++i) r.spins.push_back(l.spin + static_cast<int>(i));
  bool spherical = false;
  for (const tree::Link& link : model.links) {
    const JointType& type = joint_type(link.kind);
    for (int k = 0; k < type.scalars; ++k) {
      r.joints.push_back(link.scalar + k);
      if (link.prescribed)
        for (const int i : {link.scalar + k, link.rate + k}) r.prescribed.push_back(i);
      else
        r.coordinates.push_back({link.scalar + k, link.rate + k});
    }
    for (int k = 0; k < link.body.n; ++k) r.coordinates.push_back({link.q + k, link.q_dot + k});
    if (type.turns) r.turns.push_back({link.omega, link.attitude, type.floats});
    if (type.floats) r.roots.push_back({link.position, link.velocity, link.attitude, link.omega});
    spherical = spherical || (type.turns && !type.floats);
  }
  for (const int joint : tree.stops()) {
    const int gap = l.joints[static_cast<size_t>(joint)].scalar;
    r.gaps.push_back({gap, l.rate(gap)});
  }
  r.outside_pushes = model.poses || !tree.scene().gravity.isZero(0);
  r.loads_work = !tree.scene().loads.empty();
  r.attitudes_matter = model.poses || spherical;
  r.momentum_is_kept = r.roots.size() == 1 && is_isolated(tree.scene());
  return r;
}

class SplitTree final : public SplitProblem {
 public:
  explicit SplitTree(const Tree& tree)
      : tree_(tree),
        model_(tree.impl().model),
        layout_(layout_of(tree)),
        work_(tree.workspace()),
        contact_(tree.scene().joints.size(), 0),
        y_(layout_.size) {
    for (const tree::Link& link : model_.links) {  // parents come first
      if (link.parent < 0)
        root_of_.push_back(link.kind == JointKind::free ? floating_++ : -1);
      else
        root_of_.push_back(root_of_[static_cast<size_t>(link.parent)]);
      if (link.parent < 0 && link.kind == JointKind::free) root_links_.push_back(&link);
    }
  }

  const SplitLayout& layout() const override { return layout_; }

  void derivative(double t, const double* y, std::span<const char> contact, double* y_dot) override {
    tree_.derivative(t, y, of_joints(contact), *work_, y_dot);
  }

  Vector3d outside_acceleration(size_t root) override {
    tree::Scratch<double>& scratch = work_->scratch;
    Vector3d force = Vector3d::Zero();
    double m = 0;
    const tree::HungOn bodies = of(root);
    for (const size_t i : scratch.singles) {
      if (!bodies.counts(i)) continue;
      m += model_.links[i].body.m;
      if (model_.poses) force += eigen(scratch.links[i].A0 * scratch.links[i].external.t);
    }
    for (size_t i = 0; i < scratch.leaves.size(); ++i) {
      const tree::Leaves& leaves = model_.leaves[i];
      if (!bodies.counts(static_cast<size_t>(leaves.link[0]))) continue;
      const tree::LinkScratch<Quad>& s = scratch.leaves[i].link;
      m += sum(leaves.body.m, leaves.count);
      if (tree_.scene().field) force += eigen(tree::sum(s.A0 * s.external.t, leaves.count));
    }
    return to_root(root) * (tree_.scene().gravity + force / m);
  }

  MatrixXd linear(double t, const double* y, std::span<const char> contact) override {
    MatrixXd L(layout_.x, layout_.x);
    tree_.jacobian_columns(t, y, of_joints(contact), *work_, L);
    return L;
  }

  FloatingBodies floating(size_t root, double t, const double* y) override {
    put_roots_at_rest(t, y);
    const tree::Totals all = tree::totals(model_, y_.data(), work_->instant, origin(root), work_->scratch, of(root));
    const Matrix3d A = to_root(root), J = eigen(all.inertia) - mass_at(eigen(all.mass_centre()), all.m);
    return {centre_of(all, A), A * J * A.transpose(), A * eigen(all.angular_momentum_about_mass_centre())};
  }

  MassCentre mass_centre(size_t root, double t, const double* y) override {
    put_roots_at_rest(t, y);
    return centre_of(tree::mass_motion(model_, y_.data(), work_->instant, origin(root), work_->scratch, of(root)),
                     to_root(root));
  }

 private:
  /// Takes y, less places and velocities of the roots.
  void put_roots_at_rest(double t, const double* y) {
    y_ = Eigen::Map<const VectorXd>(y, layout_.size);
    for (const SplitLayout::Root& r : layout_.roots)
      y_.segment<3>(r.position).setZero(), y_.segment<3>(r.velocity).setZero();
    tree::set_instant(model_, t, work_->instant);
  }

  tree::Reference origin(size_t root) const { return {root_links_[root]->a.position, {}}; }
  tree::HungOn of(size_t root) const { return {root_of_, static_cast<int>(root)}; }

  /// A: inertial axes -> those of the root's position.
  static MassCentre centre_of(const tree::MassMotion& all, const Matrix3d& A) {
    return {A * eigen(all.mass_centre()), A * eigen(all.momentum) / all.m};
  }

  /// The inertia of a mass at r.
  static Matrix3d mass_at(const Vector3d& r, double m) {
    return m * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose());
  }

  /// Inertial axes -> axes of the root's position.
  Matrix3d to_root(size_t root) const {
    Matrix3d A;
    for (int i = 0; i < 3; ++i) A.col(i) = eigen(root_links_[root]->a.axes.row[static_cast<size_t>(i)]);
    return A;
  }

  std::span<const char> of_joints(std::span<const char> contact) {
    for (size_t i = 0; i < contact.size(); ++i) contact_[static_cast<size_t>(tree_.stops()[i])] = contact[i];
    return contact_;
  }

  const Tree& tree_;
  const tree::Model& model_;
  SplitLayout layout_;
  TreeWorkspaceHandle work_;
  std::vector<char> contact_;  // per joint
  std::vector<int> root_of_;   // per link: which root it hangs on, or -1
  std::vector<const tree::Link*> root_links_;
  int floating_ = 0;
  VectorXd y_;
};

}  // namespace

std::string split_fault(const Tree& tree) {
  if (tree.layout().p + tree.layout().u == 0) return "nothing moves";
  for (const tree::Link& link : tree.impl().model.links)
    if (joint_type(link.kind).floats && link.parent >= 0)
      return fmt::format("joint {} is free, between two bodies",
                         tree.scene().joints[static_cast<size_t>(link.joint)].name);
  return "";
}

std::unique_ptr<SplitProblem> split(const Tree& tree) {
  const std::string fault = split_fault(tree);
  require(fault.empty(),
          fmt::format("integrator: exponential collocation cannot simulate this: {}; adams or bdf can", fault));
  return std::make_unique<SplitTree>(tree);
}

}  // namespace flexboom
