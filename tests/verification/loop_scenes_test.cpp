// The built-in scene with a closed loop, and SPORT, by multipliers: each against what is known of it.

#include "tests/apps/run_testing.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::VectorXd;

using std::numbers::pi;

// ---- SPORT in both formulations ----

TEST(LoopScenes, SportFliesByMultipliersAsInRelativeCoordinates) {
  Scene scene = scene_named("sport");
  scene.duration = 0.5;
  scene.tolerance = 1e-8;
  for (BodyScene& b : scene.bodies) b.structure = "eq14", b.modes = 2;
  const RunResult relative = run_scene(scene, {});
  scene.formulation = "multipliers";
  const RunResult redundant = run_scene(scene, {});
  EXPECT_EQ(redundant.outputs.names, relative.outputs.names);
  ASSERT_EQ(redundant.outputs.values.rows(), relative.outputs.values.rows());
  for (const OutputDifference& d : compare_outputs(redundant.outputs, relative.outputs, {}))
    EXPECT_LT(d.error, 1e-7) << d.name;
  for (const char* energy : {"energy.kinetic", "energy.elastic", "energy.dissipated"}) {
    const VectorXd a = column(redundant, energy), b = column(relative, energy);
    EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-7 * b.maxCoeff()) << energy;
  }
  const auto &found = redundant.motion.events, &wanted = relative.motion.events;
  ASSERT_EQ(found.size(), wanted.size());
  ASSERT_GT(found.size(), 10u);
  for (size_t i = 0; i < found.size(); ++i) {
    EXPECT_NEAR(found[i].time, wanted[i].time, 1e-7) << i;
    EXPECT_EQ(found[i].joint, wanted[i].joint) << i;
    EXPECT_EQ(found[i].contact, wanted[i].contact) << i;
  }
  EXPECT_LT(redundant.motion.summary.constraint_drift, 1e-12);
  EXPECT_LT(redundant.motion.summary.momentum_drift, 1e-8);
}

// ---- slider-crank ----

constexpr double crank = 0.15, rod = 0.3;  // [m]

/// The scene with its crank at another speed [rad/s], damped so that the vibration of the start dies out.
Scene slider_crank(double speed) {
  Scene scene = scene_named("slider-crank");
  scene.joints[0].motion[0].expression = fmt::format("{}*t", speed);
  scene.joints[1].start_rate = {-speed * (1 + crank / rod)};
  scene.bodies[1].damping.beta = 1e-4;
  return scene;
}

/// A rigid slider-crank at a crank angle: angle of the rod, way of the piston.
double rod_angle(double angle) { return -std::asin(crank * std::sin(angle) / rod); }
double piston_way(double angle) { return crank * std::cos(angle) + rod * std::cos(rod_angle(angle)); }

TEST(LoopScenes, RigidSliderCrankGoesAsInClosedForm) {
  Scene scene = scene_named("slider-crank");
  const double speed = 50;
  scene.bodies[1].structure = "rigid";
  scene.tolerance = 1e-9;
  const RunResult r = run_scene(scene, {});
  const VectorXd t = column(r, "t"), way = column(r, "guide.length"), pin = column(r, "pin.angle"),
                 wrist = column(r, "wrist.angle");
  double error = 0;
  for (Index i = 0; i < t.size(); ++i) {
    const double angle = speed * t[i], phi = rod_angle(angle);
    error = std::max(
        {error, std::abs(way[i] - piston_way(angle)), std::abs(pin[i] - (phi - angle)), std::abs(wrist[i] + phi)});
  }
  std::printf("rigid slider-crank: %.1e, drift %.1e, energy %.1e\n", error, r.motion.summary.constraint_drift,
              r.motion.summary.energy_balance);
  EXPECT_LT(error, 1e-11);  // the joints decide, not the integration
  EXPECT_LT(r.motion.summary.constraint_drift, 1e-12);
  EXPECT_LT(r.motion.summary.energy_balance, 1e-7);
}

