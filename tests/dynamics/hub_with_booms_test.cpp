
#include "dynamics/numerics/newton_matrix.hpp"
#include "dynamics/relative/split.hpp"
#include "fem/base/check.hpp"
#include "hub_testing.hpp"
#include "tree_testing.hpp"

#include <gtest/gtest.h>
#include <Eigen/LU>

#include <array>

namespace flexboom {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::Hub;
using testing::HubLayout;
using testing::HubState;
using testing::PointBody;

/// Booms with every invariant non-zero on a hub, a random state, and the point masses as the oracle. By the numbers of
/// their modes four are computed side by side, two, and two alone.
struct HubCase {
  static constexpr std::array modes = {3, 2, 2, 4, 2, 3, 2, 2};

  std::mt19937 random{42};
  std::vector<PointBody> points;
  Matrix3d J_hub = Vector3d(1.3, 0.9, 0.7).asDiagonal();
  std::unique_ptr<Hub> system;
  VectorXd y;
  std::vector<char> contact = {1, 0, 1, 1, 0, 0, 0, 1};

  explicit HubCase(bool fixed_hub = false, const std::optional<OrbitalField>& field = {}) {
    J_hub(0, 1) = J_hub(1, 0) = 0.05;
    std::vector<Appendage> appendages;
    for (size_t i = 0; i < modes.size(); ++i) {
      const auto k = static_cast<double>(i);
      points.push_back(testing::random_point_body(random, 7, modes[i], "body" + std::to_string(i)));
      Hinge hinge;
      hinge.point = Vector3d(0.1, -0.2 * k, 0.3);
      hinge.stowed = Vector3d(0, 0.6, 0.8);
      hinge.outward = i % 2 == 0 ? Vector3d(1, 0, 0) : Vector3d(0, -0.8, 0.6);
      hinge.mechanism = {0.3 + 0.1 * k, 1.2, 0.02 + 0.01 * k, 9.0 + k, 1.4};
      appendages.push_back({points.back().body, hinge});
    }
    std::optional<ReducedBody> hub;
    if (!fixed_hub) hub = rigid_body("hub", 2.5, Vector3d::Zero(), J_hub);
    system = std::make_unique<Hub>(hub, appendages, field);
    std::uniform_real_distribution<double> uniform(-1, 1);
    HubState s = system->at_rest({1.6, 0.9, 1.5, 1.8, 0.7, 1.1, 1.3, 1.7});
    const auto noise = [&] { return uniform(random); };
    for (size_t i = 0; i < modes.size(); ++i) {
      s.rate[i] = noise();
      s.q[i] = 0.2 * VectorXd::NullaryExpr(s.q[i].size(), noise);
      s.q_dot[i] = VectorXd::NullaryExpr(s.q[i].size(), noise);
    }
    s.omega = Vector3d::NullaryExpr(noise);
    s.velocity = Vector3d::NullaryExpr(noise);
    s.position = Vector3d::NullaryExpr(noise);
    s.attitude = Eigen::Vector4d::NullaryExpr(noise).normalized();
    if (fixed_hub) {
      s.omega.setZero(), s.velocity.setZero(), s.position.setZero(), s.attitude = {1, 0, 0, 0};
    }
    y = system->pack(s);
  }

