// The built-in scenes with joints, each against what is known of it.

#include "apps/simulate/tree_flight.hpp"
#include "dynamics/numerics/rotation.hpp"
#include "fem/base/check.hpp"
#include "reduction/basis/mean_axis.hpp"
#include "tests/apps/run_testing.hpp"

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;

using std::numbers::pi;

std::vector<std::vector<double>> reference(const std::string& file, size_t texts) {
  std::ifstream in(std::string(FLEXBOOM_TEST_DATA) + "/reference/" + file);
  require(in.good(), "no reference file " + file);
  std::vector<std::vector<double>> rows;
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    std::string cell;
    std::vector<double> row;
    for (size_t i = 0; std::getline(cells, cell, ','); ++i)
      if (i >= texts) row.push_back(std::stod(cell));
    rows.push_back(row);
  }
  return rows;
}

/// Positive imaginary parts of the eigenvalues of the motion linearised about the start, ascending [rad/s].
std::vector<double> frequencies(const Tree& tree, const VectorXd& y) {
  MatrixXd J;
  tree.jacobian(0, y.data(), std::vector<char>(tree.scene().joints.size(), 0), *tree.workspace(), J);
  std::vector<double> omega;
  for (const double w : VectorXd(J.eigenvalues().imag()))
    if (w > 1e-3) omega.push_back(w);
  std::sort(omega.begin(), omega.end());
  return omega;
}

Tree tree_of(const Scene& scene, Stiffening stiffening) {
  std::vector<PreparedBody> bodies;
  for (const BodyScene& b : scene.bodies) bodies.push_back(prepare_body(b));
  std::vector<Stiffening> choice;
  for (const PreparedBody& p : bodies) choice.push_back(p.body.n() ? stiffening : Stiffening::off);
  return Tree(make_multibody(scene, bodies), choice);
}

double nearest(const std::vector<double>& values, double wanted) {
  return *std::min_element(values.begin(), values.end(),
                           [&](double a, double b) { return std::abs(a - wanted) < std::abs(b - wanted); });
}

// ---- spin-up ----

// Torsion, the 15th mode, is not moved. What round-off and the method make of it must not show in the root's torque,
// though a motion from rest has no energy at the start that tells how little that is.
TEST(TreeScenes, WhatNothingMovesDoesNotShowInTheLoads) {
  Scene scene = scene_named("spin-up");
  scene.error_budget = false, scene.integrator = "exponential";
  scene.bodies[0].modes = 20, scene.bodies[0].directions = "all", scene.bodies[0].shapes = {1, 3, 15};
  scene.tolerance = 1e-8;
  const RunResult reference = run_scene(scene, {});
  ASSERT_EQ(reference.bodies[0].body.coordinates[2].kind, "torsion");
  for (const double tolerance : {1e-2, 1e-3, 1e-4}) {
    scene.tolerance = tolerance;
    for (const OutputDifference& d : compare_outputs(run_scene(scene, {}).outputs, reference.outputs, {"shaft.torque"}))
      EXPECT_LT(d.error, tolerance) << d.name;
  }
}

TEST(TreeScenes, SpinUpFollowsTheGeometricallyExactBeam) {
  const RunResult r = run_scene(scene_named("spin-up"), {});
  const VectorXd v = column(r, "beam.tip.y"), u = column(r, "beam.tip.x");
  double error = 0, axial = 0;
  const auto rows = reference("spin_up_simo_vu_quoc.csv", 0);
  ASSERT_EQ(v.size(), std::ssize(rows));
  for (Index i = 0; i < v.size(); ++i) {
    error = std::max(error, std::abs(v[i] - rows[static_cast<size_t>(i)][2]));
    axial = std::max(axial, std::abs(u[i] - rows[static_cast<size_t>(i)][1]));
  }
  const double extremum = 0.57383476;
  EXPECT_LT(error, 0.02 * extremum);  // three modes
  EXPECT_LT(axial, 0.02 * extremum * extremum / 10 * 3);
  EXPECT_NEAR(v.minCoeff(), -extremum, 0.01 * extremum);
  EXPECT_TRUE(r.warnings.empty());
  RecordProperty("error", std::to_string(error / extremum));
  std::printf("spin-up: %.3e of the extremum, axial %.3e m, energy %.1e\n", error / extremum, axial,
              r.motion.summary.energy_balance);
}

