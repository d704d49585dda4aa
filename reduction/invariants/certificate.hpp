#pragma once

#include "fem/assembly/constraints.hpp"
#include "reduction/basis/modal_basis.hpp"
#include "reduction/basis/static_shapes.hpp"
#include "reduction/body/reduced_body.hpp"

#include <string>
#include <vector>

namespace flexboom {

/// What a body can be asked without its mesh. Checked are identities between its invariants and Bessel's inequality
/// |Ct_k|^2 <= m Me_kk. The inequality is checked for all coordinates together as well: the inertia they do not carry
/// is positive semidefinite. Ct = Cr0 = 0 is checked under mean axes, and diagonal Me and Ke of modes.
std::vector<BodyCheck> body_checks(const ReducedBody&);

/// The certificate of a body: check_invariants (other routes, another quadrature), body_checks and the strain energy of
/// the six rigid motions. Closed forms are added where the body is a uniform beam. The response to unit forces at its
/// markers is compared with the full model. A reduced body is never softer, and how much stiffer it is says what its
/// modes leave out. `clamp` is what the basis was made with. `exact_at`: markers whose static response the basis holds
/// (attachment modes, interfaces), to be equal to 1e-8. `statics`: of K over the unknowns that the clamp leaves, where
/// the caller has it.
std::vector<BodyCheck> certificate(const ReducedBody&, const Mesh&, const Assembly&, const Clamp&, const ModalBasis&,
                                   const std::vector<std::string>& exact_at = {}, int threads = 1,
                                   const StaticSolver* statics = nullptr);

/// SHA-256 of nodes, elements, properties, bodies, supports, connections and sets: 64 hexadecimal digits.
std::string mesh_hash(const Mesh&);

}  // namespace flexboom
