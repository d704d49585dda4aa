#pragma once

#include "fem/mesh/mesh.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace flexboom {

/// A cell type of VTK that stands for a row of the table of elements.
struct VtkSolid {
  int type = 0;
  std::string_view row;         // that a cell of this type is unless a field says otherwise
  int order = 1;                // Element::order
  std::vector<int> node_order;  // point k of the cell is our node node_order[k]; empty: alike
};

/// Type, and order of the points, of the cell that an element becomes.
VtkSolid vtk_solid_of(const Element&);

/// What a solid cell with so many points is read as. Files before version 2.1 number Lagrange hexahedra otherwise. The
/// type is 0 when it is no solid cell that there is an element for.
VtkSolid vtk_solid(int type, size_t points, bool before_2_1);

/// Whether a cell has fewer than three dimensions.
bool is_vtk_carrier(int type);

/// Whether a cell of a type may be the element `row` of the table of elements: as many points and the same shape. That
/// need not be the element it stands for by itself: type 12 may be hex8-reduced.
bool may_be_row(int type, std::string_view row);

/// Names of the fields that only we know.
namespace vtk_field {
inline constexpr std::string_view set = "set:";                    // points and cells: member 1, else 0
inline constexpr std::string_view row = "flexboom:element:";       // cells: of this row of the table 1, else 0
inline constexpr std::string_view named = "flexboom:property:";    // cells: solid property of this name 1, else 0
inline constexpr std::string_view property = "flexboom:property";  // cells: index of the property
inline constexpr std::string_view material = "flexboom:material";  // cells: E, nu, rho
inline constexpr std::string_view order = "flexboom:order";        // cells: Element::order
inline constexpr std::string_view label = "flexboom:label";        // points and cells
inline constexpr std::string_view beam_start = "flexboom:section:start";  // cells: kind of section, six dimensions
inline constexpr std::string_view beam_end = "flexboom:section:end";
inline constexpr std::string_view beam = "flexboom:beam";  // cells: y axis, rotary inertia, shear rule, its value
inline constexpr std::string_view line_mass = "flexboom:line-mass";  // cells: of beams, where any has it
inline constexpr std::string_view support = "flexboom:support";      // points: components held
inline constexpr std::string_view body = "flexboom:body";  // points: m, Jxx Jyy Jzz Jxy Jxz Jyz, offset to mass centre
}  // namespace vtk_field

}  // namespace flexboom