TEST(TreeScenes, SpinUpWithoutStiffeningIsWarnedAbout) {
  Scene scene = scene_named("spin-up");
  scene.bodies[0].stiffening = "off";
  scene.duration = 12;
  const RunResult r = run_scene(scene, {});
  ASSERT_FALSE(r.warnings.empty());
  EXPECT_NE(r.warnings.back().find("geometric stiffness is off"), std::string::npos);
  EXPECT_GT(column(r, "beam.tip.y").cwiseAbs().maxCoeff(), 2.0);  // three times what it should be, and growing
}

// ---- tumbling ----

TEST(TreeScenes, TumblingIsJacobis) {
  const RunResult r = run_scene(scene_named("tumbling"), {});
  const auto rows = reference("torque_free_case_b.csv", 1);
  ASSERT_EQ(r.outputs.values.rows(), std::ssize(rows));
  double rate = 0, attitude = 0;
  for (Index i = 0; i < r.outputs.values.rows(); ++i) {
    const std::vector<double>& row = rows[static_cast<size_t>(i)];
    rate = std::max(rate, (vector_at(r, "hub.rate", i) - Vector3d(row[1], row[2], row[3])).norm());
    const Vector4d exact(row[4], row[5], row[6], row[7]);
    const Vector3d turn = vector_at(r, "hub.rotation", i);
    const double angle = turn.norm();
    Vector4d back;
    back << std::cos(angle / 2), -std::sin(angle / 2) / std::max(angle, 1e-300) * turn;
    attitude = std::max(attitude, rotation_vector(quaternion_product(back, exact)).norm());
  }
  std::printf("tumbling: rate %.2e, attitude %.2e\n", rate, attitude);
  EXPECT_LT(rate, 1e-10);  // tolerance 1e-12, unstable axis
  EXPECT_LT(attitude, 1e-9);
  EXPECT_LT(r.motion.summary.momentum_drift, 1e-12);
  EXPECT_LT(r.motion.summary.energy_balance, 1e-12);
}

// ---- two-link arm ----

/// Textbook equations of two rigid links in a plane (absolute angles a, b of the links): accelerations.
Vector2d two_links(const std::array<ReducedBody, 2>& link, double L, const Vector2d& angle, const Vector2d& rate,
                   const Vector2d& drive) {
  const double m2 = link[1].m, mc2 = link[1].mc0.x();
  const double I1 = link[0].J0(2, 2) + m2 * L * L, I2 = link[1].J0(2, 2), d = angle[1] - angle[0];
  Eigen::Matrix2d M;
  M << I1, mc2 * L * std::cos(d), mc2 * L * std::cos(d), I2;
  const Vector2d Q(drive[0] - drive[1] + mc2 * L * std::sin(d) * rate[1] * rate[1],
                   drive[1] - mc2 * L * std::sin(d) * rate[0] * rate[0]);
  return M.inverse() * Q;
}

TEST(TreeScenes, RigidTwoLinkArmIsThatOfTheTextbooks) {
  Scene scene = scene_named("two-link-arm");
  for (BodyScene& b : scene.bodies) b.structure = "rigid";
  scene.tolerance = 1e-9;
  const RunResult r = run_scene(scene, {});
  const std::array<ReducedBody, 2> link = {prepare_body(scene.bodies[0]).body, prepare_body(scene.bodies[1]).body};
  const double L = scene.bodies[0].geometry.length();
  Eigen::Vector4d y(0, 0.5, 0, 0);  // a, b, rates
  const auto f = [&](double t, const Eigen::Vector4d& s) {
    const double on = t < 2 ? std::sin(pi * t) : 0;
    Eigen::Vector4d d;
    d << s.tail<2>(), two_links(link, L, s.head<2>(), s.tail<2>(), {2 * on, 0.4 * on});
    return d;
  };
  const VectorXd shoulder = column(r, "shoulder.angle"), elbow = column(r, "elbow.angle");
  double error = 0;
  const int steps = 100;  // per output: RK4 with 1e-4 s, error below 1e-12
  for (Index i = 0; i < shoulder.size(); ++i) {
    error = std::max({error, std::abs(shoulder[i] - y[0]), std::abs(elbow[i] - (y[1] - y[0]))});
    for (int k = 0; k < steps; ++k) {
      const double h = scene.output_step / steps, t = (static_cast<double>(i) + 1.0 * k / steps) * scene.output_step;
      const Eigen::Vector4d a = f(t, y), b = f(t + h / 2, y + h / 2 * a), c = f(t + h / 2, y + h / 2 * b),
                            d = f(t + h, y + h * c);
      y += h / 6 * (a + 2 * b + 2 * c + d);
    }
  }
  std::printf("rigid two-link arm: %.2e rad of %.2f\n", error, shoulder.cwiseAbs().maxCoeff());
  EXPECT_LT(error, 1e-8);
}

