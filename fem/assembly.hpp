#pragma once

#include "fem/element.hpp"

#include <Eigen/SparseCore>

#include <functional>
#include <vector>

namespace flexboom {

using SparseMatrix = Eigen::SparseMatrix<double>;

/// Numbering of freedoms: 6 per node (ux uy uz rx ry rz, body axes), then the internal freedoms of each element.
/// Freedoms without stiffness and mass (torsion of a line mass) are `absent` and leave the problem.
struct DofMap {
  int count = 0;
  std::vector<int> element_offset;  // first internal freedom of each element
  std::vector<char> absent;         // one flag per freedom
  static int of_node(int node, int component) { return 6 * node + component; }
  std::vector<int> of_element(const Mesh&, int element) const;
};

/// Stiffness and consistent mass over all freedoms, nothing clamped; both symmetric, both triangles stored.
struct Assembly {
  SparseMatrix K;  // [N/m, N, N m]
  SparseMatrix M;  // [kg, kg m, kg m^2]
  DofMap dofs;
};

/// @throws InputError as Mesh::validate.
Assembly assemble(const Mesh&);

/// Visits every mass point of a mesh with its freedoms: (dm, u0, N, freedoms).
using MeshMassPointVisitor = std::function<void(
    double dm, const Eigen::Vector3d& u0, const Eigen::Ref<const Eigen::Matrix3Xd>& N, std::span<const int> dofs)>;
void for_each_mass_point(const Mesh&, const DofMap&, const MeshMassPointVisitor&, int extra = 0);

/// Strain energy and generalised mass of a full vector summed over element points: more digits than u^T K u.
struct PointEnergies {
  double strain = 0;   // 1/2 u^T K u
  double kinetic = 0;  // 1/2 u^T M u
};
PointEnergies point_energies(const Mesh&, const DofMap&, const Eigen::Ref<const Eigen::VectorXd>& u);

/// The freedoms that remain when all six of each listed node are clamped and absent ones are dropped, ascending.
std::vector<int> free_dofs(const DofMap&, std::span<const int> clamped_nodes);

/// Principal submatrix on the listed freedoms.
SparseMatrix submatrix(const SparseMatrix&, std::span<const int> dofs);

/// Six rigid-body motions (columns: 3 translations, 3 rotations about the body origin) of every freedom, count x 6.
Eigen::MatrixXd rigid_motions(const Mesh&, const DofMap&);

/// Points along the elements for drawing: positions (3 x N), rows of the shapes there, and the lines between them.
struct DisplayLines {
  Eigen::Matrix3Xd points;
  std::vector<int> element;             // element of each point
  std::vector<double> parameter;        // parameter in [0, 1] on it
  std::vector<std::vector<int>> lines;  // one polyline per element
};
DisplayLines display_lines(const Mesh&, int points_per_element);

}  // namespace flexboom
