#include "reduction/matrix_model.hpp"

#include "fem/check.hpp"
#include "fem/files.hpp"
#include "fem/text_reader.hpp"
#include "reduction/matrix_market.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ostream>
#include <system_error>

namespace flexboom {
namespace {

namespace fs = std::filesystem;
using Eigen::Index;
using Eigen::MatrixXd;
using Freedom = MatrixModel::Freedom;

/// A line of freedoms.csv in parts.
std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (size_t start = 0; start <= line.size();) {
    const size_t end = std::min(line.find(',', start), line.size());
    cells.push_back(line.substr(start, end - start));
    start = end + 1;
  }
  return cells;
}

constexpr std::string_view map_header = "row,node,element,component,label";

void write_freedoms(const fs::path& path, const std::vector<Freedom>& freedoms) {
  write_file(path, [&](std::ostream& out) {
    out << map_header << '\n';
    for (size_t row = 0; row < freedoms.size(); ++row) {
      const Freedom& f = freedoms[row];
      out << fmt::format("{},{},{},{},{}\n", row, f.node, f.element, f.component, f.label);
    }
  });
}

std::vector<Freedom> read_freedoms(const fs::path& path) {
  const std::string text = file_bytes(path);
  TextReader reader(text, path.string());
  const std::string_view header = reader.next_line().value_or("");
  if (trimmed(header) != map_header) reader.fail(header, "the first line must be \"" + std::string(map_header) + "\"");
  std::vector<Freedom> freedoms;
  while (const auto line = reader.next_line()) {
    if (trimmed(*line).empty()) continue;
    const std::vector<std::string_view> cells = cells_of(trimmed(*line));
    if (cells.size() != 5) reader.fail(*line, "five numbers expected");
    std::array<long, 5> values{};
    for (size_t i = 0; i < 5; ++i) {
      const auto value = to_integer(cells[i]);
      if (!value) reader.fail(cells[i], "not an integer: " + quoted(cells[i]));
      values[i] = *value;
    }
    if (values[0] != std::ssize(freedoms)) reader.fail(*line, "rows must be counted 0, 1, 2, ...");
    freedoms.push_back(
        {static_cast<int>(values[1]), static_cast<int>(values[2]), static_cast<int>(values[3]), values[4]});
  }
  return freedoms;
}

}  // namespace

MatrixModel matrix_model(const Mesh& mesh, const Assembly& assembly, const Unknowns& unknowns) {
  const DofMap& dofs = assembly.dofs;
  MatrixModel model;
  model.K = unknowns.reduced(assembly.K);
  model.M = unknowns.reduced(assembly.M);
  model.freedoms.resize(static_cast<size_t>(unknowns.count));
  model.T.resize(unknowns.count, 6);
  const MatrixXd T = rigid_motions(mesh, dofs);
  const auto add = [&](int freedom, Freedom what) {
    const int row = unknowns.of_freedom[static_cast<size_t>(freedom)];
    if (row < 0) return;
    model.freedoms[static_cast<size_t>(row)] = what;
    model.T.row(row) = T.row(freedom);
  };
  for (int node = 0; node < mesh.nodes.cols(); ++node) {
    for (int c = 0; c < dofs.freedoms_of(node); ++c) add(dofs.of_node(node, c), {node, -1, c, mesh.node_label(node)});
  }
  for (int e = 0; e < static_cast<int>(mesh.elements.size()); ++e) {
    const int first = dofs.element_offset[static_cast<size_t>(e)];
    const int last = dofs.element_offset[static_cast<size_t>(e) + 1];
    for (int freedom = first; freedom < last; ++freedom) {
      add(freedom, {-1, e, freedom - first, mesh.element_label(e)});
    }
  }
  return model;
}

void write_matrix_market(const fs::path& folder, const MatrixModel& model) {
  std::error_code error;
  fs::create_directories(folder, error);
  require(!error, fmt::format("cannot make the folder {}: {}", folder.string(), error.message()));
  const std::string map = "SI; rows in freedoms.csv; rigid motions in T.mtx";
  write_mtx(folder / "K.mtx", model.K, "Stiffness [N/m, N, N m]. " + map);
  write_mtx(folder / "M.mtx", model.M, "Consistent mass [kg, kg m, kg m^2]. " + map);
  write_mtx(folder / "T.mtx", model.T, "Rigid motions: ux uy uz, rotations about x y z of the body origin");
  write_freedoms(folder / "freedoms.csv", model.freedoms);
}

MatrixModel read_matrix_market(const fs::path& folder) {
  MatrixModel model;
  model.K = read_mtx(folder / "K.mtx");
  model.M = read_mtx(folder / "M.mtx");
  model.T = read_mtx_array(folder / "T.mtx");
  model.freedoms = read_freedoms(folder / "freedoms.csv");
  const Index n = model.K.rows();
  require(model.K.cols() == n && model.M.rows() == n && model.M.cols() == n && model.T.rows() == n &&
              model.T.cols() == 6 && std::ssize(model.freedoms) == n,
          folder.string() + ": K.mtx, M.mtx, T.mtx and freedoms.csv do not have the same number of rows");
  return model;
}

}  // namespace flexboom
