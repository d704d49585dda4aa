#pragma once

#include "reduction/basis/modal_basis.hpp"

namespace flexboom {

/// The first `options.num_modes` elastic modes of the free body (what supports it is left out) under the mean-axis
/// condition (Buckens; Agrawal, Shabana 1985): M-orthogonal to the six rigid motions to round-off, so that Ct = 0 and
/// Cr0 = 0. That holds about any origin: rigid motions about one point are combinations of those about another, so the
/// BRF stays where the mesh has it.
/// @throws InputError when the body falls apart into pieces or is a mechanism; else as clamped_modes.
ModalBasis mean_axis_modes(const Mesh&, const Assembly&, EigenOptions, int threads = 1);

/// M-orthonormal rigid motions over all freedoms: 6 columns, or 5 of a line mass, whose spin moves nothing.
Eigen::MatrixXd rigid_modes(const Mesh&, const Assembly&);

/// Columns of Phi less their rigid part in the inner product of M: T^T M Phi = 0 with the rigid motions T.
Eigen::MatrixXd without_rigid_part(const Mesh&, const Assembly&, const Eigen::MatrixXd& Phi);

}  // namespace flexboom
