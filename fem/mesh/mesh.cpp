#include "fem/mesh/mesh.hpp"

#include "fem/base/check.hpp"
#include "fem/base/parallel.hpp"
#include "fem/base/text_reader.hpp"
#include "fem/mesh/element.hpp"
#include "fem/mesh/mesh_sets.hpp"
#include "fem/mesh/validation.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <string_view>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

std::string element_name(const Mesh& mesh, int e) {
  const Element& element = mesh.elements[static_cast<size_t>(e)];
  return fmt::format("{} element {}", type_of(element).name, mesh.element_label(e));
}

void require_node(const Mesh& mesh, int node) {
  require(node >= 0 && node < mesh.nodes.cols(),
          fmt::format("node {} is missing; the mesh has nodes 0 to {}", node, mesh.nodes.cols() - 1));
}

void validate_element(const Mesh& mesh, int e) {
  const Element& element = mesh.elements[static_cast<size_t>(e)];
  const auto rows = static_cast<int>(element_types().size());
  require(element.type >= 0 && element.type < rows,
          fmt::format("elements[{}]: type {} is not a row of the table of {} elements", e, element.type, rows));
  const ElementType& type = type_of(element);
  try {
    const int count = type.node_count(element.order);
    require(std::ssize(element.nodes) == count,
            fmt::format("has {} nodes; \"{}\" has {}", element.nodes.size(), type.name, count));
    for (const int node : element.nodes) require_node(mesh, node);
    type.validate(mesh, element);
  } catch (const InputError& error) {
    throw InputError(element_name(mesh, e) + ": " + error.what());
  }
}

/// Sets of nodes that hang together, by union and find.
class Parts {
 public:
  explicit Parts(Index nodes) : parent_(static_cast<size_t>(nodes)) { std::iota(parent_.begin(), parent_.end(), 0); }

  int root(int node) {
    while (parent_[at(node)] != node) node = parent_[at(node)] = parent_[at(parent_[at(node)])];
    return node;
  }
  void join(int a, int b) { parent_[at(root(a))] = root(b); }

 private:
  static size_t at(int node) { return static_cast<size_t>(node); }
  std::vector<int> parent_;
};

/// Nodes of every connection and equation, reference first.
std::vector<std::vector<int>> connected_groups(const Mesh& mesh) {
  std::vector<std::vector<int>> groups;
  const auto add = [&groups](int reference, const std::vector<int>& nodes) {
    groups.push_back(nodes);
    groups.back().insert(groups.back().begin(), reference);
  };
  for (const RigidConnection& c : mesh.rigid_connections) add(c.reference, c.nodes);
  for (const DistributingConnection& c : mesh.distributing_connections) add(c.reference, c.nodes);
  for (const LinearEquation& equation : mesh.equations) {
    std::vector<int>& group = groups.emplace_back();
    for (const LinearEquation::Term& term : equation.terms) group.push_back(term.node);
  }
  return groups;
}

std::vector<char> used_nodes(const Mesh& mesh) {
  std::vector<char> used(static_cast<size_t>(mesh.nodes.cols()), 0);
  const auto mark = [&used](const std::vector<int>& nodes) {
    for (const int node : nodes) used[static_cast<size_t>(node)] = 1;
  };
  for (const Element& element : mesh.elements) mark(element.nodes);
  for (const std::vector<int>& group : connected_groups(mesh)) mark(group);
  return used;
}

void validate_nodes(const Mesh& mesh, const std::vector<int>& nodes) {
  require(!nodes.empty(), "has no node");
  for (const int node : nodes) require_node(mesh, node);
}

void validate_connections(const Mesh& mesh) {
  for (size_t i = 0; i < mesh.rigid_connections.size(); ++i) {
    const RigidConnection& c = mesh.rigid_connections[i];
    within(fmt::format("rigid_connections[{}]", i), [&] {
      require_node(mesh, c.reference);
      validate_nodes(mesh, c.nodes);
    });
  }
  for (size_t i = 0; i < mesh.distributing_connections.size(); ++i) {
    const DistributingConnection& c = mesh.distributing_connections[i];
    within(fmt::format("distributing_connections[{}]", i), [&] {
      require_node(mesh, c.reference);
      validate_nodes(mesh, c.nodes);
      require(c.weights.size() == c.nodes.size(), "needs one weight per node");
      for (const double w : c.weights) require(std::isfinite(w) && w > 0, fmt::format("weight {} must be positive", w));
    });
  }
  for (size_t i = 0; i < mesh.equations.size(); ++i) {
    within(fmt::format("equations[{}]", i), [&] {
      require(!mesh.equations[i].terms.empty(), "has no term");
      for (const LinearEquation::Term& term : mesh.equations[i].terms) {
        require_node(mesh, term.node);
        require(term.component >= 0 && term.component < 6, fmt::format("component {} must be 0 to 5", term.component));
        require(std::isfinite(term.coefficient), "has a coefficient that is not finite");
      }
    });
  }
}

