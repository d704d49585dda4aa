#include "dynamics/linear_part.hpp"

#include "dynamics/phi.hpp"
#include "fem/check.hpp"
#include "fem/dense.hpp"
#include "fem/lanes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>
#include <vector>

namespace flexboom {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int functions = collocation::degree + 3;  // phi_0 .. phi_(degree + 2)

/// Powers of two D such that rows and columns of D^-1 L D are of one size (Parlett, Reinsch 1969).
VectorXd balance(MatrixXd& L) {
  VectorXd D = VectorXd::Ones(L.rows());
  for (int round = 0; round < 40; ++round) {
    bool changed = false;
    for (Index i = 0; i < L.rows(); ++i) {
      const double d = std::abs(L(i, i));
      const double row = L.row(i).cwiseAbs().sum() - d, column = L.col(i).cwiseAbs().sum() - d;
      if (row == 0 || column == 0) continue;
      const double f = std::exp2(std::round(0.5 * std::log2(row / column)));
      if (f == 1) continue;
      L.row(i) /= f;
      L.col(i) *= f;
      D[i] *= f;
      changed = true;
    }
    if (!changed) break;
  }
  return D;
}

constexpr Index terms = collocation::points;

/// (zr, zi) = sum over k of b_k times v_k, complex, in halves of m; v_k are the columns z0, M.
FLEXBOOM_FOR_EACH_PROCESSOR
void sum_of_products(Index m, const double* b, const double* z0, const double* M, double* z) {
  double* const zr = z;
  double* const zi = z + m;
#pragma GCC ivdep
  for (Index i = 0; i < m; ++i) {
    double re = b[i] * z0[i] - b[m + i] * z0[m + i], im = b[i] * z0[m + i] + b[m + i] * z0[i];
#pragma GCC unroll 8
    for (Index k = 0; k < terms; ++k) {
      const double br = b[2 * m * (k + 1) + i], bi = b[2 * m * (k + 1) + m + i];
      const double vr = M[2 * m * k + i], vi = M[2 * m * k + m + i];
      re += br * vr - bi * vi;
      im += br * vi + bi * vr;
    }
    zr[i] = re;
    zi[i] = im;
  }
}

Spectrum spectrum_of(MatrixXd L) {
  const VectorXd D = balance(L);
  const RealEigenvectors eigen = eigenvectors(L);
  const MatrixXd inverse = flexboom::inverse(eigen.vectors);
  const double growth =
      eigen.vectors.cwiseAbs().rowwise().sum().maxCoeff() * inverse.cwiseAbs().rowwise().sum().maxCoeff();
  if (!(growth < 1e10))
    throw NumericalError(
        fmt::format("exponential: the Jacobian has no full set of eigenvectors ({:.2g}); try bdf", growth));
  const Index m = (eigen.imaginary.array() >= 0).count();
  Spectrum s{Eigen::VectorXcd(m), MatrixXd::Zero(L.rows(), 2 * m), MatrixXd::Zero(2 * m, L.rows())};
  for (Index i = 0, k = 0; i < m; ++i) {
    s.lambda[i] = {eigen.real[k], eigen.imaginary[k]};
    const bool pair = eigen.imaginary[k] > 0;
    const double twice = pair ? 2 : 1;
    s.from_modes.col(i) = twice * D.cwiseProduct(eigen.vectors.col(k));
    s.to_modes.row(i) = inverse.row(k).cwiseQuotient(twice * D.transpose());
    ++k;
    if (!pair) continue;
    s.from_modes.col(m + i) = -twice * D.cwiseProduct(eigen.vectors.col(k));
    s.to_modes.row(m + i) = -inverse.row(k).cwiseQuotient(twice * D.transpose());
    ++k;
  }
  return s;
}

/// Of L + d e^T, e the unit vector of `column`, from the spectrum of L: in its eigenvectors that is diagonal plus
/// (W d) (e^T V), and only a block of it is worth another decomposition.
Spectrum with_column(const Spectrum& s, const VectorXd& d, int column) {
  // A coupling this small beside the eigenvalues, or beside what motion is slow, is left to the remainder.
  constexpr double coupled = 1e-5, slow = 100;
  const Index m = s.lambda.size();
  const VectorXd w = s.to_modes * d, v = s.from_modes.row(column).transpose();
  VectorXd strength(m);
  for (Index i = 0; i < m; ++i)
    strength[i] =
        std::sqrt(std::hypot(w[i], w[m + i]) * std::hypot(v[i], v[m + i]) / std::max(std::abs(s.lambda[i]), slow));
  std::vector<Index> block, rest;
  const double strongest = strength.maxCoeff();
  for (Index i = 0; i < m; ++i) (strength[i] * strongest > coupled ? block : rest).push_back(i);
  if (block.empty()) return s;

  std::vector<Index> entries = block;  // of z
  for (const Index i : block)
    if (s.lambda[i].imag() != 0) entries.push_back(m + i);
  MatrixXd B = w(entries) * v(entries).transpose();
  for (Index i = 0, pair = std::ssize(block); i < std::ssize(block); ++i) {
    const std::complex<double> lambda = s.lambda[block[static_cast<size_t>(i)]];
    B(i, i) += lambda.real();
    if (lambda.imag() == 0) continue;
    B(pair, pair) += lambda.real();
    B(i, pair) -= lambda.imag();
    B(pair++, i) += lambda.imag();
  }
  const Spectrum inner = spectrum_of(std::move(B));

  const Index n = s.from_modes.rows(), changed = inner.lambda.size(), same = std::ssize(rest), all = changed + same;
  Spectrum r{Eigen::VectorXcd(all), MatrixXd(n, 2 * all), MatrixXd(2 * all, n)};
  r.lambda << inner.lambda, s.lambda(rest);
  MatrixXd from(n, 2 * changed), to(2 * changed, n);
  small_product(MatrixXd(s.from_modes(Eigen::all, entries)), inner.from_modes, from);
  small_product(inner.to_modes, MatrixXd(s.to_modes(entries, Eigen::all)), to);
  for (const Index half : {0, 1}) {
    r.from_modes.middleCols(half * all, changed) = from.middleCols(half * changed, changed);
    r.to_modes.middleRows(half * all, changed) = to.middleRows(half * changed, changed);
    for (Index i = 0; i < same; ++i) {
      const Index old = half * m + rest[static_cast<size_t>(i)];
      r.from_modes.col(half * all + changed + i) = s.from_modes.col(old);
      r.to_modes.row(half * all + changed + i) = s.to_modes.row(old);
    }
  }
  return r;
}

}  // namespace

