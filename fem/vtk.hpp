#pragma once

#include <Eigen/Core>

#include <filesystem>
#include <string>
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
  std::vector<std::pair<std::string, Eigen::MatrixXd>> point_data;  // name, components x points
  std::vector<std::pair<std::string, Eigen::MatrixXd>> cell_data;   // name, components x cells
};

/// Writes an ASCII .vtu with 17 significant digits.
/// @throws InputError when the file cannot be written or a field has the wrong size.
void write_vtu(const std::filesystem::path&, const VtkGrid&);

/// Writes a .pvd collection of (time [s], file relative to the .pvd).
void write_pvd(const std::filesystem::path&, const std::vector<std::pair<double, std::string>>&);

}  // namespace flexboom