void validate_properties(const Mesh& mesh) {
  for (size_t i = 0; i < mesh.beam_properties.size(); ++i) {
    within(fmt::format("beam_properties[{}]", i), [&] {
      const BeamProperty& property = mesh.beam_properties[i];
      property.material.validate_of_beam();
      require(std::isfinite(property.line_mass) && property.line_mass >= 0,
              fmt::format("line_mass is {} kg/m; it must be zero or positive", property.line_mass));
      validate_sections(property.start, property.end, property.material, property.theory, property.shear);
    });
  }
  for (const SolidProperty& property : mesh.solid_properties) {
    within(fmt::format("material of \"{}\"", property.name), [&] {
      require(property.material.E != 0, "is missing; give E, nu and rho (--material E,nu,rho)");
      property.material.validate();
    });
  }
}

/// The first bad element is named, whichever thread meets one first.
void validate_elements(const Mesh& mesh, int threads) {
  const auto count = static_cast<int>(mesh.elements.size());
  try {
    parallel_for(threads, count, 64, [&](int e) { validate_element(mesh, e); });
  } catch (const InputError&) {
    for (int e = 0; e < count; ++e) validate_element(mesh, e);
    throw;
  }
}

/// Pairs of elements that have all nodes in common, those of lines or the others; the first of a pair is the earlier.
std::vector<std::pair<int, int>> twins(const Mesh& mesh, bool lines) {
  struct Key {
    int least;
    long sum;
    int element;
    auto operator<=>(const Key&) const = default;
  };
  std::vector<Key> keys;
  for (int e = 0; e < std::ssize(mesh.elements); ++e) {
    const Element& element = mesh.elements[static_cast<size_t>(e)];
    if ((type_of(element).shape == Shape::line) != lines) continue;
    keys.push_back(
        {std::ranges::min(element.nodes), std::accumulate(element.nodes.begin(), element.nodes.end(), 0L), e});
  }
  std::ranges::sort(keys);
  const auto sorted_nodes = [&](const Key& key) {
    std::vector<int> nodes = mesh.elements[static_cast<size_t>(key.element)].nodes;
    std::ranges::sort(nodes);
    return nodes;
  };
  std::vector<std::pair<int, int>> pairs;
  for (size_t i = 0; i < keys.size(); ++i)
    for (size_t k = i + 1; k < keys.size() && keys[k].least == keys[i].least && keys[k].sum == keys[i].sum; ++k)
      if (sorted_nodes(keys[i]) == sorted_nodes(keys[k])) pairs.emplace_back(keys[i].element, keys[k].element);
  std::ranges::sort(pairs);
  return pairs;
}

void validate_content(const Mesh& mesh, int threads) {
  for (Index i = 0; i < mesh.nodes.cols(); ++i) {
    require(mesh.nodes.col(i).allFinite(),
            fmt::format("node {} has a coordinate that is not finite", mesh.node_label(static_cast<int>(i))));
  }
  validate_properties(mesh);
  validate_elements(mesh, threads);
  if (const auto twice = twins(mesh, false); !twice.empty())
    throw InputError(fmt::format(
        "{} and {} have the same nodes: that part of the body would count twice ({} such pairs); delete one",
        element_name(mesh, twice.front().first), element_name(mesh, twice.front().second), twice.size()));
  validate_connections(mesh);
  for (size_t i = 0; i < mesh.bodies.size(); ++i) {
    within(fmt::format("bodies[{}]", i), [&] {
      require_node(mesh, mesh.bodies[i].node);
      validate_rigid(mesh.bodies[i].mass, mesh.bodies[i].inertia, mesh.bodies[i].offset);
    });
  }
  for (const Support& support : mesh.supports) within("supports", [&] { require_node(mesh, support.node); });
  for (const auto& set : mesh.node_sets) {
    within(fmt::format("node set \"{}\"", set.first), [&] { validate_nodes(mesh, set.second); });
  }
  const std::vector<char> used = used_nodes(mesh);
  for (Index i = 0; i < mesh.nodes.cols(); ++i) {
    require(used[static_cast<size_t>(i)],
            fmt::format("node {} belongs to no element", mesh.node_label(static_cast<int>(i))));
  }
}

/// Pairs of nodes at one place to round-off of the mesh's size, joined by nothing.
int coincident_nodes(const Mesh& mesh) {
  const Vector3d extent = mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff();
  const double tolerance = 1e-9 * extent.norm();
  Index axis = 0;
  extent.maxCoeff(&axis);
  std::vector<int> order(static_cast<size_t>(mesh.nodes.cols()));
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, {}, [&](int node) { return mesh.nodes(axis, node); });
  Parts joined(mesh.nodes.cols());
  for (const std::vector<int>& group : connected_groups(mesh)) {
    for (const int node : group) joined.join(node, group.front());
  }
  int count = 0;
  for (size_t i = 0; i < order.size(); ++i) {
    const Vector3d here = mesh.nodes.col(order[i]);
    for (size_t k = i + 1; k < order.size() && mesh.nodes(axis, order[k]) - here(axis) <= tolerance; ++k) {
      const bool same = (mesh.nodes.col(order[k]) - here).norm() <= tolerance;
      count += same && joined.root(order[i]) != joined.root(order[k]);
    }
  }
  return count;
}

