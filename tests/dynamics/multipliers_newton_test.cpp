#include "dynamics/numerics/rotation.hpp"
#include "dynamics/redundant/equations.hpp"
#include "dynamics/redundant/start.hpp"
#include "dynamics/simulation/formulations.hpp"

#include "dynamics_testing.hpp"
#include "multipliers_testing.hpp"
#include "reduction/body/tilde.hpp"

#include <gtest/gtest.h>
#include <Eigen/LU>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::at;
using testing::at_marker;
using testing::joint;

/// Three bodies of point masses with every invariant non-zero, markers that shift and turn, every kind of joint,
/// springs, loads, a wheel.
struct Everything {
  std::mt19937 random{7};
  std::uniform_real_distribution<double> uniform{-1, 1};
  std::vector<testing::PointBody> points;
  Multibody scene;

  double noise() { return uniform(random); }
  Vector3d vector() { return {noise(), noise(), noise()}; }
  Matrix3d turn() { return Eigen::AngleAxisd(noise(), vector().normalized()).toRotationMatrix(); }

  Everything() {
    for (int i = 0; i < 5; ++i) {
      testing::PointBody p =
          testing::random_point_body(random, 7, i % 3 == 2 ? 0 : 2 + i % 2, "body" + std::to_string(i));
      for (const char* name : {"in", "out"}) {
        Marker m;
        m.name = name;
        m.position = vector();
        m.S = Eigen::Matrix3Xd::NullaryExpr(3, p.body.n(), [&] { return noise(); });
        m.S_theta = Eigen::Matrix3Xd::NullaryExpr(3, p.body.n(), [&] { return noise(); });
        p.body.markers.push_back(m);
      }
      points.push_back(p);
      scene.bodies.push_back(p.body);
    }
    const HingeMechanism mechanism{0.7, 0.2, 0.3, 9.0, 0.4};
    const auto place = [&](int body, const char* marker) {
      Place p = at_marker(body, marker);
      p.axes = turn();
      return p;
    };
    scene.joints.push_back(joint("free", JointKind::free, at(-1), at(0)));
    scene.joints.push_back(joint("hinge", JointKind::hinge, place(0, "out"), place(1, "in"), mechanism));
    scene.joints.push_back(joint("slider", JointKind::slider, place(1, "out"), place(2, "in"), mechanism));
    scene.joints.push_back(joint("universal", JointKind::universal, place(0, "in"), place(3, "in")));
    scene.joints.push_back(joint("spherical", JointKind::spherical, place(3, "out"), place(4, "out")));
    scene.joints.push_back(joint("fixed", JointKind::fixed, at(-1, vector(), turn()), at(4, vector(), turn())));
    scene.joints[3].prescribed = {testing::polynomial(0.1, 0.4, 0.3), testing::polynomial(-0.2, 0.5, 0.1)};
    scene.joints.back().closes_loop = true;
    scene.springs.push_back({"spring", place(1, "out"), place(3, "out"), 5, 0.3, 0.2});
    scene.springs.push_back({"ground", at(-1, vector()), place(4, "in"), 5, 0.3, 0.2});
    const auto wave = [](double t) { return 1 + std::sin(t); };
    scene.loads.push_back({"thruster", place(1, "out"), false, {wave, wave, nullptr}, {wave, nullptr, wave}});
    scene.loads.push_back({"push", place(3, "in"), true, {nullptr, wave, wave}, {wave, wave, nullptr}});
    scene.wheels.push_back({"wheel", 1, vector().normalized(), 0.3, 2.0, wave});
    scene.gravity = {0.3, -0.2, -1};
  }

  VectorXd random_state(const redundant::Equations& e, bool multipliers) {
    std::vector<BodyState> states;
    for (const ReducedBody& b : scene.bodies) {
      BodyState s;
      s.position = vector(), s.velocity = vector(), s.omega = vector();
      s.attitude = Eigen::Vector4d(noise(), noise(), noise(), noise()).normalized();
      s.q = 0.3 * VectorXd::NullaryExpr(b.n(), [&] { return noise(); });
      s.q_dot = VectorXd::NullaryExpr(b.n(), [&] { return noise(); });
      states.push_back(s);
    }
    VectorXd y = e.pack(states);
    if (multipliers)
      for (const redundant::JointData& j : e.joints())
        for (const redundant::Row& r : j.rows) y[r.lambda] = noise();
    return y;
  }
};

redundant::JointMemory closed_stops(size_t joints) {
  return {std::vector<char>(joints, 1), std::vector<double>(joints, 0.0)};
}

