#include "reduction/invariants/eq14.hpp"
#include "reduction/body/tilde.hpp"

#include "fem/base/check.hpp"
#include "tests/reduction/csv.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace flexboom {
namespace {

constexpr double eps = 2.3e-16;

double relative(double value, double reference) { return std::abs(value - reference) / std::abs(reference); }

const eq14::Boom boom{0.7, 0.09, 3.5};

TEST(Eq14, RootsAndSigmaHaveFullPrecision) {
  const test::Table t = test::read_csv("eq14_roots.csv");
  for (size_t i = 0; i < t.at("k").size(); ++i) {
    const int k = static_cast<int>(t.at("k")[i]);
    const double exact = t.at("alpha_k")[i];
    EXPECT_LE(relative(eq14::alpha(k), exact), eps) << k;  // one rounding
    EXPECT_LE(relative(eq14::sigma(k), t.at("sigma_k")[i]), 8 * eps) << k;
    // 1 - sigma falls like e^-alpha, and exp is good to an ulp of its value once its argument is hi + lo.
    EXPECT_LE(relative(eq14::one_minus_sigma(k), t.at("one_minus_sigma_k")[i]), 20 * eps) << k;
    EXPECT_LE(relative(eq14::integral_phi(k), t.at("int_phi=2sigma/alpha")[i]), 10 * eps) << k;
    EXPECT_LE(relative(eq14::integral_x_phi(k), t.at("int_x_phi=2/alpha^2")[i]), 10 * eps) << k;
    EXPECT_LE(relative(eq14::phi(k, 1), t.at("phi_tip")[i]), 1e-14) << k;
    EXPECT_LE(relative(eq14::dphi(k, 1), t.at("dphi_tip=phi_tip*alpha*sigma")[i]), 1e-14) << k;
  }
}

TEST(Eq14, ShapesAreGoodTo1e13UpToMode50) {
  const test::Table t = test::read_csv("eq14_shapes.csv");
  double worst = 0;
  for (size_t i = 0; i < t.at("k").size(); ++i) {
    const int k = static_cast<int>(t.at("k")[i]);
    const double x = t.at("x")[i];
    const double a = eq14::alpha(k);
    worst = std::max(worst, std::abs(eq14::phi(k, x) - t.at("phi")[i]));
    EXPECT_NEAR(eq14::phi(k, x), t.at("phi")[i], 1e-13) << k << " " << x;
    EXPECT_NEAR(eq14::dphi(k, x), t.at("dphi")[i], 1e-13 * a) << k << " " << x;
    EXPECT_NEAR(eq14::ddphi(k, x), t.at("ddphi")[i], 1e-13 * a * a) << k << " " << x;
  }
  EXPECT_LT(worst, 3e-15);  // four terms of size 1; without the low part of alpha it would be 1e-14
  RecordProperty("worst_error_of_phi", std::to_string(worst * 1e16) + "e-16");
}

TEST(Eq14, FormAsPrintedFailsAtMode12) {
  const test::Table t = test::read_csv("eq14_shapes.csv");
  double worst_12 = 0;
  double worst_1 = 0;
  for (size_t i = 0; i < t.at("k").size(); ++i) {
    const double error = std::abs(eq14::phi_as_printed(static_cast<int>(t.at("k")[i]), t.at("x")[i]) - t.at("phi")[i]);
    if (t.at("k")[i] == 12) worst_12 = std::max(worst_12, error);
    if (t.at("k")[i] == 1) worst_1 = std::max(worst_1, error);
  }
  EXPECT_GT(worst_12, 0.1);   // the table would notice
  EXPECT_LT(worst_1, 1e-14);  // and the formula itself is right
}

TEST(Eq14, HighModesNeitherOverflowNorLoseTheTip) {
  for (const int k : {100, 300, 1000, 10000}) {
    EXPECT_NEAR(std::abs(eq14::phi(k, 1)), 2, 1e-11) << k;  // alpha to 3e4 rad: argument reduction costs alpha * eps
    EXPECT_EQ(eq14::phi(k, 0), 0) << k;
  }
}

TEST(Eq14, ModeNumberZeroIsRefused) { EXPECT_THROW(eq14::phi(0, 0.5), InputError); }

TEST(Eq14, FrequencyIsThatOfTheClosedForm) {
  // omega_1 of a unit boom is alpha_1^2 (eq14_roots.csv).
  EXPECT_NEAR(eq14::omega({1, 1, 1}, 1), 3.5160152685001511834, 1e-15);
  EXPECT_NEAR(eq14::omega({2, 3, 48}, 1), 3.5160152685001511834, 1e-15);
}

/// Every invariant straight from its definition, by composite Gauss quadrature over the line: the slow obvious version.
struct Integrated {
  Eigen::Matrix3Xd Ct, Cr0;
  std::vector<Eigen::Matrix3Xd> Cr1;
  Eigen::MatrixXd Me;
  std::vector<Eigen::Matrix3d> J1;
  std::vector<std::vector<Eigen::Matrix3d>> J2;
};

void add_point(Integrated& sum, double dm, const Eigen::Vector3d& u0, const Eigen::Matrix3Xd& S) {
  const size_t n = sum.J1.size();
  sum.Ct += dm * S;
  sum.Cr0 += dm * tilde(u0) * S;
  sum.Me += dm * S.transpose() * S;
  for (size_t k = 0; k < n; ++k) {
    const Eigen::Matrix3d S_k = tilde(S.col(static_cast<Eigen::Index>(k)));
    sum.Cr1[k] += dm * S_k * S;
    sum.J1[k] -= dm * (tilde(u0) * S_k + S_k * tilde(u0));
    for (size_t l = 0; l < n; ++l) {
      const Eigen::Matrix3d S_l = tilde(S.col(static_cast<Eigen::Index>(l)));
      sum.J2[k][l] -= dm * (S_k * S_l + S_l * S_k) / 2;
    }
  }
}

Integrated integrate_invariants(int n_per_plane) {
  const ReducedBody zero = blank_body("sum", 2 * n_per_plane);
  Integrated sum{zero.Ct, zero.Cr0, zero.Cr1, zero.Me, zero.J1, zero.J2};
  const std::array nodes = {-0.9061798459386640, -0.5384693101056831, 0.0, 0.5384693101056831, 0.9061798459386640};
  const std::array weights = {0.2369268850561891, 0.4786286704993665, 0.5688888888888889, 0.4786286704993665,
                              0.2369268850561891};
  constexpr int panels = 200;
  for (int p = 0; p < panels; ++p) {
    size_t i = 0;
    for (const double node : nodes) {
      const double x = (p + 0.5 * (1 + node)) / panels;
      Eigen::Matrix3Xd S = Eigen::Matrix3Xd::Zero(3, 2 * n_per_plane);
      for (int k = 1; k <= n_per_plane; ++k) {
        S(1, k - 1) = S(2, n_per_plane + k - 1) = (k % 2 == 1 ? 1 : -1) * eq14::phi(k, x);
      }
      const double dm = boom.mass_per_length * boom.length * weights[i++] / 2 / panels;
      add_point(sum, dm, x * boom.length * Eigen::Vector3d::UnitX(), S);
    }
  }
  return sum;
}

TEST(Eq14Body, EveryInvariantIsItsIntegral) {
  constexpr int n = 6;
  const ReducedBody body = eq14::reduced_body(boom, n, eq14::Planes::xy_and_xz, "boom");
  const Integrated sum = integrate_invariants(n);
  // 16-digit Gauss nodes and 1000 points: round-off of the sums, relative to m (or m L).
  const double tolerance = 1e-14 * body.m;
  EXPECT_LT((body.Ct - sum.Ct).cwiseAbs().maxCoeff(), tolerance);
  EXPECT_LT((body.Cr0 - sum.Cr0).cwiseAbs().maxCoeff(), tolerance);
  EXPECT_LT((body.Me - sum.Me).cwiseAbs().maxCoeff(), tolerance);
  for (size_t k = 0; k < 2 * n; ++k) {
    EXPECT_LT((body.Cr1[k] - sum.Cr1[k]).cwiseAbs().maxCoeff(), tolerance) << k;
    EXPECT_LT((body.J1[k] - sum.J1[k]).cwiseAbs().maxCoeff(), tolerance) << k;
    for (size_t l = 0; l < 2 * n; ++l) {
      EXPECT_LT((body.J2[k][l] - sum.J2[k][l]).cwiseAbs().maxCoeff(), tolerance) << k << " " << l;
    }
  }
}

TEST(Eq14Body, RigidPartIsThatOfALine) {
  const ReducedBody body = eq14::reduced_body(boom, 0, eq14::Planes::xy, "boom");
  const double m = boom.mass_per_length * boom.length;
  EXPECT_EQ(body.n(), 0);
  EXPECT_EQ(body.structure, "eq14");
  EXPECT_DOUBLE_EQ(body.m, m);
  EXPECT_EQ(body.mc0, Eigen::Vector3d(m * boom.length / 2, 0, 0));
  EXPECT_DOUBLE_EQ(body.J0(1, 1), m * boom.length * boom.length / 3);
  EXPECT_EQ(body.J0(0, 0), 0);
}

TEST(Eq14Body, OnePlaneHasNoRotationalCouplingBetweenShapes) {
  const ReducedBody body = eq14::reduced_body(boom, 3, eq14::Planes::xy, "boom");
  for (const Eigen::Matrix3Xd& C : body.Cr1) EXPECT_EQ(C.norm(), 0);
}

TEST(Eq14Body, TipMovesByTwoAndTurnsWithTheSlope) {
  const ReducedBody body = eq14::reduced_body(boom, 4, eq14::Planes::xy_and_xz, "boom");
  const Marker& tip = marker(body, "tip");
  for (int k = 1; k <= 4; ++k) {
    const double slope = 2 * eq14::alpha(k) * eq14::sigma(k) / boom.length;
    EXPECT_NEAR((tip.S.col(k - 1) - 2 * Eigen::Vector3d::UnitY()).norm(), 0, 1e-14);
    EXPECT_NEAR((tip.S.col(k + 3) - 2 * Eigen::Vector3d::UnitZ()).norm(), 0, 1e-14);
    EXPECT_NEAR((tip.S_theta.col(k - 1) - slope * Eigen::Vector3d::UnitZ()).norm(), 0, 1e-14 * slope);
    EXPECT_NEAR((tip.S_theta.col(k + 3) + slope * Eigen::Vector3d::UnitY()).norm(), 0, 1e-14 * slope);
  }
}

TEST(Eq14Body, StiffnessGivesTheFrequencies) {
  const ReducedBody body = eq14::reduced_body(boom, 5, eq14::Planes::xy, "boom");
  for (int k = 0; k < 5; ++k) {
    const double hz = std::sqrt(body.Ke(k, k) / body.Me(k, k)) / (2 * std::numbers::pi);
    EXPECT_LE(relative(hz, body.coordinates[static_cast<size_t>(k)].frequency_hz), 4 * eps);
    EXPECT_EQ(body.coordinates[static_cast<size_t>(k)].kind, "bending_y");
  }
}

TEST(Eq14Body, BadDataIsRefused) {
  EXPECT_THROW(eq14::reduced_body({0, 1, 1}, 1, eq14::Planes::xy, "b"), InputError);
  EXPECT_THROW(eq14::reduced_body({1, -1, 1}, 1, eq14::Planes::xy, "b"), InputError);
  EXPECT_THROW(eq14::reduced_body({1, 1, std::nan("")}, 1, eq14::Planes::xy, "b"), InputError);
  EXPECT_THROW(eq14::reduced_body({1, 1, 1}, -1, eq14::Planes::xy, "b"), InputError);
}

TEST(Eq14Body, GramIsTheIntegralOverTheLine) {
  // Gauss-Legendre with five points on 200 pieces: the error is below round-off for the first four shapes.
  const ReducedBody body = eq14::reduced_body(boom, 4, eq14::Planes::xy_and_xz, "boom");
  constexpr double points[] = {0, 0.5384693101056831, -0.5384693101056831, 0.9061798459386640, -0.9061798459386640};
  constexpr double weights[] = {0.5688888888888889, 0.4786286704993665, 0.4786286704993665, 0.2369268850561891,
                                0.2369268850561891};
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(body.gram.rows(), body.gram.cols());
  for (int i = 0; i < 200; ++i) {
    for (int g = 0; g < 5; ++g) {
      const double x = (i + (points[g] + 1) / 2) / 200;
      Eigen::VectorXd z = Eigen::VectorXd::Zero(gram.rows());
      z(0) = 1;
      z(1) = boom.length * x;
      for (int k = 1; k <= 4; ++k) {
        const double shape = (k % 2 == 1 ? 1 : -1) * eq14::phi(k, x);  // tip +2
        z(4 + 3 * (k - 1) + 1) = shape;
        z(4 + 3 * (k + 3) + 2) = shape;
      }
      gram += boom.mass_per_length * boom.length * weights[g] / 2 / 200 * z * z.transpose();
    }
  }
  // z has components along x of u0, y and z of shapes: gram mixes directions, which the closed form has, too.
  EXPECT_LT((gram - body.gram).cwiseAbs().maxCoeff(), 1e-14);
}

}  // namespace
}  // namespace flexboom
