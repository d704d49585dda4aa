#pragma once

#include "fem/assembly/assembly.hpp"
#include "fem/assembly/constraints.hpp"
#include "reduction/basis/reduced_matrices.hpp"
#include "reduction/basis/static_shapes.hpp"

namespace flexboom::test {

/// f^T K^-1 f of the full model. The solution u of a slender body has an error of the condition of K, 1e8; the energy
/// 2 f^T u - u^T K u, with u^T K u summed over strain points, has its square.
inline Eigen::MatrixXd compliance(const Mesh& mesh, const Assembly& assembly, const Unknowns& left,
                                  const Eigen::MatrixXd& f) {
  const StaticSolver solver(left.reduced(assembly.K), {});
  const Eigen::MatrixXd u = left.expanded(solver.loaded(left.reduced_loads(f)));
  const Eigen::MatrixXd work = f.transpose() * u;
  return work + work.transpose() - reduced_stiffness(mesh, assembly.dofs, u);
}

}  // namespace flexboom::test
