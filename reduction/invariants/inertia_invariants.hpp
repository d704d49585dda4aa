#pragma once

#include "fem/assembly/assembly.hpp"
#include "reduction/basis/modal_basis.hpp"
#include "reduction/body/reduced_body.hpp"

namespace flexboom {

/// Reduced body of a mesh with a basis: invariants, Ke = Phi^T K Phi, markers, lines of beams and the surface of
/// solids. The invariants come from the same mass points that make M. Markers are every interface, and the mean motion
/// of every node set. Damping is zero. The result does not depend on the number of threads.
/// @throws InputError when the basis belongs to another mesh.
ReducedBody reduce(const Mesh&, const Assembly&, const ModalBasis&, std::string name, int threads = 1);

/// Every invariant by other routes: rigid motions T and M (m = t^T M t, Ct = T^T M Phi, Me = Phi^T M Phi, ...). All of
/// them also by their definitions with a finer quadrature, or the same one where elements integrate their mass
/// approximately. `relative_error` is relative to the scale of the quantity (largest entry of its kind). The tolerance
/// is the round-off of sums over a hundred thousand points.
std::vector<BodyCheck> check_invariants(const ReducedBody&, const Mesh&, const Assembly&, const ModalBasis&,
                                        double tolerance = 1e-11);

}  // namespace flexboom
