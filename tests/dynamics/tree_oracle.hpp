#pragma once

// Virtual power over point masses for any tree: kinematics in Taylor arithmetic in time, no invariants, no angular
// velocities of places, no recursion of inertia.

#include "dynamics/relative/tree.hpp"
#include "dynamics_testing.hpp"

#include <Eigen/LU>

#include <array>
#include <cmath>
#include <vector>

namespace flexboom::testing {

/// x(t) to second order: value, first and second derivative.
struct Jet {
  double v = 0, d = 0, dd = 0;

  Jet() = default;
  Jet(double value) : v(value) {}
  Jet(double value, double rate, double acceleration) : v(value), d(rate), dd(acceleration) {}
  friend Jet operator+(const Jet& a, const Jet& b) { return {a.v + b.v, a.d + b.d, a.dd + b.dd}; }
  friend Jet operator-(const Jet& a, const Jet& b) { return {a.v - b.v, a.d - b.d, a.dd - b.dd}; }
  friend Jet operator*(const Jet& a, const Jet& b) {
    return {a.v * b.v, a.d * b.v + a.v * b.d, a.dd * b.v + 2 * a.d * b.d + a.v * b.dd};
  }
};
inline Jet sin(const Jet& a) {
  const double s = std::sin(a.v), c = std::cos(a.v);
  return {s, c * a.d, c * a.dd - s * a.d * a.d};
}
inline Jet cos(const Jet& a) {
  const double s = std::sin(a.v), c = std::cos(a.v);
  return {c, -s * a.d, -s * a.dd - c * a.d * a.d};
}

using JetVector = std::array<Jet, 3>;
using JetMatrix = std::array<std::array<Jet, 3>, 3>;

inline JetVector jets(const Eigen::Vector3d& a) { return {Jet(a.x()), Jet(a.y()), Jet(a.z())}; }
inline JetMatrix jets(const Eigen::Matrix3d& a) {
  JetMatrix r;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) r[size_t(i)][size_t(j)] = Jet(a(i, j));
  return r;
}
inline JetMatrix operator*(const JetMatrix& a, const JetMatrix& b) {
  JetMatrix r;
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) r[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
  return r;
}
inline JetVector operator*(const JetMatrix& a, const JetVector& b) {
  JetVector r;
  for (size_t i = 0; i < 3; ++i) r[i] = a[i][0] * b[0] + a[i][1] * b[1] + a[i][2] * b[2];
  return r;
}
inline JetVector operator+(const JetVector& a, const JetVector& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline JetVector operator-(const JetVector& a, const JetVector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline JetMatrix transposed(const JetMatrix& a) {
  JetMatrix r;
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) r[i][j] = a[j][i];
  return r;
}
inline JetMatrix rotation_about(int axis, const Jet& angle) {
  const Jet c = cos(angle), s = sin(angle);
  if (axis == 2) return {{{c, Jet(0) - s, 0}, {s, c, 0}, {0, 0, 1}}};
  return {{{c, 0, s}, {0, 1, 0}, {Jet(0) - s, 0, c}}};  // y
}

/// exp(tilde(theta)) by its power series.
inline JetMatrix exponential(const JetVector& theta) {
  const Jet zero(0);
  const JetMatrix tilde = {
      {{zero, zero - theta[2], theta[1]}, {theta[2], zero, zero - theta[0]}, {zero - theta[1], theta[0], zero}}};
  JetMatrix sum = jets(Eigen::Matrix3d(Eigen::Matrix3d::Identity())), term = sum;
  for (int k = 1; k < 40; ++k) {
    term = term * tilde;
    for (auto& row : term)
      for (Jet& x : row) x = Jet(1.0 / k) * x;
    for (size_t i = 0; i < 3; ++i)
      for (size_t j = 0; j < 3; ++j) sum[i][j] = sum[i][j] + term[i][j];
  }
  return sum;
}

struct JetFrame {
  JetVector r;
  JetMatrix A;
};

/// Where the frames of the bodies are when the velocities are `rates` (a vector like u and the velocities of floating
/// joints) and all accelerations of the unknowns are zero.
class Oracle {
 public:
  Oracle(const Tree& tree, const std::vector<PointBody>& points) : tree_(tree), points_(points) {
    const TreeLayout& l = tree.layout();
    size_ = l.u;
    for (const TreeLayout::Joint& j : l.joints) {
      floating_.push_back(j.velocity >= 0 ? size_ : -1);
      size_ += j.velocity >= 0 ? 3 : 0;
    }
  }

  int size() const { return size_; }

  /// u, then the velocities of floating joints.
  Eigen::VectorXd rates(const Eigen::VectorXd& y) const {
    const TreeLayout& l = tree_.layout();
    Eigen::VectorXd r(size_);
    r.head(l.u) = y.segment(l.p, l.u);
    for (size_t i = 0; i < floating_.size(); ++i)
      if (floating_[i] >= 0) r.segment<3>(floating_[i]) = y.segment<3>(l.joints[i].velocity);
    return r;
  }

  JetFrame place(const Eigen::VectorXd& y, const Eigen::VectorXd& rates, const Place& p,
                 const std::vector<JetFrame>& bodies) const {
    JetFrame local{jets(p.position), jets(p.axes)};
    if (p.body < 0) return local;
    if (!p.marker.empty()) {
      const Marker& m = marker(tree_.scene().bodies[size_t(p.body)], p.marker);
      local.r = jets(m.position);
      JetVector theta = jets(Eigen::Vector3d(Eigen::Vector3d::Zero()));
      for (int k = 0; k < m.S.cols(); ++k) {
        const Jet q = coordinate(y, rates, tree_.layout().q[size_t(p.body)] + k);
        for (int i = 0; i < 3; ++i) {
          local.r[size_t(i)] = local.r[size_t(i)] + q * Jet(m.S(i, k));
          theta[size_t(i)] = theta[size_t(i)] + q * Jet(m.S_theta(i, k));
        }
      }
      local.A = exponential(theta) * local.A;
    }
    const JetFrame& body = bodies[size_t(p.body)];
    return {body.r + body.A * local.r, body.A * local.A};
  }

  /// Frames of all bodies (BRF).
  std::vector<JetFrame> frames(const Eigen::VectorXd& y, const Eigen::VectorXd& rates, double t) const {
    const Multibody& scene = tree_.scene();
    std::vector<JetFrame> bodies(scene.bodies.size());
    std::vector<char> done(scene.bodies.size(), 0);
    for (size_t round = 0; round < scene.joints.size(); ++round)
      for (size_t i = 0; i < scene.joints.size(); ++i) {
        const Joint& joint = scene.joints[i];
        const auto b = size_t(joint.b.body);
        if (done[b] || (joint.a.body >= 0 && !done[size_t(joint.a.body)])) continue;
        bodies[b] = hang(y, rates, t, i, bodies);
        done[b] = 1;
      }
    return bodies;
  }

  /// Accelerations (like rates) with the given generalised forces.
  Eigen::VectorXd accelerations(const Eigen::VectorXd& y, double t, const Eigen::VectorXd& applied,
                                std::vector<char> given) const {
    using namespace Eigen;
    const VectorXd now = rates(y);
    const std::vector<JetFrame> moving = frames(y, now, t);
    std::vector<std::vector<JetFrame>> unit;
    for (int k = 0; k < size_; ++k) unit.push_back(frames(y, VectorXd::Unit(size_, k), no_drive));
    MatrixXd M = MatrixXd::Zero(size_, size_);
    VectorXd f = applied;
    for (size_t b = 0; b < points_.size(); ++b)
      for (size_t k = 0; k < points_[b].dm.size(); ++k) {
        MatrixXd B(3, size_);
        for (int c = 0; c < size_; ++c)
          B.col(c) = velocity(point(y, VectorXd::Unit(size_, c), b, k, unit[size_t(c)][b]));
        const JetVector r = point(y, now, b, k, moving[b]);
        const Vector3d bias(r[0].dd, r[1].dd, r[2].dd);
        M += points_[b].dm[k] * B.transpose() * B;
        f += points_[b].dm[k] * B.transpose() * (tree_.scene().gravity - bias);
      }
    for (int c = 0; c < size_; ++c)
      if (given[size_t(c)]) M.row(c).setZero(), M(c, c) = 1, f[c] = 0;  // its acceleration is in the bias
    return M.fullPivLu().solve(f);
  }

  /// Generalised force of a force and a torque at a place (inertial axes).
  Eigen::VectorXd generalised(const Eigen::VectorXd& y, const Place& p, const Eigen::Vector3d& force,
                              const Eigen::Vector3d& torque) const {
    Eigen::VectorXd f(size_);
    for (int c = 0; c < size_; ++c) {
      const Eigen::VectorXd e = Eigen::VectorXd::Unit(size_, c);
      const JetFrame at = place(y, e, p, frames(y, e, no_drive));
      f[c] = velocity(at.r).dot(force) + angular_velocity(at.A).dot(torque);
    }
    return f;
  }

  static Eigen::Vector3d value(const JetVector& r) { return {r[0].v, r[1].v, r[2].v}; }
  static Eigen::Vector3d velocity(const JetVector& r) { return {r[0].d, r[1].d, r[2].d}; }
  static Eigen::Matrix3d value(const JetMatrix& A) {
    Eigen::Matrix3d m;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) m(i, j) = A[size_t(i)][size_t(j)].v;
    return m;
  }
  static Eigen::Vector3d angular_velocity(const JetMatrix& A) {
    Eigen::Matrix3d m;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) m(i, j) = A[size_t(i)][size_t(j)].d;
    m = (m * value(A).transpose()).eval();
    return {m(2, 1), m(0, 2), m(1, 0)};
  }

  /// A time at which prescribed motions stand still: unit motions are of the other unknowns.
  static constexpr double no_drive = -1e300;

 private:
  Jet coordinate(const Eigen::VectorXd& y, const Eigen::VectorXd& rates, int place_in_p) const {
    return {y[place_in_p], rates[tree_.layout().base + place_in_p], 0};
  }

  JetVector point(const Eigen::VectorXd& y, const Eigen::VectorXd& rates, size_t body, size_t k,
                  const JetFrame& frame) const {
    JetVector u = jets(points_[body].u0[k]);
    for (int m = 0; m < points_[body].S[k].cols(); ++m) {
      const Jet q = coordinate(y, rates, tree_.layout().q[body] + m);
      for (int i = 0; i < 3; ++i) u[size_t(i)] = u[size_t(i)] + q * Jet(points_[body].S[k](i, m));
    }
    return frame.r + frame.A * u;
  }

  JetFrame hang(const Eigen::VectorXd& y, const Eigen::VectorXd& rates, double t, size_t i,
                const std::vector<JetFrame>& bodies) const {
    const Joint& joint = tree_.scene().joints[i];
    const TreeLayout::Joint& at = tree_.layout().joints[i];
    std::array<Jet, 2> x;
    const int scalars = joint_type(joint.kind).scalars;
    const bool has_threshold = joint.kind == JointKind::hinge || joint.kind == JointKind::slider;
    for (int k = 0; k < scalars; ++k) {
      Jet& c = x[size_t(k)];
      c = coordinate(y, rates, at.scalar + k);
      if (!joint.prescribed.empty() && t != no_drive) {
        const TimeFunction& f = joint.prescribed[size_t(k)];
        c = {f.value(t), f.rate(t), f.acceleration(t)};
      } else if (has_threshold) {
        c.v += joint.mechanism.threshold;
      }
    }
    JetFrame relative{jets(Eigen::Vector3d(Eigen::Vector3d::Zero())),
                      jets(Eigen::Matrix3d(Eigen::Matrix3d::Identity()))};
    if (joint.kind == JointKind::hinge) relative.A = rotation_about(2, x[0]);
    if (joint.kind == JointKind::slider) relative.r[2] = x[0];
    if (joint.kind == JointKind::universal) relative.A = rotation_about(2, x[0]) * rotation_about(1, x[1]);
    if (at.attitude >= 0) {  // A (1 + tilde(w) t + tilde(w)^2 t^2 / 2)
      const Eigen::Vector4d q = y.segment<4>(at.attitude).normalized();
      const Eigen::Vector3d w = rates.segment<3>(at.omega - tree_.layout().p);
      const JetVector theta = {Jet(0, w.x(), 0), Jet(0, w.y(), 0), Jet(0, w.z(), 0)};
      relative.A =
          jets(Eigen::Matrix3d(Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix())) * exponential(theta);
    }
    if (at.position >= 0)
      for (int k = 0; k < 3; ++k) relative.r[size_t(k)] = {y[at.position + k], rates[floating_[i] + k], 0};
    const JetFrame a = place(y, rates, joint.a, bodies);
    const JetFrame b_in_space{a.r + a.A * relative.r, a.A * relative.A};
    const JetFrame b_local =
        place(y, rates, joint.b,
              std::vector<JetFrame>(bodies.size(), {jets(Eigen::Vector3d(Eigen::Vector3d::Zero())),
                                                    jets(Eigen::Matrix3d(Eigen::Matrix3d::Identity()))}));
    JetFrame body;
    body.A = b_in_space.A * transposed(b_local.A);
    body.r = b_in_space.r - body.A * b_local.r;
    return body;
  }

  const Tree& tree_;
  const std::vector<PointBody>& points_;
  std::vector<int> floating_;
  int size_ = 0;
};

}  // namespace flexboom::testing
