#pragma once

#include "fem/assembly.hpp"
#include "reduction/modal_basis.hpp"
#include "reduction/reduced_body.hpp"

namespace flexboom {

/// A check of an invariant against an independent route.
struct InvariantCheck {
  std::string name;
  double value = 0;
  double reference = 0;
  double relative_error = 0;
  bool passed = false;
};

/// Reduced body of a mesh with a basis: invariants from the same mass points that make M, Ke = Phi^T K Phi, markers at
/// the nodes of every node set with one node, display lines. Damping is zero.
ReducedBody reduce(const Mesh&, const Assembly&, const ModalBasis&, std::string name);

/// Every invariant by other routes: rigid motions T and M (m = t^T M t, Ct = T^T M Phi, Me = Phi^T M Phi, ...), and all
/// of them by a finer quadrature. `relative_error` is relative to the scale of the quantity (largest entry of its
/// kind).
std::vector<InvariantCheck> check_invariants(const ReducedBody&, const Mesh&, const Assembly&, const ModalBasis&,
                                             double tolerance = 1e-12);

}  // namespace flexboom
