#pragma once

#include <cstddef>
#include <functional>
#include <vector>

namespace flexboom {

/// Shares of the variance of a quantity by the variables behind it.
struct SobolIndices {
  std::vector<double> first;  // of each variable by itself
  std::vector<double> total;  // with all that it does together with others
  size_t points = 0;          // base points of which every run has a value
};

/// The runs of one base point: those of the points A and B, and of A with coordinate i of B.
inline size_t runs_per_base_point(size_t variables) { return variables + 2; }

/// Which coordinate of a point in twice as many dimensions run `k` of a base point takes for `variable`: those of A
/// come first, those of B behind them.
inline size_t coordinate_of_base_point(size_t variables, size_t k, size_t variable) {
  const bool of_b = k == 1 || (k >= 2 && k - 2 == variable);
  return of_b ? variables + variable : variable;
}

/// First-order indices by Saltelli et al., Comput. Phys. Commun. 181 (2010), table 2 (b), total ones by Jansen, ibid.
/// (f). `value(point, k)`: of run k of a base point, NaN where there is none; the point is then left out. Indices are
/// NaN where the quantity does not vary.
SobolIndices sobol_indices(size_t variables, size_t points, const std::function<double(size_t point, size_t k)>& value);

}  // namespace flexboom
