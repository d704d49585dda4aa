#include "reduction/invariants/certificate.hpp"

#include "reduction/basis/body_shapes.hpp"
#include "reduction/basis/mode_selection.hpp"
#include "reduction/basis/reduced_matrices.hpp"
#include "reduction/basis/static_shapes.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "reduction/invariants/uniform_beam.hpp"

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double sum_round_off = 1e-11;  // of sums over many points, relative to the largest of their kind
constexpr double orthogonal = 1e-7;      // what eigen-solvers leave between modes: vectors good to 1e-6 of each other
constexpr double static_error = 1e-8;    // of a static response that the basis holds

/// value <= reference, or equal to `slack` of it.
BodyCheck at_most(std::string name, double value, double reference, double slack) {
  return {std::move(name), value, reference, std::abs(value / reference - 1), value <= (1 + slack) * reference};
}

/// A size that must vanish, relative to its scale.
BodyCheck vanishing(std::string name, double size, double limit) {
  return {std::move(name), size, 0, size, size <= limit};
}

bool is_rigid(const Coordinate& c) { return c.kind == name_of(ModeKind::rigid); }

bool all_modes(const ReducedBody& body) {
  return std::ranges::all_of(
      body.coordinates, [](const Coordinate& c) { return c.interface.empty() && (c.frequency_hz > 0 || is_rigid(c)); });
}

/// The coordinates that store strain energy: round-off of the others has no scale.
std::vector<int> elastic(const ReducedBody& body) {
  std::vector<int> list;
  for (int k = 0; k < body.n(); ++k)
    if (!is_rigid(body.coordinates[static_cast<size_t>(k)])) list.push_back(k);
  return list;
}

void add_bessel(std::vector<BodyCheck>& checks, const ReducedBody& body) {
  double largest = 0;
  for (Index k = 0; k < body.n(); ++k)
    largest = std::max(largest, body.Ct.col(k).squaredNorm() / (body.m * body.Me(k, k)));
  checks.push_back(at_most("Bessel: |Ct_k|^2 / (m Me_kk)", largest, 1, sum_round_off));
  const MatrixXd C = rigid_coupling(body);
  const MatrixXd M = rigid_mass(body);
  // Scaled so that kilograms and their moments weigh alike.
  const VectorXd scale = M.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const MatrixXd left = M - C * Eigen::LDLT<MatrixXd>(body.Me).solve(MatrixXd(C.transpose()));
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(scale.asDiagonal() * left * scale.asDiagonal()),
                                                      Eigen::EigenvaluesOnly);
  const double lowest = eigen.eigenvalues()(0);
  BodyCheck left_over =
      vanishing("inertia left to the body by all coordinates, lowest share", std::max(0.0, -lowest), 1e-9);
  left_over.value = lowest;
  checks.push_back(std::move(left_over));
}

/// Largest entry off the diagonal of a matrix, relative to the diagonal.
double coupling(const MatrixXd& A) {
  double largest = 0;
  for (Index j = 0; j < A.cols(); ++j) {
    for (Index i = 0; i < j; ++i)
      largest = std::max(largest, std::abs(A(i, j)) / std::sqrt(std::abs(A(i, i) * A(j, j))));
  }
  return largest;
}

void add_identities(std::vector<BodyCheck>& checks, const ReducedBody& body) {
  double Cr1 = 0, J2 = 0;
  for (Index k = 0; k < body.n(); ++k) {
    for (Index l = 0; l < body.n(); ++l) {
      const double scale = std::sqrt(body.Me(k, k) * body.Me(l, l));
      const auto kk = static_cast<size_t>(k), ll = static_cast<size_t>(l);
      Cr1 = std::max(Cr1, (body.Cr1[kk].col(l) + body.Cr1[ll].col(k)).cwiseAbs().maxCoeff() / scale);
      J2 = std::max(J2, std::abs(body.J2[kk][ll].trace() - 2 * body.Me(k, l)) / scale);
    }
  }
  checks.push_back(vanishing("Cr1[k] e_l + Cr1[l] e_k", Cr1, sum_round_off));
  checks.push_back(vanishing("tr J2 - 2 Me", J2, sum_round_off));
}

void add_mean_axes(std::vector<BodyCheck>& checks, const ReducedBody& body) {
  double Ct = 0, Cr0 = 0;
  for (Index k = 0; k < body.n(); ++k) {
    Ct = std::max(Ct, body.Ct.col(k).norm() / std::sqrt(body.m * body.Me(k, k)));
    Cr0 = std::max(Cr0, body.Cr0.col(k).norm() / std::sqrt(body.J0.trace() * body.Me(k, k)));
  }
  constexpr double round_off = 1e-11;  // of static shapes, too, which are differences
  checks.push_back(vanishing("mean axes: Ct", Ct, round_off));
  checks.push_back(vanishing("mean axes: Cr0", Cr0, round_off));
}

