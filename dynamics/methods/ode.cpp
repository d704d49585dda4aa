#include "dynamics/methods/ode.hpp"

#include "dynamics/numerics/newton_matrix.hpp"

#include <vector>

namespace flexboom {

namespace {

class OdeOfTree final : public Ode {
 public:
  OdeOfTree(const Tree& tree, const Laws& laws)
      : tree_(tree),
        laws_(laws),
        work_(tree.workspace()),
        contact_(tree.scene().joints.size(), 0),
        x_(tree.layout().size),
        y_dot_(tree.layout().size) {}

  std::unique_ptr<Ode> another() const override { return ode_of(tree_, laws_); }
  int size() const override { return tree_.layout().size; }
  int stops() const override { return static_cast<int>(tree_.stops().size()); }
  void derivative(double t, const double* y, std::span<const char> contact, double* y_dot) override {
    tree_.derivative(t, y, of_joints(contact), *work_, y_dot, laws_.branches());
  }
  void jacobian(double t, const double* y, std::span<const char> contact) override {
    tree_.jacobian(t, y, of_joints(contact), *work_, newton_.J, laws_.branches());
    newton_.sort();
  }
  void factorise(double gamma) override { newton_.factorise(gamma); }
  void solve(const double* b, double* x) override { newton_.solve(b, x); }
  double gap(const double* y, int stop) const override { return tree_.gap(y, joint(stop)); }
  double gap_rate(const double* y, int stop) const override { return tree_.gap_rate(y, joint(stop)); }

  Gap switch_gap(double t, const double* y, int number) override {
    const LawSwitch& s = laws_.switches()[static_cast<size_t>(number - stops())];
    const int joint = static_cast<int>(laws_.joint_of(s));
    LawPoint p{tree_.gap(y, joint), tree_.gap_rate(y, joint)};
    if (Laws::needs_acceleration(s) || Laws::needs_hold(s)) p.hold = hold_load(t, y, joint);
    if (Laws::needs_acceleration(s)) p.acceleration = tree_.gap_rate(y_dot_.data(), joint);
    if (Laws::needs_hold(s)) {  // along the motion, not beyond its end; the slope only guides the search
      constexpr double moment = 1e-6;
      const double h = t > moment ? -moment : moment;
      const Eigen::VectorXd step = h * y_dot_;
      x_ = Eigen::Map<const Eigen::VectorXd>(y, size()) + step;
      const double after = hold_load(t + h, x_.data(), joint);
      p.hold_slope = (after - p.hold) / h;
    }
    return laws_.gap(s, p);
  }

 private:
  /// Sets y_dot_.
  double hold_load(double t, const double* y, int joint) {
    tree_.derivative(t, y, contact_, *work_, y_dot_.data(), laws_.branches());
    return laws_.branches()[static_cast<size_t>(joint)].held ? tree_.hold_load(joint, y, *work_) : 0;
  }

  int joint(int stop) const { return tree_.stops()[static_cast<size_t>(stop)]; }
  std::span<const char> of_joints(std::span<const char> contact) {
    for (size_t i = 0; i < static_cast<size_t>(stops()); ++i)
      contact_[static_cast<size_t>(joint(static_cast<int>(i)))] = contact[i];
    return contact_;
  }

  const Tree& tree_;
  const Laws& laws_;
  TreeWorkspaceHandle work_;
  std::vector<char> contact_;  // as of the last call
  NewtonMatrix newton_;
  Eigen::VectorXd x_, y_dot_;
};

}  // namespace

std::unique_ptr<Ode> ode_of(const Tree& tree, const Laws& laws) { return std::make_unique<OdeOfTree>(tree, laws); }

}  // namespace flexboom