// The loop holds the rod's ends where positions of half a metre say, so its stiff stretching can not be known better
// than round-off of those: errors asked below that took the steps to 1e-9 s.
TEST(LoopScenes, ToleranceNearRoundOffOfAbsolutePlaces) {
  Scene scene = scene_named("slider-crank");
  scene.bodies[1].modes = 8;
  scene.duration = 0.05;
  std::vector<RunResult> runs;
  for (const double tolerance : {1e-7, 1e-9}) {
    scene.tolerance = tolerance;
    runs.push_back(run_scene(scene, {}));
  }
  EXPECT_LT(runs[1].motion.summary.steps, 20000);  // 2.4 times those at 1e-7
  EXPECT_LT(runs[1].motion.summary.energy_balance, 1e-9);
  const double difference = largest(compare_outputs(runs[0].outputs, runs[1].outputs, {"rod.tip"}));
  std::printf("slider-crank, 8 modes: 1e-7 against 1e-9 %.1e, %ld steps\n", difference, runs[1].motion.summary.steps);
  EXPECT_GT(difference, 0);
  EXPECT_LT(difference, 1e-6);
}

// Corrections that keep the constraints must not fall on the rod's stiff stretching: errors of a method of low order,
// invisible at constant steps, took them to 1e-7 s there.
TEST(LoopScenes, StiffDampedRodDoesNotSetTheSteps) {
  for (const double speed : {50.1, 52.0}) {
    const RunResult r = run_scene(slider_crank(speed), {});
    EXPECT_LT(r.motion.summary.steps, 5000) << speed;  // 2400
  }
}

/// Deflection of the rod from the line between its pins: in the middle [m], and the first half sine in it.
struct Deflection {
  VectorXd middle, half_sine;
};

Deflection found_deflection(const RunResult& r) {
  const ReducedBody& body = r.bodies[1].body;
  const Eigen::Matrix3Xd& points = body.display.points;
  const Index rows = r.outputs.values.rows(), last = points.cols() - 1;
  Index middle = 0;
  while (std::abs(points(0, middle) - rod / 2) > 1e-9) require(++middle < last, "no point in the middle");
  Deflection d{VectorXd::Zero(rows), VectorXd::Zero(rows)};
  for (Index k = 0; k < body.n(); ++k) {
    const VectorXd q = column(r, fmt::format("rod.q{}", k + 1));
    const auto shape = [&](Index i) {  // less what turns the line between the pins
      const double tip = body.display.S[static_cast<size_t>(last)](1, k);
      return body.display.S[static_cast<size_t>(i)](1, k) - points(0, i) / rod * tip;
    };
    d.middle += shape(middle) * q;
    for (Index i = 1; i <= last; ++i) {
      const auto sine = [&](Index j) { return shape(j) * std::sin(pi * points(0, j) / rod); };
      d.half_sine += (sine(i) + sine(i - 1)) / rod * (points(0, i) - points(0, i - 1)) * q;
    }
  }
  return d;
}

/// A beam on two pins under the inertia of its rigid motion, in sines: the first integrated, the rest as they would be
/// at rest. In the rod's own frame q_n'' + beta w_n^2 q_n' + (w_n^2 - phi_dot^2) q_n = -2 / (n pi) (a_pin - (-1)^n
/// a_piston), accelerations normal to the rod; a tension N(x) adds 2 / L sum_m q_m of the integral of N psi_n' psi_m'
/// over rho A.
class PinnedBeam {
 public:
  PinnedBeam(const BodyScene& body, double piston_mass, double speed, bool tension)
      : beta_(body.damping.beta), speed_(speed), tension_(tension) {
    const BeamSegment& s = body.geometry.segments[0];
    const auto& section = std::get<Rectangle>(s.start);
    w1_ = std::pow(pi / rod, 2) * std::sqrt(s.material.E * std::pow(section.height, 2) / 12 / s.material.rho);
    piston_ = piston_mass / (s.material.rho * section.height * section.width);
    constexpr int points = 400;
    for (int i = 0; i < points; ++i) {
      const double x = rod * (i + 0.5) / points;
      Modes slope;
      for (int n = 1; n <= dynamic; ++n) slope[n - 1] = n * pi / rod * std::cos(n * pi * x / rod);
      const std::array<double, 3> along = {1, rod - x, (rod * rod - x * x) / 2};
      for (size_t k = 0; k < 3; ++k) stiffness_[k] += 2.0 / points * along[k] * slope * slope.transpose();
    }
  }

