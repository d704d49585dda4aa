#include "apps/sweep/indices.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexboom {

SobolIndices sobol_indices(size_t variables, size_t points,
                           const std::function<double(size_t point, size_t k)>& value) {
  const size_t runs = runs_per_base_point(variables);
  std::vector<std::vector<double>> kept;  // of each point that is whole
  double mean = 0;                        // of A and B
  for (size_t point = 0; point < points; ++point) {
    std::vector<double> of_point;
    for (size_t k = 0; k < runs; ++k) of_point.push_back(value(point, k));
    if (!std::ranges::all_of(of_point, [](double v) { return std::isfinite(v); })) continue;
    mean += of_point[0] + of_point[1];
    kept.push_back(std::move(of_point));
  }
  SobolIndices indices;
  indices.points = kept.size();
  const auto n = static_cast<double>(kept.size());
  mean /= 2 * n;
  double variance = 0;
  for (const std::vector<double>& f : kept) variance += std::pow(f[0] - mean, 2) + std::pow(f[1] - mean, 2);
  variance /= 2 * n;
  const double round_off = 1e-15 * std::abs(mean);
  const bool varies = kept.size() > 1 && variance > round_off * round_off;
  for (size_t i = 0; i < variables; ++i) {
    double first = 0, total = 0;
    for (const std::vector<double>& f : kept) {
      const double a = f[0] - mean, b = f[1] - mean, ab = f[2 + i] - mean;
      first += b * (ab - a);
      total += std::pow(a - ab, 2);
    }
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    indices.first.push_back(varies ? first / n / variance : none);
    indices.total.push_back(varies ? total / (2 * n) / variance : none);
  }
  return indices;
}

}  // namespace flexboom
