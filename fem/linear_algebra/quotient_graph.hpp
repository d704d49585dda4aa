#pragma once

#include "fem/linear_algebra/ordering.hpp"

#include <vector>

namespace flexboom {

/// Unknowns with equal columns as one group, and the graph between groups. Two unlike columns with one hash would only
/// make the order a little worse.
struct QuotientGraph {
  std::vector<int> group;      // of each unknown
  std::vector<int> weight;     // unknowns of each group
  std::vector<int> start;      // neighbours of group g: neighbour[start[g] .. start[g + 1]), both directions
  std::vector<int> neighbour;  // in no order

  int size() const { return static_cast<int>(weight.size()); }
  int degree(int g) const { return start[static_cast<size_t>(g) + 1] - start[static_cast<size_t>(g)]; }
  bool operator==(const QuotientGraph&) const = default;
};

QuotientGraph quotient_graph(const SparseMatrix& lower_pattern);

/// The members, which keep their order, and the edges among them; `group` stays empty.
QuotientGraph subgraph(const QuotientGraph&, const std::vector<int>& members);

/// Sets the fill and work of a Cholesky factorisation in the given order of groups, exactly, in time proportional to
/// the entries of the quotient's factor. Returns the elimination tree: the parent of each place, -1 of roots.
std::vector<int> count_cost(const QuotientGraph&, const std::vector<int>& order, Ordering& result);

/// An equivalent order in which each subtree of the elimination tree is consecutive, which dense blocks of a factor
/// want.
std::vector<int> postordered(const std::vector<int>& order, const std::vector<int>& parent);

/// The order of unknowns that an order of groups stands for.
std::vector<int> expanded(const QuotientGraph&, const std::vector<int>& order);

/// Groups in the order of a walk through the body from one end, level by level.
struct Levels {
  std::vector<int> order;
  std::vector<int> level;  // of each group; neighbours are at most one level apart
  int count = 0;
};

/// Breadth-first from the last level of a walk from a pseudo-peripheral group, for each unconnected part: in a slender
/// body the levels are cross-sections.
Levels levels_along(const QuotientGraph&);

}  // namespace flexboom
