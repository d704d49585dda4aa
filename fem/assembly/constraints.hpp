#pragma once

#include "fem/assembly/assembly.hpp"

#include <string>
#include <utility>
#include <vector>

namespace flexboom {

/// A linear equation between freedoms: sum of coefficient * freedom = 0.
struct ConstraintRow {
  std::vector<std::pair<int, double>> terms;  // (freedom, coefficient)
  int preferred = -1;                         // the freedom that shall follow the others
};

/// The equations of all rigid and distributing connections and linear equations of a mesh.
/// @throws InputError naming a connection whose nodes cannot carry the rotation asked for (they lie on a line).
std::vector<ConstraintRow> constraint_rows(const Mesh&, const DofMap&);

/// The mesh without what ties it to the ground: its supports, and equations that hold one node alone. Freedoms that are
/// held of a node that only equations use are ground, too.
Mesh without_supports(Mesh);

/// What holds the mesh: the supports that it carries, and nodes that are clamped beside them (all freedoms).
struct Clamp {
  Clamp() = default;
  Clamp(std::vector<int> clamped_nodes, bool supported = true)
      : nodes(std::move(clamped_nodes)), with_supports(supported) {}

  std::vector<int> nodes;
  bool with_supports = true;  // false: the mesh's own supports are left out, see without_supports
};

/// A flag per freedom: absent, clamped or supported.
/// @throws InputError for a clamped node that is missing.
std::vector<char> held_freedoms(const Mesh&, const DofMap&, const Clamp&);

/// The unknowns that clamps, supports, connections and equations leave: u = T x.
struct Unknowns {
  int count = 0;
  std::vector<int> of_freedom;  // unknown of each freedom; -1 where it is held, absent or follows others
  std::vector<int> follower;    // freedoms that follow unknowns, ascending
  SparseMatrix follower_rows;   // followers x count

  /// T^T A T of a symmetric matrix over all freedoms, lower triangle.
  SparseMatrix reduced(const SparseMatrix& A) const;

  /// T X: full vectors (freedoms x k) from unknowns (count x k).
  Eigen::MatrixXd expanded(const Eigen::Ref<const Eigen::MatrixXd>& X) const;

  /// T^T F: loads on the unknowns (count x k) of loads on all freedoms.
  Eigen::MatrixXd reduced_loads(const Eigen::Ref<const Eigen::MatrixXd>& F) const;

  /// The freedoms that are unknowns, ascending.
  std::vector<int> free_dofs() const;
};

/// Eliminates the constraints by Gaussian elimination, the preferred freedom of each as its pivot where possible;
/// redundant ones drop out. Freedoms that are `independent` never follow others. Those of reference nodes that move
/// nothing of their own are no unknowns.
/// @throws InputError as constraint_rows, when nothing is left, and when independent freedoms are tied to each other.
Unknowns unknowns(const Mesh&, const DofMap&, const Clamp&, const std::vector<int>& independent = {});

/// How many of the six rigid motions of the whole mesh a clamp, the supports and the connections and equations leave, 0
/// to 6. Freedoms without stiffness move as the constraints want.
int rigid_freedoms(const Mesh&, const DofMap&, const Clamp&);

}  // namespace flexboom
