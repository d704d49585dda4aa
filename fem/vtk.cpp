#include "fem/vtk.hpp"

#include "fem/check.hpp"
#include "fem/files.hpp"

#include <fmt/format.h>

#include <iterator>

namespace flexboom {
namespace {

using Field = std::pair<std::string, Eigen::MatrixXd>;
using Text = std::string;

auto end_of(Text& text) { return std::back_inserter(text); }

Text escaped(const Text& name) {
  Text result;
  for (char c : name) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '"')
      result += "&quot;";
    else
      result += c;
  }
  return result;
}

// One line per column, 17 significant digits.
void append_array(Text& text, const Text& name, const Eigen::Ref<const Eigen::MatrixXd>& values) {
  fmt::format_to(end_of(text), "<DataArray type=\"Float64\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"ascii\">\n",
                 escaped(name), values.rows());
  for (Eigen::Index j = 0; j < values.cols(); ++j) {
    for (Eigen::Index i = 0; i < values.rows(); ++i) fmt::format_to(end_of(text), "{:.17g} ", values(i, j));
    text.back() = '\n';
  }
  text += "</DataArray>\n";
}

void append_fields(Text& text, const char* tag, const std::vector<Field>& fields) {
  fmt::format_to(end_of(text), "<{}>\n", tag);
  for (const auto& [name, values] : fields) append_array(text, name, values);
  fmt::format_to(end_of(text), "</{}>\n", tag);
}

void append_cells(Text& text, const std::vector<VtkGrid::Cell>& cells) {
  text += "<Cells>\n<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">\n";
  for (const VtkGrid::Cell& cell : cells) {
    for (int point : cell.points) fmt::format_to(end_of(text), "{} ", point);
    text.back() = '\n';
  }
  text += "</DataArray>\n<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">\n";
  size_t offset = 0;
  for (const VtkGrid::Cell& cell : cells) fmt::format_to(end_of(text), "{}\n", offset += cell.points.size());
  text += "</DataArray>\n<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">\n";
  for (const VtkGrid::Cell& cell : cells) fmt::format_to(end_of(text), "{}\n", cell.type);
  text += "</DataArray>\n</Cells>\n";
}

void validate_fields(const char* where, const std::vector<Field>& fields, Eigen::Index count) {
  for (const auto& [name, values] : fields) {
    require(values.rows() > 0 && values.cols() == count,
            fmt::format("{} field \"{}\" is {} x {}; it must have {} columns", where, name, values.rows(),
                        values.cols(), count));
    require(values.allFinite(), fmt::format("{} field \"{}\" has a value that is not finite", where, name));
  }
}

void validate(const VtkGrid& grid) {
  require(grid.points.allFinite(), "points have a coordinate that is not finite");
  for (size_t i = 0; i < grid.cells.size(); ++i) {
    const VtkGrid::Cell& cell = grid.cells[i];
    require(!cell.points.empty(), fmt::format("cell {} has no points", i));
    require(cell.type > 0 && cell.type < 256,
            fmt::format("cell {} has type {}, which VTK does not have", i, cell.type));
    for (int point : cell.points) {
      require(point >= 0 && point < grid.points.cols(), fmt::format("cell {}: point {} is missing", i, point));
    }
  }
  validate_fields("point", grid.point_data, grid.points.cols());
  validate_fields("cell", grid.cell_data, static_cast<Eigen::Index>(grid.cells.size()));
}

}  // namespace

void write_vtu(const std::filesystem::path& path, const VtkGrid& grid) {
  try {
    validate(grid);
  } catch (const InputError& error) {
    throw InputError(fmt::format("cannot write {}: {}", path.string(), error.what()));
  }
  Text text =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n<UnstructuredGrid>\n";
  fmt::format_to(end_of(text), "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n<Points>\n", grid.points.cols(),
                 grid.cells.size());
  append_array(text, "Points", grid.points);
  text += "</Points>\n";
  append_cells(text, grid.cells);
  append_fields(text, "PointData", grid.point_data);
  append_fields(text, "CellData", grid.cell_data);
  text += "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
  write_file(path, text);
}

void write_pvd(const std::filesystem::path& path, const std::vector<std::pair<double, std::string>>& files) {
  Text text =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" "
      "byte_order=\"LittleEndian\">\n<Collection>\n";
  for (const auto& [time, file] : files) {
    fmt::format_to(end_of(text), "<DataSet timestep=\"{:.17g}\" part=\"0\" file=\"{}\"/>\n", time, escaped(file));
  }
  text += "</Collection>\n</VTKFile>\n";
  write_file(path, text);
}

}  // namespace flexboom
