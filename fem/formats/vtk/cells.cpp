#include "fem/formats/vtk/cells.hpp"

#include "fem/formats/common/node_orders.hpp"
#include "fem/mesh/element.hpp"
#include "fem/mesh/shape_functions.hpp"

#include <algorithm>
#include <array>

namespace flexboom {
namespace {

constexpr int vtk_line = 3, voxel = 11, hexahedron = 12, triquadratic = 29, lagrange_hexahedron = 72;

struct VtkRow {
  int type;
  std::string_view row;
  size_t points;
  int order;
};

// Rows that need no other order of points than ours; types as in vtkCellType.h. Lagrange cells (71, 73) of these orders
// are numbered like the quadratic ones.
constexpr std::array<VtkRow, 10> same_order = {{
    {hexahedron, "hex8", 8, 1},
    {25, "hex20", 20, 2},
    {triquadratic, "hex27", 27, 2},
    {10, "tet4", 4, 1},
    {24, "tet10", 10, 2},
    {13, "wedge6", 6, 1},
    {26, "wedge15", 15, 2},
    {71, "tet4", 4, 1},
    {71, "tet10", 10, 2},
    {73, "wedge6", 6, 1},
}};

constexpr std::array<int, 25> vtk_carriers = {1,  2,  3,  4,  5,  6,  7,  8,  9,  21, 22, 23, 28,
                                              30, 34, 35, 36, 51, 60, 61, 62, 68, 69, 70, 75};

// vtkWedge counts the triangle 0 1 2 with its normal pointing out of the cell, vtkQuadraticWedge into it.
const std::vector<int> linear_wedge_order = {0, 2, 1, 3, 5, 4};

std::string_view full_name(std::string_view row) {
  constexpr std::string_view reduced = "-reduced";
  if (row.ends_with(reduced)) row.remove_suffix(reduced.size());
  return row;
}

}  // namespace

VtkSolid vtk_solid_of(const Element& element) {
  const ElementType& row = type_of(element);
  if (row.shape == Shape::line) return {vtk_line, row.name, element.order, {}};
  if (row.name == "hex") {
    const int type = element.order == 1 ? hexahedron : element.order == 2 ? triquadratic : lagrange_hexahedron;
    return {type, row.name, element.order, vtk_hexahedron_order(element.order, type == lagrange_hexahedron)};
  }
  const auto* const found = std::ranges::find(same_order, full_name(row.name), &VtkRow::row);
  return {found->type, found->row, element.order, found->type == 13 ? linear_wedge_order : std::vector<int>{}};
}

VtkSolid vtk_solid(int type, size_t points, bool before_2_1) {
  if (type == voxel && points == 8) return {type, "hex8", 1, {0, 1, 3, 2, 4, 5, 7, 6}};
  for (const VtkRow& row : same_order) {
    if (row.type == type && row.points == points)
      return {type, row.row, row.order, type == 13 ? linear_wedge_order : std::vector<int>{}};
  }
  for (int p = 1; type == lagrange_hexahedron && p <= max_hexahedron_order; ++p) {
    const size_t n = static_cast<size_t>(p) + 1;
    if (n * n * n == points) return {type, "hex", p, vtk_hexahedron_order(p, before_2_1)};
  }
  return {};
}

bool is_vtk_carrier(int type) { return std::ranges::count(vtk_carriers, type) > 0; }

bool may_be_row(int type, std::string_view row) {
  if (row == "hex") return type == hexahedron || type == triquadratic;
  return std::ranges::any_of(same_order,
                             [&](const VtkRow& known) { return known.type == type && known.row == full_name(row); });
}

}  // namespace flexboom
