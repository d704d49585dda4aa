#include "dynamics/relative/tree.hpp"

#include "dynamics/numerics/rotation.hpp"
#include "fem/base/check.hpp"
#include "tree_oracle.hpp"
#include "tree_testing.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace flexboom {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::at_marker;
using testing::Oracle;
using testing::place;
using testing::PointBody;

VectorXd derivative(const Tree& tree, double t, const VectorXd& y, const std::vector<char>& contact) {
  const auto work = tree.workspace();
  VectorXd y_dot(y.size());
  tree.derivative(t, y.data(), contact, *work, y_dot.data());
  return y_dot;
}

/// A body of points with two markers that move like nothing else.
PointBody body_with_markers(std::mt19937& random, int n, const std::string& name) {
  PointBody p = testing::random_point_body(random, 7, n, name);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto noise = [&] { return uniform(random); };
  for (const char* marker : {"left", "right"}) {
    Marker m;
    m.name = marker;
    m.position = Vector3d::NullaryExpr(noise);
    m.S = 0.5 * Eigen::Matrix3Xd::NullaryExpr(3, n, noise);
    m.S_theta = 3 * Eigen::Matrix3Xd::NullaryExpr(3, n, noise);
    p.body.markers.push_back(m);
  }
  return p;
}

// ---- against virtual power over point masses ----

enum class Where { fixed, marker };

/// Body 0 on the inertial frame, 1 on 0, 2 and 3 on 1, all by one kind of joint, gravity, one place of every kind.
struct TreeCase {
  std::mt19937 random{7};
  std::vector<PointBody> points;
  std::unique_ptr<Tree> tree;
  VectorXd y;
  double t = 0.7;
  std::vector<char> contact;

  TreeCase(JointKind root, JointKind kind, Where a, Where b, bool prescribed = false) {
    Multibody scene;
    scene.gravity = Vector3d(0.3, -9.81, 1.7);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const auto noise = [&] { return uniform(random); };
    const auto somewhere = [&](int body, Where where, const char* marker) {
      const Matrix3d axes = testing::random_rotation(random);
      return where == Where::fixed || body < 0 ? place(body, Vector3d::NullaryExpr(noise), axes)
                                               : at_marker(body, marker, axes);
    };
    for (int i = 0; i < 4; ++i) {
      points.push_back(body_with_markers(random, i == 3 ? 0 : 3 - i / 2, fmt::format("body {}", i)));
      scene.bodies.push_back(points.back().body);
      const int parent = i == 3 ? 1 : i - 1;
      const Place on = somewhere(parent, a, i == 3 ? "left" : "right"), own = somewhere(i, b, "left");
      Joint joint = testing::joint(fmt::format("joint {}", i), i == 0 ? root : kind, on, own);
      const JointType& type = joint_type(joint.kind);
      if (prescribed && i > 0)
        for (int k = 0; k < type.scalars; ++k) joint.prescribed.push_back(testing::swing(0.5 + 0.2 * k));
      if (type.scalars == 1) joint.mechanism = {0.7, 0.2, 0.05, joint.prescribed.empty() ? 3.0 : 0.0, 0.3};
      scene.joints.push_back(joint);
      contact.push_back(static_cast<char>(i % 2));
    }
    tree = std::make_unique<Tree>(scene);
    y = tree->pack(testing::random_state(*tree, random));
    tree->impose(t, y);
  }

  /// Generalised forces of structures and mechanisms.
  VectorXd internal_forces(const Oracle& oracle, std::vector<char>& given) const {
    const TreeLayout& l = tree->layout();
    VectorXd f = VectorXd::Zero(oracle.size());
    given.assign(static_cast<size_t>(oracle.size()), 0);
    for (size_t b = 0; b < points.size(); ++b) {
      const int at = l.q[b], n = points[b].body.n();
      f.segment(l.base + at, n) -= points[b].body.Ke * y.segment(at, n) + points[b].body.De * y.segment(l.rate(at), n);
    }
    for (size_t i = 0; i < l.joints.size(); ++i) {
      const Joint& joint = tree->scene().joints[i];
      const HingeMechanism& m = joint.mechanism;
      const int at = l.joints[i].scalar;
      if (at < 0) continue;
      if (!joint.prescribed.empty())
        for (size_t k = 0; k < joint.prescribed.size(); ++k) given[static_cast<size_t>(l.base + at) + k] = 1;
      if (joint_type(joint.kind).scalars != 1) continue;
      f[l.base + at] += m.stiffness * (m.rest - m.threshold - y[at]) - m.damping * y[l.rate(at)];
      if (contact[i]) f[l.base + at] -= m.stop_stiffness * y[at];
    }
    return f;
  }
};

/// u_dot and the accelerations of floating joints.
VectorXd accelerations(const Tree& tree, const VectorXd& y_dot, int size) {
  const TreeLayout& l = tree.layout();
  VectorXd r(size);
  r.head(l.u) = y_dot.segment(l.p, l.u);
  int next = l.u;
  for (const TreeLayout::Joint& j : l.joints)
    if (j.velocity >= 0) r.segment<3>(next) = y_dot.segment<3>(j.velocity), next += 3;
  return r;
}

