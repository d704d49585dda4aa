#include "fem/formats/common/node_orders.hpp"
#include "fem/formats/gmsh/data.hpp"
#include "fem/mesh/element.hpp"
#include "fem/mesh/shape_functions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace flexboom {
namespace {

// Lines, triangles and quadrangles carry sets only: {type, dimension, nodes}. Numbers as in Gmsh's reference manual,
// "MSH file format", those of order above 5 as in its GmshDefines.h.
constexpr std::array<std::array<int, 3>, 48> gmsh_carriers = {{
    {15, 0, 1},  {1, 1, 2},    {8, 1, 3},    {26, 1, 4},  {27, 1, 5},  {28, 1, 6},  {62, 1, 7},  {63, 1, 8},
    {64, 1, 9},  {65, 1, 10},  {66, 1, 11},  {2, 2, 3},   {9, 2, 6},   {20, 2, 9},  {21, 2, 10}, {22, 2, 12},
    {23, 2, 15}, {24, 2, 15},  {25, 2, 21},  {42, 2, 28}, {43, 2, 36}, {44, 2, 45}, {45, 2, 55}, {46, 2, 66},
    {52, 2, 18}, {53, 2, 21},  {54, 2, 24},  {55, 2, 27}, {56, 2, 30}, {3, 2, 4},   {10, 2, 9},  {16, 2, 8},
    {36, 2, 16}, {37, 2, 25},  {38, 2, 36},  {39, 2, 12}, {40, 2, 16}, {41, 2, 20}, {47, 2, 49}, {48, 2, 64},
    {49, 2, 81}, {50, 2, 100}, {51, 2, 121}, {57, 2, 24}, {58, 2, 28}, {59, 2, 32}, {60, 2, 36}, {61, 2, 40},
}};

constexpr int first_high_hexahedron = 92;  // of order 3

// Corners, edges, faces, centre of the triquadratic hexahedron of VTK.
std::vector<int> triquadratic_order() {
  const std::vector<int> lattice = gmsh_hexahedron_order(2), ours = vtk_hexahedron_order(2, false);
  std::vector<int> order;
  order.reserve(lattice.size());
  for (const int node : lattice) order.push_back(static_cast<int>(std::ranges::find(ours, node) - ours.begin()));
  return order;
}

std::vector<GmshKind> all_kinds() {
  std::vector<GmshKind> kinds;
  kinds.reserve(std::size(gmsh_carriers));
  for (const auto& [type, dimension, nodes] : gmsh_carriers) kinds.push_back({type, dimension, nodes, "", 1, {}});
  const std::vector<int> hex27 = triquadratic_order();
  kinds.push_back({4, 3, 4, "tet4", 1, {}});
  kinds.push_back({5, 3, 8, "hex8", 1, {}});
  kinds.push_back({6, 3, 6, "wedge6", 1, {}});
  kinds.push_back({11, 3, 10, "tet10", 2, {0, 1, 2, 3, 4, 5, 6, 7, 9, 8}});
  kinds.push_back({12, 3, 27, "hex27", 2, hex27});
  kinds.push_back({17, 3, 20, "hex20", 2, {hex27.begin(), hex27.begin() + 20}});
  // Edges 01 02 03 12 14 25 34 35 45.
  kinds.push_back({18, 3, 15, "wedge15", 2, {0, 1, 2, 3, 4, 5, 6, 8, 12, 7, 13, 14, 9, 11, 10}});
  for (int p = 3; p <= max_hexahedron_order; ++p) {
    kinds.push_back(
        {first_high_hexahedron + p - 3, 3, (p + 1) * (p + 1) * (p + 1), "hex", p, gmsh_hexahedron_order(p)});
  }
  return kinds;
}

const std::vector<GmshKind>& known_kinds() {
  static const std::vector<GmshKind> all = all_kinds();
  return all;
}

const GmshKind* found(auto matches) {
  const auto kind = std::ranges::find_if(known_kinds(), matches);
  return kind == known_kinds().end() ? nullptr : &*kind;
}

}  // namespace

const GmshKind* gmsh_kind(int type) {
  return found([type](const GmshKind& kind) { return kind.type == type; });
}

const GmshKind* gmsh_kind_of(const Element& element) {
  const ElementType& row = type_of(element);
  if (row.shape == Shape::line) return gmsh_kind(1);
  std::string_view name = row.name;
  if (name.ends_with("-reduced")) name.remove_suffix(std::string_view("-reduced").size());
  if (name == "hex" && element.order <= 2) name = element.order == 1 ? "hex8" : "hex27";
  return found(
      [&](const GmshKind& kind) { return kind.row == name && (name != "hex" || kind.order == element.order); });
}

std::string gmsh_kind_name(int type) {
  const auto is_one_of = [type](std::initializer_list<int> list) { return std::ranges::count(list, type) > 0; };
  if (is_one_of({7, 14, 19}) || (type >= 118 && type <= 131)) return "a pyramid";
  if (type == 13 || (type >= 90 && type <= 91) || (type >= 106 && type <= 117)) return "a prism of 18 nodes or more";
  if (is_one_of({29, 30, 31, 32, 33}) || (type >= 71 && type <= 83)) return "a tetrahedron of order 3 or above";
  if (type >= 98 && type <= 105) return "a hexahedron of order 9 or without inner nodes";
  return "not known here";
}

}  // namespace flexboom
