#pragma once

#include "fem/linear_algebra/sparse.hpp"
#include "fem/mesh/element.hpp"

#include <functional>
#include <span>
#include <vector>

namespace flexboom {

/// Numbering of freedoms: those of each node (none, 3: ux uy uz, or 6: and rx ry rz, mesh axes), then the internal
/// freedoms of each element. Freedoms that no mass can reach (torsion of a line mass) are `absent` and leave the
/// problem.
struct DofMap {
  int count = 0;
  std::vector<int> node_offset;     // first freedom of each node, and one past the last node's
  std::vector<int> element_offset;  // first internal freedom of each element, and one past the last element's
  std::vector<char> absent;         // one flag per freedom

  int of_node(int node, int component) const { return node_offset[static_cast<size_t>(node)] + component; }
  int freedoms_of(int node) const {
    return node_offset[static_cast<size_t>(node) + 1] - node_offset[static_cast<size_t>(node)];
  }
  std::vector<int> of_element(const Mesh&, int element) const;
};

/// Stiffness and consistent mass over all freedoms, nothing supported or connected: lower triangles.
struct Assembly {
  SparseMatrix K;  // [N/m, N, N m]
  SparseMatrix M;  // [kg, kg m, kg m^2]
  DofMap dofs;
};

/// The result does not depend on the number of threads.
/// @throws InputError as Mesh::validate.
Assembly assemble(const Mesh&, int threads = 1);

/// Visits every mass point of a mesh with its freedoms: (dm, u0, N, freedoms).
using MeshMassPointVisitor = std::function<void(
    double dm, const Eigen::Vector3d& u0, const Eigen::Ref<const Eigen::Matrix3Xd>& N, std::span<const int> dofs)>;
void for_each_mass_point(const Mesh&, const DofMap&, const MeshMassPointVisitor&, int extra = 0);

/// Mass of the whole mesh, t^T M t with a translation t [kg].
double total_mass(const Mesh&, const Assembly&);

/// Strain energies 1/2 u^T K u [J] of full vectors (freedoms x k), summed over strain points, which keeps more digits
/// than the product with K.
Eigen::VectorXd strain_energies(const Mesh&, const DofMap&, const Eigen::Ref<const Eigen::MatrixXd>& U,
                                int threads = 1);

/// The same with the generalised masses.
struct PointEnergies {
  Eigen::VectorXd strain;   // 1/2 u^T K u [J]
  Eigen::VectorXd kinetic;  // 1/2 u^T M u
};
PointEnergies point_energies(const Mesh&, const Assembly&, const Eigen::Ref<const Eigen::MatrixXd>& U, int threads = 1);

/// Six rigid-body motions (columns: 3 translations, 3 rotations about the body origin) of every freedom, count x 6.
Eigen::MatrixXd rigid_motions(const Mesh&, const DofMap&);

/// Displacement of every node of a full vector (freedoms), 3 x nodes [m].
Eigen::Matrix3Xd nodal_displacement(const Mesh&, const DofMap&, const Eigen::Ref<const Eigen::VectorXd>& u);

/// Points along the beams for drawing: positions (3 x N), rows of the shapes there, and the lines between them.
struct DisplayLines {
  Eigen::Matrix3Xd points;
  std::vector<int> element;             // element of each point
  std::vector<double> parameter;        // parameter in [0, 1] on it
  std::vector<std::vector<int>> lines;  // one polyline per element
};
DisplayLines display_lines(const Mesh&, int points_per_element);

}  // namespace flexboom
