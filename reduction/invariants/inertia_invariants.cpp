#include "reduction/invariants/inertia_invariants.hpp"

#include "fem/base/check.hpp"
#include "reduction/basis/body_shapes.hpp"
#include "reduction/basis/reduced_matrices.hpp"
#include "reduction/body/tilde.hpp"
#include "reduction/invariants/root_loads.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// ---- checks by independent routes: the definitions with tilde matrices, a finer quadrature, rigid motions and M ----

/// Adds one mass point to a body, each integral as section 4 of README.md defines it.
void add_by_definition(ReducedBody& sum, double dm, const Vector3d& u0, const Matrix3Xd& S) {
  const Matrix3d U = tilde(u0);
  sum.m += dm;
  sum.mc0 += dm * u0;
  sum.J0 -= dm * U * U;
  sum.Ct += dm * S;
  sum.Cr0 += dm * U * S;
  sum.Me += dm * S.transpose() * S;
  for (Index k = 0; k < S.cols(); ++k) {
    const auto kk = static_cast<size_t>(k);
    const Matrix3d S_k = tilde(S.col(k));
    sum.Cr1[kk] += dm * S_k * S;
    sum.J1[kk] -= dm * (U * S_k + S_k * U);
    for (Index l = 0; l < S.cols(); ++l) {
      const Matrix3d S_l = tilde(S.col(l));
      sum.J2[kk][static_cast<size_t>(l)] -= dm / 2 * (S_k * S_l + S_l * S_k);
    }
  }
}

/// The body over the coordinates p of q = R p. A point costs n^2 tilde matrices. So the invariants of a body with many
/// coordinates are checked on a few combinations of all of them. The combinations have signs at random, and each
/// coordinate in them is scaled to unit mass. No entry can be wrong without being seen in one, unless two errors
/// cancel.
struct Sample {
  MatrixXd R;  // n x few
  ReducedBody body;
};

constexpr Index sampled_coordinates = 3;

Sample sample(const ReducedBody& body) {
  const Index n = body.n();
  if (n <= sampled_coordinates) return {MatrixXd::Identity(n, n), body};
  std::mt19937 generator(2020);
  Sample s{MatrixXd(n, sampled_coordinates), blank_body(body.name, sampled_coordinates)};
  for (double& value : s.R.reshaped()) value = generator() % 2 == 0 ? 1 : -1;
  s.R = body.Me.diagonal().cwiseSqrt().cwiseInverse().asDiagonal() * s.R;
  ReducedBody& b = s.body;
  b.m = body.m, b.mc0 = body.mc0, b.J0 = body.J0;
  b.Ct = body.Ct * s.R;
  b.Cr0 = body.Cr0 * s.R;
  b.Me = s.R.transpose() * body.Me * s.R;
  for (Index k = 0; k < n; ++k) {
    const auto kk = static_cast<size_t>(k);
    const Matrix3Xd Cr1 = body.Cr1[kk] * s.R;
    for (size_t a = 0; a < sampled_coordinates; ++a) {
      const double R_a = s.R(k, static_cast<Index>(a));
      b.Cr1[a] += R_a * Cr1;
      b.J1[a] += R_a * body.J1[kk];
      for (size_t c = 0; c < sampled_coordinates; ++c) {
        for (Index l = 0; l < n; ++l)
          b.J2[a][c] += R_a * s.R(l, static_cast<Index>(c)) * body.J2[kk][static_cast<size_t>(l)];
      }
    }
  }
  return s;
}

/// By definition: the invariants of the body at rest, and frozen in the shape u0 + S q, where its m, mc0, J0 and Cr0
/// are m, mc(q), J(q), Cr(q). `finer`: quadrature points per direction above the rule that made the body.
std::pair<ReducedBody, ReducedBody> integrate(const Mesh& mesh, const DofMap& dofs, const MatrixXd& Phi,
                                              const VectorXd& q, int finer) {
  ReducedBody rest = blank_body("check", static_cast<int>(Phi.cols())), deformed = rest;
  for_each_mass_point(
      mesh, dofs,
      [&](double dm, const Vector3d& u0, const auto& N, std::span<const int> point_dofs) {
        const Matrix3Xd S = N * Phi(point_dofs, Eigen::all);
        add_by_definition(rest, dm, u0, S);
        add_by_definition(deformed, dm, u0 + S * q, S);
      },
      finer);
  return {rest, deformed};
}

/// How much finer a quadrature can check the body: by 3 points, or by none where elements integrate their mass
/// approximately (hex20-reduced, tet10, wedge15; hex20 whose faces are not parallel). Seen on the kinetic energy of a
/// seeded field.
int finer_quadrature(const Mesh& mesh, const DofMap& dofs) {
  std::mt19937 generator(2020);
  VectorXd v(dofs.count);
  for (double& value : v) value = static_cast<double>(generator()) / 4294967296.0 - 0.5;
  constexpr int finer = 3;
  const auto energy = [&](int extra) {
    double sum = 0;
    for_each_mass_point(
        mesh, dofs,
        [&](double dm, const Vector3d&, const auto& N, std::span<const int> point_dofs) {
          sum += dm * Vector3d(N * v(point_dofs)).squaredNorm();
        },
        extra);
    return sum;
  };
  const double own = energy(0);
  return std::abs(own - energy(finer)) < 1e-9 * own ? finer : 0;
}

