#include "dynamics/numerics/rotation.hpp"
#include "dynamics/redundant/multipliers.hpp"

#include "dynamics_testing.hpp"
#include "fem/base/check.hpp"
#include "multipliers_testing.hpp"

#include <gtest/gtest.h>

namespace flexboom {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::at;
using testing::joint;

using std::numbers::pi;

void expect_no_drift(const MultipliersSummary& s) {
  // What the method promises at tolerances of 1e-8 and below.
  EXPECT_LT(s.position_drift, 1e-12);
  EXPECT_LT(s.angle_drift, 1e-12);
  EXPECT_LT(s.velocity_drift, 1e-11);
  EXPECT_LT(s.angular_velocity_drift, 1e-11);
  EXPECT_LT(s.quaternion_drift, 1e-12);
}

/// Links 1, 2, 3 of a planar four-bar with ground from 0 to (d, 0): hinged at every corner about z.
Multibody four_bar(double a, double b, double c, double d) {
  Multibody scene;
  scene.bodies = {testing::bar("crank", 1, a), testing::bar("coupler", 2, b), testing::bar("rocker", 1.5, c)};
  scene.joints = {joint("crank root", JointKind::hinge, at(-1), at(0)),
                  joint("crank tip", JointKind::hinge, at(0, {a, 0, 0}), at(1)),
                  joint("rocker root", JointKind::hinge, at(-1, {d, 0, 0}), at(2)),
                  joint("rocker tip", JointKind::hinge, at(1, {b, 0, 0}), at(2, {c, 0, 0}))};
  scene.joints[3].closes_loop = true;
  return scene;
}

/// Angles of coupler and rocker (upper branch) for a crank angle.
std::pair<double, double> four_bar_angles(double a, double b, double c, double d, double crank) {
  const Vector3d A(a * std::cos(crank), a * std::sin(crank), 0), D(d, 0, 0);
  const Vector3d AD = D - A;
  const double e = AD.norm(), along = (e * e + b * b - c * c) / (2 * e), up = std::sqrt(b * b - along * along);
  const Vector3d x = AD / e, B = A + along * x + up * Vector3d(-x.y(), x.x(), 0);
  return {std::atan2(B.y() - A.y(), B.x() - A.x()), std::atan2(B.y(), B.x() - d)};
}

TEST(MultipliersLoop, DrivenFourBarFollowsClosedFormAndReportsThreeRedundantRows) {
  const double a = 1, b = 3, c = 2.5, d = 3;
  Multibody scene = four_bar(a, b, c, d);
  scene.joints[0].prescribed = {testing::polynomial(0.6, 2.0)};
  const Multipliers system(scene);
  const auto [coupler, rocker] = four_bar_angles(a, b, c, d, 0.6);
  std::vector<BodyState> start = place_bodies(scene, {{0.6}, {coupler - 0.6}, {rocker}}, {{2.0}});
  const MultibodyTrajectory r =
      integrate_multipliers(system, close_joints(system, start), testing::options(1e-9, 6, 0.05));
  ASSERT_EQ(r.summary.redundant.size(), 3U);  // four spatial hinges, plane: 20 + 1 rows, rank 18
  for (const std::string& row : r.summary.redundant) EXPECT_NE(row.find("rocker tip"), std::string::npos) << row;
  double worst = 0;
  for (size_t i = 0; i < r.time.size(); ++i) {
    const double crank = 0.6 + 2 * r.time[i];
    const auto [alpha, beta] = four_bar_angles(a, b, c, d, crank);
    worst = std::max(worst, std::abs(std::remainder(r.states[i].coordinate[2] - beta, 2 * pi)));
    worst = std::max(worst, std::abs(std::remainder(r.states[i].coordinate[1] - (alpha - crank), 2 * pi)));
  }
  EXPECT_LT(worst, 1e-11);  // the joints decide, not the integration
  EXPECT_LT(r.summary.energy_balance, 1e-7);
  expect_no_drift(r.summary);
}

TEST(MultipliersLoop, LoopThatLocksNamesItsJoint) {
  const double a = 2, b = 1.5, c = 1.5, d = 2;  // a is no crank: it locks where |AD| = b + c = 3
  Multibody scene = four_bar(a, b, c, d);
  scene.joints[0].prescribed = {testing::polynomial(0.5, 1.0)};
  const Multipliers system(scene);
  const auto [coupler, rocker] = four_bar_angles(a, b, c, d, 0.5);
  const std::vector<BodyState> start =
      close_joints(system, place_bodies(scene, {{0.5}, {coupler - 0.5}, {rocker}}, {{1.0}}));
  const double locks = std::acos((a * a + d * d - 9) / (2 * a * d)) - 0.5;
  try {
    integrate_multipliers(system, start, testing::options(1e-7, 3, 0.05));
    FAIL() << "it goes through";
  } catch (const NumericalError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("rocker tip"), std::string::npos) << text;
    EXPECT_NE(text.find(std::to_string(locks).substr(0, 4)), std::string::npos) << text;
  }
}

