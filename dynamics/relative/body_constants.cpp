#include "dynamics/relative/body_constants.hpp"

#include "reduction/body/diagonal.hpp"
#include "reduction/body/tilde.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using spatial::vec3;
using spatial::Vec3;

namespace {

std::vector<Vec3<double>> pack_columns(const Eigen::Matrix3Xd& m) {
  std::vector<Vec3<double>> r;
  for (Eigen::Index k = 0; k < m.cols(); ++k) r.push_back(vec3(m.col(k)));
  return r;
}

std::vector<double> row_major(const MatrixXd& m) {
  std::vector<double> r;
  for (Eigen::Index i = 0; i < m.rows(); ++i)
    for (Eigen::Index j = 0; j < m.cols(); ++j) r.push_back(m(i, j));
  return r;
}

/// Entries below this share of the largest of their kind are round-off of the reduction.
constexpr double negligible = 1e-14;

/// Non-zeros of a family of matrices A[k] (or A[k][l]); `entry(k, l, component)` reads it.
template <class Entry>
std::vector<equations::Term> non_zeros(int n, int second, int components, Entry entry) {
  double largest = 0;
  std::vector<equations::Term> terms;
  for (int k = 0; k < n; ++k)
    for (int l = 0; l < second; ++l)
      for (int c = 0; c < components; ++c) {
        terms.push_back({k, l, c, entry(static_cast<size_t>(k), l, c)});
        largest = std::max(largest, std::abs(terms.back().value));
      }
  std::erase_if(terms, [=](const equations::Term& t) { return std::abs(t.value) <= negligible * largest; });
  return terms;
}

double symmetric_entry(const Matrix3d& m, int component) {
  constexpr int row[] = {0, 1, 2, 0, 1, 2}, column[] = {0, 1, 2, 1, 2, 0};
  return m(row[component], column[component]);
}

}  // namespace

void pack_integrals(const ReducedBody& b, equations::Body& r) {
  r.n = b.n();
  r.m = b.m;
  r.mc0 = vec3(b.mc0);
  r.J0 = spatial::sym3(b.J0);
  r.Ct = pack_columns(b.Ct);
  r.Cr0 = pack_columns(b.Cr0);
  r.J1 = equations::Rows<double>(
      non_zeros(1, r.n, 6, [&](size_t, int l, int c) { return symmetric_entry(b.J1[static_cast<size_t>(l)], c); }));
  r.J2 = equations::Rows<double>(non_zeros(
      r.n, r.n, 6, [&](size_t k, int l, int c) { return symmetric_entry(b.J2[k][static_cast<size_t>(l)], c); }));
  r.Cr1 = equations::Rows<double>(non_zeros(r.n, r.n, 3, [&](size_t k, int l, int c) { return b.Cr1[k](c, l); }));
  r.Cr1_by_l = equations::Rows<double>(non_zeros(r.n, r.n, 3, [&](size_t l, int k, int c) {
    return b.Cr1[static_cast<size_t>(k)](c, static_cast<Eigen::Index>(l));
  }));
}

void pack_structure(const ReducedBody& b, equations::Body& r) {
  r.Ke = row_major(b.Ke);
  r.De = row_major(b.De);
  r.Me = row_major(b.Me);
  r.diagonal = is_diagonal(b.Ke) && is_diagonal(b.De) && is_diagonal(b.Me);
  const MatrixXd Me_inverse = r.n ? MatrixXd(b.Me.llt().solve(MatrixXd::Identity(r.n, r.n))) : MatrixXd(0, 0);
  r.Me_inverse = row_major(0.5 * (Me_inverse + Me_inverse.transpose()));
  r.Gt = pack_columns(b.Ct * Me_inverse);
  r.Ctt = r.n ? spatial::sym3(b.Ct * Me_inverse * b.Ct.transpose()) : spatial::Sym3<double>{};
}

void pack_invariants(const ReducedBody& b, equations::Body& r) {
  pack_integrals(b, r);
  pack_structure(b, r);
}

std::vector<equations::Term> packed_vector_family(const std::vector<MatrixXd>& components) {
  if (components.empty()) return {};
  const auto n = static_cast<int>(components[0].rows());
  return non_zeros(n, n, static_cast<int>(components.size()),
                   [&](size_t k, int l, int c) { return components[static_cast<size_t>(c)](static_cast<int>(k), l); });
}

ReducedBody seen_from(const ReducedBody& b, const Vector3d& d, const Matrix3d& axes) {
  const Matrix3d to = axes.transpose(), td = tilde(d);
  ReducedBody r;
  r.name = b.name, r.structure = b.structure, r.frame = b.frame;
  r.m = b.m;
  r.mc0 = to * (b.mc0 - b.m * d);
  // -rho tilde(u0 - d)^2
  const Matrix3d tc = tilde(b.mc0);
  r.J0 = to * (b.J0 + td * tc + tc * td - b.m * td * td) * axes;
  r.J0 = (0.5 * (r.J0 + r.J0.transpose())).eval();
  r.Ct = to * b.Ct;
  r.Cr0 = to * (b.Cr0 - td * b.Ct);
  for (size_t k = 0; k < b.Cr1.size(); ++k) {
    r.Cr1.emplace_back(to * b.Cr1[k]);
    const Matrix3d tk = tilde(b.Ct.col(static_cast<int>(k)));
    r.J1.emplace_back(to * (b.J1[k] + td * tk + tk * td) * axes);
    r.J2.emplace_back();
    for (const Matrix3d& J : b.J2[k]) r.J2[k].emplace_back(to * J * axes);
  }
  r.Me = b.Me, r.Ke = b.Ke, r.De = b.De;
  r.coordinates = b.coordinates;
  for (Marker m : b.markers) {
    m.position = to * (m.position - d);
    m.S = (to * m.S).eval();
    m.S_theta = (to * m.S_theta).eval();
    r.markers.push_back(std::move(m));
  }
  return r;
}

}  // namespace flexboom
