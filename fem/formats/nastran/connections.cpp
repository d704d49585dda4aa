#include "fem/base/at.hpp"
#include "fem/formats/deck/nodes.hpp"
#include "fem/formats/nastran/bulk.hpp"
#include "fem/mesh/mesh_sets.hpp"
#include "fem/mesh/validation.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

namespace flexboom::nastran {
namespace {

constexpr long most_listed = 200'000'000;  // ids of all ranges

class Connections {
 public:
  Connections(Bulk& bulk, Mesh& mesh) : bulk_(bulk), mesh_(mesh), sorted_(mesh.node_labels) {
    std::ranges::sort(sorted_);
  }

  void add_all();

 private:
  std::vector<int> nodes(const std::vector<IdRange>&);
  void add_rigid(const RigidLine&);
  void add_average(const RigidLine&);
  /// Of each grid that moves as one with another in all six components, that grid; -1 of the others. What is fixed to a
  /// dependent grid is fixed to its reference, which has rotations.
  std::vector<int> references() const;
  void add_masses();
  void add_mpcs();
  void add_supports();
  /// Sets that a case selects: itself, or those that a sum adds up.
  template <class Lines>
  std::vector<long> selected(std::string_view kind, const std::optional<long>& wanted,
                             const std::map<long, Lines>& sets, const std::map<long, std::vector<IdRange>>& sums);

