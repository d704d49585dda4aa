#include "dynamics/numerics/linear_part.hpp"

#include "dynamics/numerics/phi.hpp"
#include "fem/base/lanes.hpp"

#include <utility>

namespace flexboom {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int functions = collocation::degree + 3;  // phi_0 .. phi_(degree + 2)

constexpr Index collocation_terms = collocation::points;

/// (zr, zi) = sum over k of b_k times v_k, complex, in halves of m; v_k are the columns z0, M.
FLEXBOOM_FOR_EACH_PROCESSOR
void sum_of_products(Index m, const double* b, const double* z0, const double* M, double* z) {
  double* const zr = z;
  double* const zi = z + m;
#pragma GCC ivdep
  for (Index i = 0; i < m; ++i) {
    double re = b[i] * z0[i] - b[m + i] * z0[m + i], im = b[i] * z0[m + i] + b[m + i] * z0[i];
#pragma GCC unroll 8
    for (Index k = 0; k < collocation_terms; ++k) {
      const double br = b[2 * m * (k + 1) + i], bi = b[2 * m * (k + 1) + m + i];
      const double vr = M[2 * m * k + i], vi = M[2 * m * k + m + i];
      re += br * vr - bi * vi;
      im += br * vi + bi * vr;
    }
    zr[i] = re;
    zi[i] = im;
  }
}

}  // namespace

LinearPart::LinearPart(const MatrixXd& L_of_x, std::vector<int> omegas_in_x, VectorXd base_state)
    : LinearPart(spectrum_of(L_of_x), L_of_x, std::move(omegas_in_x), std::move(base_state)) {}

LinearPart::LinearPart(const LinearPart& other, MatrixXd L_of_x, int column)
    : LinearPart(with_column(other, L_of_x.col(column) - other.L.col(column), column), L_of_x, other.omegas,
                 other.base) {}

LinearPart::LinearPart(Spectrum spectrum, MatrixXd L_of_x, std::vector<int> omegas_in_x, VectorXd base_state)
    : Spectrum(std::move(spectrum)),
      L(std::move(L_of_x)),
      of_modes(from_modes.transpose()),
      base(std::move(base_state)),
      omegas(std::move(omegas_in_x)),
      fastest(lambda.size() ? lambda.cwiseAbs().maxCoeff() : 0.0),
      lambda_re_(lambda.real()),
      lambda_im_(lambda.imag()),
      used_(lambda.size() + (lambda_im_.array() != 0).count()) {
  if (omegas.empty()) return;
  omega_modes.resize(3 * std::ssize(omegas), from_modes.cols());
  for (size_t i = 0; i < omegas.size(); ++i)
    omega_modes.middleRows<3>(3 * static_cast<Index>(i)) = from_modes.middleRows<3>(omegas[i]);
  drift_modes = omega_modes;
  const Index m = lambda.size();
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
  for (int j = 1; j < collocation::points; ++j) point(collocation::node(j), h, g[static_cast<size_t>(j)]);
}

const Grid& LinearPart::kept_grid(double h) {
  const auto [place, is_new] = grids_.try_emplace(h);
  if (is_new) grid(h, place->second);
  return place->second;
}

const GridPoint& LinearPart::kept_point(double c, double h) {
  const auto [place, is_new] = points_.try_emplace({c, h});
  if (is_new) point(c, h, place->second);
  return place->second;
}

void LinearPart::combine(const GridPoint& b, int shift, const Eigen::Ref<const VectorXd>& z0, const MatrixXd& M,
                         Eigen::Ref<VectorXd> z) const {
  sum_of_products(lambda.size(), b.col(shift).data(), z0.data(), M.data(), z.data());
}

}  // namespace flexboom
