#include "reduction/basis/attachment_modes.hpp"

#include "fem/base/check.hpp"
#include "reduction/basis/body_shapes.hpp"
#include "reduction/basis/interface_nodes.hpp"
#include "reduction/basis/mean_axis.hpp"
#include "reduction/basis/static_shapes.hpp"

#include <Eigen/Cholesky>

#include <cmath>
#include <numbers>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<int> nodes_of(const ModalBasis& basis, const Mesh& mesh, const std::string& marker) {
  for (size_t i = 0; i < basis.interfaces.size(); ++i) {
    const bool has_node = i < basis.interface_nodes.size() && basis.interface_nodes[i] >= 0;
    if (has_node && basis.interfaces[i].name == marker) return {basis.interface_nodes[i]};
  }
  return node_set(mesh, marker);
}

/// Static shapes of loads; of a free body those of the loads and the inertia forces that balance them.
MatrixXd static_shapes(const Mesh& mesh, const Assembly& assembly, const Clamp& clamp, const MatrixXd& loads) {
  const Unknowns left = unknowns(mesh, assembly.dofs, clamp);
  const int rigid = rigid_freedoms(mesh, assembly.dofs, clamp);
  if (rigid == 0) return left.expanded(static_solver(mesh, assembly, left).loaded(left.reduced_loads(loads)));
  const MatrixXd T = rigid_modes(mesh, assembly);
  require(T.cols() == rigid, "attachment modes: the body is held in some rigid motions only; hold it or free it");
  const MatrixXd balanced = loads - symmetric_product(assembly.M, T) * (T.transpose() * loads);
  const StaticSolver solver = static_solver(mesh, assembly, left, determinate_support(mesh, assembly.dofs, left));
  return without_rigid_part(mesh, assembly, left.expanded(solver.loaded(left.reduced_loads(balanced))));
}

/// Part of u that is M-orthogonal to the shapes X, whose M X and Me are given.
VectorXd orthogonal_part(const MatrixXd& X, const MatrixXd& M_X, const Eigen::LDLT<MatrixXd>& Me, VectorXd u) {
  for (int pass = 0; pass < 2; ++pass) u -= X * Me.solve(VectorXd(M_X.transpose() * u));
  return u;
}

}  // namespace

MatrixXd unit_loads(const ModalBasis& basis, const Mesh& mesh, const DofMap& dofs,
                    const std::vector<AttachmentLoad>& loads) {
  MatrixXd f(dofs.count, std::ssize(loads));
  for (size_t i = 0; i < loads.size(); ++i) {
    const MeanMotion motion = mean_motion(mesh, dofs, nodes_of(basis, mesh, loads[i].marker));
    const int component = component_of(loads[i].direction);
    require(component < 3 || motion.turns,
            "attachment modes: \"" + loads[i].marker + "\" has no rotation that a torque could act on");
    f.col(static_cast<Index>(i)) = motion.loads(dofs.count).col(component);
  }
  return f;
}

ModalBasis with_attachment_modes(ModalBasis basis, const Mesh& mesh, const Assembly& assembly, const Clamp& clamp,
                                 const std::vector<AttachmentLoad>& loads, int threads) {
  const MatrixXd U = static_shapes(mesh, assembly, clamp, unit_loads(basis, mesh, assembly.dofs, loads));
  const double mass = quadratic_form(assembly.M, rigid_motions(mesh, assembly.dofs).leftCols<1>())(0, 0);
  const bool is_free = rigid_freedoms(mesh, assembly.dofs, clamp) > 0;
  if (basis.coordinates.empty()) basis.coordinates = mode_table(basis);
  for (size_t i = 0; i < loads.size(); ++i) {
    const VectorXd u = U.col(static_cast<Index>(i));
    const MatrixXd M_Phi = symmetric_product(assembly.M, basis.Phi);
    const Eigen::LDLT<MatrixXd> Me(MatrixXd(basis.Phi.transpose() * M_Phi));
    const VectorXd own = orthogonal_part(basis.Phi, M_Phi, Me, u);
    const double norm = std::sqrt(quadratic_form(assembly.M, own)(0, 0));
    // What solvers leave of a shape that is in the span already is 1e-10 of it.
    if (norm <= 1e-7 * std::sqrt(quadratic_form(assembly.M, u)(0, 0))) {
      basis.summary.note += (basis.summary.note.empty() ? "" : "; ") + loads[i].direction + " at \"" + loads[i].marker +
                            "\" adds no shape and is left out";
      continue;
    }
    const Index n = basis.Phi.cols();
    basis.Phi.conservativeResize(Eigen::NoChange, n + 1);
    basis.Phi.col(n) = own * (std::sqrt(mass) / norm);
    if (is_free)  // of what is left of a shape that is nearly in the span, its round-off is a larger part
      basis.Phi.col(n) = without_rigid_part(mesh, assembly, basis.Phi.col(n));
    const PointEnergies energy = point_energies(mesh, assembly, basis.Phi.rightCols<1>(), threads);
    basis.omega.conservativeResize(n + 1);
    basis.omega(n) = std::sqrt(energy.strain(0) / energy.kinetic(0));
    basis.kind.push_back(ModeKind::other);
    basis.coordinates.push_back(
        {"attachment", basis.omega(n) / (2 * std::numbers::pi), loads[i].marker, loads[i].direction});
  }
  return basis;
}

}  // namespace flexboom