/// Six rigid motions of a mesh store no strain energy: against what their displacements would store if every freedom
/// were alone.
void add_rigid_energy(std::vector<BodyCheck>& checks, const Mesh& mesh, const Assembly& assembly, int threads) {
  const MatrixXd T = rigid_motions(mesh, assembly.dofs);
  const VectorXd energy = strain_energies(mesh, assembly.dofs, T, threads);
  const VectorXd K = assembly.K.diagonal();
  const VectorXd alone = T.cwiseAbs2().transpose() * K / 2;
  checks.push_back(vanishing("strain energy of six rigid motions", energy.cwiseQuotient(alone).maxCoeff(), 1e-12));
}

/// Displacements of unit forces at a marker by the body and by the full model.
void add_static_response(std::vector<BodyCheck>& checks, const ReducedBody& body, const Mesh& mesh, const DofMap& dofs,
                         const Unknowns& left, const StaticSolver& statics, const std::vector<std::string>& exact_at,
                         int threads) {
  const Eigen::LDLT<MatrixXd> Ke(body.Ke);
  constexpr std::array axes = {'x', 'y', 'z'};
  std::vector<Eigen::Matrix3d> of_full_model;  // per marker; zero where the mesh has no such set
  double largest = 0;
  for (const Marker& marker : body.markers) {
    Eigen::Matrix3d& full = of_full_model.emplace_back(Eigen::Matrix3d::Zero());
    const auto set = mesh.node_sets.find(marker.name);
    if (set == mesh.node_sets.end()) continue;
    const MatrixXd f = mean_motion(mesh, dofs, set->second).loads(dofs.count).leftCols<3>();
    const MatrixXd u = left.expanded(statics.loaded(left.reduced_loads(f)));
    // 2 f^T u - u^T K u with the energy summed over strain points has the square of the error of u.
    full = f.transpose() * u + u.transpose() * f - reduced_stiffness(mesh, dofs, u, threads);
    largest = std::max(largest, full.trace());
  }
  for (size_t i = 0; i < body.markers.size(); ++i) {
    const Marker& marker = body.markers[i];
    const Eigen::Matrix3d& full = of_full_model[i];
    const MatrixXd own = marker.S * Ke.solve(marker.S.transpose());
    const bool exact = std::ranges::find(exact_at, marker.name) != exact_at.end();
    for (int c = 0; c < 3; ++c) {
      if (!(full(c, c) > std::max(1e-12 * full.trace(), 1e-15 * largest))) continue;  // held
      BodyCheck check =
          at_most(fmt::format("unit force at {} along {}: displacement", marker.name, axes[static_cast<size_t>(c)]),
                  own(c, c), full(c, c), static_error);
      if (exact) check.passed = check.relative_error <= static_error;
      checks.push_back(std::move(check));
    }
  }
}

}  // namespace

std::vector<BodyCheck> body_checks(const ReducedBody& body) {
  std::vector<BodyCheck> checks;
  if (body.n() == 0) return checks;
  add_bessel(checks, body);
  add_identities(checks, body);
  if (body.frame == "mean-axis") add_mean_axes(checks, body);
  if (all_modes(body)) {
    checks.push_back(vanishing("Me off its diagonal", coupling(body.Me), orthogonal));
    const std::vector<int> list = elastic(body);
    checks.push_back(vanishing("Ke off its diagonal", coupling(body.Ke(list, list)), orthogonal));
  }
  return checks;
}

std::vector<BodyCheck> certificate(const ReducedBody& body, const Mesh& mesh, const Assembly& assembly,
                                   const Clamp& clamp, const ModalBasis& basis,
                                   const std::vector<std::string>& exact_at, int threads, const StaticSolver* statics) {
  std::vector<BodyCheck> checks = check_invariants(body, mesh, assembly, basis);
  add_rigid_energy(checks, mesh, assembly, threads);
  if (body.n() > 0 && body.frame == "clamped") {
    const Unknowns left = unknowns(mesh, assembly.dofs, clamp);
    std::optional<StaticSolver> own;
    if (statics == nullptr) statics = &own.emplace(static_solver(mesh, assembly, left));
    add_static_response(checks, body, mesh, assembly.dofs, left, *statics, exact_at, threads);
  }
  for (const std::vector<BodyCheck>& more :
       {check_uniform_beam(body, mesh, assembly.dofs, clamp, basis), body_checks(body)})
    checks.insert(checks.end(), more.begin(), more.end());
  return checks;
}

}  // namespace flexboom
