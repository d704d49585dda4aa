#include "reduction/invariants/geometric_stiffness.hpp"

#include "fem/base/check.hpp"
#include "fem/base/parallel.hpp"
#include "fem/linear_algebra/dense.hpp"
#include "fem/mesh/shape_pairs.hpp"
#include "reduction/basis/static_shapes.hpp"
#include "reduction/body/diagonal.hpp"
#include "reduction/body/geometric_stiffness_loads.hpp"

#include <fmt/format.h>
#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Rigid accelerations (6 x loads: translation, rotation about the origin) that loads F on a free body cause; T are its
/// rigid motions.
MatrixXd rigid_accelerations(const MatrixXd& F, const MatrixXd& T, const MatrixXd& MT) {
  return (T.transpose() * MT).completeOrthogonalDecomposition().solve(T.transpose() * F);
}

/// Whether the body is free. @throws InputError when it can move in some ways and not in all: six, of a line mass five.
bool is_free(const Mesh& mesh, const DofMap& dofs, const Clamp& clamp) {
  const int rigid = rigid_freedoms(mesh, dofs, clamp), all = rigid_freedoms(mesh, dofs, Clamp({}, false));
  require(rigid == 0 || rigid == all,
          fmt::format("geometric stiffness: the clamp leaves {} of the {} rigid motions; hold the body, or leave it "
                      "free for inertia relief",
                      rigid, all));
  return rigid > 0;
}

/// Unit loads, what of them is inertia, and the static displacements that they cause.
struct Statics {
  MatrixXd F;           // freedoms x loads
  LinearFields fields;  // 12 x loads
  MatrixXd U0;          // freedoms x loads
};

/// Takes the rigid accelerations of a free body out of its loads, and solves.
void relieve(Statics& statics, const Mesh& mesh, const Assembly& assembly, const Unknowns& left) {
  const MatrixXd T = rigid_motions(mesh, assembly.dofs);
  const MatrixXd MT = symmetric_product(assembly.M, T);
  const MatrixXd x = rigid_accelerations(statics.F, T, MT);
  statics.F -= MT * x;
  statics.fields += inertial_fields().rightCols<6>() * x;  // of -a and -alpha x u0
  const StaticSolver pinned = static_solver(mesh, assembly, left, determinate_support(mesh, assembly.dofs, left));
  statics.U0 = left.expanded(pinned.loaded(left.reduced_loads(statics.F)));
}

/// Displacements of a held body. The digits that the factor of a slender body loses are those of its lowest modes.
/// Where the stiffness of the shapes is known, they are restored there instead of by a second solve.
MatrixXd displacements(const Mesh& mesh, const Assembly& assembly, const Unknowns& left, const MatrixXd& F,
                       const MatrixXd& Phi, const GeometricOptions& options) {
  const MatrixXd f = left.reduced_loads(F);
  if (options.statics == nullptr) return left.expanded(static_solver(mesh, assembly, left).loaded(f));
  if (options.Ke == nullptr || Phi.cols() == 0) return left.expanded(options.statics->loaded(f));
  const auto [x, left_over] = options.statics->loaded_once(f);
  MatrixXd U0 = left.expanded(x), residual = MatrixXd::Zero(F.rows(), F.cols());
  residual(left.free_dofs(), Eigen::all) = left_over;
  add_product(U0, 1, Transposed::no, Phi, options.Ke->ldlt().solve(transposed_product(Phi, residual)));
  return U0;
}

Statics statics(const Mesh& mesh, const Assembly& assembly, const Clamp& clamp, const std::vector<MatrixXd>& loads,
                const MatrixXd& Phi, const GeometricOptions& options) {
  Index count = 0;
  for (const MatrixXd& part : loads) count += part.cols();
  Statics result{MatrixXd(assembly.dofs.count, count), LinearFields::Zero(12, count), {}};
  result.fields.leftCols<inertial_loads>() = inertial_fields();
  for (Index first = 0; const MatrixXd& part : loads) {
    result.F.middleCols(first, part.cols()) = part;
    first += part.cols();
  }
  const Unknowns left = unknowns(mesh, assembly.dofs, clamp);
  if (is_free(mesh, assembly.dofs, clamp))
    relieve(result, mesh, assembly, left);
  else
    result.U0 = displacements(mesh, assembly, left, result.F, Phi, options);
  return result;
}