void expect_virtual_power(const TreeCase& c, const std::string& what) {
  const Oracle oracle(*c.tree, c.points);
  std::vector<char> given;
  const VectorXd forces = c.internal_forces(oracle, given);
  VectorXd expected = oracle.accelerations(c.y, c.t, forces, given);
  VectorXd found = accelerations(*c.tree, derivative(*c.tree, c.t, c.y, c.contact), oracle.size());
  for (int i = 0; i < found.size(); ++i)
    if (given[static_cast<size_t>(i)]) found[i] = 0;
  // Round-off of solves with condition numbers up to 1e4.
  EXPECT_LT((found - expected).norm(), 2e-12 * expected.norm()) << what << "\n"
                                                                << found.transpose() << "\n"
                                                                << expected.transpose();
}

TEST(Tree, AccelerationsAgreeWithVirtualPowerOverPointMasses) {
  for (const JointKind root : {JointKind::free, JointKind::hinge, JointKind::fixed})
    for (const JointType& type : joint_types)
      for (const Where a : {Where::fixed, Where::marker})
        for (const Where b : {Where::fixed, Where::marker})
          expect_virtual_power(
              TreeCase(root, type.kind, a, b),
              fmt::format("root {}, {}, a {}, b {}", joint_type(root).name, type.name,
                          a == Where::marker ? "marker" : "fixed", b == Where::marker ? "marker" : "fixed"));
}

TEST(Tree, PrescribedJointsMoveAsTheyAreTold) {
  for (const JointKind kind : {JointKind::hinge, JointKind::slider, JointKind::universal})
    for (const Where where : {Where::fixed, Where::marker}) {
      const TreeCase c(JointKind::free, kind, where, where, true);
      expect_virtual_power(c, std::string(joint_type(kind).name));
      const VectorXd y_dot = derivative(*c.tree, c.t, c.y, c.contact);
      const TreeLayout& l = c.tree->layout();
      const TimeFunction f = testing::swing(0.5);
      EXPECT_DOUBLE_EQ(y_dot[l.joints[2].scalar], f.rate(c.t));
      EXPECT_DOUBLE_EQ(y_dot[l.rate(l.joints[2].scalar)], f.acceleration(c.t));
    }
}

TEST(Tree, PlacesAreWhereTheOracleSeesThem) {
  for (const JointType& type : joint_types) {
    TreeCase c(JointKind::free, type.kind, Where::marker, Where::marker);
    const Oracle oracle(*c.tree, c.points);
    const auto frames = oracle.frames(c.y, oracle.rates(c.y), c.t);
    for (const Place& p :
         {place(2, Vector3d(0.1, 0.2, 0.3)), at_marker(1, "right", testing::random_rotation(c.random))}) {
      const testing::JetFrame expected = oracle.place(c.y, oracle.rates(c.y), p, frames);
      const PlaceMotionInSpace found = c.tree->motion(c.t, c.y, p);
      EXPECT_LT((found.position - Oracle::value(expected.r)).norm(), 1e-13 * 10);
      EXPECT_LT((found.axes - Oracle::value(expected.A)).norm(), 1e-13 * 10);
      EXPECT_LT((found.velocity - Oracle::velocity(expected.r)).norm(), 1e-13 * 30);
      EXPECT_LT((found.omega - Oracle::angular_velocity(expected.A)).norm(), 1e-13 * 30);
    }
  }
}

TEST(Tree, JacobianAgreesWithCentralDifferences) {
  for (const JointType& type : joint_types)
    for (const Where b : {Where::fixed, Where::marker}) {
      const TreeCase c(JointKind::free, type.kind, Where::marker, b);
      const auto work = c.tree->workspace();
      MatrixXd J;
      c.tree->jacobian(c.t, c.y.data(), c.contact, *work, J);
      const double h = 1e-5;
      for (Eigen::Index i = 0; i < c.y.size(); ++i) {
        const VectorXd step = h * VectorXd::Unit(c.y.size(), i);
        const VectorXd column =
            (derivative(*c.tree, c.t, c.y + step, c.contact) - derivative(*c.tree, c.t, c.y - step, c.contact)) /
            (2 * h);
        // Truncation h^2 f''' / 6 with derivatives up to 1e3 of the largest entries.
        EXPECT_LT((J.col(i) - column).cwiseAbs().maxCoeff(), 1e-7 * std::max(1.0, J.cwiseAbs().maxCoeff()))
            << type.name << ", column " << i;
      }
    }
}

// ---- balances ----

/// d/dt of a function of t and the state along the motion, by a central difference.
template <class F>
auto rate_of(const TreeCase& c, F f) {
  const double h = 1e-6;
  const VectorXd y_dot = derivative(*c.tree, c.t, c.y, std::vector<char>(c.contact.size(), 0));
  return ((f(c.t + h, c.y + h * y_dot) - f(c.t - h, c.y - h * y_dot)) / (2 * h)).eval();
}