/// Kg that mean nothing, for every load.
void add_geometric_stiffness(Everything& c) {
  for (ReducedBody& b : c.scene.bodies) {
    const auto matrices = [&](size_t count) {
      std::vector<MatrixXd> K(count);
      for (MatrixXd& k : K) {
        k = MatrixXd::NullaryExpr(b.n(), b.n(), [&] { return 0.3 * c.noise(); });
        k = (k + k.transpose()).eval();
      }
      return K;
    };
    if (b.n() == 0) continue;
    b.Kg.spin = matrices(6), b.Kg.acceleration = matrices(3), b.Kg.angular_acceleration = matrices(3);
    for (const Marker& m : b.markers) b.Kg.markers.push_back({m.name, matrices(3), matrices(3)});
  }
}

class NewtonMatrix : public ::testing::TestWithParam<Stiffening> {};
INSTANTIATE_TEST_SUITE_P(Multipliers, NewtonMatrix, ::testing::Values(Stiffening::off, Stiffening::on),
                         [](const auto& p) { return p.param == Stiffening::on ? "stiffened" : "plain"; });

TEST_P(NewtonMatrix, AgreesWithCentralDifferences) {
  Everything c;
  add_geometric_stiffness(c);
  const Multipliers system(c.scene, {GetParam()});
  redundant::Equations e(system.impl());
  const VectorXd y = c.random_state(e, true), y_dot = VectorXd::NullaryExpr(e.size(), [&] { return c.noise(); });
  const redundant::JointMemory memory = closed_stops(c.scene.joints.size());
  const double t = 0.3, factor = 1.7, h = 1e-5;
  redundant::PatternSum sparse;
  e.newton(t, factor, y.data(), y_dot.data(), memory, sparse);
  sparse.finish(e.size());
  std::vector<double> values(sparse.rows().size());
  sparse.begin(values.data());
  e.newton(t, factor, y.data(), y_dot.data(), memory, sparse);
  VectorXd plus(e.size()), minus(e.size());
  for (int i = 0; i < e.size(); ++i) {
    VectorXd step = VectorXd::Zero(e.size());
    step[i] = h;
    e.residual(t, (y + step).eval().data(), (y_dot + factor * step).eval().data(), memory, plus.data());
    e.residual(t, (y - step).eval().data(), (y_dot - factor * step).eval().data(), memory, minus.data());
    const VectorXd column = (plus - minus) / (2 * h);
    VectorXd exact = VectorXd::Zero(e.size());
    for (int k = sparse.starts()[static_cast<size_t>(i)]; k < sparse.starts()[static_cast<size_t>(i) + 1]; ++k)
      exact[sparse.rows()[static_cast<size_t>(k)]] = values[static_cast<size_t>(k)];
    // Truncation h^2 f''' and round-off eps / h, both near 1e-9 of entries near 1e2.
    EXPECT_LT((exact - column).cwiseAbs().maxCoeff(), 2e-7) << "column " << i;
  }
}

