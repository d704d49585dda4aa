// Trees in motion: conservation, closed forms, the stop.

#include "dynamics/simulation/tree_integrator.hpp"

#include "dynamics/numerics/rotation.hpp"
#include "fem/base/check.hpp"
#include "tree_testing.hpp"

#include <gtest/gtest.h>

namespace flexboom {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;
using testing::at_marker;
using testing::place;

IntegratorOptions tree_options(const std::string& method, double tolerance, double duration, double output_step) {
  IntegratorOptions o;
  o.method = method, o.tolerance = tolerance, o.duration = duration, o.output_step = output_step;
  return o;
}

/// Free bodies with inertia about their mass centre.
Multibody free_bodies(const std::vector<Vector3d>& inertia) {
  Multibody scene;
  for (const Vector3d& J : inertia) {
    const auto i = static_cast<int>(scene.bodies.size());
    scene.bodies.push_back(rigid_body("body" + std::to_string(i), 1.0, Vector3d::Zero(), J.asDiagonal()));
    scene.joints.push_back(testing::joint("flight" + std::to_string(i), JointKind::free, place(-1), place(i)));
  }
  return scene;
}

TEST(TreeFlight, TorqueFreeTumblingIsJacobis) {
  const Tree tree(free_bodies({{0.134942, 0.10477, 0.05858}}));
  TreeState s = tree.at_rest();
  s.joints[0].omega = Vector3d(0.1, 1, 0.05);
  const TreeTrajectory flight = integrate(tree, tree.pack(s), tree_options("adams", 1e-12, 200, 1.0));
  double omega = 0, attitude = 0;
  const auto table = testing::read_csv("torque_free_case_b.csv");
  for (size_t i = 0; i < table.size(); ++i) {
    const auto value = [&](size_t c) { return std::stod(table[i][c]); };
    const TreeState now = tree.unpack(flight.y[i]);
    omega = std::max(omega, (now.joints[0].omega - Vector3d(value(2), value(3), value(4))).norm());
    Vector4d q(value(5), value(6), value(7), value(8));
    q.tail<3>() *= -1;
    attitude = std::max(attitude, rotation_vector(quaternion_product(q, now.joints[0].attitude)).norm());
  }
  EXPECT_LT(omega, 1e-9);
  EXPECT_LT(attitude, 1e-9);
  EXPECT_LT(flight.summary.energy_balance, 1e-12);
  EXPECT_LT(flight.summary.momentum_drift, 2e-12);  // round-off: each of the steps is asked for 1e-15
}

/// Two flexible links of FE-like shapes: eq. 14 booms with a tip marker, hinged in a plane.
Multibody two_link_arm(double gravity) {
  Multibody scene;
  scene.gravity = Vector3d(0, -gravity, 0);
  for (int i = 0; i < 2; ++i) {
    scene.bodies.push_back(eq14::reduced_body({1.0, 0.5, 20.0}, 3, eq14::Planes::xy, "link" + std::to_string(i)));
    scene.joints.push_back(
        testing::joint(i ? "elbow" : "shoulder", JointKind::hinge, i ? at_marker(0, "tip") : place(-1), place(i)));
  }
  return scene;
}

TEST(TreeFlight, TheMethodSuitsTheScene) {
  // A flexible arm vibrates within its steps; a rigid body that tumbles has no linear part.
  const Tree arm(two_link_arm(9.81));
  TreeState bent = arm.at_rest();
  bent.joints[0].coordinate = {0.3}, bent.joints[1].coordinate = {0.5};
  const TreeTrajectory stiff = integrate(arm, arm.pack(bent), tree_options("auto", 1e-6, 0.5, 0.02));
  EXPECT_EQ(stiff.summary.method, "exponential");
  EXPECT_NE(stiff.summary.why_method.find("linear motions reach"), std::string::npos) << stiff.summary.why_method;
  const Tree body(free_bodies({{0.134942, 0.10477, 0.05858}}));
  TreeState tumbling = body.at_rest();
  tumbling.joints[0].omega = Vector3d(0.1, 1, 0.05);
  const TreeTrajectory slow = integrate(body, body.pack(tumbling), tree_options("auto", 1e-6, 50, 0.1));
  EXPECT_EQ(slow.summary.method, "erk");
  EXPECT_NE(slow.summary.why_method.find("nonlinear"), std::string::npos) << slow.summary.why_method;
}

TEST(TreeFlight, AFreeJointBetweenBodiesIsNotForExponentialCollocation) {
  Multibody scene = free_bodies({{0.1, 0.2, 0.25}, {0.1, 0.2, 0.25}});
  scene.joints[1].a = place(0, Vector3d(1, 0, 0));
  const Tree tree(scene);
  TreeState s = tree.at_rest();
  s.joints[0].omega = Vector3d(0.1, 1, 0.05);
  EXPECT_THROW(integrate(tree, tree.pack(s), tree_options("exponential", 1e-6, 1, 0.1)), InputError);
  const TreeTrajectory flight = integrate(tree, tree.pack(s), tree_options("auto", 1e-8, 1, 0.1));
  EXPECT_EQ(flight.summary.method, "adams");
  EXPECT_NE(flight.summary.why_method.find("is free, between two bodies"), std::string::npos);
}

// Laws are not for exponential collocation either; where vibrations are fast beside others, small steps are dear.
TEST(TreeFlight, LawsAreForTheMethodThatTheirFastestMotionAllows) {
  struct Row {
    int modes;
    double damping, pad;
    const char* method;
  };
  for (const Row& row : {Row{2, 0, 0, "adams"}, Row{0, 0, 0, "adams"}, Row{12, 0, 0, "dirk"}, Row{2, 1e5, 0, "bdf"},
                         Row{0, 1e5, 0, "bdf"}, Row{2, 0, 1e5, "bdf"}, Row{12, 1e5, 0, "dirk"}}) {
    Multibody scene;
    scene.gravity = Vector3d(0, -9.81, 0);
    if (row.modes > 0)
      scene.bodies.push_back(eq14::reduced_body({1.0, 0.5, 20.0}, row.modes, eq14::Planes::xy, "link"));
    else
      scene.bodies.push_back(rigid_body("link", 0.5, Vector3d(0.25, 0, 0), Vector3d(0.01, 0.17, 0.17).asDiagonal()));
    scene.joints.push_back(testing::joint("shoulder", JointKind::hinge, place(-1), place(0)));
    Joint& shoulder = scene.joints[0];
    shoulder.law.friction = {0.1, 0.1}, shoulder.mechanism.damping = row.damping;
    if (row.pad > 0) shoulder.law.upper_stop = {1.0, 1e4, row.pad};
    const Tree tree(scene);
    const TreeTrajectory flight = integrate(tree, tree.pack(tree.at_rest()), tree_options("auto", 1e-5, 0.1, 0.1));
    EXPECT_EQ(flight.summary.method, row.method) << row.modes << " modes, " << row.damping << ", " << row.pad;
    EXPECT_NE(flight.summary.why_method.find("joints have laws"), std::string::npos);
  }
}

TEST(TreeFlight, FlexibleArmKeepsItsEnergy) {
  for (const char* method : {"exponential", "adams", "bdf", "dirk"}) {
    const Tree tree(two_link_arm(9.81));
    TreeState s = tree.at_rest();
    s.joints[0].coordinate = {0.3};
    s.joints[1].coordinate = {0.5};
    const TreeTrajectory flight = integrate(tree, tree.pack(s), tree_options(method, 1e-8, 2, 0.02));
    EXPECT_LT(flight.summary.energy_balance, 1e-8);
  }
}

TEST(TreeFlight, ChainOfStiffLinksIsTheChainOfRigidOnes) {
  // Quasi-static deflections of links 1e6 times stiffer are 1e-6 of theirs.
  Multibody flexible = two_link_arm(9.81), rigid = flexible;
  for (ReducedBody& b : flexible.bodies) {
    b.Ke *= 1e6;
    apply_damping(b, {.name = "rayleigh", .alpha = 0, .beta = 1e-4});
  }
  for (ReducedBody& b : rigid.bodies) {
    const ReducedBody r = rigid_body(b.name, b.m, b.mc0, b.J0);
    Marker tip = marker(b, "tip");
    tip.S.resize(3, 0), tip.S_theta.resize(3, 0);
    b = r;
    b.markers.push_back(tip);
  }
  const Tree a(flexible), b(rigid);
  TreeState s = a.at_rest();
  s.joints[0].coordinate = {0.3}, s.joints[1].coordinate = {0.5};
  TreeState r = b.at_rest();
  r.joints = s.joints;
  const auto o = tree_options("bdf", 1e-7, 2, 0.02);
  const TreeTrajectory soft = integrate(a, a.pack(s), o), hard = integrate(b, b.pack(r), o);
  double difference = 0;
  for (size_t i = 0; i < soft.y.size(); ++i)
    for (size_t j = 0; j < 2; ++j)
      difference = std::max(difference, std::abs(a.unpack(soft.y[i]).joints[j].coordinate[0] -
                                                 b.unpack(hard.y[i]).joints[j].coordinate[0]));
  EXPECT_LT(difference, 1e-5);
  EXPECT_GT(difference, 1e-12);  // they are not the same
}

TEST(TreeFlight, FreeChainKeepsItsMomenta) {
  std::mt19937 random(5);
  Multibody scene = two_link_arm(0);
  scene.bodies.push_back(rigid_body("hub", 3.0, Vector3d(0.02, 0.1, 0), Vector3d(0.3, 0.2, 0.4).asDiagonal()));
  scene.joints[0].a = place(2, Vector3d(0.2, 0, 0), testing::random_rotation(random));
  scene.joints[1].kind = JointKind::spherical;
  scene.bodies[1].J0(0, 0) += 0.01;  // a line has no inertia about itself
  scene.joints.push_back(testing::joint("flight", JointKind::free, place(-1), place(2)));
  scene.joints[0].mechanism = {1.0, 0.3, 0.1, 0, 0};
  const Tree tree(scene);
  TreeState s = testing::random_state(tree, random);
  for (auto& q : s.q) q *= 0.01;
  for (auto& q : s.q_dot) q *= 0.1;
  const TreeTrajectory flight = integrate(tree, tree.pack(s), tree_options("bdf", 1e-9, 2, 0.05));
  EXPECT_LT(flight.summary.energy_balance, 1e-8);
  EXPECT_LT(flight.summary.momentum_drift, 2e-9);  // relative to what turns, without what moves along
  EXPECT_GT(flight.balance.back().dissipated_by_joint[0], 1e-3);
}

TEST(TreeFlight, FlexibleBoomOnItsStopFollowsTheReference) {
  ReducedBody boom = eq14::reduced_body(testing::round_boom(0.295, 0.005), 1, eq14::Planes::xy, "boom");
  const auto events = testing::read_csv("flexible_boom2_fixed_hub_events.csv");
  Multibody scene;
  scene.bodies.push_back(boom);
  scene.joints.push_back(testing::joint("hinge", JointKind::hinge, place(-1), place(0)));
  scene.joints[0].mechanism = testing::sport_mechanism(0.35);
  const Tree tree(scene);
  TreeState s = tree.at_rest();
  s.joints[0].coordinate = {std::numbers::pi / 2 + 3 * std::numbers::pi / 180};
  const auto o = tree_options("bdf", 1e-11, 1, 0.005);
  const TreeTrajectory flight = integrate(tree, tree.pack(s), o);
  size_t k = 0;
  for (const auto& row : events) {
    if (std::stod(row[2]) != 0 || std::stod(row[4]) > 1) continue;
    ASSERT_LT(k, flight.events.size());
    EXPECT_NEAR(flight.events[k++].time, std::stod(row[4]), 1e-9);
  }
  EXPECT_GT(k, 3u);
  double gap = 0, q = 0, largest_q = 0;
  for (const auto& row : testing::read_csv("flexible_boom2_fixed_hub.csv")) {
    const double t = std::stod(row[3]);
    const auto i = static_cast<size_t>(std::lround(t / 0.005));
    if (std::stod(row[2]) != 0 || i >= flight.y.size()) continue;
    const TreeState now = tree.unpack(flight.y[i]);
    gap = std::max(gap, std::abs(now.joints[0].coordinate[0] - std::numbers::pi / 2 - std::stod(row[4])));
    q = std::max(q, std::abs(now.q[0][0] - std::stod(row[6])));
    largest_q = std::max(largest_q, std::abs(std::stod(row[6])));
  }
  EXPECT_LT(gap, 1e-9 * 3 * std::numbers::pi / 180);
  EXPECT_LT(q, 1e-9 * largest_q);
}

TEST(TreeFlight, WheelTurnsItsBody) {
  Multibody scene = free_bodies({{2, 3, 4}});
  ReactionWheel w;
  w.name = "wheel", w.axis = Vector3d::UnitZ(), w.inertia = 0.1, w.spin = 2;
  w.torque = [](double t) { return std::sin(t); };
  scene.wheels.push_back(w);
  const Tree tree(scene);
  const TreeTrajectory flight = integrate(tree, tree.pack(tree.at_rest()), tree_options("adams", 1e-10, 3, 0.5));
  const TreeState end = tree.unpack(flight.y.back());
  const double impulse = 1 - std::cos(3.0);
  EXPECT_NEAR(end.joints[0].omega.z(), -impulse / 4, 1e-10);  // J omega_dot = -torque
  EXPECT_NEAR(end.spin[0], 2 + impulse / 0.1 + impulse / 4, 1e-9);
  EXPECT_LT(flight.summary.momentum_drift, 1e-12);
  EXPECT_LT(flight.summary.energy_balance, 1e-10);
}

TEST(TreeFlight, WheelStiffensASpinningBody) {
  // Torque-free body with a wheel along z: omega_x, omega_y turn at (h + (Jz - J) omega_z) / J (dual spin).
  const double J = 3, Jz = 2, h = 5, wz = 0.4;
  Multibody scene = free_bodies({{J, J, Jz}});
  ReactionWheel w;
  w.name = "wheel", w.axis = Vector3d::UnitZ(), w.inertia = 0.1, w.spin = h / 0.1 - wz;
  scene.wheels.push_back(w);
  const Tree tree(scene);
  TreeState s = tree.at_rest();
  s.joints[0].omega = Vector3d(0.1, 0, wz);
  const TreeTrajectory flight = integrate(tree, tree.pack(s), tree_options("adams", 1e-10, 3, 0.5));
  const double rate = (h + (Jz - J) * wz) / J;
  const Vector3d omega = tree.unpack(flight.y.back()).joints[0].omega;
  EXPECT_NEAR(omega.x(), 0.1 * std::cos(rate * 3), 1e-9);
  EXPECT_NEAR(omega.y(), 0.1 * std::sin(rate * 3), 1e-9);
  EXPECT_LT(flight.summary.momentum_drift, 1e-11);
}

TEST(TreeFlight, BodiesThatFlyApartDoNotFeelEachOther) {
  Multibody scene = free_bodies({{1, 2, 3}, {3, 2, 1}});
  const Tree tree(scene);
  TreeState s = tree.at_rest();
  s.joints[0].velocity = Vector3d(1, 0, 0), s.joints[1].velocity = Vector3d(0, -2, 0);
  const TreeTrajectory flight = integrate(tree, tree.pack(s), tree_options("adams", 1e-9, 2, 1));
  EXPECT_LT((tree.unpack(flight.y.back()).joints[0].position - Vector3d(2, 0, 0)).norm(), 1e-12);
  EXPECT_LT((tree.unpack(flight.y.back()).joints[1].position - Vector3d(0, -4, 0)).norm(), 1e-12);
}

TEST(TreeFlight, StaticLoadsOfJointsAreTheWeight) {
  // A hinge held at an angle carries the weight of what hangs on it, and its moment.
  Multibody scene = two_link_arm(9.81);
  for (Joint& j : scene.joints) {
    const auto zero = [](double) { return 0.0; };
    j.prescribed.push_back({zero, zero, zero});
  }
  for (ReducedBody& b : scene.bodies) b = eq14::reduced_body({1.0, 0.5, 20.0}, 0, eq14::Planes::xy, b.name);
  const Tree tree(scene);
  VectorXd y = tree.pack(tree.at_rest());
  tree.impose(0, y);
  const std::vector<JointLoad> loads = tree.joint_loads(0, y, std::vector<char>(2, 0), *tree.workspace());
  EXPECT_NEAR(loads[0].force.y(), 2 * 0.5 * 9.81, 1e-13);
  EXPECT_NEAR(loads[0].drive[0], 2 * 0.5 * 9.81, 1e-13);  // mass centre of both at 1 m
  EXPECT_NEAR(loads[1].drive[0], 0.5 * 9.81 * 0.5, 1e-13);
}

// ---- what is refused ----

void expect_refusal(const Multibody& scene, const std::string& words) {
  try {
    const Tree tree(scene);
    ADD_FAILURE() << "accepted; should say: " << words;
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
  }
}

TEST(Tree, SaysWhatIsWrongWithAScene) {
  const Multibody good = two_link_arm(0);
  const auto with = [&](auto change) {
    Multibody scene = good;
    change(scene);
    return scene;
  };
  expect_refusal(with([](Multibody& s) { s.joints[1].closes_loop = true; }), "closes a loop");
  expect_refusal(with([](Multibody& s) { s.joints.pop_back(); }), "hangs on no joint");
  expect_refusal(with([](Multibody& s) { s.joints[0].a = place(1); }), "in a circle");
  expect_refusal(with([](Multibody& s) { s.joints[1].b = place(0); }), "hangs on two joints");
  expect_refusal(with([](Multibody& s) { s.joints[1].a = at_marker(0, "top"); }), "tip");
  expect_refusal(with([](Multibody& s) { s.joints[1].a = place(7); }), "there is no body 7");
  expect_refusal(with([](Multibody& s) { s.joints[1].kind = JointKind::spherical; }),
                 "joint elbow");  // line about itself
  expect_refusal(with([](Multibody& s) { s.joints[0].mechanism.damping = -1; }), "negative");
  expect_refusal(with([](Multibody& s) {
                   s.joints[0].kind = JointKind::spherical;
                   s.joints[0].prescribed.push_back(testing::swing(1));
                 }),
                 "prescribed");
}

}  // namespace
}  // namespace flexboom