/// Largest deviation of A from B, relative to the largest entry of B, or to `bound` where B is zero by symmetry
/// (bound: what Cauchy-Schwarz allows such an integral to be).
class CheckList {
 public:
  explicit CheckList(double tolerance) : tolerance_(tolerance) {}

  /// `slack`: times the tolerance of all.
  void compare(const std::string& name, const MatrixXd& A, const MatrixXd& B, double bound, double slack = 1) {
    if (A.size() == 0) return;
    Index row = 0;
    Index col = 0;
    const double deviation = (A - B).cwiseAbs().maxCoeff(&row, &col);
    const double largest = B.cwiseAbs().maxCoeff();
    const double error = deviation / (largest > 1e-3 * bound ? largest : bound);
    checks_.push_back({name, A(row, col), B(row, col), error, error <= slack * tolerance_});
  }

  std::vector<BodyCheck> take() { return std::move(checks_); }

 private:
  double tolerance_;
  std::vector<BodyCheck> checks_;
};

/// n matrices side by side, so that a family of invariants is one check.
template <class Matrices>
MatrixXd side_by_side(const Matrices& family) {
  if (family.empty()) return {};
  const Index cols = family.front().cols();
  MatrixXd all(3, cols * std::ssize(family));
  for (Index k = 0; k < std::ssize(family); ++k) all.middleCols(k * cols, cols) = family[static_cast<size_t>(k)];
  return all;
}

MatrixXd side_by_side(const std::vector<std::vector<Matrix3d>>& family) {
  std::vector<Matrix3d> flat;
  for (const auto& row : family) flat.insert(flat.end(), row.begin(), row.end());
  return side_by_side(flat);
}

struct Scales {
  double first = 0;    // m L
  double inertia = 0;  // largest moment
  double modal = 0;    // largest Me
};

Scales scales_of(const ReducedBody& body) {
  const double inertia = body.J0.diagonal().maxCoeff();
  return {std::sqrt(body.m * inertia), inertia, body.n() > 0 ? body.Me.diagonal().maxCoeff() : 0};
}

/// Elements of a beam that are far shorter than deep have rotary inertia in M that is many times their mass, and
/// cancels in the mass: its round-off stays. Terms a thousand times their sum are within the tolerance.
double slack_of_cancellation(const Eigen::SparseMatrix<double>& M, const MatrixXd& translations, const Vector3d& mass) {
  constexpr double usual = 1e-3;
  const MatrixXd sizes = translations.cwiseAbs();
  const MatrixXd terms = sizes.transpose() * symmetric_product(M.cwiseAbs(), sizes);
  return std::max(1.0, usual * terms.diagonal().cwiseQuotient(mass).maxCoeff());
}

/// Rigid motions T and the assembled M: T^T M T and T^T M Phi hold all integrals up to first order in S.
/// Returns the slack of sums over M.
double check_by_rigid_motions(CheckList& list, const ReducedBody& body, const Mesh& mesh, const Assembly& assembly,
                              const ModalBasis& basis) {
  const Scales s = scales_of(body);
  const MatrixXd T = rigid_motions(mesh, assembly.dofs);
  const MatrixXd M_T = symmetric_product(assembly.M, T);
  const MatrixXd rigid = T.transpose() * M_T;
  const MatrixXd coupling = M_T.transpose() * basis.Phi;
  const double slack = slack_of_cancellation(assembly.M, T.leftCols<3>(), rigid.diagonal().head<3>());
  list.compare("m = t^T M t", body.m * Matrix3d::Identity(), rigid.topLeftCorner<3, 3>(), body.m, slack);
  list.compare("mc0 = t^T M r", -tilde(body.mc0), rigid.topRightCorner<3, 3>(), s.first, slack);
  list.compare("J0 = r^T M r", body.J0, rigid.bottomRightCorner<3, 3>(), s.inertia, slack);
  list.compare("Ct = t^T M Phi", body.Ct, coupling.topRows(3), std::sqrt(body.m * s.modal), slack);
  list.compare("Cr0 = r^T M Phi", body.Cr0, coupling.bottomRows(3), std::sqrt(s.inertia * s.modal), slack);
  list.compare("Me = Phi^T M Phi", body.Me, quadratic_form(assembly.M, basis.Phi), s.modal, slack);
  return slack;
}