/// Accelerations by virtual power over the point masses, with the constraints' gradient and second derivative by
/// differences of their values: no invariant and no Jacobian of ours.
TEST(Multipliers, AccelerationsAgreeWithVirtualPowerOverPointMasses) {
  Everything c;
  c.scene.wheels.clear();
  c.scene.loads.clear();
  c.scene.springs.clear();
  c.scene.joints[1].mechanism = c.scene.joints[2].mechanism = testing::no_mechanism();
  const Multipliers system(c.scene);
  redundant::Equations e(system.impl());
  VectorXd y = c.random_state(e, false), y_dot;
  e.make_consistent(0.2, y, y_dot, closed_stops(c.scene.joints.size()));
  const int n = e.freedoms(), m = e.all_rows();
  MatrixXd M = MatrixXd::Zero(n, n);
  VectorXd f = VectorXd::Zero(n);
  const std::vector<BodyState> states = e.unpack(y.data());
  for (size_t i = 0; i < states.size(); ++i) {
    const BodyState& s = states[i];
    const testing::PointBody& p = c.points[i];
    const Matrix3d A = rotation_matrix(s.attitude);
    const int at = e.places()[i].freedom, modes = p.body.n();
    for (size_t k = 0; k < p.dm.size(); ++k) {
      const Vector3d u = p.u0[k] + p.S[k] * s.q, u_dot = p.S[k] * s.q_dot;
      MatrixXd B = MatrixXd::Zero(3, n);
      B.middleCols<3>(at).setIdentity();
      B.middleCols<3>(at + 3) = -A * tilde(u);
      B.middleCols(at + 6, modes) = A * p.S[k];
      const Vector3d bias = A * (s.omega.cross(s.omega.cross(u)) + 2 * s.omega.cross(u_dot));
      M += p.dm[k] * B.transpose() * B;
      f += p.dm[k] * B.transpose() * (c.scene.gravity - bias);
    }
    f.segment(at + 6, modes) -= p.body.Ke * s.q + p.body.De * s.q_dot;
  }
  const double h = 1e-4;
  const auto values = [&](double t, const VectorXd& state) {
    VectorXd g(m), g_dot(m);
    e.row_violations(t, state.data(), g.data(), g_dot.data());
    return std::pair(g, g_dot);
  };
  MatrixXd G(m, n);
  for (int i = 0; i < n; ++i) {
    VectorXd plus = y, minus = y;
    e.displace(plus, h * VectorXd::Unit(n, i));
    e.displace(minus, -h * VectorXd::Unit(n, i));
    G.col(i) = (values(0.2, plus).first - values(0.2, minus).first) / (2 * h);
  }
  VectorXd velocity(n);
  for (const redundant::BodyPlaces& b : e.places()) velocity.segment(b.freedom, 6 + b.n) = y.segment(b.v, 6 + b.n);
  // Rates of the rows: the gradient times the velocity, and the time in them.
  const VectorXd in_time = (values(0.2 + h, y).first - values(0.2 - h, y).first) / (2 * h);
  EXPECT_LT((values(0.2, y).second - G * velocity - in_time).norm(), 1e-6);  // h^2 times third derivatives near 10
  VectorXd plus = y, minus = y;
  e.displace(plus, h * velocity);
  e.displace(minus, -h * velocity);
  const VectorXd bias = (values(0.2 + h, plus).second - values(0.2 - h, minus).second) / (2 * h);
  MatrixXd K = MatrixXd::Zero(n + m, n + m);
  K << M, -G.transpose(), G, MatrixXd::Zero(m, m);
  VectorXd b(n + m);
  b << f, -bias;
  const VectorXd x = K.lu().solve(b);
  for (const redundant::BodyPlaces& p : e.places())
    EXPECT_LT((x.segment(p.freedom, 6 + p.n) - y_dot.segment(p.v, 6 + p.n)).norm(), 1e-6 * x.head(n).norm());
}

/// Geometric stiffness in every term: the tree has its own kinematics, and its own tests by virtual power.
TEST(Multipliers, StiffenedAccelerationsAreThoseOfTheTree) {
  Everything c;
  add_geometric_stiffness(c);
  c.scene.joints.pop_back();  // the loop
  c.scene.wheels.clear();
  const double t = 0.2;
  const Tree tree(c.scene, {Stiffening::on});
  TreeState s = tree.at_rest();
  for (JointState& j : s.joints) {
    for (double& x : j.coordinate) x = 0.3 * c.noise();
    for (double& x : j.rate) x = c.noise();
    j.omega = c.vector(), j.velocity = c.vector();
    j.attitude = Eigen::Vector4d(1, c.noise(), c.noise(), c.noise()).normalized();
  }
  for (VectorXd& q : s.q) q = 0.2 * VectorXd::NullaryExpr(q.size(), [&] { return c.noise(); });
  for (VectorXd& q_dot : s.q_dot) q_dot = VectorXd::NullaryExpr(q_dot.size(), [&] { return c.noise(); });
  VectorXd y = tree.pack(s), y_dot(y.size());
  tree.impose(t, y);
  const std::vector<char> open(c.scene.joints.size(), 0);
  tree.derivative(t, y.data(), open, *tree.workspace(), y_dot.data());

  const Multipliers system(c.scene, {Stiffening::on});
  redundant::Equations e(system.impl());
  redundant::JointMemory memory{open, {}};
  for (size_t i = 0; i < s.joints.size(); ++i)
    memory.near.push_back(
        s.joints[i].coordinate.empty() ? 0.0 : s.joints[i].coordinate[0] - c.scene.joints[i].mechanism.threshold);
  VectorXd z = VectorXd::Zero(e.size()), z_dot;
  z = e.pack(body_states(tree, t, y));
  e.make_consistent(t, z, z_dot, memory);
  for (size_t i = 0; i < c.scene.bodies.size(); ++i) {
    const redundant::BodyPlaces& at = e.places()[i];
    const VectorXd wanted = y_dot.segment(tree.layout().rate(tree.layout().q[i]), at.n);
    EXPECT_LT((z_dot.segment(at.u, at.n) - wanted).norm(), 1e-10 * y_dot.norm()) << i;
  }
}

}  // namespace
}  // namespace flexboom
