#include "fem/mesh/mesh_sets.hpp"

#include "fem/base/at.hpp"
#include "fem/mesh/element.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <numeric>

namespace flexboom {
namespace {

// Calls `visit` with every node that the mesh refers to outside of its node sets.
void for_each_node(Mesh& mesh, const auto& visit) {
  const auto visit_all = [&visit](std::vector<int>& nodes) {
    for (int& node : nodes) visit(node);
  };
  for (Element& element : mesh.elements) visit_all(element.nodes);
  for (NodalBody& body : mesh.bodies) visit(body.node);
  for (Support& support : mesh.supports) visit(support.node);
  for (RigidConnection& connection : mesh.rigid_connections) {
    visit(connection.reference);
    visit_all(connection.nodes);
  }
  for (DistributingConnection& connection : mesh.distributing_connections) {
    visit(connection.reference);
    visit_all(connection.nodes);
  }
  for (LinearEquation& equation : mesh.equations) {
    for (LinearEquation::Term& term : equation.terms) visit(term.node);
  }
}

void renumber_sets(Mesh& mesh, const std::vector<int>& places, std::vector<std::string>& notes) {
  for (auto set = mesh.node_sets.begin(); set != mesh.node_sets.end();) {
    std::vector<int>& nodes = set->second;
    for (int& node : nodes) node = places[at(node)];
    std::erase(nodes, -1);
    if (nodes.empty()) {
      notes.push_back(fmt::format("node set \"{}\" has no node of an element and was left out", set->first));
      set = mesh.node_sets.erase(set);
    } else {
      ++set;
    }
  }
}

}  // namespace

std::vector<int> sorted_unique(std::vector<int> values) {
  std::ranges::sort(values);
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

void drop_unused_nodes(Mesh& mesh, std::vector<std::string>& notes) {
  const auto count = static_cast<size_t>(mesh.nodes.cols());
  std::vector<int> places(count, -1);
  for_each_node(mesh, [&places](int node) { places[at(node)] = 0; });
  const auto unused = std::ranges::count(places, -1);
  if (unused == 0) return;
  int kept = 0;
  for (int node = 0; node < mesh.nodes.cols(); ++node) {
    if (places[at(node)] < 0) continue;
    mesh.nodes.col(kept) = mesh.nodes.col(node).eval();
    if (!mesh.node_labels.empty()) mesh.node_labels[at(kept)] = mesh.node_labels[at(node)];
    places[at(node)] = kept++;
  }
  mesh.nodes.conservativeResize(Eigen::NoChange, kept);
  if (!mesh.node_labels.empty()) mesh.node_labels.resize(at(kept));
  for_each_node(mesh, [&places](int& node) { node = places[at(node)]; });
  renumber_sets(mesh, places, notes);
  notes.push_back(
      fmt::format("{} node{} of no element {} left out", unused, unused > 1 ? "s" : "", unused > 1 ? "were" : "was"));
}

std::vector<long> file_labels(const std::vector<long>& labels, size_t count) {
  std::vector<long> sorted = labels;
  std::ranges::sort(sorted);
  const bool different = std::ranges::adjacent_find(sorted) == sorted.end();
  if (labels.size() == count && count > 0 && sorted.front() > 0 && different) return labels;
  std::vector<long> counted(count);
  std::iota(counted.begin(), counted.end(), 1L);
  return counted;
}

int turn_wedges(Mesh& mesh) {
  int count = 0;
  for (Element& element : mesh.elements) {
    if (type_of(element).shape != Shape::wedge) continue;
    const auto corner = [&](size_t i) -> Eigen::Vector3d { return mesh.nodes.col(element.nodes[i]); };
    const Eigen::Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
    const Eigen::Vector3d axis = corner(3) + corner(4) + corner(5) - corner(0) - corner(1) - corner(2);
    if (normal.dot(axis) >= 0) continue;
    constexpr std::array<size_t, 15> turned = {3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8, 12, 13, 14};
    const std::vector<int> nodes = element.nodes;
    for (size_t i = 0; i < nodes.size(); ++i) element.nodes[i] = nodes[turned[i]];
    ++count;
  }
  return count;
}

}  // namespace flexboom