/// Each integral as it is defined, by `quadrature`, which is finer than the body's where there is one that can check
/// it.
void check_by_quadrature(CheckList& list, const ReducedBody& body, const ReducedBody& finer,
                         const std::string& quadrature) {
  const Scales s = scales_of(body);
  list.compare("m, " + quadrature, MatrixXd::Constant(1, 1, body.m), MatrixXd::Constant(1, 1, finer.m), body.m);
  list.compare("mc0, " + quadrature, body.mc0, finer.mc0, s.first);
  list.compare("J0, " + quadrature, body.J0, finer.J0, s.inertia);
  list.compare("Ct, " + quadrature, body.Ct, finer.Ct, std::sqrt(body.m * s.modal));
  list.compare("Cr0, " + quadrature, body.Cr0, finer.Cr0, std::sqrt(s.inertia * s.modal));
  list.compare("Cr1, " + quadrature, side_by_side(body.Cr1), side_by_side(finer.Cr1), s.modal);
  list.compare("Me, " + quadrature, body.Me, finer.Me, s.modal);
  list.compare("J1, " + quadrature, side_by_side(body.J1), side_by_side(finer.J1), std::sqrt(s.inertia * s.modal));
  list.compare("J2, " + quadrature, side_by_side(body.J2), side_by_side(finer.J2), s.modal);
}

/// mc(q), J(q) and Cr(q) from the invariants against the integrals over the deformed body.
void check_deformed(CheckList& list, const ReducedBody& body, const VectorXd& q, const ReducedBody& deformed) {
  const auto& [mc, J, Cr] = deformed_inertia(body, q);
  const Scales s = scales_of(deformed);
  list.compare("mc(q) of the deformed body", mc, deformed.mc0, s.first);
  list.compare("J(q) of the deformed body", J, deformed.J0, s.inertia);
  list.compare("Cr(q) of the deformed body", Cr, deformed.Cr0, std::sqrt(s.inertia * s.modal));
}

/// Rayleigh quotients of the coordinates that have a frequency.
void check_frequencies(CheckList& list, const ReducedBody& body, const VectorXd& omega, double slack) {
  std::vector<int> modes;
  for (int k = 0; k < body.n(); ++k) {
    if (omega(k) > 0) modes.push_back(k);
  }
  const VectorXd squares = body.Ke.diagonal().cwiseQuotient(body.Me.diagonal())(modes);
  const VectorXd expected = omega(modes).cwiseAbs2();
  constexpr double of_many = 10;  // sixty modes of a strip leave 2e-12
  list.compare("Ke = omega^2 Me", squares.cwiseQuotient(expected), VectorXd::Ones(std::ssize(modes)), 1,
               of_many * slack);
}

/// A seeded q that moves the body by about its own size, so that every order of q counts.
VectorXd large_deformation(const ReducedBody& body) {
  std::mt19937 generator(2020);
  VectorXd q(body.n());
  for (Index k = 0; k < q.size(); ++k) {
    const double size = std::sqrt(body.J0.trace() / std::max(body.Me(k, k), 1e-300));
    q(k) = size * (static_cast<double>(generator()) / 4294967296.0 - 0.5);
  }
  return q;
}

}  // namespace

ReducedBody reduce(const Mesh& mesh, const Assembly& assembly, const ModalBasis& basis, std::string name, int threads) {
  require(basis.Phi.rows() == assembly.dofs.count, "reduce: the basis belongs to another mesh (" +
                                                       std::to_string(basis.Phi.rows()) + " freedoms, the mesh has " +
                                                       std::to_string(assembly.dofs.count) + ")");
  ReducedBody body = blank_body(std::move(name), static_cast<int>(basis.Phi.cols()));
  const auto is_beam = [](const Element& element) { return type_of(element).shape == Shape::line; };
  body.structure = std::ranges::all_of(mesh.elements, is_beam) ? "beam" : "solid";
  body.frame = basis.rigid_freedoms > 0 ? "free" : basis.frame;
  body.full_freedoms = basis.unknowns;
  set_invariants(body, gram_matrix(mesh, assembly, basis.Phi, threads));
  body.Ke = reduced_stiffness(mesh, assembly.dofs, basis.Phi, threads);
  body.coordinates = basis.coordinates.empty() ? mode_table(basis) : basis.coordinates;
  body.interfaces = basis.interfaces;
  body.markers = body_markers(mesh, assembly.dofs, basis);
  body.display = display_shape(mesh, assembly.dofs, basis.Phi);
  body.validate();
  return body;
}

std::vector<BodyCheck> check_invariants(const ReducedBody& body, const Mesh& mesh, const Assembly& assembly,
                                        const ModalBasis& basis, double tolerance) {
  CheckList list(tolerance);
  const double slack = check_by_rigid_motions(list, body, mesh, assembly, basis);
  const int finer = finer_quadrature(mesh, assembly.dofs);
  const Sample some = sample(body);
  const VectorXd q = large_deformation(some.body);
  const auto [rest, deformed] = integrate(mesh, assembly.dofs, basis.Phi * some.R, q, finer);
  check_by_quadrature(list, some.body, rest, finer > 0 ? "finer quadrature" : "by definition");
  if (body.n() > 0) {
    check_deformed(list, some.body, q, deformed);
    check_frequencies(list, body, basis.omega, slack);
  }
  return list.take();
}

}  // namespace flexboom