  Deflection at(const VectorXd& t, VectorXd& tip) {
    constexpr int steps = 200;
    Deflection d{VectorXd::Zero(t.size()), VectorXd::Zero(t.size())};
    tip = VectorXd::Zero(t.size());
    State y{Modes::Zero(), Modes::Zero()};
    for (Index i = 0; i < t.size(); ++i) {
      const Moment m = moment(t[i]);
      for (int n = 1; n <= 40; ++n) {
        const double q = n <= dynamic ? y.q[n - 1] : m.load(n) / std::pow(n * n * w1_, 2);
        d.middle[i] += q * std::sin(n * pi / 2);
        tip[i] -= n * pi * q;  // seen from the tangent at the pin
        if (n == 1) d.half_sine[i] = q;
      }
      if (i + 1 < t.size()) advance(t[i], t[i + 1], steps, y);
    }
    return d;
  }

 private:
  static constexpr int dynamic = 3;
  using Modes = Eigen::Matrix<double, dynamic, 1>;
  using Stiffness = Eigen::Matrix<double, dynamic, dynamic>;
  struct State {
    Modes q, q_dot;
    State operator+(const State& b) const { return {q + b.q, q_dot + b.q_dot}; }
    friend State operator*(double f, const State& a) { return {f * a.q, f * a.q_dot}; }
  };

  /// Rigid motion of the rod: its rate, accelerations of its ends along and normal to it, tension over rho A as N0 +
  /// N1 (L - x) + N2 (L^2 - x^2) / 2.
  struct Moment {
    double rate, pin, piston;
    std::array<double, 3> tension;
    double load(int n) const { return -2 / (n * pi) * (pin - (n % 2 == 0 ? 1 : -1) * piston); }
  };

  Moment moment(double t) const {
    const double angle = speed_ * t, phi = rod_angle(angle), h = 1e-4;
    const double rate = -crank * speed_ * std::cos(angle) / (rod * std::cos(phi));
    const double phi_ddot =
        speed_ * speed_ * (rod_angle(angle + h) - 2 * rod_angle(angle) + rod_angle(angle - h)) / (h * h);
    const double way =
        speed_ * speed_ * (piston_way(angle + h) - 2 * piston_way(angle) + piston_way(angle - h)) / (h * h);
    const Vector2d along(std::cos(phi), std::sin(phi)), normal(-std::sin(phi), std::cos(phi));
    const Vector2d pin = -speed_ * speed_ * crank * Vector2d(std::cos(angle), std::sin(angle));
    // What the piston pushes with: along its guide by its inertia, across it by the rod's moment about the crank pin.
    const double X = -piston_ * way;
    const double moment = rod * rod * rod / 3 * phi_ddot + rod * rod / 2 * normal.dot(pin);
    const double Y = (moment / rod - X * normal.x()) / normal.y();
    return {rate, normal.dot(pin), way * normal.x(), {along.dot(Vector2d(X, Y)), -along.dot(pin), rate * rate}};
  }

  State rate(double t, const State& s) const {
    const Moment m = moment(t);
    State r{s.q_dot, Modes::Zero()};
    for (int n = 1; n <= dynamic; ++n) {
      const double w2 = std::pow(n * n * w1_, 2);
      r.q_dot[n - 1] = m.load(n) - (w2 - m.rate * m.rate) * s.q[n - 1] - beta_ * w2 * s.q_dot[n - 1];
    }
    for (size_t k = 0; tension_ && k < 3; ++k) r.q_dot -= m.tension[k] * (stiffness_[k] * s.q);
    return r;
  }

