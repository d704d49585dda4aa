#pragma once

#include "reduction/eigen_solver.hpp"

#include <Eigen/Core>

#include <string>
#include <vector>

namespace flexboom {

/// What a mode of a boom does mostly.
enum class ModeKind { bending_y, bending_z, torsion, axial, other };
std::string_view name_of(ModeKind);

/// Mode shapes over all freedoms of a mesh (zero where clamped), generalised mass and stiffness.
struct ModalBasis {
  Eigen::MatrixXd Phi;         // freedoms x n
  Eigen::VectorXd omega;       // [rad/s], ascending; within a group of equal frequencies to round-off
  std::vector<ModeKind> kind;  // one per mode
  EigenSummary summary;
  int unknowns = 0;     // freedoms left in the eigenproblem
  bool clamped = true;  // false: the body is free, rigid modes come first
};

/// Modes of the mesh with the nodes of `clamp` fixed. Groups of equal frequencies are aligned to the body's axes
/// (deflection of the tip along y first, then z, x, rotations), signs are fixed: positive tip deflection along the
/// local axis (positive tip rotation for torsion). Shapes are scaled so that the tip deflection is 2, as in eq. 14;
/// torsion to Me_kk = m (see README). Without a clamp the body is free and the six rigid modes come first.
/// @throws InputError, NumericalError as solve_modes.
ModalBasis clamped_modes(const Mesh&, const Assembly&, const std::vector<int>& clamp, const EigenOptions&);

/// The first `count` modes of the given kinds (all kinds when empty). Asks for more modes of the body until there are
/// enough.
ModalBasis clamped_modes_of_kind(const Mesh&, const Assembly&, const std::vector<int>& clamp, int count,
                                 const std::vector<ModeKind>& kinds, EigenOptions);

}  // namespace flexboom
