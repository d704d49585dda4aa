#include "reduction/basis/interface_nodes.hpp"

#include "fem/base/check.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <string_view>
#include <utility>

namespace flexboom {
namespace {

constexpr std::array<std::string_view, 6> motions = {"ux", "uy", "uz", "rx", "ry", "rz"};
constexpr std::array<std::string_view, 6> loads = {"Fx", "Fy", "Fz", "Mx", "My", "Mz"};

/// A node at the centre of others that holds them or follows them.
int add_reference_node(Mesh& mesh, const std::vector<int>& nodes, const InterfacePlan& plan) {
  const auto reference = static_cast<int>(mesh.nodes.cols());
  const Eigen::Vector3d centre = mesh.nodes(Eigen::all, nodes).rowwise().mean();
  mesh.nodes.conservativeResize(Eigen::NoChange, reference + 1);
  mesh.nodes.col(reference) = centre;
  if (!mesh.node_labels.empty()) mesh.node_labels.push_back(*std::ranges::max_element(mesh.node_labels) + 1);
  if (plan.connection == "rigid") {
    mesh.rigid_connections.push_back({reference, nodes});
  } else {
    mesh.distributing_connections.push_back({reference, nodes, std::vector<double>(nodes.size(), 1.0)});
  }
  return reference;
}

}  // namespace

std::vector<InterfaceNode> place_interfaces(Mesh& mesh, const std::vector<InterfacePlan>& plans) {
  std::vector<InterfaceNode> placed;
  std::set<std::string> names;
  for (const InterfacePlan& plan : plans) {
    require(names.insert(plan.name).second, "interface \"" + plan.name + "\" is given twice");
    require(plan.connection == "rigid" || plan.connection == "distributing",
            "interface \"" + plan.name + "\": connection \"" + plan.connection +
                R"(" is unknown; there are "rigid" and "distributing")");
    const std::vector<int> nodes = node_set(mesh, plan.node_set);
    require(!nodes.empty(), "interface \"" + plan.name + "\": node set \"" + plan.node_set + "\" is empty");
    const int node = nodes.size() == 1 ? nodes.front() : add_reference_node(mesh, nodes, plan);
    placed.push_back({plan.name, node, plan.components});
  }
  return placed;
}

std::vector<int> kept_freedoms(const DofMap& dofs, InterfaceNode& interface) {
  std::vector<int> freedoms;
  for (int k = 0; k < 6; ++k) {
    bool& kept = interface.components[static_cast<size_t>(k)];
    const int dof = dofs.of_node(interface.node, k);
    kept = kept && k < dofs.freedoms_of(interface.node) && !dofs.absent[static_cast<size_t>(dof)];
    if (kept) freedoms.push_back(dof);
  }
  require(!freedoms.empty(), "interface \"" + interface.name + "\" keeps no freedom that its node has");
  return freedoms;
}

std::string motion_name(int component) { return std::string(motions.at(static_cast<size_t>(component))); }

std::string load_name(int component) { return std::string(loads.at(static_cast<size_t>(component))); }

int component_of(const std::string& name) {
  for (size_t k = 0; k < 6; ++k) {
    if (name == motions[k] || name == loads[k]) return static_cast<int>(k);
  }
  throw InputError("direction \"" + name + "\" is unknown; there are ux uy uz rx ry rz and Fx Fy Fz Mx My Mz");
}

}  // namespace flexboom
