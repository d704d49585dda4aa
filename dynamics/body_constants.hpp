#pragma once

#include "dynamics/equations.hpp"
#include "reduction/reduced_body.hpp"

namespace flexboom {

/// Sets the invariants of `constants`, packed for the inner loop: what is round-off of the reduction is left out.
void pack_invariants(const ReducedBody&, equations::Body& constants);

/// Appends the non-zeros of n x n matrices, one per component of a vector.
std::vector<equations::Term> packed_vector_family(const std::vector<Eigen::MatrixXd>& components);

/// The same body in another frame that is fixed in its BRF: origin at `position` (BRF) and these axes (columns, BRF).
/// Coordinates and energies do not change. Interfaces, shapes for display and `gram` are left out.
ReducedBody seen_from(const ReducedBody&, const Eigen::Vector3d& position, const Eigen::Matrix3d& axes);

/// The body whose points move by S q + u2(q), u2 the second-order displacement (foreshortening) that its geometric
/// stiffness stands for: a load f does the work -1/2 q^T (sum f Kg) q on u2. Here J2 of it; the first moments of u2 are
/// Kg.acceleration (of mass) and Kg.angular_acceleration (of u0 x mass), by -Kg.force a marker moves further.
void add_second_order_inertia(ReducedBody&);

}  // namespace flexboom