  VectorXd derivative(const VectorXd& state) const { return system->derivative(state, contact); }
};

/// u_dot, hub acceleration and power of gravity by virtual power over the point masses: no invariant is formed.
VectorXd oracle_accelerations(const HubCase& c, Vector3d& a_hub, double& power) {
  const HubState s = c.system->unpack(c.y);
  const HubLayout& l = c.system->layout();
  const int n = 3 + l.u;  // hub translation (hub axes), then u
  MatrixXd M = MatrixXd::Zero(n, n);
  VectorXd f = VectorXd::Zero(n);
  M.topLeftCorner<3, 3>() = c.system->hub().m * Matrix3d::Identity();
  M.block<3, 3>(3, 3) = c.J_hub;
  f.segment<3>(3) = -s.omega.cross(c.J_hub * s.omega);
  LocalGravity gravity;  // about the hub's origin, hub axes
  if (c.system->field()) gravity = c.system->field()->at(0, s.position).in_axes(rotation_matrix(s.attitude));
  const BodyGravity of_hub = body_gravity(c.system->hub(), gravity, VectorXd());
  const Vector3d v = rotation_matrix(s.attitude).transpose() * s.velocity;
  f.head<3>() += of_hub.force;
  f.segment<3>(3) += of_hub.torque;
  power = of_hub.force.dot(v) + of_hub.torque.dot(s.omega);
  for (size_t i = 0; i < c.points.size(); ++i) {
    const PointBody& p = c.points[i];
    const Appendage& a = c.system->appendages()[i];
    const Matrix3d C = c.system->boom_to_hub(i, s.angle[i]);
    const Vector3d z = Vector3d::UnitZ();
    const int at = 6 + l.body[i], n_modes = p.body.n();
    for (size_t k = 0; k < p.dm.size(); ++k) {
      const Vector3d x = p.u0[k] + p.S[k] * s.q[i], x_dot = p.S[k] * s.q_dot[i];
      const Vector3d r = a.hinge.point + C * x, r_dot = C * (s.rate[i] * z.cross(x) + x_dot);
      MatrixXd B = MatrixXd::Zero(3, n);
      B.leftCols<3>().setIdentity();
      B.middleCols<3>(3) = -tilde(r);
      B.col(at) = C * z.cross(x);
      B.middleCols(at + 1, n_modes) = C * p.S[k];
      const Vector3d bias = s.omega.cross(s.omega.cross(r)) + 2 * s.omega.cross(r_dot) +
                            C * (s.rate[i] * s.rate[i] * z.cross(z.cross(x)) + 2 * s.rate[i] * z.cross(x_dot));
      M += p.dm[k] * B.transpose() * B;
      const Vector3d pull = p.dm[k] * gravity.at(r).acceleration;
      f += B.transpose() * (pull - p.dm[k] * bias);
      power += pull.dot(v + s.omega.cross(r) + r_dot);
    }
    const HingeMechanism& h = a.hinge.mechanism;
    f[at] += h.stiffness * (h.rest - s.angle[i]) - h.damping * s.rate[i];
    if (c.contact[i]) f[at] -= h.stop_stiffness * (s.angle[i] - h.threshold);
    f.segment(at + 1, n_modes) -= p.body.Ke * s.q[i] + p.body.De * s.q_dot[i];
  }
  const VectorXd acceleration = M.lu().solve(f);
  a_hub = acceleration.head<3>();
  return acceleration.tail(l.u);
}

TEST(HubWithBooms, AccelerationsAgreeWithVirtualPowerOverPointMasses) {
  const HubCase c;
  Vector3d a_hub;
  double power = 0;
  const VectorXd expected = oracle_accelerations(c, a_hub, power);
  const VectorXd y_dot = c.derivative(c.y);
  const HubLayout& l = c.system->layout();
  // Round-off of a solve with a condition number near 1e3.
  EXPECT_LT((y_dot.segment(l.p, l.u) - expected).norm(), 1e-12 * expected.norm());
  const Vector3d inertial = rotation_matrix(c.system->unpack(c.y).attitude) * a_hub;
  EXPECT_LT((y_dot.segment<3>(l.velocity()) - inertial).norm(), 1e-12 * inertial.norm());
}

/// A gradient of 0.7 1/s^2, as strong as the motion; linear, as it is within a body.
TEST(HubWithBooms, AccelerationsInAFieldOfGravityAgreeWithVirtualPower) {
  const Orbit orbit({.semi_major_axis = 1e3, .inclination = 0.9, .mean_anomaly = 0.4}, {.mu = 0.7e9});
  const HubCase c(false, OrbitalField{orbit, false}), free;
  Vector3d a_hub;
  double power = 0;
  const VectorXd expected = oracle_accelerations(c, a_hub, power);
  const VectorXd y_dot = c.derivative(c.y);
  const HubLayout& l = c.system->layout();
  EXPECT_LT((y_dot.segment(l.p, l.u) - expected).norm(), 1e-12 * expected.norm());
  EXPECT_GT((free.derivative(c.y).segment(l.p, l.u) - expected).norm(), 1e-2 * expected.norm());
  const Vector3d inertial = rotation_matrix(c.system->unpack(c.y).attitude) * a_hub;
  EXPECT_LT((y_dot.segment<3>(l.velocity()) - inertial).norm(), 1e-12 * inertial.norm());
  EXPECT_NEAR(y_dot[l.work()], power, 1e-12 * std::abs(power));
  EXPECT_EQ(free.derivative(c.y)[l.work()], 0);
  const int losses = c.system->tree().layout().dissipated_elsewhere;
  EXPECT_EQ(free.derivative(c.y)[losses], y_dot[losses]);
}

TEST(HubWithBooms, BodyMadeOfPointsHasConsistentInvariants) { EXPECT_NO_THROW(HubCase().points[0].body.validate()); }

TEST(HubWithBooms, JacobianAgreesWithCentralDifferences) {
  for (const bool fixed : {false, true}) {
    const HubCase c(fixed);
    const MatrixXd J = c.system->jacobian(c.y, c.contact);
    const double h = 1e-5;
    for (Eigen::Index i = 0; i < c.y.size(); ++i) {
      VectorXd plus = c.y, minus = c.y;
      plus[i] += h;
      minus[i] -= h;
      const VectorXd column = (c.derivative(plus) - c.derivative(minus)) / (2 * h);
      // Truncation h^2 f''' and round-off eps / h, both near 1e-9 of the largest entries (about 1e2).
      EXPECT_LT((J.col(i) - column).cwiseAbs().maxCoeff(), 1e-7) << "column " << i << (fixed ? ", fixed hub" : "");
    }
  }
}

TEST(HubWithBooms, NewtonSolveInvertsIMinusGammaJ) {
  const Orbit orbit({.semi_major_axis = 1e3, .inclination = 0.9, .mean_anomaly = 0.4}, {.mu = 0.7e9});
  for (int i = 0; i < 3; ++i) {
    const HubCase c(i == 1, i == 2 ? std::optional(OrbitalField{orbit, false}) : std::nullopt);
    NewtonMatrix newton;
    newton.J = c.system->jacobian(c.y, c.contact);
    newton.sort();
    const double gamma = 0.37;
    newton.factorise(gamma);
    const VectorXd b = VectorXd::LinSpaced(c.y.size(), -1, 2);
    VectorXd x(b.size());
    newton.solve(b.data(), x.data());
    const MatrixXd A = MatrixXd::Identity(b.size(), b.size()) - gamma * newton.J;
    EXPECT_LT((A * x - b).norm(), 1e-11 * (A.norm() * x.norm()));  // round-off of one LU
  }
}

/// d/dt of a function of the state along the motion, by a central difference.
template <class F>
auto rate_of(const HubCase& c, F f) {
  const double h = 1e-6;
  const VectorXd y_dot = c.derivative(c.y);
  return ((f(c.y + h * y_dot) - f(c.y - h * y_dot)) / (2 * h)).eval();
}

TEST(HubWithBooms, PowerBalances) {
  const HubCase c;
  const auto energy = [&](const VectorXd& y) { return Eigen::Matrix<double, 1, 1>(c.system->balance(y).energy()); };
  EXPECT_NEAR(rate_of(c, energy)[0], 0,
              1e-8);  // energies near 1 J, difference step 1e-6: truncation 1e-12 f''', round-off 1e-10
}

TEST(HubWithBooms, MomentaAreConserved) {
  const HubCase c;
  EXPECT_LT(rate_of(c, [&](const VectorXd& y) { return c.system->balance(y).momentum; }).norm(), 1e-8);
  EXPECT_LT(rate_of(c, [&](const VectorXd& y) { return c.system->balance(y).angular_momentum; }).norm(), 1e-8);
}

// By the point masses: first and second moments, and the velocity of the first.
TEST(HubWithBooms, IsOneBodyAboutItsMassCentre) {
  const HubCase c;
  testing::expect_same_mass_centre(c.system->tree(), c.y);
  const FloatingBodies whole = split(c.system->tree())->floating(0, 0, c.y.data());
  const Matrix3d A = rotation_matrix(c.system->unpack(c.y).attitude);
  const HubState s = c.system->unpack(c.y);
  double m = c.system->hub().m;
  Vector3d first = Vector3d::Zero(), rate = Vector3d::Zero(), turning = c.system->hub().J0 * s.omega;
  Matrix3d second = Vector3d(0.5 * (-1.3 + 0.9 + 0.7), 0.5 * (1.3 - 0.9 + 0.7), 0.5 * (1.3 + 0.9 - 0.7)).asDiagonal();
  second(0, 1) = second(1, 0) = -0.05;
  for (size_t i = 0; i < c.points.size(); ++i) {
    const Matrix3d C = c.system->boom_to_hub(i, s.angle[i]);
    const PointBody& points = c.points[i];
    for (size_t p = 0; p < points.dm.size(); ++p) {
      const Vector3d u = points.u0[p] + points.S[p] * s.q[i];
      const Vector3d r = c.system->appendages()[i].hinge.point + C * u;
      const Vector3d along = C * (s.rate[i] * Vector3d::UnitZ().cross(u) + points.S[p] * s.q_dot[i]);
      m += points.dm[p];
      first += points.dm[p] * r;
      rate += points.dm[p] * (s.omega.cross(r) + along);
      second += points.dm[p] * r * r.transpose();
      turning += points.dm[p] * r.cross(s.omega.cross(r) + along);
    }
  }
  second -= first * first.transpose() / m;
  EXPECT_LT((whole.centre.position - A * first / m).norm(), 1e-14);
  EXPECT_LT((whole.centre.velocity - A * rate / m).norm(), 1e-14);
  EXPECT_LT((A.transpose() * whole.inertia * A - (second.trace() * Matrix3d::Identity() - second)).norm(), 1e-13);
  EXPECT_LT((whole.angular_momentum - A * (turning - first.cross(rate) / m)).norm(), 1e-13);
}

TEST(HubWithBooms, MotionIsTheSameSeenFromAnotherInertialFrame) {
  const HubCase c;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.8, Vector3d(1, 2, -1).normalized()));
  HubState s = c.system->unpack(c.y);
  s.attitude = quaternion_product({turn.w(), turn.x(), turn.y(), turn.z()}, s.attitude);
  s.velocity = turn * s.velocity;
  s.position = turn * s.position + Vector3d(3, -4, 5);
  const VectorXd y_dot = c.derivative(c.y), turned = c.derivative(c.system->pack(s));
  const HubLayout& l = c.system->layout();
  EXPECT_LT((turned.head(l.p + l.u) - y_dot.head(l.p + l.u)).norm(), 1e-13 * y_dot.norm());
  EXPECT_LT((turned.segment<3>(l.velocity()) - turn * y_dot.segment<3>(l.velocity())).norm(), 1e-13 * y_dot.norm());
}