TEST(Tree, PowerBalances) {
  for (const JointType& type : joint_types)
    for (const bool prescribed : {false, true}) {
      if (prescribed && type.scalars == 0) continue;
      TreeCase c(JointKind::free, type.kind, Where::marker, Where::marker, prescribed);
      for (const TreeLayout::Joint& j : c.tree->layout().joints)  // within the stops
        if (j.scalar >= 0) c.y[j.scalar] = -std::abs(c.y[j.scalar]);
      c.tree->impose(c.t, c.y);
      const auto energy = [&](double t, const VectorXd& y) {
        return Eigen::Matrix<double, 1, 1>(c.tree->balance(t, y).energy());
      };
      EXPECT_NEAR(rate_of(c, energy)[0], 0, 3e-7) << type.name << prescribed;  // energies near 1e2 J: round-off 1e-8
    }
}

TEST(Tree, MomentaOfFreeFlightAreConserved) {
  for (const JointType& type : joint_types) {
    TreeCase c(JointKind::free, type.kind, Where::marker, Where::marker);
    Multibody scene = c.tree->scene();
    scene.gravity.setZero();
    c.tree = std::make_unique<Tree>(scene);
    if (type.kind != JointKind::free) testing::expect_same_mass_centre(*c.tree, c.y);
    EXPECT_LT(rate_of(c, [&](double t, const VectorXd& y) { return c.tree->balance(t, y).momentum; }).norm(), 3e-7)
        << type.name;
    EXPECT_LT(rate_of(c, [&](double t, const VectorXd& y) { return c.tree->balance(t, y).angular_momentum; }).norm(),
              3e-7)
        << type.name;
  }
}

// ---- loads, springs, wheels ----

TEST(Tree, LoadsAndSpringsDoTheirVirtualWork) {
  const TreeCase bare(JointKind::free, JointKind::universal, Where::marker, Where::marker);
  Multibody scene = bare.tree->scene();
  const Matrix3d axes = Eigen::Quaterniond(0.5, 0.1, -0.7, 0.2).normalized().toRotationMatrix();
  const auto constant = [](double x) { return [x](double) { return x; }; };
  scene.loads.push_back({"follower", at_marker(1, "right", axes), false, {constant(1.0), constant(-2.0), nullptr}, {}});
  scene.loads.push_back({"dead",
                         place(2, Vector3d(0.2, -0.1, 0.5)),
                         true,
                         {nullptr, constant(3.0), nullptr},
                         {constant(0.5), nullptr, constant(-0.7)}});
  scene.loads.push_back(
      {"twist", at_marker(2, "right", axes), false, {}, {constant(0.4), constant(0.3), constant(-0.6)}});
  scene.springs.push_back({"brace", at_marker(0, "left"), place(3, Vector3d(0.3, 0.2, 0.1)), 5.0, 0.4, 0.3});
  scene.springs.push_back({"tether", place(-1, Vector3d(1, 2, 3)), at_marker(2, "left"), 2.0, 1.0, 0.1});
  const Tree tree(scene);
  VectorXd y = VectorXd::Zero(tree.layout().size);
  y = bare.y;
  const Oracle oracle(tree, bare.points);
  std::vector<char> given;
  VectorXd f = bare.internal_forces(oracle, given);
  const auto frames = oracle.frames(y, oracle.rates(y), bare.t);
  const auto at = [&](const Place& p) { return oracle.place(y, oracle.rates(y), p, frames); };
  for (const Load& load : scene.loads) {
    Vector3d force, torque;
    for (int i = 0; i < 3; ++i) {
      force[i] = load.force[size_t(i)] ? load.force[size_t(i)](0) : 0;
      torque[i] = load.torque[size_t(i)] ? load.torque[size_t(i)](0) : 0;
    }
    const Matrix3d A = load.inertial_axes ? Matrix3d::Identity() : Oracle::value(at(load.at).A);
    f += oracle.generalised(y, load.at, A * force, A * torque);
  }
  for (const SpringDamper& s : scene.springs) {
    const testing::JetVector d = at(s.b).r - at(s.a).r;
    const Vector3d line = Oracle::value(d), rate = Oracle::velocity(d);
    const double length = line.norm();
    const Vector3d pull =
        (s.stiffness * (length - s.free_length) + s.damping * rate.dot(line) / length) / length * line;
    f += oracle.generalised(y, s.a, pull, Vector3d::Zero()) + oracle.generalised(y, s.b, -pull, Vector3d::Zero());
  }
  const VectorXd expected = oracle.accelerations(y, bare.t, f, given);
  const VectorXd found = accelerations(tree, derivative(tree, bare.t, y, bare.contact), oracle.size());
  EXPECT_LT((found - expected).norm(), 2e-12 * expected.norm());  // as above
}

}  // namespace
}  // namespace flexboom
