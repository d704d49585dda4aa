#include "reduction/basis/mean_axis.hpp"

#include "fem/base/check.hpp"

#include <Eigen/Eigenvalues>

#include <cmath>
#include <numeric>

namespace flexboom {
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd rigid_modes(const Mesh& mesh, const Assembly& assembly) {
  MatrixXd T = rigid_motions(mesh, assembly.dofs);
  // About the mass centre, where translations and rotations are orthogonal, and scaled to equal size.
  const MatrixXd rigid = quadratic_form(assembly.M, T);
  const double m = rigid(0, 0);
  const Eigen::Vector3d centre(rigid(1, 5) / m, rigid(2, 3) / m, rigid(0, 4) / m);  // u_y of r_z is x, ...
  T.col(3) += centre.z() * T.col(1) - centre.y() * T.col(2);
  T.col(4) += centre.x() * T.col(2) - centre.z() * T.col(0);
  T.col(5) += centre.y() * T.col(0) - centre.x() * T.col(1);
  T.rightCols(3) *= std::sqrt(m / quadratic_form(assembly.M, T.rightCols(3)).diagonal().maxCoeff());
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(quadratic_form(assembly.M, T));
  const auto none = static_cast<Index>((solver.eigenvalues().array() < 1e-12 * m).count());
  return T * solver.eigenvectors().rightCols(6 - none) *
         solver.eigenvalues().tail(6 - none).cwiseSqrt().cwiseInverse().asDiagonal();
}

MatrixXd without_rigid_part(const Mesh& mesh, const Assembly& assembly, const MatrixXd& Phi) {
  const MatrixXd T = rigid_modes(mesh, assembly);
  const MatrixXd M_T = symmetric_product(assembly.M, T);
  MatrixXd result = Phi;
  for (int pass = 0; pass < 3; ++pass)
    result -= T * (M_T.transpose() * result);  // round-off of one is left to the next
  return result;
}

ModalBasis mean_axis_modes(const Mesh& mesh, const Assembly& assembly, EigenOptions options, int threads) {
  const Clamp nothing({}, false);
  const int rigid = rigid_freedoms(mesh, assembly.dofs, nothing);
  const int wanted = options.num_modes;
  options.num_modes += rigid;
  const auto motions = static_cast<int>(rigid_modes(mesh, assembly).cols());
  require(rigid == motions, "mean-axis: equations leave the body " + std::to_string(rigid) + " of its " +
                                std::to_string(motions) + " rigid motions; a body under mean axes is not held");
  const ModalBasis all = clamped_modes(mesh, assembly, nothing, options, threads);
  require(all.rigid_freedoms <= rigid, "mean-axis: the body has " + std::to_string(all.rigid_freedoms) +
                                           " motions that store no energy, " + std::to_string(rigid) +
                                           " expected; it falls apart or is a mechanism: join its parts");
  std::vector<int> elastic(static_cast<size_t>(wanted));
  std::iota(elastic.begin(), elastic.end(), rigid);
  ModalBasis basis = selected(all, elastic);
  basis.Phi = without_rigid_part(mesh, assembly, basis.Phi);
  basis.rigid_freedoms = 0;
  basis.summary.rigid_modes = 0;
  basis.frame = "mean-axis";
  basis.interfaces.clear();
  basis.interface_nodes.clear();
  return basis;
}

}  // namespace flexboom
