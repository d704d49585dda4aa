#include "dynamics/rotation.hpp"
#include "dynamics/split.hpp"
#include "dynamics/workspace.hpp"

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

SplitLayout layout_of(const System& system) {
  const Layout& l = system.layout();
  SplitLayout r;
  r.x = l.p + l.u, r.energies = l.dissipated(), r.size = l.size;
  for (int i = 0; i < l.p; ++i) r.coordinates.push_back({i, l.p + l.base + i});
  for (const int gap : l.body) r.gaps.push_back({gap, l.p + l.base + gap}), r.joints.push_back(gap);
  if (system.fixed_hub()) return r;
  r.turns.push_back({l.p, l.attitude(), true});
  r.roots.push_back({l.position(), l.velocity(), l.attitude(), l.p});
  r.outside_pushes = r.attitudes_matter = system.field().has_value();
  r.momentum_is_kept = !system.field();
  return r;
}

class SplitSystem final : public SplitProblem {
 public:
  explicit SplitSystem(const System& system) : system_(system), layout_(layout_of(system)), work_(system.workspace()) {}

  const SplitLayout& layout() const override { return layout_; }

  void derivative(double t, const double* y, std::span<const char> contact, double* y_dot) override {
    system_.derivative(t, y, contact, *work_, y_dot);
  }

  Vector3d outside_acceleration(size_t, double t, const double* y) override {
    const Layout& l = system_.layout();
    const LocalGravity g = system_.field()->at(t, Eigen::Map<const Vector3d>(y + l.position()));
    return g.at(floating(0, t, y).mass_centre).acceleration;
  }

  MatrixXd linear(double, const double* y, std::span<const char> contact) override {
    const Layout& l = system_.layout();
    system_.jacobian(y, contact, *work_);
    MatrixXd J = MatrixXd::Zero(layout_.x, layout_.x);
    J.block(0, l.p + l.base, l.p, l.p).setIdentity();
    J.bottomRows(l.u) = work_->dudot;
    return J;
  }

  FloatingBodies floating(size_t, double, const double* y) override {
    const Layout& l = system_.layout();
    const Whole whole = system_.whole(Eigen::Map<const VectorXd>(y, l.size), *work_);
    const Matrix3d A = rotation_matrix(Eigen::Map<const Eigen::Vector4d>(y + l.attitude()));
    return {A * whole.mass_centre, A * whole.velocity, A * whole.inertia * A.transpose(), A * whole.angular_momentum};
  }

 private:
  const System& system_;
  SplitLayout layout_;
  WorkspaceHandle work_;
};

}  // namespace

std::unique_ptr<SplitProblem> split(const System& system) { return std::make_unique<SplitSystem>(system); }

}  // namespace flexboom