TEST(TreeScenes, TwoLinkArmKeepsTheWorkOfItsTorques) {
  const RunResult r = run_scene(scene_named("two-link-arm"), {});
  const VectorXd work = column(r, "energy.work"), kinetic = column(r, "energy.kinetic"),
                 elastic = column(r, "energy.elastic");
  const double scale = work.cwiseAbs().maxCoeff();
  EXPECT_GT(elastic.maxCoeff(), 1e-3 * scale);  // it bends
  EXPECT_LT((kinetic + elastic - work).cwiseAbs().maxCoeff(), 1e-5 * scale);
  // The same work from the torques and rates themselves, trapezoidal over the outputs.
  const VectorXd shoulder = column(r, "shoulder.rate"), elbow = column(r, "elbow.rate"), t = column(r, "t");
  const auto power = [&](Index i) { return t[i] < 2 ? std::sin(pi * t[i]) * (2 * shoulder[i] + 0.4 * elbow[i]) : 0.0; };
  double sum = 0, worst = 0;
  for (Index i = 1; i < t.size(); ++i) {
    sum += (power(i) + power(i - 1)) / 2 * (t[i] - t[i - 1]);
    worst = std::max(worst, std::abs(sum - work[i]));
  }
  std::printf("arm: work %.4f J, elastic %.4f J, by trapezoids %.1e\n", scale, elastic.maxCoeff(), worst / scale);
  // Vibrations of 0.1 s, 10 outputs each: trapezoids are good to a percent of their share. Elbow and tip angles of the
  // flexible upper arm are the joint's own, as the power is.
  EXPECT_LT(worst, 5e-3 * scale);
}

TEST(TreeScenes, TwoLinkArmBecomesRigidAsItsLinksStiffen) {
  const auto elbow = [](double factor) {
    Scene scene = scene_named("two-link-arm");
    scene.duration = 1;
    scene.tolerance = 1e-8;
    for (BodyScene& b : scene.bodies) {
      if (factor == 0) b.structure = "rigid";
      b.modes = std::min(b.modes, 1);
      for (BeamSegment& s : b.geometry.segments) s.material.E *= std::max(factor, 1.0);
    }
    return column(run_scene(scene, {}), "elbow.angle");
  };
  const VectorXd rigid = elbow(0);
  const double soft = (elbow(1e2) - rigid).cwiseAbs().maxCoeff(), stiff = (elbow(1e3) - rigid).cwiseAbs().maxCoeff();
  std::printf("arm: rigid limit %.3e, %.3e\n", soft, stiff);
  EXPECT_NEAR(soft / stiff, 10, 1);  // the deflection is that of a static load, 1 / E
}

// ---- flexible appendage ----

