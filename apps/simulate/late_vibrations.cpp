#include "apps/simulate/late_vibrations.hpp"

#include "apps/base/deflection.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>

namespace flexboom {

using Eigen::ArrayXd;
using Eigen::Index;

namespace {

constexpr Index most_samples = 20000;  // of a deflection

/// How late the vibrations of a body are at each output [s].
ArrayXd lag_of(const PreparedBody& p, const OutputTable& outputs) {
  const Index rows = outputs.values.rows(), stride = rows / most_samples + 1;
  ArrayXd lag = ArrayXd::Zero(rows);
  if (p.body.n() == 0) return lag;
  const Deflection deflection(p.body);
  const auto first = std::ranges::find(outputs.names, p.body.name + ".q1") - outputs.names.begin();
  const auto rate = [&](Index row) {
    const Eigen::VectorXd q = outputs.values.row(row).segment(first, p.body.n()).transpose();
    return std::pow(deflection.largest(q) / deflection.length(), 2);
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

}  // namespace

OutputTable with_late_vibrations(const Run& run, const Scene& scene) {
  const std::map<std::string, ArrayXd> lags = lags_of(run, scene);
  const OutputTable& now = run.outputs;
  OutputTable late = now;
  for (size_t i = 0; i < now.names.size(); ++i) {
    const auto of_name = lags.find(now.names[i].substr(0, now.names[i].find('.')));
    const ArrayXd& lag = of_name != lags.end() ? of_name->second : lags.at("");
    const auto column = static_cast<Index>(i);
    if (now.names[i] == "t") continue;
    Index before = 0;  // the last row that is not after the time looked for
    for (Index row = 1; row < now.values.rows(); ++row) {
      const double t = now.values(row, 0) - lag[row];
      while (before + 1 < row && now.values(before + 1, 0) <= t) ++before;
      const double from = now.values(before, 0), to = now.values(before + 1, 0);
      const double a = now.values(before, column), b = now.values(before + 1, column);
      const bool jumps = std::abs(b - a) > std::numbers::pi && now.names[i].find(".rotation.") != std::string::npos;
      if (!jumps && to > from)
        late.values(row, column) = std::lerp(a, b, std::clamp((t - from) / (to - from), 0.0, 1.0));
    }
  }
  return late;
}

}  // namespace flexboom
