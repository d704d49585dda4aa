#include "fem/assembly/idle_freedoms.hpp"

#include "fem/base/at.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <numeric>

namespace flexboom {
std::string freedom_name(const Mesh& mesh, const DofMap& dofs, int freedom) {
  constexpr std::array names = {"ux", "uy", "uz", "rx", "ry", "rz"};
  if (freedom < dofs.node_offset.back()) {
    const auto next = std::ranges::upper_bound(dofs.node_offset, freedom);
    const auto node = static_cast<int>(next - dofs.node_offset.begin()) - 1;
    return fmt::format("{} of node {}", names[at(freedom - dofs.of_node(node, 0))], mesh.node_label(node));
  }
  const auto next = std::ranges::upper_bound(dofs.element_offset, freedom);
  const auto element = static_cast<int>(next - dofs.element_offset.begin()) - 1;
  return fmt::format("an internal freedom of element {}", mesh.element_label(element));
}

std::vector<char> strained_freedoms(const Mesh& mesh, const DofMap& dofs) {
  std::vector<char> strained(at(dofs.count), 0);
  for (int e = 0; e < std::ssize(mesh.elements); ++e) {
    for (const int dof : dofs.of_element(mesh, e)) strained[at(dof)] = !dofs.absent[at(dof)];
  }
  return strained;
}

std::vector<char> idle_freedoms(const Mesh& mesh, const DofMap& dofs) {
  std::vector<char> idle = strained_freedoms(mesh, dofs);
  std::ranges::transform(idle, idle.begin(), [](char strained) { return static_cast<char>(!strained); });
  for (const NodalBody& body : mesh.bodies) {
    const auto about = body.mass * (body.offset.squaredNorm() - body.offset.array().square());
    for (int k = 0; k < dofs.freedoms_of(body.node); ++k) {
      const double mass = k < 3 ? body.mass : body.inertia(k - 3, k - 3) + about(k - 3);
      if (mass != 0) idle[at(dofs.of_node(body.node, k))] = 0;
    }
  }
  return idle;
}

std::vector<IdleGroup> idle_groups(const std::vector<std::vector<std::pair<int, double>>>& rows, int count) {
  std::vector<int> parent(at(count));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&parent](int i) {
    while (parent[at(i)] != i) i = parent[at(i)] = parent[at(parent[at(i)])];
    return i;
  };
  for (const auto& row : rows) {
    for (const auto& [dof, coefficient] : row) parent[at(root(dof))] = root(row.front().first);
  }
  std::map<int, IdleGroup> groups;
  for (size_t i = 0; i < rows.size(); ++i) groups[root(rows[i].front().first)].rows.push_back(static_cast<int>(i));
  std::vector<IdleGroup> result;
  for (auto& [name, group] : groups) {
    std::map<int, Eigen::Index> column;
    for (const int row : group.rows) {
      for (const auto& [dof, coefficient] : rows[at(row)]) {
        if (column.try_emplace(dof, std::ssize(column)).second) group.freedoms.push_back(dof);
      }
    }
    group.A.setZero(std::ssize(group.rows), std::ssize(column));
    for (Eigen::Index i = 0; i < group.A.rows(); ++i) {
      for (const auto& [dof, coefficient] : rows[at(group.rows[static_cast<size_t>(i)])])
        group.A(i, column.at(dof)) += coefficient;
    }
    result.push_back(std::move(group));
  }
  return result;
}

}  // namespace flexboom
