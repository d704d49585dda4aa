#pragma once

#include "fem/mesh/mesh.hpp"

#include <span>
#include <string_view>
#include <vector>

// Elements of any kind from one hexahedral lattice.
namespace flexboom {

/// A hexahedron of (order + 1)^3 nodes in the order of the element "hex".
struct LatticeCell {
  std::vector<int> nodes;
  int segment = 0;
};

/// A kind of element that a lattice can be cut into.
struct CellKind {
  std::string_view name;  // row of element_types()
  int order;              // of the lattice that it needs, 0: any
  std::vector<std::vector<int>> (*cut)(const std::vector<int>& cell, int order);
};

/// The kinds that exist.
std::span<const CellKind> cell_kinds();

/// Kind of a name. @throws InputError listing the names that exist.
const CellKind& cell_kind(std::string_view name);

/// Drops nodes that no element uses and renumbers elements and node sets by first use. Returns `values`, one per node
/// or none at all, of the nodes that stay.
std::vector<double> remove_unused_nodes(Mesh&, const std::vector<double>& values);

}  // namespace flexboom
