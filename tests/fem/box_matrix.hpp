#pragma once

#include "fem_testing.hpp"

#include <algorithm>
#include <vector>

namespace flexboom::testing {

/// Laplacian of a box of nodes with three like freedoms each, plus `shift` on the diagonal; lower triangle.
inline SparseMatrix box(int nx, int ny, int nz, double shift) {
  std::vector<Eigen::Triplet<double>> triplets;
  const auto node = [&](int i, int j, int k) { return i + nx * (j + ny * k); };
  const auto couple = [&](int a, int b) {
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        const double value = r == c ? 1.0 : 0.2;
        triplets.emplace_back(3 * a + r, 3 * a + c, value);
        triplets.emplace_back(3 * b + r, 3 * b + c, value);
        triplets.emplace_back(3 * std::max(a, b) + r, 3 * std::min(a, b) + c, -value);
      }
    }
  };
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        if (i + 1 < nx) couple(node(i, j, k), node(i + 1, j, k));
        if (j + 1 < ny) couple(node(i, j, k), node(i, j + 1, k));
        if (k + 1 < nz) couple(node(i, j, k), node(i, j, k + 1));
        for (int c = 0; c < 3; ++c) triplets.emplace_back(3 * node(i, j, k) + c, 3 * node(i, j, k) + c, shift);
      }
    }
  }
  SparseMatrix A(3 * nx * ny * nz, 3 * nx * ny * nz);
  A.setFromTriplets(triplets.begin(), triplets.end());
  return A.triangularView<Eigen::Lower>();
}

}  // namespace flexboom::testing