LinearPart::LinearPart(MatrixXd L_of_x, int omega_in_x, VectorXd base_p)
    : LinearPart(spectrum_of(L_of_x), L_of_x, omega_in_x, std::move(base_p)) {}

LinearPart::LinearPart(const LinearPart& other, MatrixXd L_of_x, int column)
    : LinearPart(with_column(other, L_of_x.col(column) - other.L.col(column), column), L_of_x, other.first_omega,
                 other.base) {}

LinearPart::LinearPart(Spectrum spectrum, MatrixXd L_of_x, int omega_in_x, VectorXd base_p)
    : Spectrum(std::move(spectrum)),
      L(std::move(L_of_x)),
      of_modes(from_modes.transpose()),
      base(std::move(base_p)),
      first_omega(omega_in_x),
      lambda_re_(lambda.real()),
      lambda_im_(lambda.imag()) {
  if (first_omega < 0) return;
  omega_modes = from_modes.middleRows<3>(first_omega);
  drift_modes = omega_modes;
  const Index m = lambda.size();
  const double fastest = lambda.cwiseAbs().maxCoeff();
  for (Index i = 0; i < m; ++i)
    if (std::abs(lambda[i]) > 1e-9 * fastest) drift_modes.col(i).setZero(), drift_modes.col(m + i).setZero();
}

void LinearPart::remainder(const Eigen::Ref<const MatrixXd>& F, const Eigen::Ref<const MatrixXd>& Z,
                           Eigen::Ref<MatrixXd> N) const {
  const Index m = lambda.size();
  to_z(F, N);
  for (Index c = 0; c < N.cols(); ++c) {
    const double *re = Z.col(c).data(), *im = re + m;
    double *n_re = N.col(c).data(), *n_im = n_re + m;
    for (Index i = 0; i < m; ++i) {
      n_re[i] -= lambda_re_[i] * re[i] - lambda_im_[i] * im[i];
      n_im[i] -= lambda_re_[i] * im[i] + lambda_im_[i] * re[i];
    }
  }
}

void LinearPart::point(double c, double h, GridPoint& result) const {
  result.resize(2 * lambda.size(), functions);
  phi_functions(c * h, lambda_re_, lambda_im_, result);
  double power = c;
  for (Index k = 1; k < functions; ++k, power *= c) result.col(k) *= power;
}

void LinearPart::grid(double h, Grid& g) const {
  for (int j = 1; j < collocation::points; ++j) point(collocation::node(j), h, g.at[static_cast<size_t>(j)]);
  for (auto& levels : g.between) levels.clear();
}

Grid& LinearPart::kept_grid(double h) {
  const auto [place, is_new] = grids_.try_emplace(h);
  if (is_new) grid(h, place->second);
  return place->second;
}

const std::vector<GridPoint>& LinearPart::between(Grid& g, double h, int j, int level) const {
  auto& levels = g.between[static_cast<size_t>(j)];
  if (std::ssize(levels) <= level) levels.resize(static_cast<size_t>(level) + 1);
  std::vector<GridPoint>& points = levels[static_cast<size_t>(level)];
  const int parts = 1 << level;
  if (points.empty() && parts > 1) {
    points.resize(static_cast<size_t>(parts) - 1);
    for (int k = 1; k < parts; ++k) point(collocation::between(j, k, parts), h, points[static_cast<size_t>(k) - 1]);
  }
  return points;
}

void LinearPart::combine(const GridPoint& b, int shift, const Eigen::Ref<const VectorXd>& z0, const MatrixXd& M,
                         Eigen::Ref<VectorXd> z) const {
  sum_of_products(lambda.size(), b.col(shift).data(), z0.data(), M.data(), z.data());
}

}  // namespace flexboom
