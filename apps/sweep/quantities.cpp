#include "apps/sweep/quantities.hpp"

#include "apps/base/toml_reader.hpp"
#include "apps/base/usage.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

namespace flexboom {

using Eigen::VectorXd;

namespace {

std::optional<Eigen::Index> column_named(const std::vector<std::string>& columns, const std::string& name) {
  const auto found = std::find(columns.begin(), columns.end(), name);
  if (found == columns.end()) return {};
  return found - columns.begin();
}

/// Of a column its values, of a vector its lengths.
std::optional<VectorXd> course_of_output(const OutputTable& table, const std::string& output) {
  if (const auto column = column_named(table.names, output)) return table.values.col(*column);
  const auto x = column_named(table.names, output + ".x");
  if (!x) return {};
  return table.values.middleCols<3>(*x).rowwise().norm();
}

bool is_there(const std::string& output, const std::vector<std::string>& columns) {
  return column_named(columns, output) || column_named(columns, output + ".x");
}

bool is_component_of(std::string_view column, std::string_view output) {
  return column.size() > 2 && column[column.size() - 2] == '.' && column.substr(0, column.size() - 2).ends_with(output);
}

/// Integral over time by the trapezoidal rule, divided by the time. Rows may repeat a time.
double mean_over_time(const VectorXd& t, const VectorXd& y) {
  const Eigen::Index n = t.size();
  const double duration = t[n - 1] - t[0];
  if (n < 2 || !(duration > 0)) return y.mean();
  return (t.tail(n - 1) - t.head(n - 1)).dot(y.tail(n - 1) + y.head(n - 1)) / (2 * duration);
}

double settling_time(const VectorXd& t, const VectorXd& y, double fraction) {
  const VectorXd distance = (y.array() - y[y.size() - 1]).abs();
  const double band = fraction * distance.maxCoeff();
  for (Eigen::Index row = t.size(); row > 0; --row)
    if (distance[row - 1] > band) return t[row - 1];
  return t[0];
}

}  // namespace

Quantity quantity_of(const std::string& text) {
  constexpr std::array<std::string_view, 3> kinds = {"max", "rms", "final"};
  const std::string usage =
      fmt::format("--quantity {}: is written COLUMN:max, COLUMN:rms, COLUMN:final or settle:COLUMN:FRACTION", text);
  const size_t last = text.rfind(':');
  require_usage(last != std::string::npos && last > 0 && last + 1 < text.size(), usage);
  const std::string behind = text.substr(last + 1);
  Quantity q;
  q.name = text;
  if (!text.starts_with("settle:")) {
    const auto* const kind = std::find(kinds.begin(), kinds.end(), behind);
    require_usage(kind != kinds.end(), usage);
    q.output = text.substr(0, last);
    q.kind = static_cast<Quantity::Kind>(kind - kinds.begin());
    return q;
  }
  const size_t begin = std::string_view("settle:").size();
  require_usage(last > begin, usage);
  q.output = text.substr(begin, last - begin);
  q.kind = Quantity::Kind::settle;
  const auto [end, error] = std::from_chars(behind.data(), behind.data() + behind.size(), q.fraction);
  require_usage(error == std::errc() && end == behind.data() + behind.size() && q.fraction > 0 && q.fraction < 1,
                fmt::format("--quantity {}: the fraction '{}' must be a number between 0 and 1", text, behind));
  return q;
}

std::vector<Quantity> default_quantities(const std::vector<std::string>& columns) {
  std::vector<Quantity> quantities;
  const auto add = [&](const std::string& output, const char* kind) {
    quantities.push_back(quantity_of(fmt::format("{}:{}", output, kind)));
  };
  for (const std::string& column : columns) {
    const bool angle = column.ends_with(".angle") || column.ends_with(".angle1") || column.ends_with(".angle2") ||
                       column.ends_with(".length");
    const bool component =
        is_component_of(column, ".rotation") || is_component_of(column, ".pointing") || is_component_of(column, ".tip");
    if (angle || component || column.starts_with("lvlh.")) add(column, "max"), add(column, "rms");
  }
  for (const std::string& column : columns)
    if (column.ends_with(".force.x") || column.ends_with(".torque.x")) add(column.substr(0, column.size() - 2), "max");
  return quantities;
}

void check_quantities(const std::vector<Quantity>& quantities, const std::vector<std::string>& columns) {
  std::vector<std::string> outputs = columns;
  for (const std::string& column : columns)
    if (column.ends_with(".x")) outputs.push_back(column.substr(0, column.size() - 2));
  for (const Quantity& q : quantities) {
    if (is_there(q.output, columns)) continue;
    const std::vector<std::string_view> views(outputs.begin(), outputs.end());
    throw InputError(fmt::format("--quantity {}: there is no output \"{}\"; {}there are {}", q.name, q.output,
                                 toml_reader::question(q.output, views), fmt::join(columns, ", ")));
  }
}

double value_of(const Quantity& q, const OutputTable& table) {
  const std::optional<VectorXd> course = course_of_output(table, q.output);
  if (!course || course->size() == 0) return std::numeric_limits<double>::quiet_NaN();
  const VectorXd& y = *course;
  const VectorXd t = table.values.col(0);
  switch (q.kind) {
    case Quantity::Kind::max:
      return y.cwiseAbs().maxCoeff();
    case Quantity::Kind::rms:
      return std::sqrt(mean_over_time(t, y.array().square()));
    case Quantity::Kind::final:
      return y[y.size() - 1];
    case Quantity::Kind::settle:
      return settling_time(t, y, q.fraction);
  }
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace flexboom