TEST(MultipliersLoop, ConfigurationThatCanNotCloseNamesTheJoint) {
  Multibody scene = four_bar(1, 1, 1, 4);
  const Multipliers system(scene);
  const std::vector<BodyState> start = place_bodies(scene, {{0.3}, {0.2}, {2.0}});
  for (const bool close : {true, false}) try {
      if (close)
        close_joints(system, start);
      else
        integrate_multipliers(system, start, {});
      FAIL();
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("joint \""), std::string::npos) << error.what();
      if (!close) {
        EXPECT_NE(std::string(error.what()).find("rocker tip"), std::string::npos) << error.what();
      }
    }
}

/// Slider-crank: way of the piston, force in the rod's joint from the piston's acceleration.
TEST(MultipliersLoop, SliderCrankFollowsClosedFormWithItsForces) {
  const double a = 0.4, b = 1.1, speed = 3, mass = 0.7;
  Multibody scene;
  const Matrix3d z_to_x = Eigen::AngleAxisd(pi / 2, Vector3d::UnitY()).toRotationMatrix();
  ReducedBody rod = rigid_body("rod", 1e-9, Vector3d::Zero(), 1e-9 * Matrix3d::Identity());
  scene.bodies = {testing::bar("crank", 1, a), rod,
                  rigid_body("piston", mass, Vector3d::Zero(), 0.1 * Matrix3d::Identity())};
  scene.joints = {joint("drive", JointKind::hinge, at(-1), at(0)),
                  joint("pin", JointKind::spherical, at(0, {a, 0, 0}), at(1)),
                  joint("guide", JointKind::slider, at(-1, {0, 0, 0}, z_to_x), at(2, {0, 0, 0}, z_to_x)),
                  joint("wrist", JointKind::universal, at(1, {b, 0, 0}, Matrix3d::Identity()), at(2))};
  scene.joints[3].closes_loop = true;
  scene.joints[0].prescribed = {testing::polynomial(0.3, speed)};
  const Multipliers system(scene);
  const double phi = std::asin(-a * std::sin(0.3) / b), x0 = a * std::cos(0.3) + b * std::cos(phi);
  std::vector<BodyState> start = place_bodies(scene, {{0.3}, {0, 0, phi - 0.3}, {x0}}, {{speed}});
  start = close_joints(system, start);
  const MultibodyTrajectory r = integrate_multipliers(system, start, testing::options(1e-9, 3, 0.05));
  double way = 0, force = 0, largest = 0;
  for (size_t i = 0; i < r.time.size(); ++i) {
    const double angle = 0.3 + speed * r.time[i], s = a * std::sin(angle), c = a * std::cos(angle);
    const double root = std::sqrt(b * b - s * s);
    way = std::max(way, std::abs(r.states[i].coordinate[2] - c - root));
    // x'' of c + sqrt(b^2 - s^2); the massless rod pulls along itself.
    const double x_ddot = speed * speed * (-c + (s * s - c * c) / root - s * s * c * c / (root * root * root));
    const double along_x = mass * x_ddot;
    const Vector3d on_piston = rotation_matrix(r.states[i].bodies[1].attitude) * r.states[i].loads[3].force;
    largest = std::max(largest, std::abs(along_x));
    force = std::max({force, std::abs(on_piston.x() - along_x), std::abs(on_piston.y() + along_x * s / root)});
  }
  EXPECT_LT(way, 1e-11);
  EXPECT_LT(force, 1e-6 * largest);  // the rod's own mass is 1e-9 of the piston's
  expect_no_drift(r.summary);
}

