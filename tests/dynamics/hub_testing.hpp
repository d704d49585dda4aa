#pragma once

#include "dynamics/model/hub_with_booms.hpp"
#include "dynamics/numerics/rotation.hpp"
#include "dynamics/simulation/tree_integrator.hpp"
#include "dynamics_testing.hpp"
#include "fem/base/check.hpp"

#include <algorithm>
#include <optional>
#include <span>
#include <utility>

namespace flexboom::testing {

/// State of a hub with hinged booms in one list per quantity.
struct HubState {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // of the hub's origin, inertial axes [m]
  Eigen::Vector4d attitude = Eigen::Vector4d(1, 0, 0, 0);
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // inertial axes [m/s]
  Eigen::Vector3d omega = Eigen::Vector3d::Zero();     // hub axes [rad/s]
  std::vector<double> angle, rate;                     // per boom
  std::vector<Eigen::VectorXd> q, q_dot;               // per boom
};

/// Places in y.
struct HubLayout {
  std::vector<int> body;  // of each boom's gap; its q follows
  int p = 0, u = 0, base = 0, size = 0, spent = 0;
  TreeLayout::Joint floats;

  int position() const { return floats.position; }
  int attitude() const { return floats.attitude; }
  int velocity() const { return floats.velocity; }
  int work() const { return spent; }
};

/// A tree that is a hub with hinged booms, with lists per boom. Joint i is the hinge of boom i; the hub's comes last.
class Hub {
 public:
  Hub(std::optional<ReducedBody> hub, std::vector<Appendage> booms, const std::optional<OrbitalField>& field = {})
      : hub_(hub.value_or(ReducedBody{})), booms_(booms), floats_(hub.has_value()), tree_([&] {
          Multibody scene = hub_with_booms(std::move(hub), std::move(booms), field);
          if (floats_) std::rotate(scene.joints.begin(), scene.joints.begin() + 1, scene.joints.end());
          return scene;
        }()) {
    const TreeLayout& l = tree_.layout();
    layout_.p = l.p, layout_.u = l.u, layout_.base = l.base, layout_.size = l.size;
    layout_.spent = l.work;
    for (size_t i = 0; i < booms_.size(); ++i) layout_.body.push_back(l.joints[i].scalar);
    if (floats_) layout_.floats = l.joints.back();
  }

  const Tree& tree() const { return tree_; }
  const ReducedBody& hub() const { return hub_; }
  const std::vector<Appendage>& appendages() const { return booms_; }
  const std::optional<OrbitalField>& field() const { return tree_.scene().field; }
  const HubLayout& layout() const { return layout_; }

  HubState at_rest(const std::vector<double>& angles) const {
    HubState s;
    s.angle = angles, s.rate.assign(angles.size(), 0.0);
    for (const Appendage& a : booms_)
      s.q.push_back(Eigen::VectorXd::Zero(a.body.n())), s.q_dot.push_back(Eigen::VectorXd::Zero(a.body.n()));
    return s;
  }

  Eigen::VectorXd pack(const HubState& s) const {
    TreeState t = tree_.at_rest();
    for (size_t i = 0; i < booms_.size(); ++i) {
      const size_t body = i + (floats_ ? 1 : 0);
      t.joints[i].coordinate = {s.angle[i]}, t.joints[i].rate = {s.rate[i]};
      t.q[body] = s.q[i], t.q_dot[body] = s.q_dot[i];
    }
    if (floats_) {
      JointState& j = t.joints.back();
      j.position = s.position, j.attitude = s.attitude, j.velocity = s.velocity, j.omega = s.omega;
    }
    return tree_.pack(t);
  }

  HubState unpack(const Eigen::Ref<const Eigen::VectorXd>& y) const {
    const TreeState t = tree_.unpack(y);
    HubState s;
    for (size_t i = 0; i < booms_.size(); ++i) {
      const size_t body = i + (floats_ ? 1 : 0);
      s.angle.push_back(t.joints[i].coordinate[0]), s.rate.push_back(t.joints[i].rate[0]);
      s.q.push_back(t.q[body]), s.q_dot.push_back(t.q_dot[body]);
    }
    if (floats_) {
      const JointState& j = t.joints.back();
      s.position = j.position, s.attitude = j.attitude, s.velocity = j.velocity, s.omega = j.omega;
    }
    return s;
  }

  /// contact: one flag per boom.
  Eigen::VectorXd derivative(const Eigen::VectorXd& y, std::vector<char> contact) const {
    contact.resize(tree_.scene().joints.size(), 0);
    Eigen::VectorXd y_dot(y.size());
    tree_.derivative(0, y.data(), contact, *tree_.workspace(), y_dot.data());
    return y_dot;
  }

  Eigen::MatrixXd jacobian(const Eigen::VectorXd& y, std::vector<char> contact) const {
    contact.resize(tree_.scene().joints.size(), 0);
    Eigen::MatrixXd J;
    tree_.jacobian(0, y.data(), contact, *tree_.workspace(), J);
    return J;
  }

  Balance balance(const Eigen::VectorXd& y) const { return tree_.balance(0, y); }

  double gap(const double* y, int boom) const { return tree_.gap(y, boom); }

  /// Boom axes -> hub axes.
  Eigen::Matrix3d boom_to_hub(size_t boom, double angle) const {
    const Hinge& h = booms_[boom].hinge;
    Eigen::Matrix3d B;
    B << h.stowed, h.outward, h.stowed.cross(h.outward);
    return B * Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  }

 private:
  ReducedBody hub_;
  std::vector<Appendage> booms_;
  bool floats_;
  Tree tree_;
  HubLayout layout_;
};

inline TreeTrajectory integrate(const Hub& hub, const Eigen::VectorXd& y0, IntegratorOptions o) {
  if (o.method == "auto") o.method = "exponential";
  return flexboom::integrate(hub.tree(), y0, o);
}

}  // namespace flexboom::testing