TEST(TreeScenes, FlexibleAppendageHasTheFrequenciesOfTheFreeBeamWithItsHub) {
  Scene scene = scene_named("flexible-appendage");
  scene.bodies[1].modes = 24;
  const Tree tree = tree_of(scene, Stiffening::off);
  TreeState s = tree.at_rest();
  const std::vector<double> found = frequencies(tree, tree.pack(s));

  // Finite elements of the free beam with the hub as a mass at its root.
  BeamGeometry geometry = scene.bodies[1].geometry;
  RigidAttachment hub;
  hub.name = "hub";
  hub.mass = scene.bodies[0].rigid->mass;
  hub.inertia = scene.bodies[0].rigid->inertia;
  hub.offset = -scene.joints[1].a.point;
  geometry.attachments.push_back(hub);
  const Mesh mesh = make_mesh(geometry);
  EigenOptions options;
  options.num_modes = 6;
  const ModalBasis exact = mean_axis_modes(mesh, assemble(mesh), options);
  const ReducedBody& panel = tree.scene().bodies[1];
  for (Index k = 0; k < 4; ++k) {
    const double wanted = exact.omega[k];
    std::printf("appendage: %.8f rad/s, FE %.8f (%.1e)\n", nearest(found, wanted), wanted,
                nearest(found, wanted) / wanted - 1);
    EXPECT_NEAR(nearest(found, wanted) / wanted, 1, 1e-5) << k;  // 24 clamped modes
  }
  EXPECT_GT(exact.omega[0], 1.005 * std::sqrt(panel.Ke(0, 0) / panel.Me(0, 0)));  // not those of a wall
}