  Bulk& bulk_;
  Mesh& mesh_;
  std::vector<long> sorted_;  // labels of nodes
  long listed_ = 0;
};

std::vector<int> Connections::nodes(const std::vector<IdRange>& ranges) {
  std::vector<int> result;
  for (const IdRange& range : ranges) {
    if (range.first == range.last) {
      result.push_back(node_of(bulk_, range.first, range.at));
      continue;
    }
    const auto begin = std::ranges::lower_bound(sorted_, range.first),
               end = std::ranges::upper_bound(sorted_, range.last);
    listed_ += end - begin;
    if (listed_ > most_listed) bulk_.fail(range.at, fmt::format("ranges of more than {} grids", most_listed));
    for (auto label = begin; label != end; ++label) result.push_back(bulk_.nodes.find(*label));
  }
  return sorted_unique(std::move(result));
}

void Connections::add_rigid(const RigidLine& line) {
  RigidConnection connection{node_of(bulk_, line.reference, line.at), nodes(line.nodes), line.components};
  std::erase(connection.nodes, connection.reference);
  if (connection.nodes.empty()) bulk_.fail(line.at, fmt::format("{} has no dependent grids", line.name));
  mesh_.node_sets[line.name] = connection.nodes;
  mesh_.rigid_connections.push_back(std::move(connection));
}

void Connections::add_average(const RigidLine& line) {
  DistributingConnection connection;
  connection.reference = node_of(bulk_, line.reference, line.at);
  connection.components = line.components;
  for (size_t i = 0; i < line.nodes.size(); ++i) {
    connection.nodes.push_back(node_of(bulk_, line.nodes[i].first, line.nodes[i].at));
    if (connection.nodes.back() == connection.reference)
      bulk_.fail(line.nodes[i].at, fmt::format("{}: the reference grid cannot follow itself", line.name));
  }
  connection.weights = line.weights;
  mesh_.node_sets[line.name] = sorted_unique(connection.nodes);
  mesh_.distributing_connections.push_back(std::move(connection));
}

std::vector<int> Connections::references() const {
  std::vector<int> references(at(static_cast<int>(mesh_.nodes.cols())), -1);
  for (const RigidConnection& c : mesh_.rigid_connections) {
    if (c.components != all_components) continue;
    for (const int node : c.nodes) references[at(node)] = c.reference;
  }
  return references;
}

void Connections::add_masses() {
  const std::vector<char> rotates = nodes_that_rotate(mesh_);
  const std::vector<int> reference = references();
  for (const MassLine& line : bulk_.masses) {
    NodalBody body = line.body;
    body.node = node_of(bulk_, line.node, line.at);
    if (line.absolute) body.offset -= mesh_.nodes.col(body.node);
    if (const int to = reference[at(body.node)]; to >= 0 && !rotates[at(body.node)]) {
      body.offset += mesh_.nodes.col(body.node) - mesh_.nodes.col(to);
      body.node = to;
    }
    body.mass *= bulk_.mass_factor;
    body.inertia *= bulk_.mass_factor;
    if (!rotates[at(body.node)] && !(body.inertia.isZero(0) && body.offset.isZero(0)))
      bulk_.notes.add("CONM2 on a grid without rotations acts as a point mass");
    try {
      validate_rigid(body.mass, body.inertia, body.offset);
    } catch (const InputError& error) {
      bulk_.fail(line.at, fmt::format("CONM2: {}", error.what()));
    }
    mesh_.bodies.push_back(body);
  }
}

template <class Lines>
std::vector<long> Connections::selected(std::string_view kind, const std::optional<long>& wanted,
                                        const std::map<long, Lines>& sets,
                                        const std::map<long, std::vector<IdRange>>& sums) {
  if (!wanted) {
    std::set<long> ids;
    for (const auto& [id, lines] : sets) ids.insert(id);
    if (ids.empty()) return {};
    if (bulk_.cards.case_control().given)
      bulk_.fail({}, fmt::format("the case control selects none of the {0} sets {1}, and without that Nastran leaves "
                                 "them out; add {0} = n to it, or take them out",
                                 kind, fmt::join(ids, ", ")));
    if (sums.size() == 1) {
      bulk_.notes.add(fmt::format("no case control selects an {}; {}ADD {} is used", kind, kind, sums.begin()->first));
      return selected(kind, sums.begin()->first, sets, sums);
    }
    if (ids.size() > 1 || !sums.empty())
      bulk_.fail({}, fmt::format("no case control says which of the {} sets {} count; add one with {} = n", kind,
                                 fmt::join(ids, ", "), kind));
    bulk_.notes.add(fmt::format("no case control selects an {}; the only set, {}, is used", kind, *ids.begin()));
    return {*ids.begin()};
  }
  const auto sum = sums.find(*wanted);
  if (sum == sums.end()) {
    const CaseControl& control = bulk_.cards.case_control();
    if (!sets.contains(*wanted))
      bulk_.fail(kind == "SPC" ? control.spc_at : control.mpc_at,
                 fmt::format("{} = {}: there is no such set", kind, *wanted));
    return {*wanted};
  }
  std::set<long> result;
  for (const IdRange& range : sum->second) {
    const auto begin = sets.lower_bound(range.first), end = sets.upper_bound(range.last);
    if (begin == end) bulk_.fail(range.at, fmt::format("{}ADD {}: there is no set {}", kind, *wanted, range.first));
    for (auto set = begin; set != end; ++set) result.insert(set->first);
  }
  return {result.begin(), result.end()};
}

void Connections::add_mpcs() {
  const std::vector<char> rotates = nodes_that_rotate(mesh_);
  for (const long id : selected("MPC", bulk_.cards.case_control().mpc, bulk_.mpcs, bulk_.mpc_sums)) {
    for (const MpcLine& line : bulk_.mpcs.at(id)) {
      LinearEquation equation;
      for (const MpcLine::Term& term : line.terms) {
        const int node = node_of(bulk_, term.node, term.at);
        if (term.component >= 3 && !rotates[at(node)])
          bulk_.fail(term.at, fmt::format("MPC: grid {} has no rotations", term.node));
        equation.terms.push_back({node, term.component, term.coefficient});
      }
      mesh_.equations.push_back(std::move(equation));
    }
  }
}

void Connections::add_supports() {
  std::vector<Components> held(at(static_cast<int>(mesh_.nodes.cols())), Components{});
  const auto hold = [&held](int node, const std::vector<int>& components) {
    for (const int k : components) held[at(node)][at(k)] = true;
  };
  for (const auto& [label, components] : bulk_.permanent) hold(bulk_.nodes.find(label), components);
  for (const long id : selected("SPC", bulk_.cards.case_control().spc, bulk_.supports, bulk_.support_sums)) {
    std::vector<int> set;
    for (const SupportLine& line : bulk_.supports.at(id)) {
      for (const int node : nodes(line.nodes)) {
        hold(node, line.components);
        set.push_back(node);
      }
    }
    mesh_.node_sets[fmt::format("SPC_{}", id)] = sorted_unique(std::move(set));
  }
  const std::vector<char> used = nodes_in_use(mesh_);
  int idle = 0;
  for (size_t node = 0; node < held.size(); ++node) {
    if (held[node] == Components{}) continue;
    if (used[node])
      mesh_.supports.push_back({static_cast<int>(node), held[node]});
    else
      ++idle;
  }
  if (idle > 0) bulk_.notes.add(fmt::format("supports of {} grids that belong to nothing were left out", idle));
}

void Connections::add_all() {
  for (const RigidLine& line : bulk_.rigids) add_rigid(line);
  for (const RigidLine& line : bulk_.averages) add_average(line);
  add_masses();
  add_mpcs();
  add_supports();
}

}  // namespace

void add_connections(Bulk& bulk, Mesh& mesh) { Connections(bulk, mesh).add_all(); }

}  // namespace flexboom::nastran
