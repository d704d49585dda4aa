#pragma once

#include "fem/assembly/assembly.hpp"

#include <vector>

namespace flexboom {

/// Entities carry freedoms: the nodes, then the elements with their internal ones. Freedoms ascend with entities.
struct EntityGraph {
  int nodes = 0;
  std::vector<int> offset;     // first freedom of each entity, and one past the last one's
  std::vector<int> start;      // neighbours of entity a: neighbours[start[a] .. start[a + 1])
  std::vector<int> neighbour;  // later entities that share an element with it, ascending

  int size_of(int entity) const {
    return offset[static_cast<size_t>(entity) + 1] - offset[static_cast<size_t>(entity)];
  }
};

EntityGraph entity_graph(const Mesh&, const DofMap&);

/// The entities of an element: its nodes, and itself where it has internal freedoms.
std::vector<int> entities_of(const Mesh&, const DofMap&, int element);

/// How two nodes of three freedoms couple: in all components (stiffness), or each with its like (mass of solids).
enum class Coupling { full, by_component };

/// A symmetric matrix with the pattern of a mesh, lower triangle, made once and filled by element matrices.
class PatternMatrix {
 public:
  /// @throws InputError when the matrix has more entries than an int counts.
  PatternMatrix(const EntityGraph&, Coupling, int threads = 1);

  /// Adds the lower triangle of an element matrix with the first `node_freedoms` of each node and all internal
  /// freedoms. Two elements without a common entity can be added at once.
  void add(const std::vector<int>& entities, int node_freedoms, const Eigen::MatrixXd& lower);

  SparseMatrix take();

 private:
  bool thin(int a, int b) const;
  template <class Block>  // also a transposed one, without a copy
  void add_block(int row_entity, int column_entity, const Block& block);
  void add_diagonal(int entity, const Eigen::Ref<const Eigen::MatrixXd>& lower);

  const EntityGraph& graph_;
  Coupling coupling_;
  std::vector<int> before_;  // per neighbour: rows of the entity's columns above that neighbour's
  SparseMatrix matrix_;
};

/// Elements in groups whose members share no entity, so that a group can be added in parallel. The groups and their
/// order do not depend on the number of threads. Each group lies within about a thousand successive elements, whose
/// part of the matrices a cache holds.
std::vector<std::vector<int>> independent_groups(const Mesh&, const DofMap&);

}  // namespace flexboom
