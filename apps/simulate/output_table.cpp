#include "apps/simulate/output_table.hpp"

#include "apps/scene/wanted_accuracy.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string_view>
#include <vector>

namespace flexboom {

std::string output_of_column(const std::string& column) {
  const size_t dot = column.rfind('.');
  if (dot == std::string::npos) return column;
  std::string first = column.substr(0, dot);
  const std::string last = column.substr(dot + 1);
  if (last == "x" || last == "y" || last == "z") return first;
  if (last.size() > 1 && last[0] == 'q' && std::isdigit(static_cast<unsigned char>(last[1]))) return first + ".q";
  return column;
}

bool is_coordinate(const std::string& column) { return output_of_column(column).ends_with(".q"); }

bool is_pointing(const std::string& output) { return output.ends_with(".pointing") || output.starts_with("lvlh."); }

bool is_load(const std::string& output) {
  const std::string_view unit = unit_of(output, {});  // that of its drive is one of the two, too, where a joint slides
  return unit == "N" || unit == "N m";
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
