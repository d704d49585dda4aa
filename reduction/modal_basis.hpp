#pragma once

#include "fem/constraints.hpp"
#include "reduction/eigen_solver.hpp"
#include "reduction/mode_kind.hpp"

#include <Eigen/Core>

#include <string>
#include <vector>

namespace flexboom {

/// Mode shapes over all freedoms of a mesh (zero where clamped), generalised mass and stiffness.
struct ModalBasis {
  Eigen::MatrixXd Phi;         // freedoms x n
  Eigen::VectorXd omega;       // [rad/s], ascending; within a group of equal frequencies to round-off
  std::vector<ModeKind> kind;  // one per mode
  EigenSummary summary;
  double mass = 0;         // of the whole mesh [kg]
  int unknowns = 0;        // freedoms left in the eigenproblem
  int rigid_freedoms = 0;  // rigid motions that nothing holds: 6 of a free body
};

/// Modes of the mesh with the nodes of `clamp` fixed. Groups of equal frequencies are aligned to the body's axes
/// (deflection of the tip along y first, then z, x, rotations), signs are fixed: positive tip deflection along the
/// local axis (positive tip rotation for torsion). Shapes are scaled so that the tip deflection is 2, as in eq. 14;
/// torsion to Me_kk = m (see README). What nothing holds is free and its rigid modes come first.
/// @throws InputError, NumericalError as solve_modes.
ModalBasis clamped_modes(const Mesh&, const Assembly&, const Clamp&, const EigenOptions&, int threads = 1);

/// The same for large meshes: K and M are released once their parts over the unknowns are made (both are empty
/// afterwards).
ModalBasis clamped_modes_releasing(const Mesh&, Assembly&, const Clamp&, const EigenOptions&, int threads = 1);

/// The first `count` modes of the given kinds (all kinds when empty). Asks for more modes of the body until there are
/// enough.
ModalBasis clamped_modes_of_kind(const Mesh&, const Assembly&, const Clamp&, int count,
                                 const std::vector<ModeKind>& kinds, EigenOptions);

}  // namespace flexboom
