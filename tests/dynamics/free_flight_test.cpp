// One boom in free flight, by clamped modes and by mean axes: two descriptions of one motion.

#include "dynamics/numerics/rotation.hpp"
#include "reduction/basis/mean_axis.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "reduction/invariants/root_loads.hpp"
#include "tests/reduction/booms.hpp"

#include <gtest/gtest.h>
#include <Eigen/LU>

#include <cmath>
#include <numbers>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;
using test::boom4;
using test::make_boom;

using std::numbers::pi;

/// A push on the tip along a fixed direction in space, so small that squares of the deflection (1e-4 of the length)
/// do not count: with them the two descriptions are two models.
Vector3d push(double t) {
  constexpr double until = 0.01;
  const double size = t < until ? std::pow(std::sin(pi * t / until), 2) : 0;
  return size * Vector3d(0, 2, 1.5);
}

/// A free body (eqs. 7-9). State: R, attitude, v (body axes), omega, q, q_dot.
class FreeBody {
 public:
  explicit FreeBody(ReducedBody body) : body_(std::move(body)), n_(body_.n()) {}

  VectorXd at_rest() const {
    VectorXd y = VectorXd::Zero(13 + 2 * n_);
    y[3] = 1;
    return y;
  }

  VectorXd derivative(double t, const VectorXd& y) const {
    const Vector4d attitude = y.segment<4>(3).normalized();
    const Matrix3d A = rotation_matrix(attitude);
    BodyMotion motion;
    motion.v = y.segment<3>(7);
    motion.omega = y.segment<3>(10);
    motion.q = y.segment(13, n_);
    motion.q_dot = y.tail(n_);
    const Vector3d &w = motion.omega, force = A.transpose() * push(t);
    const RootLoads without_acceleration = root_loads(body_, motion, {{"tip", force, Vector3d::Zero()}});
    const DeformedInertia d = deformed_inertia(body_, motion.q);
    MatrixXd M(6 + n_, 6 + n_);
    M.topLeftCorner<3, 3>() = body_.m * Matrix3d::Identity();
    M.block<3, 3>(0, 3) = -tilde(d.mc);
    M.block<3, 3>(3, 0) = tilde(d.mc);
    M.block<3, 3>(3, 3) = d.J;
    M.block(0, 6, 3, n_) = body_.Ct;
    M.block(3, 6, 3, n_) = d.Cr;
    M.block(6, 0, n_, 3) = body_.Ct.transpose();
    M.block(6, 3, n_, 3) = d.Cr.transpose();
    M.bottomRightCorner(n_, n_) = body_.Me;
    VectorXd f(6 + n_);
    f.head<3>() = -without_acceleration.force;
    f.segment<3>(3) = -without_acceleration.moment;
    f.tail(n_) = -body_.Ke * motion.q + marker(body_, "tip").S.transpose() * force;
    for (Index k = 0; k < n_; ++k) {
      const auto ku = static_cast<size_t>(k);
      Matrix3d slope = body_.J1[ku];
      for (Index l = 0; l < n_; ++l) slope += 2 * motion.q[l] * body_.J2[ku][static_cast<size_t>(l)];
      f[6 + k] += 0.5 * w.dot(slope * w) + 2 * w.dot(body_.Cr1[ku] * motion.q_dot);
    }
    const VectorXd x = M.partialPivLu().solve(f);
    VectorXd y_dot(y.size());
    y_dot.head<3>() = A * motion.v;
    y_dot.segment<4>(3) = 0.5 * quaternion_product(attitude, {0, w.x(), w.y(), w.z()});
    y_dot.segment<3>(7) = x.head<3>() - w.cross(motion.v);
    y_dot.segment<3>(10) = x.segment<3>(3);
    y_dot.segment(13, n_) = motion.q_dot;
    y_dot.tail(n_) = x.tail(n_);
    return y_dot;
  }

  /// Where the tip and the root are, in space.
  Eigen::Matrix<double, 3, 2> places(const VectorXd& y) const {
    const Matrix3d A = rotation_matrix(y.segment<4>(3));
    Eigen::Matrix<double, 3, 2> r;
    int column = 0;
    for (const char* name : {"tip", "root"}) {
      const Marker& m = marker(body_, name);
      r.col(column++) = y.head<3>() + A * (m.position + m.S * y.segment(13, n_));
    }
    return r;
  }

 private:
  ReducedBody body_;
  Index n_;
};

/// Tip and root at 100 times of a flight, by the classical Runge-Kutta method.
MatrixXd flight(const FreeBody& body, const Vector3d& spin) {
  constexpr double duration = 0.03;
  constexpr int steps = 8000, shown = 80;  // 25 kHz: 0.6 rad a step
  const double h = duration / steps;
  VectorXd y = body.at_rest();
  y.segment<3>(10) = spin;
  MatrixXd places(3, 2 * steps / shown);
  for (int i = 0; i < steps; ++i) {
    const double t = i * h;
    const VectorXd k1 = body.derivative(t, y), k2 = body.derivative(t + h / 2, y + h / 2 * k1),
                   k3 = body.derivative(t + h / 2, y + h / 2 * k2), k4 = body.derivative(t + h, y + h * k3);
    y += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    if ((i + 1) % shown == 0) places.middleCols<2>(2 * (i / shown)) = body.places(y);
  }
  return places;
}

TEST(FreeFlight, ClampedModesAndMeanAxesConvergeToOneMotion) {
  const test::Boom boom = make_boom(boom4(BeamTheory::timoshenko, true, 4, 6));
  const Clamp root(node_set(boom.mesh, "root"));
  const Vector3d spin(0.5, -0.4, 0.7);
  const auto body = [&](const ModalBasis& basis) { return FreeBody(reduce(boom.mesh, boom.assembly, basis, "boom")); };
  const auto options = [](int modes) { return EigenOptions{.num_modes = modes, .sigma = {}, .backend = "arpack"}; };
  ReducedBody stiff =
      reduce(boom.mesh, boom.assembly, clamped_modes(boom.mesh, boom.assembly, root, options(2)), "boom");
  stiff.Ke *= 1e3;
  const MatrixXd rigid = flight(FreeBody(stiff), spin);
  double last = 1;
  for (const int modes : {4, 8, 16, 24}) {
    const MatrixXd clamped = flight(body(clamped_modes(boom.mesh, boom.assembly, root, options(modes))), spin);
    const MatrixXd mean = flight(body(mean_axis_modes(boom.mesh, boom.assembly, options(modes))), spin);
    const double bending = (mean - rigid).colwise().norm().maxCoeff();
    const double difference = (clamped - mean).colwise().norm().maxCoeff() / bending;
    EXPECT_LT(difference, 0.4 * last) << modes;  // 0.15, 0.023, 0.0020, 0.00051: what the modes leave out
    last = difference;
  }
  EXPECT_LT(last, 1e-3);
}

}  // namespace
}  // namespace flexboom