  void advance(double t0, double t1, int steps, State& y) const {
    const double h = (t1 - t0) / steps;
    for (int k = 0; k < steps; ++k) {
      const double t = t0 + k * h;
      const State a = rate(t, y), b = rate(t + h / 2, y + h / 2 * a), c = rate(t + h / 2, y + h / 2 * b),
                  e = rate(t + h, y + h * c);
      y = y + h / 6 * (a + 2 * b + 2 * c + e);
    }
  }

  double beta_, speed_, w1_ = 0, piston_ = 0;  // piston: mass over rho A [m]
  bool tension_;
  std::array<Stiffness, 3> stiffness_ = {Stiffness::Zero(), Stiffness::Zero(), Stiffness::Zero()};
};

/// Largest differences of the rod's tip and middle from those of the beam, over the largest deflection.
Vector2d errors_against_pinned_beam(double speed, bool tension) {
  Scene scene = slider_crank(speed);
  scene.bodies[1].stiffening = tension ? "auto" : "off";
  const RunResult r = run_scene(scene, {});
  EXPECT_LT(r.motion.summary.energy_balance, 1e-6);
  EXPECT_LT(r.motion.summary.constraint_drift, 1e-12);
  VectorXd tip;
  const Deflection wanted =
                       PinnedBeam(scene.bodies[1], scene.bodies[2].rigid->mass, speed, tension).at(column(r, "t"), tip),
                   found = found_deflection(r);
  const auto error = [](const VectorXd& a, const VectorXd& b) {
    return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
  };
  const Vector2d e(error(column(r, "rod.tip.y"), tip), error(found.middle, wanted.middle));
  std::printf("rod at %g rad/s, tension %s: tip %.2e of %.3e m, middle %.2e of %.3e m\n", speed, tension ? "in" : "out",
              e[0], tip.cwiseAbs().maxCoeff(), e[1], wanted.middle.cwiseAbs().maxCoeff());
  return e;
}

/// With geometric stiffness the rod is a beam under its own tension; what is left is that of four modes. Without, the
/// error grows with the square of the speed: a rod in its tangent frame and a beam on pins leave out different things.
TEST(LoopScenes, RodBendsAsABeamOnTwoPins) {
  for (const double speed : {50.0, 100.0}) {
    const Vector2d e = errors_against_pinned_beam(speed, true);
    EXPECT_LT(e.maxCoeff(), 0.008);
  }
  const Vector2d slow = errors_against_pinned_beam(50, false), fast = errors_against_pinned_beam(100, false);
  EXPECT_LT(slow[0], 0.02);
  EXPECT_LT(slow[1], 0.01);
  EXPECT_GT(fast[1] / slow[1], 3);
}

/// At the speed of the source, where the loads reach 5 % of what buckles the rod. The source has a linear rod without
/// tension and without damping, and longitudinal modes; its start is without vibration.
TEST(LoopScenes, RodAtTheSpeedOfTheSourceEndsNearItsPublishedDeflection) {
  Scene scene = slider_crank(150);
  scene.bodies[1].stiffening = "off";
  scene.duration = 0.1, scene.output_step = 5e-4;
  const RunResult r = run_scene(scene, {});
  const VectorXd found = found_deflection(r).half_sine;
  const double published = 1.893192460247178e-4, way = 1.697373326718410e-1;
  const Index last = found.size() - 1;
  std::printf("published: %.4e m, found %.4e m of %.3e m; piston %.3e m\n", published, found[last],
              found.cwiseAbs().maxCoeff(), column(r, "guide.length")[last] - way);
  EXPECT_NEAR(found[last], published, 0.02 * found.cwiseAbs().maxCoeff());
  EXPECT_NEAR(column(r, "guide.length")[last], way, 2e-5);  // the source's rod is 8e-6 m shorter then
}

}  // namespace
}  // namespace flexboom
