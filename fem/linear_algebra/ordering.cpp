#include "fem/linear_algebra/ordering.hpp"

#include "fem/base/at.hpp"
#include "fem/base/check.hpp"
#include "fem/linear_algebra/quotient_graph.hpp"

#include <cholmod.h>
#include <metis.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace flexboom {
namespace {

constexpr int small_problem = 2000;  // unknowns; below, every order is cheap

/// Levels in a slice: of 2 to 16 tried on bars of 6 x 6 to 16 x 16 quadratic elements, 4 gave the least work or nearly.
constexpr int slice_levels = 4;

/// Bodies this much longer than wide are cut across only. Measured were quadratic bars 4 to 21 times as long as wide.
/// METIS alone took 23 to 55 % more work than slices, and as long as a tenth of the factorisation. AMD took 1.8 to 8
/// times the work.
constexpr double slender_from = 3.5;

/// The graph as CHOLMOD reads it: lower triangle, pattern only.
class CholmodGraph {
 public:
  explicit CholmodGraph(const QuotientGraph& graph) {
    cholmod_start(&common_);
    common_.print = 0;
    start_.push_back(0);
    for (int j = 0; j < graph.size(); ++j) {
      for (int k = graph.start[at(j)]; k < graph.start[at(j) + 1]; ++k) {
        if (graph.neighbour[at(k)] > j) row_.push_back(graph.neighbour[at(k)]);
      }
      std::sort(row_.begin() + start_.back(), row_.end());
      start_.push_back(static_cast<int>(row_.size()));
    }
    view_.nrow = view_.ncol = graph.weight.size();
    view_.nzmax = row_.size();
    view_.p = start_.data();
    view_.i = row_.data();
    view_.stype = -1;
    view_.itype = CHOLMOD_INT;
    view_.xtype = CHOLMOD_PATTERN;
    view_.dtype = CHOLMOD_DOUBLE;
    view_.sorted = 1;
    view_.packed = 1;
  }
  ~CholmodGraph() { cholmod_finish(&common_); }
  CholmodGraph(const CholmodGraph&) = delete;
  CholmodGraph& operator=(const CholmodGraph&) = delete;

  /// Empty when the library has no such ordering or fails.
  std::vector<int> amd() {
    std::vector<int> order(view_.nrow);
    return cholmod_amd(&view_, nullptr, 0, order.data(), &common_) ? order : std::vector<int>{};
  }

