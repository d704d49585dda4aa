#include "dynamics/numerics/collocation.hpp"
#include "dynamics/numerics/linear_part.hpp"
#include "dynamics/numerics/phi.hpp"
#include "dynamics/simulation/tree_integrator.hpp"

#include "fem/base/check.hpp"
#include "hub_testing.hpp"

#include <gtest/gtest.h>

#include <array>
#include <numeric>

namespace flexboom {
namespace {

using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::Hub;
using testing::HubLayout;
using testing::HubState;
using Complex = std::complex<double>;

using std::numbers::pi;

/// (k - 1)! phi_k(w): the integral of its definition by the 5-point Lobatto rule on many pieces.
Complex phi_by_quadrature(int k, Complex w) {
  constexpr int pieces = 4000;
  constexpr double weight[] = {9.0 / 180, 49.0 / 180, 64.0 / 180, 49.0 / 180, 9.0 / 180};
  Complex sum = 0;
  for (int piece = 0; piece < pieces; ++piece) {
    for (int j = 0; j < 5; ++j) {
      const double s = (piece + collocation::node(j)) / pieces;
      sum += weight[j] / pieces * std::exp((1 - s) * w) * std::pow(s, k - 1);
    }
  }
  return sum;
}

/// One among others, small and large.
std::vector<Complex> phi_of(Complex w, int count) {
  VectorXd x = VectorXd::LinSpaced(21, -5, 3), y = VectorXd::LinSpaced(21, 0, 4);
  x[11] = w.real(), y[11] = w.imag();
  MatrixXd phi(42, count);
  phi_functions(1, x, y, phi);
  std::vector<Complex> result;
  for (int k = 0; k < count; ++k) result.emplace_back(phi(11, k), phi(32, k));
  return result;
}

// On both sides of |w| = 2, where the series meets the recurrence, and for decay, growth and vibration.
TEST(Phi, AgreesWithItsIntegral) {
  for (const Complex w : {Complex(0, 0), Complex(0.3, 0), Complex(0, 1.999), Complex(0, 2.001), Complex(-1.4, 1.4),
                          Complex(-1.5, 1.5), Complex(-30, 0), Complex(0, 40), Complex(2, 3), Complex(-3, 60)}) {
    const std::vector<Complex> phi = phi_of(w, 9);
    EXPECT_LT(std::abs(phi[0] - std::exp(w)), 1e-15 * std::abs(std::exp(w)));
    double factorial = 1;
    for (int k = 1; k < 9; factorial *= k++) {
      const Complex exact = phi_by_quadrature(k, w);
      EXPECT_LT(std::abs(factorial * phi[static_cast<size_t>(k)] - exact), 1e-13 * std::max(1.0, std::exp(w.real())))
          << k << " at " << w;
    }
  }
}

TEST(Phi, OfManyIsZeroWhereTheDecayIsFast) {
  const std::vector<Complex> phi = phi_of({-1e7, 3}, 8);
  EXPECT_EQ(phi[0], 0.0);
  EXPECT_NEAR(phi[1].real(), 1e-7, 1e-20);
}

TEST(Collocation, HasLobattoPointsAndWeights) {
  EXPECT_NEAR(collocation::node(1), 0.5 * (1 - std::sqrt(3.0 / 7)), 1e-16);
  EXPECT_EQ(collocation::node(0), 0);
  EXPECT_NEAR(collocation::node(2), 0.5, 1e-16);
  EXPECT_EQ(collocation::node(4), 1);
  // Order 8: a polynomial of degree 7 is integrated exactly through five points.
  collocation::Values values;
  for (int j = 0; j < collocation::points; ++j) values[j] = std::pow(collocation::node(j), 7);
  const collocation::Values c = collocation::coefficients().transpose() * values;
  EXPECT_NEAR(c.dot(collocation::integrals(1)), 1.0 / 8, 1e-14);
}

TEST(Collocation, IntegratesItsPolynomials) {
  collocation::Values values;
  for (int j = 0; j < collocation::points; ++j) {
    const double c = collocation::node(j);
    values[j] = 3 + c * (-2 + c * (5 + c * (1 - 4 * c)));
  }
  const collocation::Values c = collocation::coefficients().transpose() * values;
  const double x = 0.37;
  EXPECT_NEAR(c.dot(collocation::monomials(x)), 3 + x * (-2 + x * (5 + x * (1 - 4 * x))), 1e-13);
  EXPECT_NEAR(c.dot(collocation::integrals(x)), x * (3 + x * (-1 + x * (5.0 / 3 + x * (0.25 - 0.8 * x)))), 1e-13);
  EXPECT_NEAR(c.dot(collocation::double_integrals(x)),
              x * x * (1.5 + x * (-1.0 / 3 + x * (5.0 / 12 + x * (0.05 - 4.0 / 30 * x)))), 1e-13);
  // A cubic says nothing at the middle point that the others do not.
  for (int j = 0; j < collocation::points; ++j) values[j] = std::pow(collocation::node(j), 3);
  EXPECT_NEAR(values.dot(collocation::middle_difference()), 0, 1e-15);
}

// x' = L x + (polynomial): the state and its integral at a point against those of a long Taylor series.
TEST(LinearPart, CarriesALinearSystemUnderAPolynomialExactly) {
  const MatrixXd L{{0, 1, 0}, {-400, -3, 7}, {2, 0, -1e3}};  // a vibration and a decay
  LinearPart part(L, {}, VectorXd::Zero(1));
  const VectorXd x0{{0.3, -2, 1}}, force{{0, 5, 0}};  // force * c^2, c = t / h
  const double h = 0.01;
  Eigen::MatrixXd M = MatrixXd::Zero(part.size(), collocation::points);
  M.col(2) = 2 * h * part.to_modes * force;
  GridPoint point;
  part.point(0.8, h, point);
  std::array<VectorXd, 2> got;
  for (int shift = 0; shift < 2; ++shift) {
    VectorXd z(part.size());
    part.combine(point, shift, part.to_modes * x0, M, z);
    got[static_cast<size_t>(shift)] = part.from_modes * z;
  }
  VectorXd term = x0, x = x0, integral = 0.8 * x0;  // term: the power k of c
  for (int k = 1; k < 600; ++k) {
    term = 0.8 * h / k * (L * term).eval();
    if (k == 3) term += 0.8 * 0.8 * 0.8 * h / 3 * force;
    x += term;
    integral += term * 0.8 / (k + 1);
  }
  // Terms of the series reach 8^8 / 8!.
  const double tolerance = 1e-12;
  EXPECT_LT((got[0] - x).norm(), tolerance);
  EXPECT_LT((got[1] - integral).norm(), tolerance);
}

/// Vibrations, weakly coupled to those beside them, and two decays; column 0 can be made stiffer.
MatrixXd chain(int count, double stiffer) {
  const int n = 2 * count + 2;
  MatrixXd L = MatrixXd::Zero(n, n);
  for (int k = 0; k < count; ++k) {
    L(k, count + k) = 1;
    L(count + k, k) = -std::pow(40.0, 2 + 0.3 * k);
    L(count + k, count + k) = -0.02 * std::pow(40.0, 1 + 0.15 * k);
    if (k > 0) L(count + k, k - 1) = L(count + k - 1, k) = 3;
  }
  L(n - 2, n - 2) = -1e4, L(n - 1, n - 1) = -3, L(n - 1, 0) = 1;
  L(count, 0) -= stiffer, L(n - 2, 0) += 0.1 * stiffer;
  return L;
}

// The eigenvectors that the difference couples are found anew, the others kept; what that leaves out is the remainder.
TEST(LinearPart, FollowsFromAnotherThatDiffersInAColumn) {
  const int count = 12;
  const MatrixXd before = chain(count, 0), L = chain(count, 500);
  const LinearPart other(before, {}, VectorXd::Zero(count)), part(other, L, 0), whole(L, {}, VectorXd::Zero(count));
  const MatrixXd I = MatrixXd::Identity(L.rows(), L.rows());
  EXPECT_LT((part.from_modes * part.to_modes - I).norm(), 1e-10);  // round-off of eigenvectors 1e4 from orthogonal
  int kept = 0;
  for (Eigen::Index i = 0; i < part.lambda.size(); ++i)
    kept += (other.lambda.array() - part.lambda[i]).cwiseAbs().minCoeff() == 0;
  EXPECT_GT(kept, 3);
  EXPECT_LE(kept, part.lambda.size() - 2);
  // Eigenvalues are those of L, but for what second-order effects of the rest make of them.
  for (Eigen::Index i = 0; i < whole.lambda.size(); ++i)
    EXPECT_LT((part.lambda.array() - whole.lambda[i]).cwiseAbs().minCoeff(), 1e-8 * std::abs(whole.lambda[i])) << i;
  const VectorXd x = VectorXd::LinSpaced(L.rows(), 1, 2), z = part.to_modes * x;
  MatrixXd N(part.size(), 1);
  part.remainder(L * x, z, N);
  const VectorXd F = part.to_modes * (L * x);
  EXPECT_LT(N.norm(), 1e-4 * F.norm());
  EXPECT_GT(N.norm(), 0);
  // And back again; and one that couples nothing.
  const LinearPart back(part, before, 0);
  EXPECT_LT((back.from_modes * back.to_modes - I).norm(), 1e-10);
  for (Eigen::Index i = 0; i < other.lambda.size(); ++i)
    EXPECT_LT((back.lambda.array() - other.lambda[i]).cwiseAbs().minCoeff(), 1e-8 * std::abs(other.lambda[i])) << i;
  const LinearPart same(other, chain(count, 1e-9), 0);
  EXPECT_EQ(same.lambda, other.lambda);
}

TEST(LinearPart, WithoutAFullSetOfEigenvectorsIsRefused) {
  const MatrixXd jordan{{0, 1}, {0, 0}};
  EXPECT_THROW(LinearPart(jordan, {}, VectorXd::Zero(1)), NumericalError);
}

Hub sport_boom(int modes, double stiffness_scale = 1) {
  ReducedBody body = eq14::reduced_body(testing::round_boom(0.295, 0.005), modes, eq14::Planes::xy, "boom");
  apply_damping(body, {"modal", 0.05});
  Hinge hinge;
  hinge.mechanism = testing::sport_mechanism(0.35);
  hinge.mechanism.stiffness *= stiffness_scale;
  hinge.point = Vector3d(0.05, 0.1, 0.02);
  ReducedBody hub = rigid_body("hub", 8.5, Vector3d::Zero(), Vector3d(0.13, 0.1, 0.06).asDiagonal());
  return Hub(hub, {{body, hinge}});
}

IntegratorOptions exponential_options(double tolerance, double duration) {
  IntegratorOptions o;
  o.method = "exponential";
  o.tolerance = tolerance;
  o.duration = duration;
  return o;
}

// A hinge that nothing pulls back, on a free hub: the eigenvectors of L are short of one.
TEST(Exponential, AHingeWithoutASpringTurnsOn) {
  const Hub system = sport_boom(1, 0);
  HubState s = system.at_rest({pi / 2 - 0.5});
  s.rate[0] = -0.3;
  const VectorXd y0 = system.pack(s);
  IntegratorOptions o = exponential_options(1e-9, 3);
  const TreeTrajectory r = integrate(system, y0, o);
  o.method = "bdf";
  const TreeTrajectory reference = integrate(system, y0, o);
  for (size_t i = 0; i < r.time.size(); ++i) EXPECT_NEAR(r.y[i][0], reference.y[i][0], 2e-8);
  EXPECT_LT(r.summary.momentum_drift, 1e-8);
}

// Large angles and rates: the linear part at rest is a poor guide, and the answer is the same.
TEST(Exponential, AgreesWithBdfFarFromWhereItWasLinearised) {
  const Hub system = sport_boom(2);
  HubState s = system.at_rest({pi / 2 - 1.2});
  s.omega = Vector3d(1, -2, 1.5);
  const VectorXd y0 = system.pack(s);
  IntegratorOptions o = exponential_options(1e-9, 2);
  const TreeTrajectory r = integrate(system, y0, o);
  o.method = "bdf";
  const TreeTrajectory reference = integrate(system, y0, o);
  VectorXd size = VectorXd::Zero(y0.size()), error = size;
  for (size_t i = 0; i < r.time.size(); ++i) {
    size = size.cwiseMax(reference.y[i].cwiseAbs());
    error = error.cwiseMax((r.y[i] - reference.y[i]).cwiseAbs());
  }
  EXPECT_LT(error.cwiseQuotient(size).maxCoeff(), 1e-6);  // of the rates of q just after a contact, by bdf
  EXPECT_EQ(r.events.size(), reference.events.size());
}

// What is far from linear is as good as asked for, and a coarse answer costs less.
TEST(Exponential, ErrorIsThatOfTheTolerance) {
  for (const bool fixed_hub : {false, true}) {
    const Hub free = sport_boom(2), fixed({}, free.appendages());
    const Hub& system = fixed_hub ? fixed : free;
    HubState s = system.at_rest({pi / 2 - 1.2});
    if (fixed_hub)
      s.rate[0] = -30;
    else
      s.omega = Vector3d(1, -2, 1.5);
    const VectorXd y0 = system.pack(s);
    const TreeTrajectory reference = integrate(system, y0, exponential_options(1e-11, 0.5));
    const auto shape = [&](const VectorXd& y) { return y.head(system.layout().p + system.layout().u); };
    long steps = 0;
    for (const double tolerance : {1e-3, 1e-5, 1e-7, 1e-9}) {
      const TreeTrajectory r = integrate(system, y0, exponential_options(tolerance, 0.5));
      EXPECT_GT(r.summary.steps, steps) << tolerance;
      steps = r.summary.steps;
      VectorXd size = VectorXd::Zero(shape(y0).size()), error = size;
      for (size_t i = 0; i < r.time.size(); ++i) {
        size = size.cwiseMax(shape(reference.y[i]).cwiseAbs());
        error = error.cwiseMax(shape(r.y[i] - reference.y[i]).cwiseAbs());
      }
      // Errors of steps add up, more where the hub turns what was wrong; from one step size of the ladder to the next
      // they are 16 times as large.
      EXPECT_LT(error.cwiseQuotient(size).maxCoeff(), (fixed_hub ? 3 : 5) * tolerance) << fixed_hub << tolerance;
    }
  }
}

// A coarse tolerance takes steps that are longer than a contact.
TEST(Exponential, LongStepsMissNoContact) {
  const Hub system = sport_boom(2);
  const VectorXd y0 = system.pack(system.at_rest({pi / 2 - pi / 60}));
  IntegratorOptions fine = exponential_options(1e-9, 3);
  const TreeTrajectory reference = integrate(system, y0, fine);
  for (const double tolerance : {1e-2, 1e-3, 1e-4}) {
    IntegratorOptions o = exponential_options(tolerance, 3);
    o.settle = 1e-11;
    const TreeTrajectory r = integrate(system, y0, o);
    ASSERT_GT(reference.events.size(), 20U);
    for (size_t k = 0; k < 20; ++k) EXPECT_NEAR(r.events[k].time, reference.events[k].time, tolerance) << k;
  }
}

// Clamped modes on a damped hinge: the fastest eigenvalue grows from 5e4 to 1e7 rad/s (dynamics/README.md).
TEST(Exponential, MoreModesDoNotShrinkTheStep) {
  long steps_with_2 = 0;
  for (const int modes : {2, 4, 8, 16}) {
    const Hub system = sport_boom(modes);
    const VectorXd y0 = system.pack(system.at_rest({pi / 2 - pi / 60}));
    const TreeTrajectory r = integrate(system, y0, exponential_options(1e-4, 3));
    if (modes == 2) steps_with_2 = r.summary.steps;
    EXPECT_LT(10 * r.summary.steps, 13 * steps_with_2) << modes;
    EXPECT_LT(r.summary.energy_balance, 1e-4);
    // The hub, which all the modes shake, is as good as ever.
    const TreeTrajectory reference = integrate(system, y0, exponential_options(1e-8, 3));
    const HubLayout& l = system.layout();
    for (const int place : {l.position(), l.attitude() + 1}) {
      double size = 0, error = 0;
      for (size_t i = 0; i < r.time.size(); ++i) {
        size = std::max(size, reference.y[i].segment<3>(place).norm());
        error = std::max(error, (r.y[i] - reference.y[i]).segment<3>(place).norm());
      }
      EXPECT_LT(error, 3e-4 * size) << modes;  // errors of steps add up
    }
  }
}

// The momenta stay what they were at the start, whatever the tolerance.
TEST(Exponential, KeepsMomentaAtAnyTolerance) {
  const Hub system = sport_boom(4);
  HubState s = system.at_rest({pi / 2 - 1.2});
  for (const double tolerance : {1e-2, 1e-4, 1e-7})
    for (const Vector3d& omega : {Vector3d(0, 0, 0), Vector3d(0.3, -0.2, 0.5)}) {
      s.omega = omega;
      s.velocity = Vector3d(0.1, 0.2, -0.3);
      const TreeTrajectory r = integrate(system, system.pack(s), exponential_options(tolerance, 2));
      EXPECT_GT(r.events.size(), 4U);
      // Where a step ends: the correction leaves its own square.
      const Balance &first = r.balance.front(), &last = r.balance.back();
      const double scale = system.hub().J0.norm() * (0.1 + omega.norm());
      EXPECT_LT((last.angular_momentum - first.angular_momentum).norm(), 1e-7 * scale);
      EXPECT_LT((last.momentum - first.momentum).norm(), 1e-14 * first.momentum_scale);
      EXPECT_LT(r.summary.energy_balance, tolerance);
    }
}

// Shape and rates do not know how far the hub is, or how fast.
TEST(Exponential, PlaceDoesNotActBack) {
  const Hub system = sport_boom(4);
  HubState s = system.at_rest({pi / 2 - pi / 60});
  const TreeTrajectory here = integrate(system, system.pack(s), exponential_options(1e-9, 2));
  s.position = Vector3d(1e7, -2e7, 3e6);
  s.velocity = Vector3d(7e3, 100, -3e3);
  const TreeTrajectory away = integrate(system, system.pack(s), exponential_options(1e-9, 2));
  ASSERT_EQ(away.time.size(), here.time.size());
  const HubLayout& l = system.layout();
  VectorXd size = VectorXd::Zero(l.p + l.u), error = size;
  for (size_t i = 0; i < here.time.size(); ++i) {
    size = size.cwiseMax(here.y[i].head(l.p + l.u).cwiseAbs());
    error = error.cwiseMax((away.y[i] - here.y[i]).head(l.p + l.u).cwiseAbs());
  }
  for (Eigen::Index i = 0; i < size.size(); ++i) EXPECT_LE(error[i], 1e-11 * size[i]) << i;
}

// Interpolated outputs are as good as steps that end there.
TEST(Exponential, OutputsBetweenStepsAreOfTheSameQuality) {
  const Hub system = sport_boom(2);
  const VectorXd y0 = system.pack(system.at_rest({pi / 2 - pi / 60}));
  IntegratorOptions o = exponential_options(1e-8, 0.3);
  o.output_step = 0.0007;
  const TreeTrajectory fine = integrate(system, y0, o);
  VectorXd size = VectorXd::Zero(y0.size());
  for (const VectorXd& y : fine.y) size = size.cwiseMax(y.cwiseAbs());
  for (const size_t i : {100U, 211U, 402U}) {
    IntegratorOptions until = o;
    until.duration = fine.time[i];
    const TreeTrajectory r = integrate(system, y0, until);
    EXPECT_LT((r.y.back() - fine.y[i]).cwiseAbs().cwiseQuotient(size).maxCoeff(), 1e-7) << i;
  }
}

}  // namespace
}  // namespace flexboom
