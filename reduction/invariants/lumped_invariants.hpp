#pragma once

#include "fem/assembly/assembly.hpp"
#include "reduction/body/reduced_body.hpp"

#include <Eigen/Core>

namespace flexboom {

/// Mass of every node [kg] by the rule of Hinton, Rock and Zienkiewicz. It is the diagonal of each element's consistent
/// mass, scaled to the mass of the element. Positive for every element, where row sums are negative at the corners of
/// hex20 and tet10. Rotations and freedoms inside elements get nothing.
Eigen::VectorXd nodal_masses(const Mesh&);

/// Invariants of shapes Phi (freedoms x n) as sums over nodal masses. That is what a program knows that reads nodes and
/// shapes only. It is for comparison with `reduce`, never for use. Bodies on nodes are exact; Ke and De are zero, no
/// markers.
/// @throws InputError when Phi is not over the freedoms of the mesh.
ReducedBody lumped_invariants(const Mesh&, const Assembly&, const Eigen::MatrixXd& Phi);

}  // namespace flexboom
