#include "fem/formats/vtk/vtk.hpp"

#include "fem/base/base64.hpp"
#include "fem/base/check.hpp"
#include "fem/base/files.hpp"

#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <iterator>

namespace flexboom {
namespace {

using NamedField = std::pair<std::string, Eigen::MatrixXd>;
using Group = std::pair<std::string, std::vector<int>>;
using Text = std::string;

constexpr Eigen::Index most_ascii_points = 10000;

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

/// Appends data arrays, as text or as base64 of a count of bytes and the bytes.
struct ArrayWriter {
  Text& text;
  bool binary;

  template <class Number>
  void append(std::string_view type, const Text& name, Eigen::Index components, const std::vector<Number>& values) {
    fmt::format_to(end_of(text), R"(<DataArray type="{}" Name="{}")", type, escaped(name));
    if (components > 0) fmt::format_to(end_of(text), " NumberOfComponents=\"{}\"", components);
    fmt::format_to(end_of(text), " format=\"{}\">\n", binary ? "binary" : "ascii");
    binary ? append_binary(values) : append_text(components, values);
    text += "</DataArray>\n";
  }

 private:
  // One line per point or cell (connectivity: 20 numbers, cells differ in length), 17 significant digits.
  template <class Number>
  void append_text(Eigen::Index components, const std::vector<Number>& values) {
    const Eigen::Index line = components > 0 ? components : 20;
    Eigen::Index in_line = 0;
    for (const Number value : values) {
      if constexpr (std::is_floating_point_v<Number>)
        fmt::format_to(end_of(text), "{:.17g} ", value);
      else
        fmt::format_to(end_of(text), "{} ", value);
      if (++in_line < line) continue;
      text.back() = '\n';
      in_line = 0;
    }
    if (in_line > 0) text.back() = '\n';
  }

  template <class Number>
  void append_binary(const std::vector<Number>& values) {
    const std::uint64_t size = values.size() * sizeof(Number);
    std::string bytes(reinterpret_cast<const char*>(&size), sizeof(size));
    bytes.append(reinterpret_cast<const char*>(values.data()), size);
    text += base64(bytes);
    text += '\n';
  }
};

void append_field(ArrayWriter& out, const Text& name, const Eigen::MatrixXd& values) {
  out.append("Float64", name, values.rows(), std::vector<double>(values.data(), values.data() + values.size()));
}

void append_fields(ArrayWriter& out, const char* tag, const std::vector<NamedField>& fields,
                   const std::vector<Group>& groups, size_t count) {
  fmt::format_to(end_of(out.text), "<{}>\n", tag);
  for (const auto& [name, values] : fields) append_field(out, name, values);
  for (const auto& [name, members] : groups) {
    std::vector<std::uint8_t> values(count, 0);
    for (const int member : members) values[static_cast<size_t>(member)] = 1;
    out.append("UInt8", name, 1, values);
  }
  fmt::format_to(end_of(out.text), "</{}>\n", tag);
}

void append_cells(ArrayWriter& out, const std::vector<VtkGrid::Cell>& cells) {
  std::vector<std::int64_t> points, offsets;
  std::vector<std::uint8_t> types;
  for (const VtkGrid::Cell& cell : cells) {
    points.insert(points.end(), cell.points.begin(), cell.points.end());
    offsets.push_back(static_cast<std::int64_t>(points.size()));
    types.push_back(static_cast<std::uint8_t>(cell.type));
  }
  out.text += "<Cells>\n";
  out.append("Int64", "connectivity", 0, points);
  out.append("Int64", "offsets", 1, offsets);
  out.append("UInt8", "types", 1, types);
  out.text += "</Cells>\n";
}

void validate_fields(const char* where, const std::vector<NamedField>& fields, Eigen::Index count) {
  for (const auto& [name, values] : fields) {
    require(values.rows() > 0 && values.cols() == count,
            fmt::format("{} field \"{}\" is {} x {}; it must have {} columns", where, name, values.rows(),
                        values.cols(), count));
    require(values.allFinite(), fmt::format("{} field \"{}\" has a value that is not finite", where, name));
  }
}

void validate_groups(const char* where, const std::vector<Group>& groups, Eigen::Index count) {
  for (const auto& [name, members] : groups) {
    for (const int member : members)
      require(member >= 0 && member < count, fmt::format("{} group \"{}\": {} is missing", where, name, member));
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
  const auto cells = static_cast<Eigen::Index>(grid.cells.size());
  validate_fields("point", grid.point_data, grid.points.cols());
  validate_fields("cell", grid.cell_data, cells);
  validate_groups("point", grid.point_groups, grid.points.cols());
  validate_groups("cell", grid.cell_groups, cells);
}

}  // namespace

void write_vtu(const std::filesystem::path& path, const VtkGrid& grid) {
  try {
    validate(grid);
  } catch (const InputError& error) {
    throw InputError(fmt::format("cannot write {}: {}", path.string(), error.what()));
  }
  const bool little = std::endian::native == std::endian::little;
  // Version 1.0 is the highest that meshio 5.0 opens.
  Text text = fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"{}Endian\" "
      "header_type=\"UInt64\">\n<UnstructuredGrid>\n",
      little ? "Little" : "Big");
  fmt::format_to(end_of(text), "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n<Points>\n", grid.points.cols(),
                 grid.cells.size());
  ArrayWriter out{text, grid.points.cols() > most_ascii_points};
  append_field(out, "Points", grid.points);
  text += "</Points>\n";
  append_cells(out, grid.cells);
  append_fields(out, "PointData", grid.point_data, grid.point_groups, static_cast<size_t>(grid.points.cols()));
  append_fields(out, "CellData", grid.cell_data, grid.cell_groups, grid.cells.size());
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

std::vector<std::pair<double, std::string>> read_pvd(const std::filesystem::path& path) {
  constexpr std::string_view head = "<DataSet timestep=\"", middle = R"(" part="0" file=")", end = "\"/>";
  std::vector<std::pair<double, std::string>> files;
  std::ifstream in(path, std::ios::binary);
  std::string line;
  for (size_t number = 1; std::getline(in, line); ++number) {
    if (!line.starts_with("<DataSet")) continue;
    const size_t split = line.find(middle);
    double time = 0;
    const bool ours = line.starts_with(head) && split != std::string::npos && line.ends_with(end) &&
                      std::from_chars(line.data() + head.size(), line.data() + split, time).ptr == line.data() + split;
    require(ours, fmt::format("{}:{}: is not as flexboom wrote it", path.string(), number));
    const size_t name = split + middle.size();
    files.emplace_back(time, line.substr(name, line.size() - end.size() - name));
  }
  return files;
}

}  // namespace flexboom