/// Elements whose Jacobian is not positive at a node; empty if there is none.
std::string inverted_corners(const Mesh& mesh) {
  int count = 0;
  std::string first;
  for (int e = 0; e < std::ssize(mesh.elements); ++e) {
    const Element& element = mesh.elements[static_cast<size_t>(e)];
    const int node = type_of(element).inverted_node(mesh, element);
    if (node < 0) continue;
    if (count++ == 0)
      first = fmt::format("{} at node {}", element_name(mesh, e),
                          mesh.node_label(element.nodes[static_cast<size_t>(node)]));
  }
  if (count == 0) return "";
  return fmt::format(
      "{} elements have a Jacobian that is not positive at a node, the first is {}; what is integrated "
      "there is coarse: repair the mesh",
      count, first);
}

}  // namespace

long Mesh::node_label(int node) const { return node_labels.empty() ? node : node_labels[static_cast<size_t>(node)]; }

long Mesh::element_label(int element) const {
  return element_labels.empty() ? element : element_labels[static_cast<size_t>(element)];
}

void Mesh::validate(int threads) const {
  require(nodes.cols() > 0 && !elements.empty(), "mesh: has no elements");
  within("mesh", [&] { validate_content(*this, threads); });
}

std::string node_set_name(const Mesh& mesh, const std::string& name) {
  std::vector<std::string_view> known;
  for (const auto& [set, nodes] : mesh.node_sets) known.emplace_back(set);
  return spelled(name, known);
}

const std::vector<int>& node_set(const Mesh& mesh, const std::string& name) {
  const auto found = mesh.node_sets.find(node_set_name(mesh, name));
  if (found != mesh.node_sets.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [known, nodes] : mesh.node_sets) names.push_back(fmt::format("\"{}\"", known));
  throw InputError(fmt::format("node set \"{}\" not found; the mesh has {}", name,
                               names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
}

int part_count(const Mesh& mesh) {
  Parts parts(mesh.nodes.cols());
  for (const Element& element : mesh.elements) {
    for (const int node : element.nodes) parts.join(node, element.nodes.front());
  }
  for (const std::vector<int>& group : connected_groups(mesh)) {
    for (const int node : group) parts.join(node, group.front());
  }
  const std::vector<char> used = used_nodes(mesh);
  int count = 0;
  for (int node = 0; node < mesh.nodes.cols(); ++node)
    count += used[static_cast<size_t>(node)] && parts.root(node) == node;
  return count;
}

std::string suspicion(const Material& m) {
  // Solids of technology weigh 1 to 23 000 kg/m^3 and are stiffer than 1 kPa and softer than diamond (1.2 TPa).
  const bool absurd = (m.rho > 0 && (m.rho < 1 || m.rho > 3e4)) || m.E < 1e3 || m.E > 2e12;
  return !absurd ? ""
                 : fmt::format(
                       "E = {:g}, rho = {:g} is no material in Pa and kg/m^3; are the units mixed up "
                       "(N, mm, t give Hz as well, but say so to yourself)?",
                       m.E, m.rho);
}

std::vector<std::string> material_suspicions(const Mesh& mesh) {
  std::vector<std::string> result;
  const auto judge = [&result](const std::string& where, const Material& m) {
    if (const std::string odd = suspicion(m); !odd.empty()) result.push_back(where + ": " + odd);
  };
  for (const SolidProperty& property : mesh.solid_properties) judge("\"" + property.name + "\"", property.material);
  for (size_t i = 0; i < mesh.beam_properties.size(); ++i) {
    const bool repeated = i > 0 && mesh.beam_properties[i].material.E == mesh.beam_properties[i - 1].material.E;
    if (!repeated) judge(fmt::format("beam property {}", i), mesh.beam_properties[i].material);
  }
  return result;
}

std::vector<std::string> suspicions(const Mesh& mesh) {
  std::vector<std::string> result;
  if (std::string inverted = inverted_corners(mesh); !inverted.empty()) result.push_back(std::move(inverted));
  if (const int parts = part_count(mesh); parts > 1)
    result.push_back(fmt::format("the mesh has {} parts that nothing joins; each moves on its own", parts));
  if (const int twins = coincident_nodes(mesh); twins > 0)
    result.push_back(
        fmt::format("{} pairs of nodes lie at one place and nothing joins them: the mesh is open there "
                    "(merge them if it should not be)",
                    twins));
  if (const auto twice = twins(mesh, true); !twice.empty())
    result.push_back(fmt::format("{} pairs of beams have the same nodes and lie side by side; the first are {} and {}",
                                 twice.size(), element_name(mesh, twice.front().first),
                                 element_name(mesh, twice.front().second)));
  std::ranges::move(material_suspicions(mesh), std::back_inserter(result));
  return result;
}

}  // namespace flexboom
