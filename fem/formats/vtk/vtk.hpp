#pragma once

#include "fem/formats/common/mesh_file.hpp"

#include <Eigen/Core>

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace flexboom {

/// An unstructured grid with fields, as VTK's .vtu holds it.
struct VtkGrid {
  struct Cell {
    int type = 0;  // VTK cell type: 3 line, 12 hexahedron, ... (4, polyline, is skipped by meshio)
    std::vector<int> points;
  };
  Eigen::Matrix3Xd points;
  std::vector<Cell> cells;
  std::vector<std::pair<std::string, Eigen::MatrixXd>> point_data;     // name, components x points
  std::vector<std::pair<std::string, Eigen::MatrixXd>> cell_data;      // name, components x cells
  std::vector<std::pair<std::string, std::vector<int>>> point_groups;  // name, members; written as a field of 0 and 1
  std::vector<std::pair<std::string, std::vector<int>>> cell_groups;
};

/// Writes a .vtu: ASCII with 17 significant digits, above 10 000 points base64, both of which meshio and VTK read.
/// @throws InputError when the file cannot be written or a field has the wrong size.
void write_vtu(const std::filesystem::path&, const VtkGrid&);

/// Points and cells of a mesh, point i at or near node i; no fields. Beams become lines, elements of order 1 and 2 the
/// VTK cells of the same shape. "hex" of higher order become Lagrange hexahedra (type 72), whose points are equally
/// spaced in the reference element.
VtkGrid vtk_grid(const Mesh&);

/// Values at the points of vtk_grid(mesh) of a field with the values `nodal` (components x nodes) at the nodes.
Eigen::MatrixXd vtk_point_values(const Mesh&, const Eigen::MatrixXd& nodal);

/// Writes a mesh whole. Node and element sets are fields "set:NAME" of points and cells (1: member). What VTK does not
/// know are fields "flexboom:...": element names, properties, materials, beam sections, supports, bodies (those on one
/// node as one), labels.
/// @throws InputError naming a connection or equation, which it cannot hold.
void write_vtu(const std::filesystem::path&, const Mesh&);

/// Reads a .vtu: ASCII, base64, appended, zlib; either byte order. Sets come from fields "set:NAME" and from integer
/// fields of cells that other programs write, whose numbers are names. Those are gmsh:physical, cell_tags, medit:ref,
/// CellEntityIds, MaterialIDs and their likes. Of cells that are no solids (triangles, lines, ...) the nodes make a
/// node set. Without our own fields there are no materials, and lines are no beams.
/// @throws InputError with file:line:column.
MeshFile read_vtu(std::string_view text, const std::string& file);

/// Writes a .pvd collection of (time [s], file relative to the .pvd).
void write_pvd(const std::filesystem::path&, const std::vector<std::pair<double, std::string>>&);

/// What write_pvd wrote. @throws InputError with file:line for anything else.
std::vector<std::pair<double, std::string>> read_pvd(const std::filesystem::path&);

}  // namespace flexboom
