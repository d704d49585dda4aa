#include "dynamics/redundant/multipliers.hpp"
#include "dynamics/numerics/rotation.hpp"
#include "dynamics/simulation/formulations.hpp"
#include "dynamics/simulation/tree_integrator.hpp"

#include "fem/base/check.hpp"
#include "hub_testing.hpp"
#include "multipliers_testing.hpp"
#include "sport_testing.hpp"

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include <cmath>

namespace flexboom {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;
using testing::at;
using testing::at_marker;
using testing::Hub;
using testing::HubState;
using testing::joint;

using std::numbers::pi;

Multipliers torque_free() {
  Multibody scene;
  scene.bodies = {rigid_body("hub", 8.5, Vector3d::Zero(), Vector3d(0.134942, 0.10477, 0.05858).asDiagonal())};
  return Multipliers(scene);
}

TEST(Multipliers, TorqueFreeCaseBFollowsEllipticFunctionsFor200Seconds) {
  BodyState start;
  start.omega = {0.1, 1, 0.05};
  const MultibodyTrajectory r = integrate_multipliers(torque_free(), {start}, testing::options(1e-12, 200, 1));
  double omega = 0, attitude = 0;
  size_t i = 0;
  for (const auto& row : testing::read_csv("torque_free_case_b.csv")) {
    const BodyState& s = r.states.at(i++).bodies[0];
    for (size_t k = 0; k < 3; ++k)
      omega = std::max(omega, std::abs(s.omega[static_cast<int>(k)] - std::stod(row[2 + k])));
    Vector4d exact;
    for (size_t k = 0; k < 4; ++k) exact[static_cast<int>(k)] = std::stod(row[5 + k]);
    attitude = std::max(attitude, std::min((s.attitude - exact).norm(), (s.attitude + exact).norm()));
  }
  EXPECT_EQ(i, 201U);
  EXPECT_LT(omega, 1e-9);
  EXPECT_LT(attitude, 1e-9);
  EXPECT_LT(r.summary.energy_balance, 1e-10);
  EXPECT_LT(r.summary.momentum_drift, 1e-10);
  EXPECT_LT(r.summary.quaternion_drift, 1e-12);
}

/// A bar released horizontally: 5/2 m g sin along it, 1/4 m g cos across it (statics of a textbook), and the period by
/// the complete elliptic integral.
TEST(Multipliers, PendulumHasItsTextbookForcesAndPeriod) {
  const double m = 2, l = 0.8, g = 9.81;
  Multibody scene;
  scene.bodies = {testing::bar("bar", m, l)};
  scene.joints = {joint("pivot", JointKind::hinge, at(-1), at(0))};
  scene.gravity = {0, -g, 0};
  const double omega0 = std::sqrt(1.5 * g / l), period = 4 * std::comp_ellint_1(std::sin(pi / 4)) / omega0;
  MultipliersOptions o = testing::options(1e-10, 3 * period, period / 40);
  const MultibodyTrajectory r = integrate_multipliers(Multipliers(scene), place_bodies(scene, {{0}}), o);
  double force = 0;
  for (const MultibodyState& s : r.states) {
    const double below = -s.coordinate[0];  // angle under the horizontal
    const Matrix3d A = rotation_matrix(s.bodies[0].attitude);
    const Vector3d pull = A.transpose() * s.loads[0].force;
    force =
        std::max({force, std::abs(pull.x() + 2.5 * m * g * std::sin(below)),
                  std::abs(pull.y() - 0.25 * m * g * std::cos(below)), std::abs(pull.z()), s.loads[0].torque.norm()});
  }
  EXPECT_LT(force, 1e-8 * m * g);
  EXPECT_LT(std::abs(r.states.back().coordinate[0]), 1e-7);  // at the top, where its square is the energy
  EXPECT_LT(r.summary.energy_balance, 1e-9);
}

// At the start nothing moves, and nothing has energy yet.
TEST(Multipliers, AConstantTorqueFromRestTurnsABodyEvenly) {
  const double m = 2, l = 0.8, torque = 0.3, J = m * l * l / 3;
  Multibody scene;
  scene.bodies = {testing::bar("bar", m, l)};
  scene.joints = {joint("pivot", JointKind::hinge, at(-1), at(0))};
  Load motor;
  motor.name = "motor", motor.at = at(0);
  motor.torque[2] = [torque](double) { return torque; };
  scene.loads.push_back(motor);
  const MultibodyTrajectory r =
      integrate_multipliers(Multipliers(scene), place_bodies(scene, {}), testing::options(1e-9, 1, 0.1));
  for (size_t i = 0; i < r.time.size(); ++i) {
    const double angle = 0.5 * torque / J * r.time[i] * r.time[i];
    EXPECT_NEAR(r.states[i].coordinate[0], angle, 1e-9) << r.time[i];
    EXPECT_NEAR(r.states[i].work, torque * angle, 1e-9) << r.time[i];
  }
  EXPECT_LT(r.summary.energy_balance, 1e-9);
}

/// Planar chain of bars in absolute angles: sum_j H_ij (theta_j'' cos + theta_j'^2 sin)(theta_i - theta_j) = -w_i cos
/// theta_i, flown by the classical Runge-Kutta method.
VectorXd chain_acceleration(const VectorXd& angle, const VectorXd& rate, double m, double l, double g) {
  const auto n = angle.size();
  MatrixXd M(n, n);
  VectorXd f(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    f[i] = -(0.5 + static_cast<double>(n - 1 - i)) * m * l * g * std::cos(angle[i]);
    for (Eigen::Index j = 0; j < n; ++j) {
      const auto after = static_cast<double>(n - 1 - std::max(i, j));
      const double H = i == j ? (1.0 / 3 + after) * m * l * l : (0.5 + after) * m * l * l;
      M(i, j) = H * std::cos(angle[i] - angle[j]);
      f[i] -= H * std::sin(angle[i] - angle[j]) * rate[j] * rate[j];
    }
  }
  return M.ldlt().solve(f);
}

TEST(Multipliers, PendulumChainFollowsItsPlanarEquations) {
  const double m = 0.6, l = 0.5, g = 9.81;
  constexpr int n = 4;
  Multibody scene;
  for (int i = 0; i < n; ++i) {
    scene.bodies.push_back(testing::bar("bar" + std::to_string(i), m, l));
    scene.joints.push_back(
        joint("hinge" + std::to_string(i), JointKind::hinge, i == 0 ? at(-1) : at(i - 1, {l, 0, 0}), at(i)));
  }
  scene.gravity = {0, -g, 0};
  const MultibodyTrajectory r = integrate_multipliers(
      Multipliers(scene), place_bodies(scene, {{-0.9}, {0.3}, {0}, {-0.2}}), testing::options(1e-9, 2, 0.1));
  VectorXd x(n), v = VectorXd::Zero(n);
  x << -0.9, -0.6, -0.6, -0.8;
  const double h = 1e-4;
  double worst = 0;
  for (int step = 0; step <= 20000; ++step) {
    if (step % 1000 == 0) {
      double angle = 0;
      for (int i = 0; i < n; ++i) {
        angle += r.states[static_cast<size_t>(step / 1000)].coordinate[static_cast<size_t>(i)];
        worst = std::max(worst, std::abs(angle - x[i]));
      }
    }
    const auto a = [&](const VectorXd& p, const VectorXd& q) { return chain_acceleration(p, q, m, l, g); };
    const VectorXd k1 = a(x, v), k2 = a(x + h / 2 * v, v + h / 2 * k1),
                   k3 = a(x + h / 2 * v + h * h / 4 * k1, v + h / 2 * k2),
                   k4 = a(x + h * v + h * h / 2 * k2, v + h * k3);
    x += h * v + h * h / 6 * (k1 + k2 + k3);
    v += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  EXPECT_LT(worst, 1e-7);  // a chaotic chain: 100 times the tolerance
  EXPECT_LT(r.summary.energy_balance, 1e-8);
  EXPECT_LT(r.summary.position_drift, 1e-12);
}

/// Fixed joints carry what hangs on them: force and moment of the statics.
TEST(Multipliers, FixedJointsCarryWeightAndMoment) {
  const double m = 2, l = 0.8, g = 9.81;
  Multibody scene;
  scene.bodies = {testing::bar("inner", m, l), testing::bar("outer", m, l)};
  scene.joints = {joint("wall", JointKind::fixed, at(-1), at(0)),
                  joint("middle", JointKind::fixed, at(0, {l, 0, 0}), at(1))};
  scene.gravity = {0, -g, 0};
  scene.loads.push_back({"twist", at(1, {l, 0, 0}), true, {}, {[](double) { return 3.0; }, nullptr, nullptr}});
  const MultibodyTrajectory r =
      integrate_multipliers(Multipliers(scene), place_bodies(scene, {}), testing::options(1e-8, 1, 0.5));
  const std::vector<JointReaction>& loads = r.states.back().loads;
  EXPECT_LT((loads[0].force - Vector3d(0, 2 * m * g, 0)).norm(), 1e-10);
  EXPECT_LT((loads[0].torque - Vector3d(-3, 0, 2 * m * g * l)).norm(), 1e-10);
  EXPECT_LT((loads[1].force - Vector3d(0, m * g, 0)).norm(), 1e-10);
  EXPECT_LT((loads[1].torque - Vector3d(-3, 0, m * g * l / 2)).norm(), 1e-10);
}

/// A wheel that speeds up turns its body back: both momenta known.
TEST(Multipliers, WheelTurnsItsBodyBack) {
  Multibody scene;
  const Matrix3d J = Vector3d(2, 3, 4).asDiagonal();
  scene.bodies = {rigid_body("hub", 5, Vector3d::Zero(), J)};
  scene.wheels.push_back({"wheel", 0, Vector3d::UnitZ(), 0.5, 10.0, [](double t) { return std::sin(t); }});
  const MultibodyTrajectory r =
      integrate_multipliers(Multipliers(scene), {BodyState{}}, testing::options(1e-10, 3, 0.5));
  for (size_t i = 0; i < r.time.size(); ++i) {
    const double t = r.time[i], h = 1 - std::cos(t), omega = -h / 4;
    EXPECT_NEAR(r.states[i].bodies[0].omega.z(), omega, 1e-10);
    EXPECT_NEAR(r.states[i].spin[0], 10 + h / 0.5 - omega, 1e-8);
  }
  EXPECT_LT(r.summary.momentum_drift, 1e-12);
  EXPECT_LT(r.summary.energy_balance, 1e-9);
}

/// Boom 2 of SPORT with one mode on the ground, with its stop.
TEST(Multipliers, FlexibleBoomOnAFixedHubMeetsTheReference) {
  for (const char* zeta : {"0.0", "0.05"}) {
    ReducedBody body = eq14::reduced_body(testing::round_boom(0.295, 0.005), 1, eq14::Planes::xy, "boom");
    if (std::stod(zeta) > 0) apply_damping(body, {"modal", std::stod(zeta)});
    Multibody scene;
    scene.bodies = {body};
    scene.joints = {joint("hinge", JointKind::hinge, at(-1), at(0), testing::sport_mechanism(0.35))};
    MultipliersOptions o = testing::options(1e-11, 1, 0.005);
    o.settle = 0;
    const MultibodyTrajectory r =
        integrate_multipliers(Multipliers(scene), place_bodies(scene, {{pi / 2 + pi / 60}}), o);
    double gap_error = 0, q_error = 0, gap_size = 0, q_size = 0;
    for (const auto& row : testing::read_csv("flexible_boom2_fixed_hub.csv")) {
      if (row[0] != "2" || row[1] != "1" || row[2] != zeta) continue;
      const auto i = static_cast<size_t>(std::llround(std::stod(row[3]) / o.output_step));
      if (i >= r.states.size()) continue;
      const double gap = std::stod(row[4]), q = std::stod(row[6]);
      gap_error = std::max(gap_error, std::abs(r.states[i].coordinate[0] - pi / 2 - gap));
      q_error = std::max(q_error, std::abs(r.states[i].bodies[0].q[0] - q));
      gap_size = std::max(gap_size, std::abs(gap));
      q_size = std::max(q_size, std::abs(q));
    }
    EXPECT_LT(gap_error, 1e-9 * gap_size) << zeta;
    EXPECT_LT(q_error, 1e-9 * q_size) << zeta;
    size_t k = 0;
    for (const auto& row : testing::read_csv("flexible_boom2_fixed_hub_events.csv")) {
      if (row[0] != "2" || row[1] != "1" || row[2] != zeta) continue;
      ASSERT_LT(k, r.events.size());
      EXPECT_NEAR(r.events[k++].time, std::stod(row[4]), 1e-9);
    }
    EXPECT_EQ(r.events.size(), k) << zeta;
  }
}

/// SPORT in both formulations.
struct Sport {
  ReducedBody hub = testing::sport_hub();
  std::vector<Appendage> appendages;
  Multibody scene;

  explicit Sport(int modes) : appendages(testing::sport_booms(modes)) {
    scene.bodies = {hub};
    for (const auto& [body, hinge] : appendages) {
      Matrix3d axes;
      axes << hinge.stowed, hinge.outward, hinge.stowed.cross(hinge.outward);
      scene.joints.push_back(joint(hinge.name, JointKind::hinge, at(0, hinge.point, axes),
                                   at(static_cast<int>(scene.bodies.size())), hinge.mechanism));
      scene.bodies.push_back(body);
    }
  }

  std::vector<BodyState> start() const {
    Multibody tree = scene;
    tree.joints.insert(tree.joints.begin(), joint("free", JointKind::free, at(-1), at(0)));
    const std::vector<double> angle = {pi / 2 - pi / 60};
    return place_bodies(tree, {{}, angle, angle, angle, angle});
  }
};

// Joints hold at the distances and speeds of an orbit as they do at the origin, in as many steps.
TEST(Multipliers, FarAndFastIsTheSameMotion) {
  const Sport sport(1);
  const MultipliersOptions o = testing::options(1e-8, 0.02, 0.002);
  const Multipliers system(sport.scene);
  const MultibodyTrajectory here = integrate_multipliers(system, sport.start(), o);
  const Vector3d way(0.6, -0.64, 0.48);
  for (const auto& [distance, speed] : {std::pair{1e4, 0.0}, {1e6, 0.0}, {0.0, 7.6e3}, {7e6, 7.6e3}}) {
    std::vector<BodyState> start = sport.start();
    for (BodyState& b : start) b.position += distance * way, b.velocity += speed * way.reverse();
    const MultibodyTrajectory there = integrate_multipliers(system, start, o);
    EXPECT_LT(there.summary.steps, 1.2 * static_cast<double>(here.summary.steps))
        << distance << " m, " << speed << " m/s";
    EXPECT_EQ(there.events.size(), here.events.size());
    const double far = distance + speed * o.duration, round_off = 1e-15 * far;
    ASSERT_EQ(there.time, here.time);
    for (size_t i = 0; i < here.states.size(); ++i) {
      const MultibodyState &a = here.states[i], &b = there.states[i];
      const Vector3d moved = distance * way + here.time[i] * speed * way.reverse();
      for (size_t k = 0; k < a.bodies.size(); ++k) {
        EXPECT_LT((b.bodies[k].position - moved - a.bodies[k].position).norm(), 1e-9 + round_off);
        EXPECT_LT((b.bodies[k].velocity - speed * way.reverse() - a.bodies[k].velocity).norm(), 1e-7);
        if (k > 0) {
          EXPECT_LT((b.bodies[k].q - a.bodies[k].q).norm(), 1e-9 + 10 * round_off);
        }
      }
      for (size_t k = 0; k < a.coordinate.size(); ++k) EXPECT_NEAR(b.coordinate[k], a.coordinate[k], 1e-8);
    }
    EXPECT_LT(there.summary.position_drift, 1e-12);
    EXPECT_LT(there.summary.momentum_drift, 1e-9);
    EXPECT_LT(there.summary.energy_balance, 1e-7);
  }
}

// Energies and the work of a load are those of the outer frame, gravity's too.
TEST(Multipliers, EnergiesOfAFastBodyAreThoseOfRelativeCoordinates) {
  Multibody scene;
  scene.bodies = {rigid_body("hub", 3, Vector3d(0.1, 0, 0), Vector3d(0.3, 0.4, 0.5).asDiagonal()),
                  testing::bar("bar", 1, 0.6)};
  scene.joints = {joint("hub", JointKind::free, at(-1), at(0)),
                  joint("hinge", JointKind::hinge, at(0, {0.2, 0.1, 0}), at(1), {2, 0.3, 0.1, 0, 0})};
  scene.gravity = {0, -9.81, 0.3};
  Load thrust;
  thrust.name = "thrust", thrust.at = at(0, {0.1, 0, 0.2});
  thrust.force[0] = [](double t) { return 2 + t; };
  scene.loads = {thrust};
  const Tree tree(scene);
  TreeState start = tree.at_rest();
  start.joints[0].position = {1e4, -2e4, 3e4}, start.joints[0].velocity = {4e3, 3e3, -1e3};
  start.joints[0].omega = {0.3, -0.2, 0.4};
  IntegratorOptions of_tree;
  of_tree.method = "adams", of_tree.tolerance = 1e-10, of_tree.duration = 2, of_tree.output_step = 0.2;
  const VectorXd y0 = tree.pack(start);
  const TreeTrajectory a = integrate(tree, y0, of_tree);
  const Multipliers system(scene);
  const MultibodyTrajectory b = integrate_multipliers(system, body_states(tree, 0, y0), testing::options(1e-9, 2, 0.2));
  ASSERT_EQ(a.time.size(), b.time.size());
  for (size_t i = 0; i < a.time.size(); ++i) {
    const Balance& e = a.balance[i];
    EXPECT_NEAR(b.balance[i].kinetic, e.kinetic, 1e-12 * e.kinetic) << i;
    EXPECT_NEAR(b.states[i].work, e.work, 1e-12 * e.kinetic) << i;
    EXPECT_NEAR(b.balance[i].elastic, e.elastic, 1e-12 * e.kinetic) << i;
    EXPECT_NEAR(b.balance[i].potential, e.potential, 1e-12 * e.kinetic) << i;
    EXPECT_NEAR(b.states[i].dissipated, e.dissipated, 1e-6) << i;
    EXPECT_LT((b.balance[i].momentum - e.momentum).norm(), 1e-11 * e.momentum.norm()) << i;
  }
  EXPECT_LT(b.summary.energy_balance, 1e-12);
}

void expect_sport(double duration, const char* method, double tolerance) {
  const Sport sport(2);
  const Hub system(sport.hub, sport.appendages);
  IntegratorOptions of_system;
  of_system.method = method;
  of_system.tolerance = 1e-11;
  of_system.duration = duration;
  of_system.settle = 1e-12;
  const double angle = pi / 2 - pi / 60;
  const TreeTrajectory expected =
      integrate(system, system.pack(system.at_rest({angle, angle, angle, angle})), of_system);
  MultipliersOptions o = testing::options(tolerance, duration, 0.01);
  o.settle = of_system.settle;
  const MultibodyTrajectory r = integrate_multipliers(Multipliers(sport.scene), sport.start(), o);
  ASSERT_EQ(r.states.size(), expected.y.size());
  // Largest difference over the largest value of each output.
  std::vector<std::pair<double, double>> outputs(4 + 4 * 4);
  const auto compare = [&](size_t i, double difference, double size) {
    outputs[i].first = std::max(outputs[i].first, difference);
    outputs[i].second = std::max(outputs[i].second, size);
  };
  for (size_t i = 0; i < r.states.size(); ++i) {
    const HubState s = system.unpack(expected.y[i]);
    const BodyState& hub = r.states[i].bodies[0];
    Vector4d back = s.attitude;
    back.tail<3>() *= -1;
    compare(0, (hub.position - s.position).norm(), s.position.norm());
    compare(1, (hub.velocity - s.velocity).norm(), s.velocity.norm());
    compare(2, (hub.omega - s.omega).norm(), s.omega.norm());
    compare(3, rotation_vector(quaternion_product(back, hub.attitude)).norm(), rotation_vector(s.attitude).norm());
    for (size_t b = 0; b < 4; ++b) {
      const MultibodyState& m = r.states[i];
      const double gap = system.gap(expected.y[i].data(), static_cast<int>(b));
      compare(4 + 4 * b, std::abs(m.coordinate[b] - pi / 2 - gap), std::abs(gap));
      compare(5 + 4 * b, std::abs(m.rate[b] - s.rate[b]), std::abs(s.rate[b]));
      compare(6 + 4 * b, (m.bodies[b + 1].q - s.q[b]).cwiseAbs().maxCoeff(), s.q[b].cwiseAbs().maxCoeff());
      compare(7 + 4 * b, (m.bodies[b + 1].q_dot - s.q_dot[b]).cwiseAbs().maxCoeff(), s.q_dot[b].cwiseAbs().maxCoeff());
    }
  }
  double worst = 0;
  for (size_t i = 0; i < outputs.size(); ++i) {
    EXPECT_LT(outputs[i].first, 1e-8 * outputs[i].second) << i;
    worst = std::max(worst, outputs[i].first / outputs[i].second);
  }
  const MultipliersSummary& s = r.summary;
  std::printf(
      "%g s, tolerance %g: %.1e from %s; %.2f s, %ld steps, %ld residuals, %ld matrices, %zu events; drift %.1e m, "
      "%.1e rad, %.1e m/s, %.1e rad/s; energy %.1e, momentum %.1e\n",
      duration, tolerance, worst, method, s.seconds, s.steps, s.residual_evaluations, s.factorisations, r.events.size(),
      s.position_drift, s.angle_drift, s.velocity_drift, s.angular_velocity_drift, s.energy_balance, s.momentum_drift);
  // An error of the gap moves a slow contact in proportion to 1 / rate, and the last ones settle: the first in order.
  for (size_t i = 0; i < std::min<size_t>({r.events.size(), expected.events.size(), 30}); ++i)
    EXPECT_NEAR(r.events[i].time, expected.events[i].time, 1e-8) << i;
  EXPECT_LT(s.position_drift, 1e-12);
  EXPECT_LT(s.angle_drift, 1e-12);
  EXPECT_LT(s.quaternion_drift, 1e-12);
  EXPECT_LT(s.momentum_drift, 1e-9);
}

/// A bar on a soft spring, in steps longer than two seconds, that turns back before its stop: no contact, however
/// often it comes near.
TEST(Multipliers, SlowSwingsThatTurnBeforeAStopDoNotMeetIt) {
  Multibody scene;
  scene.bodies = {testing::bar("bar", 3, 1)};
  scene.joints = {joint("pivot", JointKind::hinge, at(-1), at(0), {0.001, 0, 0.5, 1, 1.05})};
  for (const double tolerance : {1e-1, 1e-2, 1e-3}) {
    const MultibodyTrajectory r =
        integrate_multipliers(Multipliers(scene), place_bodies(scene, {{0}}), testing::options(tolerance, 800, 1));
    EXPECT_TRUE(r.events.empty()) << tolerance;
    EXPECT_LT(r.summary.steps, 400) << "steps are too short to tell";
  }
}

// A spring that joins two places where they coincide has no direction, and no load.
TEST(Multipliers, ASpringOfNoLengthHasNoLoad) {
  Multibody scene;
  scene.bodies = {testing::bar("bar", 2, 0.8)};
  scene.joints = {joint("pivot", JointKind::hinge, at(-1), at(0))};
  SpringDamper spring;
  spring.name = "tether", spring.a = at(-1, {0.8, 0, 0}), spring.b = at(0, {0.8, 0, 0});
  spring.stiffness = 10, spring.free_length = 0.1;
  scene.springs = {spring};
  const MultibodyTrajectory r =
      integrate_multipliers(Multipliers(scene), place_bodies(scene, {{0}}), testing::options(1e-8, 0.1, 0.1));
  EXPECT_EQ(r.states.back().coordinate[0], 0);
}

// omega = J_l(v) v_dot = v_dot + v x v_dot / 2 + O(v^2), where (1 - cos v) / v^2 has lost its digits.
TEST(Multipliers, RatesOfSmallRotationsHaveAllDigits) {
  Multibody scene;
  scene.bodies = {testing::bar("bar", 2, 0.8)};
  scene.joints = {joint("ball", JointKind::spherical, at(-1), at(0))};
  const double angle = 1.1e-6;
  const BodyState s = place_bodies(scene, {{angle, 0, 0}}, {{0, 1, 0}})[0];
  const Vector3d omega = rotation_matrix(s.attitude) * s.omega;
  EXPECT_NEAR(omega.y(), 1, 1e-12);
  EXPECT_NEAR(omega.z(), angle / 2, 1e-15);
}

TEST(Multipliers, StatesOfOtherSizesAreRefused) {
  Multibody scene;
  scene.bodies = {testing::bar("bar", 2, 0.8)};
  scene.joints = {joint("pivot", JointKind::hinge, at(-1), at(0))};
  const Multipliers system(scene);
  std::vector<BodyState> states = place_bodies(scene, {{0}});
  states[0].q = VectorXd::Zero(3);
  EXPECT_THROW(close_joints(system, states), InputError);
  EXPECT_THROW(close_joints(system, {}), InputError);
  const Tree tree(scene);
  TreeState s = tree.at_rest();
  s.q[0] = VectorXd::Zero(3);
  EXPECT_THROW(tree.pack(s), InputError);
  s = tree.at_rest();
  s.joints[0].coordinate.clear();
  EXPECT_THROW(tree.pack(s), InputError);
}

TEST(Multipliers, SportAgreesWithRelativeCoordinates) { expect_sport(0.1, "exponential", 1e-10); }
TEST(Multipliers, SportAgreesWithRelativeCoordinatesByBdf) { expect_sport(0.05, "bdf", 1e-10); }
TEST(SlowMultipliers, SportAgreesWithExponentialOver10Seconds) { expect_sport(10, "exponential", 1e-10); }
// When all is at rest the steps are seconds long: no output may fall out of what IDA remembers.
TEST(SlowMultipliers, SportAgreesFor100Seconds) { expect_sport(100, "exponential", 1e-11); }

}  // namespace
}  // namespace flexboom
