#include "apps/simulate/output_table.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <vector>

namespace flexboom {

namespace {

/// What follows the last dot.
std::string last_word(const std::string& column) {
  const auto dot = column.rfind('.');
  return dot == std::string::npos ? column : column.substr(dot + 1);
}

}  // namespace

std::string output_of_column(const std::string& column) {
  const std::string last = last_word(column);
  if (last.size() == column.size()) return column;
  std::string first = column.substr(0, column.size() - last.size() - 1);
  if (last == "x" || last == "y" || last == "z") return first;
  if (last.size() > 1 && last[0] == 'q' && std::isdigit(static_cast<unsigned char>(last[1]))) return first + ".q";
  return column;
}

bool is_coordinate(const std::string& column) { return output_of_column(column).ends_with(".q"); }

bool is_pointing(const std::string& output) { return output.ends_with(".pointing") || output.starts_with("lvlh."); }

bool is_load(const std::string& output) {
  const std::string what = last_word(output);
  return what == "force" || what == "torque" || what.starts_with("drive");
}

Eigen::MatrixXd coordinates_of(const OutputTable& outputs, const ReducedBody& body) {
  if (body.n() == 0) return Eigen::MatrixXd(outputs.values.rows(), 0);
  const auto first = std::ranges::find(outputs.names, body.name + ".q1") - outputs.names.begin();
  require(first + body.n() <= outputs.values.cols(), fmt::format("outputs have no coordinates of body {}", body.name));
  return outputs.values.middleCols(first, body.n());
}

OutputTable without_coordinates(const OutputTable& table) {
  OutputTable r;
  std::vector<Eigen::Index> kept;
  for (size_t i = 0; i < table.names.size(); ++i) {
    if (is_coordinate(table.names[i])) continue;
    r.names.push_back(table.names[i]);
    kept.push_back(static_cast<Eigen::Index>(i));
  }
  r.values = table.values(Eigen::all, kept);
  return r;
}

}  // namespace flexboom
