#pragma once

#include "fem/mesh/mesh.hpp"

#include <Eigen/Core>

#include <vector>

namespace flexboom {

// In which order Gmsh and VTK list the nodes of a hexahedron of order p, as indices of our own lexicographic order.
// Node n of the format is our node order[n] = i + (p + 1) (j + (p + 1) k), i along xi fastest. Both have corners,
// edges, faces, interior.

/// Gmsh (reference manual, "Node ordering"): faces and interior are numbered like a quadrangle and a hexahedron of
/// order p - 2 again, edges run from their first corner.
std::vector<int> gmsh_hexahedron_order(int p);

/// VTK_LAGRANGE_HEXAHEDRON of files before version 2.1 (vertical edges 04 15 37 26) and after it (04 15 26 37).
std::vector<int> vtk_hexahedron_order(int p, bool before_2_1);

/// Positions (3 x nodes) of our Gauss-Lobatto-Legendre nodes, from those of Gmsh and VTK, on the same shapes. Gmsh and
/// VTK space the nodes of "hex" elements of order above 2 equally in the reference element.
Eigen::Matrix3Xd lobatto_from_equispaced(const Mesh&, const Eigen::Matrix3Xd&);

/// The other way, for any values at the nodes (components x nodes).
Eigen::MatrixXd equispaced_from_lobatto(const Mesh&, const Eigen::MatrixXd&);

}  // namespace flexboom
