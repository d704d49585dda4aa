#include "dynamics/numerics/spectrum.hpp"

#include "dynamics/numerics/method_failure.hpp"
#include "dynamics/numerics/secular.hpp"
#include "dynamics/numerics/small_product.hpp"
#include "fem/base/check.hpp"
#include "fem/linear_algebra/dense.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace flexboom {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

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

}  // namespace

Spectrum spectrum_of(MatrixXd L) {
  const VectorXd D = balance(L);
  const RealEigenvectors eigen = eigenvectors(L);
  const MatrixXd inverse = flexboom::inverse(eigen.vectors);
  const double growth =
      eigen.vectors.cwiseAbs().rowwise().sum().maxCoeff() * inverse.cwiseAbs().rowwise().sum().maxCoeff();
  if (!(growth < 1e10))
    throw MethodFailure(
        fmt::format("exponential: the Jacobian has no full set of eigenvectors ({:.2g}); try bdf", growth));
  const Index m = (eigen.imaginary.array() >= 0).count();
  Spectrum s{Eigen::VectorXcd(m), MatrixXd::Zero(L.rows(), 2 * m), MatrixXd::Zero(2 * m, L.rows())};
  const Index pairs = (eigen.imaginary.array() > 0).count();
  for (Index k = 0, pair = 0, alone = pairs; k < L.rows(); ++k) {
    const bool is_pair = eigen.imaginary[k] > 0;
    const Index i = is_pair ? pair++ : alone++;
    const double twice = is_pair ? 2 : 1;
    s.lambda[i] = {eigen.real[k], eigen.imaginary[k]};
    s.from_modes.col(i) = twice * D.cwiseProduct(eigen.vectors.col(k));
    s.to_modes.row(i) = inverse.row(k).cwiseQuotient(twice * D.transpose());
    if (!is_pair) continue;
    ++k;
    s.from_modes.col(m + i) = -twice * D.cwiseProduct(eigen.vectors.col(k));
    s.to_modes.row(m + i) = -inverse.row(k).cwiseQuotient(twice * D.transpose());
  }
  return s;
}

Spectrum with_column(const Spectrum& s, const VectorXd& d, int column) {
  // In the eigenvectors of L that is diagonal plus (W d) (e^T V), and only a block of it is worth another
  // decomposition. A coupling this small beside the eigenvalues, or beside what motion is slow, is left to the
  // remainder.
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
  for (const Index i : block) entries.push_back(m + i);
  const Spectrum inner = rank_one_spectrum(s.lambda(block), w(entries), v(entries));

  const Index n = s.from_modes.rows(), changed = inner.lambda.size(), same = std::ssize(rest), all = changed + same;
  Eigen::VectorXcd lambda(all);  // those that changed, then the others
  lambda << inner.lambda, s.lambda(rest);
  MatrixXd from(n, 2 * changed), to(2 * changed, n);
  small_product(MatrixXd(s.from_modes(Eigen::all, entries)), inner.from_modes, from);
  small_product(inner.to_modes, MatrixXd(s.to_modes(entries, Eigen::all)), to);
  Spectrum r{Eigen::VectorXcd(all), MatrixXd(n, 2 * all), MatrixXd(2 * all, n)};
  for (Index i = 0, pair = 0, alone = (lambda.imag().array() != 0).count(); i < all; ++i) {
    const Index place = lambda[i].imag() != 0 ? pair++ : alone++;
    r.lambda[place] = lambda[i];
    for (const Index half : {0, 1}) {
      if (i < changed) {
        r.from_modes.col(half * all + place) = from.col(half * changed + i);
        r.to_modes.row(half * all + place) = to.row(half * changed + i);
      } else {
        const Index old = half * m + rest[static_cast<size_t>(i - changed)];
        r.from_modes.col(half * all + place) = s.from_modes.col(old);
        r.to_modes.row(half * all + place) = s.to_modes.row(old);
      }
    }
  }
  return r;
}

}  // namespace flexboom