TEST(TreeScenes, FlexibleAppendageKeepsEnergyAndMomenta) {
  const Scene scene = scene_named("flexible-appendage");
  const RunResult r = run_scene(scene, {});
  EXPECT_LT(r.motion.summary.energy_balance, 1e-5);
  EXPECT_LT(r.motion.summary.momentum_drift, scene.tolerance);  // the integrator knows nothing of momenta
  EXPECT_GT(column(r, "panel.tip.y").cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_EQ(column(r, "clamp.torque.z").size(), r.outputs.values.rows());
}

// ---- wire spinner ----

/// omega^2 / Omega^2 of the swings of a wire on a pivot at radius r out of the plane, by polynomials over its length
/// and Gauss' rule: int T w'^2 + EI w''^2 against int m w^2, T = m/2 ((r + L)^2 - (r + x)^2).
VectorXd cable_spectrum(double r, double L, double bending, double m, double Omega) {
  constexpr int n = 14, points = 40;
  MatrixXd K = MatrixXd::Zero(n, n), M = MatrixXd::Zero(n, n);
  // Gauss-Legendre by the eigenvalues of Jacobi's matrix.
  MatrixXd jacobi = MatrixXd::Zero(points, points);
  for (int i = 1; i < points; ++i) jacobi(i, i - 1) = jacobi(i - 1, i) = i / std::sqrt(4.0 * i * i - 1);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> rule(jacobi);
  for (int g = 0; g < points; ++g) {
    const double s = rule.eigenvalues()[g], weight = std::pow(rule.eigenvectors()(0, g), 2) * L, x = (s + 1) / 2 * L;
    // w_k = x P_k(s), Legendre's polynomials keep the matrices well conditioned.
    VectorXd P(n), dP(n), ddP(n);
    P[0] = 1, P[1] = s, dP[0] = 0, dP[1] = 1, ddP[0] = ddP[1] = 0;
    for (int k = 2; k < n; ++k) {
      P[k] = ((2 * k - 1) * s * P[k - 1] - (k - 1) * P[k - 2]) / k;
      dP[k] = dP[k - 2] + (2 * k - 1) * P[k - 1];
      ddP[k] = ddP[k - 2] + (2 * k - 1) * dP[k - 1];
    }
    const double scale = 2 / L;
    const VectorXd w = x * P, dw = P + x * scale * dP, ddw = 2 * scale * dP + x * scale * scale * ddP;
    const double T = m * Omega * Omega / 2 * (std::pow(r + L, 2) - std::pow(r + x, 2));
    K += weight * (T * dw * dw.transpose() + bending * ddw * ddw.transpose());
    M += weight * m * w * w.transpose();
  }
  return Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(K, M).eigenvalues() / (Omega * Omega);
}

TEST(TreeScenes, WireSpinnerSwingsAsACable) {
  EXPECT_NEAR(cable_spectrum(0, 20, 0, 1, 1)[0], 1, 1e-12);  // a cable from the axis: n (2 n - 1)
  EXPECT_NEAR(cable_spectrum(0, 20, 0, 1, 1)[1], 6, 1e-10);
  Scene scene = scene_named("wire-spinner");
  for (BodyScene& b : scene.bodies) b.damping = {};
  const Tree tree = tree_of(scene, Stiffening::on);
  TreeState s = start_state(scene, tree);
  for (JointState& j : s.joints)
    for (double& angle : j.coordinate) angle = 0;
  const double Omega = s.joints[0].omega.z();
  const std::vector<double> found = frequencies(tree, tree.pack(s));
  const BeamSegment& wire = scene.bodies[1].geometry.segments[0];
  const double d = std::get<RoundBar>(wire.start).diameter, EI = wire.material.E * pi * std::pow(d, 4) / 64;
  const VectorXd lambda =
      cable_spectrum(scene.joints[1].a.point.x(), wire.length, EI, wire.material.rho * pi * d * d / 4, Omega);
  const double pendulum = 1.5 * 0.8 / 20;
  EXPECT_NEAR(lambda[0], 1 + pendulum, 5e-3);
  for (Index k = 0; k < 2; ++k)
    for (const double square : {lambda[k], lambda[k] - 1}) {  // out of the plane, in it
      const double wanted = Omega * std::sqrt(square);
      std::printf("wire: %.8f rad/s, cable %.8f (%.1e)\n", nearest(found, wanted), wanted,
                  nearest(found, wanted) / wanted - 1);
      EXPECT_NEAR(nearest(found, wanted) / wanted, 1, k == 0 ? 1e-4 : 1e-2) << k;
    }
}

TEST(TreeScenes, WireSpinnerFliesSteadily) {
  Scene scene = scene_named("wire-spinner");
  scene.duration = 30;
  const RunResult r = run_scene(scene, {});
  // Out of the plane the wires swing near Omega sqrt(1 + 1.5 r / L) with the size they were given.
  const VectorXd angle = column(r, "east.angle2");
  EXPECT_NEAR(angle.cwiseAbs().maxCoeff(), 0.02, 1e-3);
  EXPECT_LT(r.motion.summary.momentum_drift, 1e-6);
  EXPECT_LT(r.motion.summary.energy_balance, 1e-5);
  std::printf("wires: %ld steps, energy %.1e, momentum %.1e\n", r.motion.summary.steps, r.motion.summary.energy_balance,
              r.motion.summary.momentum_drift);
}

// Stiffness that a spin makes is in the linear part, too: from the start, or once the spin has come.
TEST(TreeScenes, MoreModesOfWhatSpinsDoNotShrinkTheStep) {
  struct Row {
    const char* scene;
    int modes, many;
  };
  for (const Row& row : {Row{"wire-spinner", 8, 24}, Row{"spin-up", 3, 11}}) {
    Scene scene = scene_named(row.scene);
    scene.tolerance = 1e-4, scene.error_budget = false;
    const auto flown_with = [&](int modes) {
      for (BodyScene& b : scene.bodies) {
        if (b.structure == "rigid") continue;
        b.modes = modes;
        for (BeamSegment& s : b.geometry.segments) s.elements = std::max(s.elements, 16);
      }
      const IntegrationSummary s = run_scene(scene, {}).motion.summary;
      EXPECT_EQ(s.method, "exponential") << row.scene;
      std::printf("%s, %d modes: %ld steps, %ld evaluations\n", row.scene, modes, s.steps, s.rhs_evaluations);
      return s;
    };
    const IntegrationSummary few = flown_with(row.modes), many = flown_with(row.many);
    EXPECT_LT(10 * many.steps, 13 * few.steps) << row.scene;
    EXPECT_LT(10 * many.rhs_evaluations, 15 * few.rhs_evaluations) << row.scene;
  }
}

// ---- latching panel ----

TEST(TreeScenes, LatchingPanelIsCaughtAndKeepsItsAngle) {
  const RunResult r = run_scene(scene_named("latching-panel"), {});
  const std::vector<StopEvent>& events = r.motion.events;
  const auto count = [&](EventKind kind) { return std::ranges::count(events, kind, &StopEvent::kind); };
  EXPECT_GE(count(EventKind::impact), 1);
  ASSERT_EQ(count(EventKind::latch), 1);
  EXPECT_EQ(events.back().kind, EventKind::latch);
  EXPECT_LE(std::abs(events.back().rate), 0.5);
  const VectorXd t = column(r, "t"), angle = column(r, "hinge.angle");
  for (Index i = 0; i < t.size(); ++i) {
    EXPECT_LT(angle[i], pi / 2 + 1e-9);
    if (t[i] > events.back().time) {
      EXPECT_NEAR(angle[i], 1.55, 1e-12);
    }
  }
  const EnergyLedger& e = r.ledger->ledger;
  EXPECT_GT(e.laws[static_cast<size_t>(LawLoss::friction)], 0.1);
  EXPECT_GT(e.laws[static_cast<size_t>(LawLoss::latch)], 1e-4);
  EXPECT_NEAR(r.ledger->kinetic + e.stored() + e.lost(), 0, 1e-4 * std::abs(e.stored()));
}

// ---- panel slew ----

TEST(TreeScenes, PanelSlewRingsAsDuhamelSays) {
  const Scene scene = scene_named("panel-slew");
  const RunResult r = run_scene(scene, {});
  const ReducedBody& panel = r.bodies[1].body;
  const TimeCourse turn = course_of(scene.joints[0].motion[0], scene.duration);
  const double end = turn.corners.back(), r0 = scene.joints[1].a.point.x();
  ASSERT_GT(scene.duration, end + 5);
  const Marker& tip = marker(panel, "tip");
  // q'' + 2 zeta w q' + w^2 q = -(r0 Ct_y + Cr0_z) / Me alpha(t), linear and without spin, each mode by small RK4
  // steps.
  const VectorXd t = column(r, "t"), found = column(r, "panel.tip.y");
  VectorXd expected = VectorXd::Zero(t.size());
  for (Index k = 0; k < panel.n(); ++k) {
    const double push = -(r0 * panel.Ct(1, k) + panel.Cr0(2, k)) / panel.Me(k, k);
    const double w2 = panel.Ke(k, k) / panel.Me(k, k), c = panel.De(k, k) / panel.Me(k, k);
    Vector2d y(0, 0);
    const auto f = [&](double time, const Vector2d& s) {
      return Vector2d(s[1], push * turn.function.acceleration(time) - w2 * s[0] - c * s[1]);
    };
    for (Index i = 1; i < t.size(); ++i) {
      const int steps = 20;
      const double h = (t[i] - t[i - 1]) / steps;
      for (int j = 0; j < steps; ++j) {
        const double time = t[i - 1] + j * h;
        const Vector2d a = f(time, y), b = f(time + h / 2, y + h / 2 * a), d = f(time + h / 2, y + h / 2 * b),
                       e = f(time + h, y + h * d);
        y += h / 6 * (a + 2 * b + 2 * d + e);
      }
      expected[i] += tip.S(1, k) * y[0];
    }
  }
  double residual = 0, wanted = 0, error = 0;
  for (Index i = 0; i < t.size(); ++i) {
    error = std::max(error, std::abs(found[i] - expected[i]));
    if (t[i] < end) continue;
    residual = std::max(residual, std::abs(found[i]));
    wanted = std::max(wanted, std::abs(expected[i]));
  }
  const double spin = 0.6, w1 = std::sqrt(panel.Ke(0, 0) / panel.Me(0, 0));
  std::printf(
      "slew: end %.2f s, w1 %.3f rad/s, residual %.4e m, Duhamel %.4e m, peak %.3e, worst %.2e, (spin/w1)^2 %.1e\n",
      end, w1, residual, wanted, expected.cwiseAbs().maxCoeff(), error, spin * spin / w1 / w1);
  EXPECT_NEAR(column(r, "slew.angle")[t.size() - 1], pi, 1e-9);
  EXPECT_NEAR(residual / wanted, 1, 0.05);
  EXPECT_LT(error, 0.05 * expected.cwiseAbs().maxCoeff());
}

}  // namespace
}  // namespace flexboom