/// Second-order work of the prestresses U0 on pairs of shapes, summed over the elements: pairs x loads.
MatrixXd prestress_work(const Mesh& mesh, const DofMap& dofs, const MatrixXd& U0, const MatrixXd& Phi, int threads) {
  // Blocks of fixed number, so that the sum does not depend on the number of threads.
  constexpr int blocks = 8;
  const auto elements = static_cast<int>(mesh.elements.size());
  std::array<MatrixXd, blocks> parts;
  parallel_for(threads, blocks, 1, [&](int b) {
    MatrixXd& part = parts[static_cast<size_t>(b)];
    part.setZero(number_of_pairs(Phi.cols()), U0.cols());
    for (int e = elements * b / blocks; e < elements * (b + 1) / blocks; ++e) {
      const Element& element = mesh.elements[static_cast<size_t>(e)];
      const std::vector<int> element_dofs = dofs.of_element(mesh, e);
      type_of(element).add_prestress_work(mesh, element, U0(element_dofs, Eigen::all), Phi(element_dofs, Eigen::all),
                                          part);
    }
  });
  for (size_t b = 1; b < blocks; ++b) parts[0] += parts[b];
  return parts[0];
}

}  // namespace

GeometricStiffness geometric_stiffness(const Mesh& mesh, const Assembly& assembly, const Clamp& clamp,
                                       const MatrixXd& Phi, const GeometricOptions& options) {
  require(assembly.K.rows() == assembly.dofs.count, "geometric stiffness: the stiffness matrix was released");
  require(Phi.rows() == assembly.dofs.count,
          fmt::format("geometric stiffness: shapes have {} entries, the mesh has {} freedoms", Phi.rows(),
                      assembly.dofs.count));
  std::vector<MatrixXd> loads = {inertial_forces(mesh, assembly)};
  for (const std::string& name : options.markers) loads.push_back(marker_forces(mesh, assembly.dofs, name));
  const Statics state = statics(mesh, assembly, clamp, loads, Phi, options);
  MatrixXd work = prestress_work(mesh, assembly.dofs, state.U0, Phi, options.threads);
  add_inertia_of_arms(work, mesh, assembly.dofs, state.fields, Phi);
  add_rigid_connections(work, mesh, assembly, state.F, state.U0, Phi);
  std::vector<MatrixXd> matrices;
  for (Index c = 0; c < work.cols(); ++c) matrices.push_back(unpacked(work.col(c), Phi.cols()));

  auto next = matrices.begin();
  const auto take = [&next](Index count) {
    std::vector<MatrixXd> result(next, next + count);
    next += count;
    return result;
  };
  GeometricStiffness Kg;
  Kg.spin = take(6);
  Kg.acceleration = take(3);
  Kg.angular_acceleration = take(3);
  for (size_t i = 0; i < options.markers.size(); ++i) {
    MarkerStiffness& marker = Kg.markers.emplace_back();
    marker.marker = options.markers[i];
    marker.force = take(3);
    marker.torque = take(loads[i + 1].cols() - 3);
  }
  return Kg;
}

MatrixXd motion_stiffness(const ReducedBody& body, const Vector3d& omega, const Vector3d& acceleration,
                          const Vector3d& angular_acceleration) {
  MatrixXd K = MatrixXd::Zero(body.n(), body.n());
  if (body.Kg.spin.empty()) return K;
  for (size_t c = 0; c < 6; ++c) {
    const auto [i, j] = spin_products[c];
    K += omega(i) * omega(j) * body.Kg.spin[c];
  }
  for (size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Index>(i);
    K += acceleration(axis) * body.Kg.acceleration[i] + angular_acceleration(axis) * body.Kg.angular_acceleration[i];
  }
  return K;
}

MatrixXd marker_stiffness(const ReducedBody& body, const std::string& marker, const Vector3d& force,
                          const Vector3d& torque) {
  MatrixXd K = MatrixXd::Zero(body.n(), body.n());
  for (const MarkerStiffness& m : body.Kg.markers) {
    if (m.marker != marker) continue;
    for (size_t i = 0; i < m.force.size(); ++i) K += force[static_cast<Index>(i)] * m.force[i];
    for (size_t i = 0; i < m.torque.size(); ++i) K += torque[static_cast<Index>(i)] * m.torque[i];
  }
  return K;
}

std::array<double, 2> relative_stiffness(const ReducedBody& body, const MatrixXd& Kg) {
  if (body.n() == 0 || Kg.isZero(0)) return {0, 0};
  VectorXd values;
  if (is_diagonal(body.Ke) && body.Ke.diagonal().minCoeff() > 0) {  // as that of modes is
    const VectorXd scale = body.Ke.diagonal().cwiseSqrt().cwiseInverse();
    values = (scale.asDiagonal() * Kg * scale.asDiagonal()).eval().selfadjointView<Eigen::Lower>().eigenvalues();
  } else {
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(Kg, body.Ke, Eigen::EigenvaluesOnly);
    if (solver.info() != Eigen::Success) return {0, 0};
    values = solver.eigenvalues();
  }
  return {values.minCoeff(), values.maxCoeff()};
}

}  // namespace flexboom
