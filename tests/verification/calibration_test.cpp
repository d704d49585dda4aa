// SPORT turned by its reaction wheels: what the booms do to the pointing of the hub.

#include "dynamics/model/time_function.hpp"
#include "tests/apps/run_testing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

using std::numbers::pi;

/// Largest pointing error [rad].
double worst_pointing(const RunResult& r) {
  double worst = 0;
  for (Index i = 0; i < r.outputs.values.rows(); ++i) worst = std::max(worst, vector_at(r, "sport.pointing", i).norm());
  return worst;
}

/// A quarter turn about x, from t = 1 s on; rigid: booms that neither bend nor swing.
Scene quarter_turn(const std::string& profile, bool rigid) {
  Scene scene = scene_named("sport-calibration");
  scene.turns.resize(1);
  scene.turns[0].manoeuvre = {profile, pi / 2, 0.1, 0.02, 0};
  scene.turns[0].pause = 1;
  scene.duration = 45;
  scene.output_step = 0.05;
  for (JointScene& j : scene.joints)
    if (rigid && j.kind == JointKind::hinge) j.kind = JointKind::fixed, j.mechanism = {.rest = 0, .threshold = 0};
  for (BodyScene& b : scene.bodies)
    if (rigid && !b.rigid) b.structure = "rigid";
  return scene;
}

TEST(Calibration, RigidSportPointsAsCommanded) {
  Scene scene = quarter_turn("trapezoid", true);
  scene.tolerance = 1e-9;
  const RunResult r = run_scene(scene, {});
  EXPECT_LT(worst_pointing(r), 1e-7);
  EXPECT_NEAR(vector_at(r, "sport.rotation", r.outputs.values.rows() - 1).norm(), pi / 2, 1e-7);
}

/// In a smooth turn SIP leans on its spring, or on its stop, by what its inertia asks: with s along the boom and the
/// hinge at (y, z) from the mass centre, k gap + c gap' = int s (s + |z|) dm alpha + int s |y| dm omega^2.
TEST(Calibration, LeansTheBoomsOnTheirSprings) {
  const Scene scene = quarter_turn("smooth", false);
  const RunResult r = run_scene(scene, {});
  double mass = 0;
  Vector3d centre = Vector3d::Zero();
  for (size_t i = 0; i < r.bodies.size(); ++i) {
    const ReducedBody& b = r.bodies[i].body;
    const PlaceScene& hinge = scene.joints[i].a;  // joint i carries body i
    mass += b.m;
    // Deployed: along stowed x turned by 90 degrees about z.
    if (i > 0) centre += b.m * hinge.point + b.mc0.x() * hinge.z.cross(hinge.x);
  }
  centre /= mass;
  const ReducedBody& sip = r.bodies[3].body;
  const JointScene& hinge = scene.joints[3];
  ASSERT_EQ(hinge.name, "sip");
  const double y = std::abs(hinge.a.point.y() - centre.y()), z = std::abs(hinge.a.point.z() - centre.z());
  const TimeFunction turn = rest_to_rest(turns_of(scene.turns)[0].manoeuvre).function;
  const VectorXd t = column(r, "t"), angle = column(r, "sip.angle"), angle_rate = column(r, "sip.rate");
  double largest = 0, worst = 0;
  for (Index i = 0; i < t.size(); ++i) {
    const double rate = turn.rate(t[i]),
                 push = (sip.J0(2, 2) + z * sip.mc0.x()) * turn.acceleration(t[i]) + y * sip.mc0.x() * rate * rate;
    const double gap = angle[i] - hinge.mechanism.rest;
    const double k = hinge.mechanism.stiffness + (gap > 0 ? hinge.mechanism.stop_stiffness : 0);
    largest = std::max(largest, std::abs(gap));
    worst = std::max(worst, std::abs(gap - (push - hinge.mechanism.damping * angle_rate[i]) / k));
  }
  std::printf("calibration: SIP leans by %.3e rad, quasi-static within %.1e\n", largest, worst);
  EXPECT_GT(largest, 1e-4);
  EXPECT_LT(worst, 0.03 * largest);  // the boom and the hub vibrate
}

TEST(Calibration, ShakesMoreByCornersThanSmoothly) {
  const RunResult corners = run_scene(quarter_turn("trapezoid", false), {}),
                  smooth = run_scene(quarter_turn("smooth", false), {});
  std::printf("calibration: pointing error %.2e rad by a trapezoid, %.2e smoothly\n", worst_pointing(corners),
              worst_pointing(smooth));
  EXPECT_GT(worst_pointing(corners), 2.5 * worst_pointing(smooth));
  EXPECT_LT(corners.motion.summary.momentum_drift, 1e-6);
}

/// Steps know the attitude alone, which is a thousand times larger.
TEST(Calibration, PointingHasItsOwnDigitsWithoutABudget) {
  Scene scene = quarter_turn("smooth", false);
  scene.error_budget = false;
  scene.tolerance = 1e-9;
  const RunResult exact = run_scene(scene, {});
  for (const double tolerance : {1e-2, 1e-3, 1e-4}) {
    scene.tolerance = tolerance;
    const RunResult r = run_scene(scene, {});
    const double error = compare_outputs(r.outputs, exact.outputs, {"sport.pointing"}).at(0).error;
    std::printf("calibration: pointing %.1e off at %.0e, steps at %.0e\n", error, tolerance, r.scene.step_tolerance());
    EXPECT_LT(error, 10 * tolerance);
  }
}

/// Booms that came to rest on their stops are pushed into them by the next turn, at any time within a step.
TEST(Calibration, TheNextTurnFindsTheStopsOfBoomsAtRest) {
  Scene scene = quarter_turn("trapezoid", false);
  scene.turns.push_back(scene.turns[0]);
  scene.turns[1].axis = Vector3d::UnitZ();
  scene.turns[1].pause = 10;
  scene.duration = 34;  // the second turn begins after 31.7 s
  scene.error_budget = false;
  const auto at = [&](const std::string& formulation, const std::string& method, double tolerance) {
    Scene other = scene;
    other.formulation = formulation, other.integrator = method, other.tolerance = tolerance;
    return run_scene(other, {});
  };
  const RunResult exact = at("relative", "exponential", 1e-9);
  const auto worst = [&](const RunResult& r) {
    double most = 0;
    for (const char* name : {"efield_plus.rate", "efield_minus.rate", "sip.rate", "slp.rate"}) {
      const VectorXd there = column(exact, name);
      most = std::max(most, (column(r, name) - there).cwiseAbs().maxCoeff() / there.cwiseAbs().maxCoeff());
    }
    return most;
  };
  constexpr double tolerance = 1e-4;
  for (const char* method : {"exponential", "adams", "bdf", "dirk"})
    EXPECT_LT(worst(at("relative", method, tolerance)), 10 * tolerance) << method;
  EXPECT_LT(worst(at("multipliers", "auto", 1e-5)), 1e-3);  // rates there are differences of larger ones
}

/// Booms at rest on their stops are no reason for steps without end, whatever the tolerance.
TEST(Calibration, TightToleranceDoesNotChatter) {
  Scene scene = quarter_turn("smooth", false);
  scene.turns[0].axis = Vector3d::UnitY();  // pushes no boom on its spring
  scene.tolerance = 1e-10;
  const RunResult r = run_scene(scene, {});
  EXPECT_LT(r.motion.events.size(), 3000u);  // bounces down to 1e-10 of the first
  EXPECT_LT(r.motion.summary.steps, 100'000);
}

}  // namespace
}  // namespace flexboom
