#include "fem/booms/solid_cells.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace flexboom {
namespace {

using Cell = std::vector<int>;
using Cells = std::vector<std::vector<int>>;

// Corners of a hexahedron in the order of VTK and Abaqus, as steps (i, j, k) of 0 or 1.
constexpr std::array<std::array<int, 3>, 8> corners = {
    {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}};
constexpr std::array<std::array<int, 2>, 12> hex_edges = {
    {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6}, {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}}};
// -x +x -y +y -z +z, each counter-clockwise seen from outside.
constexpr std::array<std::array<int, 4>, 6> hex_faces = {
    {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}}};
constexpr std::array<std::array<int, 2>, 6> tet_edges = {{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};

// Node of a lattice of order `order` (1 or 2) in the middle of corners a and b (a == b: the corner).
int middle(const Cell& cell, int order, int a, int b) {
  std::array<size_t, 3> at{};
  for (size_t d = 0; d < 3; ++d) {
    at[d] = static_cast<size_t>(order * (corners[static_cast<size_t>(a)][d] + corners[static_cast<size_t>(b)][d]) / 2);
  }
  const size_t n = static_cast<size_t>(order) + 1;
  return cell[at[0] + n * (at[1] + n * at[2])];
}

Cells whole(const Cell& cell, int) { return {cell}; }

Cells hex_of(const Cell& cell, int order, bool faces) {
  Cell nodes;
  for (int c = 0; c < 8; ++c) nodes.push_back(middle(cell, order, c, c));
  if (order == 2) {
    for (const auto& [a, b] : hex_edges) nodes.push_back(middle(cell, order, a, b));
  }
  if (faces) {
    for (const auto& face : hex_faces) nodes.push_back(middle(cell, order, face[0], face[2]));
    nodes.push_back(middle(cell, order, 0, 6));
  }
  return {nodes};
}

Cells linear_hex(const Cell& cell, int order) { return hex_of(cell, order, false); }
Cells serendipity_hex(const Cell& cell, int order) { return hex_of(cell, order, false); }
Cells full_hex(const Cell& cell, int order) { return hex_of(cell, order, true); }

// Six tetrahedra. The corner of smallest number is the tip of a pyramid over each face that it is not on. A face is cut
// through its corner of smallest number. Both sides of a face see the same numbers, so cuts conform.
Cells tetrahedra(const Cell& cell, int order) {
  const auto number = [&](int c) { return middle(cell, order, c, c); };
  int tip = 0;
  for (int c = 1; c < 8; ++c) tip = number(c) < number(tip) ? c : tip;
  Cells cells;
  for (std::array<int, 4> face : hex_faces) {
    if (std::find(face.begin(), face.end(), tip) != face.end()) continue;
    std::rotate(face.begin(),
                std::min_element(face.begin(), face.end(), [&](int a, int b) { return number(a) < number(b); }),
                face.end());
    for (size_t half = 1; half < 3; ++half) {
      // The face is counter-clockwise from outside, so its reverse is counter-clockwise from the tip's far side.
      const std::array<int, 4> tet = {face[0], face[half + 1], face[half], tip};
      Cell nodes;
      for (const int c : tet) nodes.push_back(number(c));
      for (const auto& [a, b] : tet_edges) {
        if (order == 2) {
          nodes.push_back(middle(cell, order, tet[static_cast<size_t>(a)], tet[static_cast<size_t>(b)]));
        }
      }
      cells.push_back(std::move(nodes));
    }
  }
  return cells;
}

constexpr std::array<CellKind, 8> kinds = {{{"hex", 0, whole},
                                            {"hex8", 1, linear_hex},
                                            {"hex8-reduced", 1, linear_hex},
                                            {"hex20", 2, serendipity_hex},
                                            {"hex20-reduced", 2, serendipity_hex},
                                            {"hex27", 2, full_hex},
                                            {"tet4", 1, tetrahedra},
                                            {"tet10", 2, tetrahedra}}};

}  // namespace

std::span<const CellKind> cell_kinds() { return kinds; }

const CellKind& cell_kind(std::string_view name) {
  const auto* const found =
      std::find_if(kinds.begin(), kinds.end(), [&](const CellKind& kind) { return kind.name == name; });
  if (found != kinds.end()) return *found;
  std::string names;
  for (const CellKind& kind : kinds) names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", kind.name);
  throw InputError(fmt::format("element: \"{}\" is not known; a solid boom is made of {}", name, names));
}

std::vector<double> remove_unused_nodes(Mesh& mesh, const std::vector<double>& values) {
  std::vector<int> renumbered(static_cast<size_t>(mesh.nodes.cols()), -1);
  int count = 0;
  for (Element& element : mesh.elements) {
    for (int& node : element.nodes) {
      int& number = renumbered[static_cast<size_t>(node)];
      if (number < 0) number = count++;
      node = number;
    }
  }
  Eigen::Matrix3Xd nodes(3, count);
  std::vector<double> kept_values(values.empty() ? 0 : static_cast<size_t>(count));
  for (size_t i = 0; i < renumbered.size(); ++i) {
    if (renumbered[i] < 0) continue;
    nodes.col(renumbered[i]) = mesh.nodes.col(static_cast<Eigen::Index>(i));
    if (!values.empty()) kept_values[static_cast<size_t>(renumbered[i])] = values[i];
  }
  mesh.nodes = std::move(nodes);
  for (auto& [name, set] : mesh.node_sets) {
    std::vector<int> kept;
    for (const int i : set) {
      if (renumbered[static_cast<size_t>(i)] >= 0) kept.push_back(renumbered[static_cast<size_t>(i)]);
    }
    std::sort(kept.begin(), kept.end());
    set = std::move(kept);
  }
  return kept_values;
}

}  // namespace flexboom
