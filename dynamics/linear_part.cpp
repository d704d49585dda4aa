#include "dynamics/linear_part.hpp"

#include "dynamics/phi.hpp"
#include "dynamics/small_product.hpp"
#include "fem/check.hpp"
#include "fem/dense.hpp"
#include "fem/lanes.hpp"

#include <fmt/format.h>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexboom {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int functions = collocation::degree + 4;  // phi_0 .. phi_(degree + 3)

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

/// (zr, zi) = sum over k of b_k times v_k, complex, in halves of m; v_k are the columns z0, M.
FLEXBOOM_FOR_EACH_PROCESSOR
void sum_of_products(Index m, Index terms, const double* b, const double* z0, const double* M, double* z) {
  double* const zr = z;
  double* const zi = z + m;
  for (Index k = 0; k <= terms; ++k) {
    const double* const br = b + 2 * m * k;
    const double* const bi = br + m;
    const double* const vr = k == 0 ? z0 : M + 2 * m * (k - 1);
    const double* const vi = vr + m;
    if (k == 0) {
#pragma GCC ivdep
      for (Index i = 0; i < m; ++i) {
        zr[i] = br[i] * vr[i] - bi[i] * vi[i];
        zi[i] = br[i] * vi[i] + bi[i] * vr[i];
      }
    } else {
#pragma GCC ivdep
      for (Index i = 0; i < m; ++i) {
        zr[i] += br[i] * vr[i] - bi[i] * vi[i];
        zi[i] += br[i] * vi[i] + bi[i] * vr[i];
      }
    }
  }
}

}  // namespace

LinearPart::LinearPart(MatrixXd L, MatrixXd a_hub_by_x, int first_omega, VectorXd base_p)
    : a_hub(std::move(a_hub_by_x)), base(std::move(base_p)) {
  const VectorXd D = balance(L);
  const RealEigenvectors eigen = eigenvectors(L);
  const MatrixXd inverse = eigen.vectors.inverse();
  const double growth =
      eigen.vectors.cwiseAbs().rowwise().sum().maxCoeff() * inverse.cwiseAbs().rowwise().sum().maxCoeff();
  if (!(growth < 1e10))
    throw NumericalError(
        fmt::format("exponential: the Jacobian has no full set of eigenvectors ({:.2g}); try bdf", growth));
  const Index m = (eigen.imaginary.array() >= 0).count();
  lambda.resize(m);
  from_modes.setZero(L.rows(), 2 * m);
  to_modes.setZero(2 * m, L.rows());
  for (Index i = 0, k = 0; i < m; ++i) {
    lambda[i] = {eigen.real[k], eigen.imaginary[k]};
    const bool pair = eigen.imaginary[k] > 0;
    const double twice = pair ? 2 : 1;
    from_modes.col(i) = twice * D.cwiseProduct(eigen.vectors.col(k));
    to_modes.row(i) = inverse.row(k).cwiseQuotient(twice * D.transpose());
    ++k;
    if (!pair) continue;
    from_modes.col(m + i) = -twice * D.cwiseProduct(eigen.vectors.col(k));
    to_modes.row(m + i) = -inverse.row(k).cwiseQuotient(twice * D.transpose());
    ++k;
  }
  lambda_re_ = lambda.real();
  lambda_im_ = lambda.imag();
  if (first_omega < 0) return;
  omega_modes = from_modes.middleRows<3>(first_omega);
  a_hub_modes = a_hub * from_modes;
  drift_modes = omega_modes;
  for (Index i = 0; i < m; ++i)
    if (std::abs(lambda[i]) > 1e-9 * L.norm()) drift_modes.col(i).setZero(), drift_modes.col(m + i).setZero();
}

void LinearPart::remainder(const Eigen::Ref<const MatrixXd>& F, const Eigen::Ref<const MatrixXd>& Z,
                           Eigen::Ref<MatrixXd> N) const {
  const Index m = lambda.size();
  small_product(to_modes, F, N);
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
  sum_of_products(lambda.size(), M.cols(), b.col(shift).data(), z0.data(), M.data(), z.data());
}

}  // namespace flexboom