TEST(HubWithBooms, RigidBodiesAreBodiesWithoutModes) {
  std::mt19937 random(7);
  const PointBody p = testing::random_point_body(random, 9, 0, "rigid");
  const Hub system(rigid_body("hub", 2.0, Vector3d::Zero(), Matrix3d::Identity()), {{p.body, Hinge{}}});
  const VectorXd y_dot = system.derivative(system.pack(system.at_rest({1.0})), {0});
  EXPECT_EQ(y_dot.norm(), 0.0);  // nothing pushes
}

TEST(HubWithBooms, SaysWhatIsWrongWithItsParts) {
  const ReducedBody hub = rigid_body("hub", 1.0, Vector3d::Zero(), Matrix3d::Identity());
  Appendage a{eq14::reduced_body(testing::round_boom(0.295, 0.005), 2, eq14::Planes::xy, "boom"), {}};
  Appendage tilted = a;
  tilted.hinge.outward = Vector3d(0.1, 1, 0).normalized();
  EXPECT_THROW(Hub(hub, {tilted}), InputError);
  Appendage negative = a;
  negative.hinge.mechanism.damping = -1;
  EXPECT_THROW(Hub(hub, {negative}), InputError);
  EXPECT_THROW(Hub({}, {}), InputError);  // nothing moves
}

}  // namespace
}  // namespace flexboom
