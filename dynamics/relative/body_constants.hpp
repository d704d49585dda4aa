#pragma once

#include "dynamics/relative/body_equations.hpp"
#include "reduction/body/reduced_body.hpp"

namespace flexboom {

/// Sets the integrals of mass and shapes of `constants`, packed for the inner loop: what is round-off of the reduction
/// is left out.
void pack_integrals(const ReducedBody&, equations::Body& constants);

/// Sets Me, Ke, De and what follows from them.
void pack_structure(const ReducedBody&, equations::Body& constants);

/// Both.
void pack_invariants(const ReducedBody&, equations::Body& constants);

/// Appends the non-zeros of n x n matrices, one per component of a vector.
std::vector<equations::Term> packed_vector_family(const std::vector<Eigen::MatrixXd>& components);

/// The same body in another frame that is fixed in its BRF: origin at `position` (BRF) and these axes (columns, BRF).
/// Coordinates and energies do not change. Geometric stiffness, interfaces, shapes for display and `gram` are left out.
ReducedBody seen_from(const ReducedBody&, const Eigen::Vector3d& position, const Eigen::Matrix3d& axes);

}  // namespace flexboom