 private:
  cholmod_common common_{};
  cholmod_sparse view_{};
  std::vector<int> start_;
  std::vector<int> row_;
};

/// Nested dissection by METIS with the unknowns of each group as its weight. Empty when it fails.
std::vector<int> dissection(QuotientGraph graph) {  // a copy: METIS takes no constants
  static_assert(sizeof(idx_t) == sizeof(int));
  idx_t size = graph.size();
  std::vector<int> order(at(size)), place(at(size));
  std::array<idx_t, METIS_NOPTIONS> options{};
  METIS_SetDefaultOptions(options.data());
  options[METIS_OPTION_SEED] = 1;
  options[METIS_OPTION_COMPRESS] = 0;  // done
  const int code = METIS_NodeND(&size, graph.start.data(), graph.neighbour.data(), graph.weight.data(), options.data(),
                                order.data(), place.data());
  return code == METIS_OK ? order : std::vector<int>{};
}

/// Reverse Cuthill-McKee: for thin bodies, a front that runs along.
std::vector<int> band_order(const Levels& levels) { return {levels.order.rbegin(), levels.order.rend()}; }

/// The part of a graph from `first` to before `last`, which has no edge to others.
QuotientGraph range_of(const QuotientGraph& graph, int first, int last) {
  QuotientGraph part;
  part.weight.assign(graph.weight.begin() + first, graph.weight.begin() + last);
  const int base = graph.start[at(first)];
  for (int g = first; g <= last; ++g) part.start.push_back(graph.start[at(g)] - base);
  for (int e = base; e < graph.start[at(last)]; ++e) part.neighbour.push_back(graph.neighbour[at(e)] - first);
  return part;
}

/// For slender bodies: cuts across them leave slices, whose insides METIS orders one by one; then the cuts, from one
/// end to the other. Nested dissection alone would cut a slender body in halves, and each cut would see two neighbours;
/// in a chain it sees one. A cut holds the groups of a level that touch the next one.
std::vector<int> slices_order(const QuotientGraph& graph, const Levels& levels) {
  std::vector<int> inside, cuts;
  for (const int g : levels.order) {
    const int level = levels.level[at(g)];
    const bool touches_next =
        std::any_of(graph.neighbour.begin() + graph.start[at(g)], graph.neighbour.begin() + graph.start[at(g) + 1],
                    [&](int other) { return levels.level[at(other)] > level; });
    const bool is_cut = level % slice_levels == slice_levels - 1 && touches_next;
    (is_cut ? cuts : inside).push_back(g);
  }
  const auto slice_of = [&](int g) { return levels.level[at(g)] / slice_levels; };
  // As the mesh numbers them, so that slices of a uniform mesh are the same graph.
  std::sort(inside.begin(), inside.end(),
            [&](int g, int h) { return std::pair(slice_of(g), g) < std::pair(slice_of(h), h); });
  const QuotientGraph insides = subgraph(graph, inside);
  std::vector<int> order, slice;
  QuotientGraph seen;  // that of `slice`
  for (int first = 0, last = 0; first < insides.size(); first = last) {
    while (last < insides.size() && slice_of(inside[at(last)]) == slice_of(inside[at(first)])) ++last;
    if (QuotientGraph part = range_of(insides, first, last); part != seen) {
      slice = dissection(part);
      if (slice.empty()) return {};
      seen = std::move(part);
    }
    for (const int k : slice) order.push_back(inside[at(first + k)]);
  }
  order.insert(order.end(), cuts.begin(), cuts.end());
  return order;
}

/// Length of a body over its width, in groups.
double slenderness(const QuotientGraph& graph, const Levels& levels) {
  return levels.count / std::sqrt(static_cast<double>(graph.size()) / levels.count);
}

/// Work of a factorisation and of the solves that follow, which move every entry.
double cost(const Ordering& order) { return order.flops + 500 * order.nonzeros; }

/// The cheapest order so far.
class BestOrdering {
 public:
  explicit BestOrdering(const QuotientGraph& graph) : graph_(graph) {}

  void consider(const char* name, std::vector<int> order) {
    if (order.size() != graph_.weight.size()) return;
    Ordering candidate;
    candidate.name = name;
    std::vector<int> parent = count_cost(graph_, order, candidate);
    if (!best_.name.empty() && cost(candidate) >= cost(best_)) return;
    best_ = std::move(candidate);
    order_ = std::move(order);
    parent_ = std::move(parent);
  }

  /// Whether a dissection, at 4e-7 s an edge, takes much less than the factorisation that it may shorten.
  bool dissection_may_pay() const {
    constexpr double seconds_per_edge = 4e-7, flops_per_second = 2e10;
    return best_.flops / flops_per_second > 2 * seconds_per_edge * static_cast<double>(graph_.neighbour.size());
  }

  Ordering result() const {
    if (best_.name.empty()) throw NumericalError("ordering: CHOLMOD made none");
    Ordering result = best_;
    result.permutation = expanded(graph_, postordered(order_, parent_));
    return result;
  }

 private:
  const QuotientGraph& graph_;
  Ordering best_;
  std::vector<int> order_;
  std::vector<int> parent_;  // elimination tree
};

}  // namespace

Ordering fill_reducing_ordering(const SparseMatrix& lower_pattern) {
  const QuotientGraph graph = quotient_graph(lower_pattern);
  BestOrdering choice(graph);
  if (lower_pattern.cols() < small_problem) {
    choice.consider("amd", CholmodGraph(graph).amd());
    return choice.result();
  }
  const Levels levels = levels_along(graph);
  const bool slender = levels.count > 4 * slice_levels && slenderness(graph, levels) > slender_from;
  choice.consider("amd", CholmodGraph(graph).amd());  // of slender bodies too: a thin plate is as long as one
  choice.consider("rcm", band_order(levels));
  if (choice.dissection_may_pay())
    slender ? choice.consider("slices", slices_order(graph, levels)) : choice.consider("metis", dissection(graph));
  return choice.result();
}

}  // namespace flexboom