/// Flexible slider-crank of Jahnke, Popp, Dirr (1993): crank 0.15 m at 150 rad/s, steel rod 0.3 m, 6 mm round, piston
/// of half the rod's mass. `stiffness` scales E.
MultibodyTrajectory flexible_slider_crank(double stiffness, double tolerance) {
  const double a = 0.15, b = 0.3, speed = 150, A = pi * 9e-6, I = pi * 81e-12 / 4, rho_A = 7870 * A;
  ReducedBody rod = eq14::reduced_body({b, rho_A, 2e11 * stiffness * I}, 2, eq14::Planes::xy, "rod");
  apply_damping(rod, {"modal", 0.1});
  Multibody scene;
  const Matrix3d z_to_x = Eigen::AngleAxisd(pi / 2, Vector3d::UnitY()).toRotationMatrix();
  scene.bodies = {testing::bar("crank", 0.2, a), rod,
                  rigid_body("piston", rho_A * b / 2, Vector3d::Zero(), 1e-4 * Matrix3d::Identity())};
  scene.joints = {joint("drive", JointKind::hinge, at(-1), at(0)),
                  joint("pin", JointKind::hinge, at(0, {a, 0, 0}), at(1)),
                  joint("guide", JointKind::slider, at(-1, {0, 0, 0}, z_to_x), at(2, {0, 0, 0}, z_to_x)),
                  joint("wrist", JointKind::hinge, testing::at_marker(1, "tip"), at(2))};
  scene.joints[3].closes_loop = true;
  scene.joints[0].prescribed = {testing::polynomial(0, speed)};
  const Multipliers system(scene);
  const double rate = -speed * (1 + a / b);
  const std::vector<BodyState> start =
      close_joints(system, place_bodies(scene, {{0}, {0}, {a + b}}, {{speed}, {rate}, {0}}));
  return integrate_multipliers(system, start, testing::options(tolerance, 2 * pi / speed, 2 * pi / speed / 100));
}

TEST(MultipliersLoop, FlexibleSliderCrankTendsToTheRigidOne) {
  double bent[2] = {0, 0};
  for (const int i : {0, 1}) {  // stiffness times 1 and 10
    const MultibodyTrajectory r = flexible_slider_crank(i == 0 ? 1 : 10, 1e-7);
    EXPECT_EQ(r.summary.redundant.size(), 3U);  // a planar loop of spatial joints
    EXPECT_LT(r.summary.energy_balance, 1e-5);
    expect_no_drift(r.summary);
    for (size_t k = 0; k < r.time.size(); ++k) {
      bent[i] = std::max(bent[i], r.states[k].bodies[1].q.cwiseAbs().maxCoeff());
      // The piston follows the rigid one but for what bending shortens, second order in q / length.
      const double angle = 150 * r.time[k], s = 0.15 * std::sin(angle);
      const double rigid = 0.15 * std::cos(angle) + std::sqrt(0.09 - s * s);
      EXPECT_LT(std::abs(r.states[k].coordinate[2] - rigid), 10 * bent[i] * bent[i] / 0.3 + 1e-9);
    }
  }
  EXPECT_GT(bent[0] / bent[1], 10);  // more than in proportion: the soft rod has 829 rad/s against the crank's 150
}

}  // namespace
}  // namespace flexboom
