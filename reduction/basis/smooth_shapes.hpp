#pragma once

#include "fem/assembly/assembly.hpp"
#include "fem/mesh/mesh.hpp"

#include <Eigen/Core>

namespace flexboom {

/// Eight shapes of the kind that the lowest modes of a slender body have, of size about 1. They are bending in two
/// planes, twist and stretching, along the body by Legendre polynomials. Freedoms of the mesh x 8; rotations of nodes
/// are zero. No columns for a body that is not slender.
Eigen::MatrixXd smooth_shapes(const Mesh&, const DofMap&);

}  // namespace flexboom
