#include "fem/linear_algebra/quotient_graph.hpp"

#include "fem/base/at.hpp"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>

namespace flexboom {
namespace {

std::uint64_t scrambled(int i) {  // splitmix64
  std::uint64_t z = static_cast<std::uint64_t>(i) * 0x9e3779b97f4a7c15ULL + 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

std::vector<int> groups_of(const SparseMatrix& A, int& count) {
  const auto n = static_cast<int>(A.cols());
  std::vector<std::pair<std::uint64_t, int>> hash(at(n));
  for (int j = 0; j < n; ++j) hash[at(j)] = {scrambled(j), j};
  for (int j = 0; j < n; ++j) {
    for (SparseMatrix::InnerIterator it(A, j); it; ++it) {
      const auto i = static_cast<int>(it.row());
      if (i <= j) continue;
      hash[at(i)].first += scrambled(j);
      hash[at(j)].first += scrambled(i);
    }
  }
  std::sort(hash.begin(), hash.end());
  // Groups are numbered by their first unknown, which keeps neighbours near.
  std::vector<int> first(at(n));
  for (int k = 0; k < n; ++k) {
    const bool same = k > 0 && hash[at(k)].first == hash[at(k - 1)].first;
    first[at(hash[at(k)].second)] = same ? first[at(hash[at(k - 1)].second)] : hash[at(k)].second;
  }
  std::vector<int> group(at(n));
  count = 0;
  for (int i = 0; i < n; ++i) group[at(i)] = first[at(i)] == i ? count++ : group[at(first[at(i)])];
  return group;
}

/// Appends the groups that can be reached from `roots`, level by level, neighbours of few neighbours first (Cuthill,
/// McKee). Returns where in the order the last level begins.
size_t walk(const QuotientGraph& graph, const std::vector<int>& roots, Levels& levels) {
  const auto append = [&](int g, int level) {
    levels.level[at(g)] = level;
    levels.order.push_back(g);
  };
  size_t begin = levels.order.size();
  for (const int g : roots) append(g, levels.count);
  for (size_t last = begin;; last = begin) {
    ++levels.count;
    const size_t end = levels.order.size();
    for (size_t k = begin; k < end; ++k) {
      const int g = levels.order[k];
      const size_t old = levels.order.size();
      for (int e = graph.start[at(g)]; e < graph.start[at(g) + 1]; ++e) {
        if (levels.level[at(graph.neighbour[at(e)])] < 0) append(graph.neighbour[at(e)], levels.count);
      }
      std::sort(levels.order.begin() + static_cast<std::ptrdiff_t>(old), levels.order.end(),
                [&](int a, int b) { return std::pair(graph.degree(a), a) < std::pair(graph.degree(b), b); });
    }
    begin = end;
    if (levels.order.size() == end) return last;
  }
}

/// Undoes a walk; returns its groups from `place` on.
std::vector<int> take_back(Levels& levels, size_t first, size_t place, int count) {
  std::vector<int> tail(levels.order.begin() + static_cast<std::ptrdiff_t>(place), levels.order.end());
  for (size_t k = first; k < levels.order.size(); ++k) levels.level[at(levels.order[k])] = -1;
  levels.order.resize(first);
  levels.count = count;
  return tail;
}

}  // namespace

QuotientGraph quotient_graph(const SparseMatrix& A) {
  QuotientGraph graph;
  int count = 0;
  graph.group = groups_of(A, count);
  graph.weight.assign(at(count), 0);
  std::vector<char> represents(graph.group.size(), 0);
  for (size_t i = 0; i < graph.group.size(); ++i) represents[i] = graph.weight[at(graph.group[i])]++ == 0;

  const auto for_each_edge = [&](const auto& visit) {
    for (int j = 0; j < A.cols(); ++j) {
      if (!represents[at(j)]) continue;
      for (SparseMatrix::InnerIterator it(A, j); it; ++it) {
        const auto i = static_cast<int>(it.row());
        if (i > j && represents[at(i)]) visit(graph.group[at(i)], graph.group[at(j)]);
      }
    }
  };
  graph.start.assign(at(count) + 1, 0);
  for_each_edge([&](int a, int b) {
    ++graph.start[at(a) + 1];
    ++graph.start[at(b) + 1];
  });
  std::partial_sum(graph.start.begin(), graph.start.end(), graph.start.begin());
  graph.neighbour.resize(at(graph.start.back()));
  std::vector<int> next(graph.start.begin(), graph.start.end() - 1);
  for_each_edge([&](int a, int b) {
    graph.neighbour[at(next[at(a)]++)] = b;
    graph.neighbour[at(next[at(b)]++)] = a;
  });
  return graph;
}

std::vector<int> count_cost(const QuotientGraph& graph, const std::vector<int>& order, Ordering& result) {
  const int n = graph.size();
  std::vector<int> place(at(n)), parent(at(n), -1), ancestor(at(n), -1), mark(at(n), -1);
  for (int k = 0; k < n; ++k) place[at(order[at(k)])] = k;
  std::vector<double> below(at(n), 0);  // unknowns under the diagonal block of each column
  for (int i = 0; i < n; ++i) {         // row i of L: from its neighbours up the elimination tree
    mark[at(i)] = i;
    const int g = order[at(i)];
    const double weight = graph.weight[at(g)];
    for (int k = graph.start[at(g)]; k < graph.start[at(g) + 1]; ++k) {
      for (int j = place[at(graph.neighbour[at(k)])]; j < i && mark[at(j)] != i; j = parent[at(j)]) {
        if (parent[at(j)] < 0) parent[at(j)] = i;
        below[at(j)] += weight;
        mark[at(j)] = i;
      }
    }
  }
  result.nonzeros = result.flops = 0;
  for (int j = 0; j < n; ++j) {
    const double w = graph.weight[at(order[at(j)])], b = below[at(j)];
    result.nonzeros += w * (w + 1) / 2 + w * b;
    // sum over k = 0 .. w-1 of (b + w - k)^2
    result.flops += w * b * b + b * w * (w + 1) + w * (w + 1) * (2 * w + 1) / 6;
  }
  return parent;
}

std::vector<int> postordered(const std::vector<int>& order, const std::vector<int>& parent) {
  // A place comes right before its later siblings' subtrees are done. Parents have higher places than their children.
  // So sizes and positions of subtrees follow in one pass each.
  std::vector<int> size(order.size(), 1), end(order.size());
  for (size_t k = 0; k < order.size(); ++k) {
    if (parent[k] >= 0) size[at(parent[k])] += size[k];
  }
  std::vector<int> result(order.size());
  int roots_end = static_cast<int>(order.size());
  for (size_t k = order.size(); k-- > 0;) {  // the last child stands right before its parent, and so on backwards
    int& limit = parent[k] < 0 ? roots_end : end[at(parent[k])];
    result[at(limit - 1)] = order[k];
    end[k] = limit - 1;
    limit -= size[k];
  }
  return result;
}

std::vector<int> expanded(const QuotientGraph& graph, const std::vector<int>& order) {
  std::vector<int> first(at(graph.size()));
  for (int k = 0, place = 0; k < graph.size(); ++k) {
    first[at(order[at(k)])] = place;
    place += graph.weight[at(order[at(k)])];
  }
  std::vector<int> permutation(graph.group.size());
  for (size_t i = 0; i < graph.group.size(); ++i) permutation[at(first[at(graph.group[i])]++)] = static_cast<int>(i);
  return permutation;
}

QuotientGraph subgraph(const QuotientGraph& graph, const std::vector<int>& members) {
  std::vector<int> place(at(graph.size()), -1);
  for (size_t k = 0; k < members.size(); ++k) place[at(members[k])] = static_cast<int>(k);
  QuotientGraph result;
  result.start.push_back(0);
  for (const int g : members) {
    result.weight.push_back(graph.weight[at(g)]);
    for (int e = graph.start[at(g)]; e < graph.start[at(g) + 1]; ++e) {
      const int other = place[at(graph.neighbour[at(e)])];
      if (other >= 0) result.neighbour.push_back(other);
    }
    result.start.push_back(static_cast<int>(result.neighbour.size()));
  }
  return result;
}

Levels levels_along(const QuotientGraph& graph) {
  Levels levels;
  levels.level.assign(at(graph.size()), -1);
  for (int g = 0; g < graph.size(); ++g) {
    if (levels.level[at(g)] >= 0) continue;
    const size_t first = levels.order.size();
    const int before = levels.count;
    std::vector<int> roots = {g};
    for (int depth = 0;;) {  // to and fro, until the part gets no longer
      const size_t last = walk(graph, roots, levels);
      const int reached = levels.count - before;
      const std::vector<int> end = take_back(levels, first, last, before);
      if (reached <= depth) {
        roots = end;
        break;
      }
      depth = reached;
      roots = {end.back()};
    }
    walk(graph, roots, levels);
  }
  return levels;
}

}  // namespace flexboom
