#include "apps/accuracy/late_vibrations.hpp"

#include "apps/accuracy/output_errors.hpp"
#include "apps/base/deflection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom {

using Eigen::ArrayXd;
using Eigen::Index;

namespace {

/// How late the vibrations of a body are at each output [s].
ArrayXd lag_of(const PreparedBody& p, const OutputTable& outputs) {
  const Index rows = outputs.values.rows(), stride = rows / most_deflections + 1;
  ArrayXd lag = ArrayXd::Zero(rows);
  if (p.body.n() == 0) return lag;
  const Deflection deflection(p.body);
  const Eigen::MatrixXd q = coordinates_of(outputs, p.body);
  const auto rate = [&](Index row) {
    return std::pow(deflection.largest(q.row(row).transpose()) / deflection.length(), 2);
  };
  for (Index row = 0; row + 1 < rows; row += stride) {
    const Index next = std::min(row + stride, rows - 1);
    const double since = outputs.values(row, 0), mean = (rate(row) + rate(next)) / 2;
    for (Index k = row + 1; k <= next; ++k) lag[k] = lag[row] + mean * (outputs.values(k, 0) - since);
  }
  return lag;
}

/// Of each body and joint by name; of "" the largest of all.
std::map<std::string, ArrayXd> lags_of(const Run& run, const Scene& scene) {
  std::map<std::string, ArrayXd> lags;
  ArrayXd most = ArrayXd::Zero(run.outputs.values.rows());
  for (const PreparedBody& p : run.bodies) {
    const ArrayXd& lag = lags[p.body.name] = lag_of(p, run.outputs);
    most = most.max(lag);
  }
  for (const PreparedBody& p : run.bodies)
    if (p.body.n() == 0) lags.erase(p.body.name);  // it feels those that bend
  for (const JointScene& j : with_joints(scene).joints) {
    if (!lags.contains(j.a.body) && !lags.contains(j.b.body)) continue;
    ArrayXd lag = ArrayXd::Zero(most.size());
    for (const std::string& body : {j.a.body, j.b.body})
      if (const auto found = lags.find(body); found != lags.end()) lag = lag.max(found->second);
    if (!j.name.empty()) lags.emplace(j.name, std::move(lag));
  }
  lags[""] = std::move(most);
  return lags;
}

/// A time between two rows: after `before`, by a share of the way to the next one.
struct Ago {
  Index before = 0;
  double share = 0;
};

/// What was a lag ago, at each row.
std::vector<Ago> rows_ago(const OutputTable& table, const ArrayXd& lag) {
  const auto time = table.values.col(0);
  std::vector<Ago> rows(static_cast<size_t>(lag.size()));
  Index before = 0;
  for (Index row = 1; row < lag.size(); ++row) {
    const double t = time[row] - lag[row];
    while (before + 1 < row && time[before + 1] <= t) ++before;
    const double from = time[before], to = time[before + 1];
    rows[static_cast<size_t>(row)] = {before, to > from ? std::clamp((t - from) / (to - from), 0.0, 1.0) : 1};
  }
  return rows;
}

}  // namespace

std::vector<std::string> prescribed_outputs(const Scene& scene) {
  std::vector<std::string> names;
  for (const JointScene& j : scene.joints) {
    if (j.motion.empty()) continue;
    const ScalarOutputs scalars = scalar_outputs(j.kind);
    for (const auto whats : {scalars.values, scalars.rates})
      for (const std::string_view what : whats) names.push_back(fmt::format("{}{}", j.name, what));
  }
  return names;
}

OutputTable with_late_vibrations(const Run& run, const Scene& scene) {
  const OutputTable& now = run.outputs;
  std::map<std::string, std::vector<Ago>> ago;
  for (const auto& [name, lag] : lags_of(run, scene)) ago[name] = rows_ago(now, lag);
  const std::vector<std::string> given = prescribed_outputs(scene);
  OutputTable late = now;
  for (size_t i = 0; i < now.names.size(); ++i) {
    const std::string& name = now.names[i];
    if (name == "t" || is_coordinate(name) || std::ranges::find(given, name) != given.end()) continue;
    const auto of_name = ago.find(name.substr(0, name.find('.')));
    const std::vector<Ago>& rows = of_name != ago.end() ? of_name->second : ago.at("");
    const auto column = static_cast<Index>(i);
    const bool turns = name.find(".rotation.") != std::string::npos;
    for (size_t row = 1; row < rows.size(); ++row) {
      const double a = now.values(rows[row].before, column), b = now.values(rows[row].before + 1, column);
      const bool jumps = turns && std::abs(b - a) > std::numbers::pi;
      if (!jumps) late.values(static_cast<Index>(row), column) = std::lerp(a, b, rows[row].share);
    }
  }
  return late;
}

}  // namespace flexboom
