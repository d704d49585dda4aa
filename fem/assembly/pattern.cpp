#include "fem/assembly/pattern.hpp"

#include "fem/base/at.hpp"
#include "fem/base/check.hpp"
#include "fem/base/parallel.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <iterator>
#include <limits>

namespace flexboom {
namespace {

/// Elements of each entity, as compressed rows.
struct Incidence {
  std::vector<int> start;
  std::vector<int> element;
};

Incidence incidence_of(const std::vector<std::vector<int>>& entities, int entity_count) {
  Incidence result;
  result.start.assign(at(entity_count) + 1, 0);
  for (const auto& list : entities) {
    for (const int a : list) ++result.start[at(a) + 1];
  }
  for (size_t a = 1; a < result.start.size(); ++a) result.start[a] += result.start[a - 1];
  result.element.resize(at(result.start.back()));
  std::vector<int> next(result.start.begin(), result.start.end() - 1);
  for (size_t e = 0; e < entities.size(); ++e) {
    for (const int a : entities[e]) result.element[at(next[at(a)]++)] = static_cast<int>(e);
  }
  return result;
}

}  // namespace

std::vector<int> entities_of(const Mesh& mesh, const DofMap& dofs, int element) {
  std::vector<int> entities = mesh.elements[at(element)].nodes;
  const bool internal = dofs.element_offset[at(element)] < dofs.element_offset[at(element) + 1];
  if (internal) entities.push_back(static_cast<int>(mesh.nodes.cols()) + element);
  return entities;
}

EntityGraph entity_graph(const Mesh& mesh, const DofMap& dofs) {
  const auto nodes = static_cast<int>(mesh.nodes.cols());
  const auto elements = static_cast<int>(mesh.elements.size());
  EntityGraph graph;
  graph.nodes = nodes;
  graph.offset.assign(dofs.node_offset.begin(), dofs.node_offset.end());
  graph.offset.insert(graph.offset.end(), dofs.element_offset.begin() + 1, dofs.element_offset.end());

  std::vector<std::vector<int>> entities;
  entities.reserve(at(elements));
  for (int e = 0; e < elements; ++e) entities.push_back(entities_of(mesh, dofs, e));
  const int count = nodes + elements;
  const Incidence incidence = incidence_of(entities, count);

  std::vector<int> seen(at(count), -1);
  graph.start.push_back(0);
  for (int a = 0; a < count; ++a) {
    const auto first = static_cast<std::ptrdiff_t>(graph.neighbour.size());
    for (int k = incidence.start[at(a)]; k < incidence.start[at(a) + 1]; ++k) {
      for (const int b : entities[at(incidence.element[at(k)])]) {
        if (b <= a || seen[at(b)] == a) continue;
        seen[at(b)] = a;
        graph.neighbour.push_back(b);
      }
    }
    std::sort(graph.neighbour.begin() + first, graph.neighbour.end());
    graph.start.push_back(static_cast<int>(graph.neighbour.size()));
  }
  return graph;
}

bool PatternMatrix::thin(int a, int b) const {
  return coupling_ == Coupling::by_component && graph_.size_of(a) == 3 && graph_.size_of(b) == 3;
}

PatternMatrix::PatternMatrix(const EntityGraph& graph, Coupling coupling, int threads)
    : graph_(graph), coupling_(coupling) {
  const auto entities = static_cast<int>(graph.offset.size()) - 1;
  const int freedoms = graph.offset.back();
  matrix_.resize(freedoms, freedoms);
  before_.resize(graph.neighbour.size());

  int* column_start = matrix_.outerIndexPtr();
  long entries = 0;
  for (int a = 0; a < entities; ++a) {
    int below = 0;
    for (int k = graph.start[at(a)]; k < graph.start[at(a) + 1]; ++k) {
      before_[at(k)] = below;
      below += thin(a, graph.neighbour[at(k)]) ? 1 : graph.size_of(graph.neighbour[at(k)]);
    }
    const int size = graph.size_of(a);
    for (int c = 0; c < size; ++c) {
      column_start[graph.offset[at(a)] + c] = static_cast<int>(entries);
      entries += (thin(a, a) ? 1 : size - c) + below;
    }
    require(entries < std::numeric_limits<int>::max(),
            fmt::format("assembly: the matrix of {} freedoms has more entries than this program counts", freedoms));
  }
  column_start[freedoms] = static_cast<int>(entries);
  matrix_.resizeNonZeros(entries);

  // Half the time goes into memory that is touched for the first time.
  constexpr int grain = 256;
  parallel_for(threads, entities, grain, [&](int a) {
    const int size = graph.size_of(a);
    const int first_entry = column_start[graph.offset[at(a)]], last_entry = column_start[graph.offset[at(a) + 1]];
    std::fill(matrix_.valuePtr() + first_entry, matrix_.valuePtr() + last_entry, 0.0);
    int* row = matrix_.innerIndexPtr() + first_entry;
    for (int c = 0; c < size; ++c) {
      const int own = thin(a, a) ? c + 1 : size;
      for (int r = c; r < own; ++r) *row++ = graph.offset[at(a)] + r;
      for (int k = graph.start[at(a)]; k < graph.start[at(a) + 1]; ++k) {
        const int b = graph.neighbour[at(k)];
        const int first = thin(a, b) ? c : 0;
        const int last = thin(a, b) ? c + 1 : graph.size_of(b);
        for (int r = first; r < last; ++r) *row++ = graph.offset[at(b)] + r;
      }
    }
  });
}

SparseMatrix PatternMatrix::take() {
  SparseMatrix result;
  result.swap(matrix_);  // Eigen copies a sparse matrix that is moved
  return result;
}

void PatternMatrix::add_diagonal(int entity, const Eigen::Ref<const Eigen::MatrixXd>& lower) {
  const bool only_diagonal = thin(entity, entity);
  const auto size = static_cast<int>(lower.rows());
  for (int c = 0; c < size; ++c) {
    double* column = matrix_.valuePtr() + matrix_.outerIndexPtr()[graph_.offset[at(entity)] + c];
    const int last = only_diagonal ? c + 1 : size;
    for (int r = c; r < last; ++r) column[r - c] += lower(r, c);
  }
}

template <class Block>
void PatternMatrix::add_block(int row_entity, int column_entity, const Block& block) {
  const auto first = graph_.neighbour.begin() + graph_.start[at(column_entity)];
  const auto last = graph_.neighbour.begin() + graph_.start[at(column_entity) + 1];
  const auto place = std::lower_bound(first, last, row_entity) - graph_.neighbour.begin();
  const int below = before_[static_cast<size_t>(place)];
  const bool one = thin(row_entity, column_entity);
  const bool own_one = thin(column_entity, column_entity);
  const int own = graph_.size_of(column_entity);
  for (int c = 0; c < block.cols(); ++c) {
    const int start = matrix_.outerIndexPtr()[graph_.offset[at(column_entity)] + c];
    double* target = matrix_.valuePtr() + start + (own_one ? 1 : own - c) + below;
    if (one) {
      *target += block(c, c);
    } else {
      for (int r = 0; r < block.rows(); ++r) target[r] += block(r, c);
    }
  }
}

void PatternMatrix::add(const std::vector<int>& entities, int node_freedoms, const Eigen::MatrixXd& lower) {
  const auto width = [&](int entity) { return entity < graph_.nodes ? node_freedoms : graph_.size_of(entity); };
  Eigen::Index row = 0;
  for (size_t p = 0; p < entities.size(); ++p) {
    const int a = entities[p];
    const Eigen::Index rows = width(a);
    Eigen::Index column = 0;
    for (size_t q = 0; q < p; ++q) {
      const int b = entities[q];
      const Eigen::Index columns = width(b);
      const auto block = lower.block(row, column, rows, columns);
      if (a > b) {
        add_block(a, b, block);
      } else if (a < b) {
        add_block(b, a, block.transpose());
      } else {  // a collapsed element has a node twice
        add_diagonal(a, block + block.transpose());
      }
      column += columns;
    }
    add_diagonal(a, lower.block(row, row, rows, rows));
    row += rows;
  }
}

std::vector<std::vector<int>> independent_groups(const Mesh& mesh, const DofMap& dofs) {
  constexpr int max_groups = 64;
  constexpr int slab = 1024;  // elements whose part of the matrices stays in a cache
  std::vector<std::uint64_t> taken(at(static_cast<int>(mesh.nodes.cols() + std::ssize(mesh.elements))), 0);
  std::vector<std::vector<int>> groups;
  std::vector<std::vector<int>> of_slab(max_groups), alone;  // alone: elements that found no group
  const auto close_slab = [&] {
    for (std::vector<int>& group : of_slab)
      if (!group.empty()) groups.push_back(std::move(group)), group.clear();
    std::ranges::move(alone, std::back_inserter(groups));
    alone.clear();
  };
  for (int e = 0; e < std::ssize(mesh.elements); ++e) {
    if (e % slab == 0) close_slab();
    const std::vector<int> entities = entities_of(mesh, dofs, e);
    std::uint64_t used = 0;
    for (const int a : entities) used |= taken[at(a)];
    const int group = std::countr_one(used);
    if (group == max_groups) {
      alone.push_back({e});
      continue;
    }
    of_slab[at(group)].push_back(e);
    for (const int a : entities) taken[at(a)] |= std::uint64_t{1} << group;
  }
  close_slab();
  return groups;
}

}  // namespace flexboom
