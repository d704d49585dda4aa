#include "dynamics/numerics/secular.hpp"

#include "fem/base/check.hpp"

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

#include <complex>
#include <random>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

/// diag(lambda) + w v^T on z, real parts before imaginary parts, without the imaginary parts that are always zero.
struct Problem {
  VectorXcd lambda;
  VectorXd w, v;

  std::vector<Index> used() const {
    std::vector<Index> entries;
    for (Index i = 0; i < 2 * lambda.size(); ++i)
      if (i < lambda.size() || lambda[i - lambda.size()].imag() != 0) entries.push_back(i);
    return entries;
  }

  MatrixXd matrix() const {
    const Index m = lambda.size();
    MatrixXd A = w * v.transpose();
    for (Index i = 0; i < m; ++i) {
      A(i, i) += lambda[i].real(), A(m + i, m + i) += lambda[i].real();
      A(i, m + i) -= lambda[i].imag(), A(m + i, i) += lambda[i].imag();
    }
    return A(used(), used());
  }
};

Problem random_problem(std::mt19937& random, int pairs, int reals, double strength) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const int m = pairs + reals;
  Problem p{VectorXcd(m), VectorXd::Zero(2 * m), VectorXd::Zero(2 * m)};
  for (int i = 0; i < m; ++i) {
    const double size = std::pow(10, 3 + 2 * uniform(random));
    const bool pair = i < pairs;
    p.lambda[i] = pair ? size * Complex(-0.02, 1) : Complex(-size);
    for (VectorXd* a : {&p.w, &p.v}) {
      (*a)[i] = std::sqrt(strength * size) * uniform(random);
      if (pair) (*a)[m + i] = std::sqrt(strength * size) * uniform(random);
    }
  }
  return p;
}

/// Eigenvalues, eigenvectors and their inverse against the matrix; `share`: of its norm, for the eigenvectors.
void expect_spectrum(const Problem& p, double share) {
  const Spectrum s = rank_one_spectrum(p.lambda, p.w, p.v);
  const MatrixXd A = p.matrix(), from = s.from_modes(p.used(), Eigen::all), to = s.to_modes(Eigen::all, p.used());
  const Index n = A.rows(), m = s.lambda.size();
  EXPECT_LT((from * to - MatrixXd::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-11);
  MatrixXd turned(2 * m, n);  // lambda z
  for (Index i = 0; i < m; ++i) {
    turned.row(i) = s.lambda[i].real() * to.row(i) - s.lambda[i].imag() * to.row(m + i);
    turned.row(m + i) = s.lambda[i].imag() * to.row(i) + s.lambda[i].real() * to.row(m + i);
  }
  EXPECT_LT((from * turned - A).norm(), share * A.norm());
  const VectorXcd expected = A.eigenvalues();
  for (Index i = 0; i < n; ++i) {
    const Complex wanted = expected[i].imag() < 0 ? std::conj(expected[i]) : expected[i];
    // Round-off of the reference grows with its largest eigenvalue.
    EXPECT_LT((s.lambda.array() - wanted).abs().minCoeff(), 1e-9 * std::abs(wanted) + 1e-13 * A.norm()) << wanted;
  }
  EXPECT_EQ(2 * (s.lambda.imag().array() != 0).count() + (s.lambda.imag().array() == 0).count(), n);
}

TEST(Secular, IsTheSpectrumOfDiagonalAndRankOne) {
  std::mt19937 random(3);
  for (const double strength : {1e-6, 1e-2, 1.0, 30.0})
    for (int repetition = 0; repetition < 10; ++repetition) {
      SCOPED_TRACE(strength);
      expect_spectrum(random_problem(random, 12, 5, strength), 1e-11);
    }
}

// Booms that are alike: eigenvalues that differ by round-off.
TEST(Secular, PolesMayBeAlike) {
  std::mt19937 random(5);
  Problem p = random_problem(random, 10, 3, 0.5);
  p.lambda[1] = p.lambda[0] * (1 + 1e-15);
  p.lambda[3] = p.lambda[2] * (1 - 4e-15);
  p.lambda[11] = p.lambda[10] * (1 + 1e-13);
  p.lambda[5] = p.lambda[4] * (1 + 1e-12), p.lambda[6] = p.lambda[4] * (1 - 3e-12);
  expect_spectrum(p, 1e-11);
}

// An oscillator that is damped more and more has two real roots, and back.
TEST(Secular, PairsBecomeRealAndRealOnesPairs) {
  const auto changed = [](const VectorXcd& lambda, double w, double v) {
    const Index m = lambda.size();
    Problem p{lambda, VectorXd::Zero(2 * m), VectorXd::Zero(2 * m)};
    p.w.head(m).setConstant(w), p.v.head(m).setConstant(v);
    if (m == 2) p.w[1] = -w;
    expect_spectrum(p, 1e-12);
    return rank_one_spectrum(p.lambda, p.w, p.v).lambda;
  };
  // (-1 - mu)^2 + 1 = -w v (-1 - mu) has real roots beyond |w v| = 2.
  EXPECT_EQ(changed(VectorXcd::Constant(1, Complex(-1, 1)), 2, -1.5).imag().norm(), 0);
  const VectorXcd pair = changed((VectorXcd(2) << Complex(-1), Complex(-2)).finished(), -1, 30);
  ASSERT_EQ(pair.size(), 1);
  EXPECT_GT(pair[0].imag(), 1);
}

TEST(Secular, NoFullSetOfEigenvectorsIsRefused) {
  // As above at |w v| = 2: a double root.
  Problem p{VectorXcd::Constant(1, Complex(-1, 1)), VectorXd::Zero(2), VectorXd::Zero(2)};
  p.w[0] = 2, p.v[0] = -1;
  EXPECT_THROW(rank_one_spectrum(p.lambda, p.w, p.v), NumericalError);
  // Two poles in one place.
  p = {VectorXcd::Constant(2, Complex(-1, 1)), VectorXd::Ones(4), VectorXd::Ones(4)};
  EXPECT_THROW(rank_one_spectrum(p.lambda, p.w, p.v), NumericalError);
}

}  // namespace
}  // namespace flexboom
