#pragma once

#include "fem/base/check.hpp"
#include "reduction/eigen/backends.hpp"
#include "tests/reduction/messages.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace flexboom::test {

constexpr double pi = std::numbers::pi;

struct System {
  SparseMatrix K;
  SparseMatrix M;
  EigenProblem problem(bool free_floating = false) const { return {K, M, free_floating}; }
};

inline System from_triplets(int n, const std::vector<Eigen::Triplet<double>>& K, const Eigen::VectorXd& mass) {
  System s{SparseMatrix(n, n), SparseMatrix(n, n)};
  s.K.setFromTriplets(K.begin(), K.end());
  std::vector<Eigen::Triplet<double>> M;
  for (int i = 0; i < n; ++i) M.emplace_back(i, i, mass(i));
  s.M.setFromTriplets(M.begin(), M.end());
  return s;
}

/// `copies` separate strings of n unit masses and unit springs between fixed walls: omega_j^2 = 4 sin^2(j pi / (2n +
/// 2)), each `copies` times. Ends free when `free`: omega_j^2 = 4 sin^2(j pi / 2n), j = 0, 1, ...
inline System strings(int n, int copies = 1, bool free = false) {
  std::vector<Eigen::Triplet<double>> K;
  for (int c = 0; c < copies; ++c) {
    for (int i = 0; i < n; ++i) {
      const int row = c * n + i;
      const bool end = i == 0 || i == n - 1;
      K.emplace_back(row, row, free && end ? 1 : 2);
      if (i + 1 < n) {
        K.emplace_back(row, row + 1, -1);
        K.emplace_back(row + 1, row, -1);
      }
    }
  }
  return from_triplets(n * copies, K, Eigen::VectorXd::Ones(n * copies));
}

inline double string_frequency(int n, int j) { return 4 * std::pow(std::sin(j * pi / (2 * n + 2)), 2); }

/// Square membrane on an n x n grid: the eigenvalues are sums of two of the string's, every pair (i, j), (j, i) twice.
inline System membrane(int n) {
  std::vector<Eigen::Triplet<double>> K;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const int row = i * n + j;
      K.emplace_back(row, row, 4);
      for (const int neighbour :
           {i > 0 ? row - n : -1, i < n - 1 ? row + n : -1, j > 0 ? row - 1 : -1, j < n - 1 ? row + 1 : -1}) {
        if (neighbour >= 0) K.emplace_back(row, neighbour, -1);
      }
    }
  }
  return from_triplets(n * n, K, Eigen::VectorXd::Ones(n * n));
}

inline std::vector<double> membrane_frequencies(int n) {
  std::vector<double> all;
  for (int i = 1; i <= n; ++i) {
    for (int j = 1; j <= n; ++j) all.push_back(string_frequency(n, i) + string_frequency(n, j));
  }
  std::ranges::sort(all);
  return all;
}

inline EigenOptions options(int modes, const std::string& backend) {
  return {.num_modes = modes, .sigma = {}, .backend = backend};
}

inline std::vector<std::string> backend_names() {
  std::vector<std::string> names;
  for (const EigenBackend& row : eigen_backends()) names.emplace_back(row.name);
  return names;
}

/// Lattice of unit masses with springs to all neighbours along edges and face diagonals, in three dimensions: rigid
/// motions are the only ones without energy. Freedom `f` of node (i, j, k) is 3 (i + nx (j + ny k)) + f; those in
/// `held` are tied to the ground by springs of 1. `copies` of it stand beside each other, unconnected.
inline System lattice(std::array<int, 3> size, const std::vector<int>& held, int copies = 1, double soft = 1) {
  const auto [nx, ny, nz] = size;
  const int nodes = nx * ny * nz;
  std::vector<Eigen::Triplet<double>> K;
  const auto spring = [&](int a, int b, const Eigen::Vector3d& d, double k) {
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        const double value = k * d(r) * d(c) / d.squaredNorm();
        K.emplace_back(3 * a + r, 3 * a + c, value);
        K.emplace_back(3 * b + r, 3 * b + c, value);
        K.emplace_back(3 * a + r, 3 * b + c, -value);
        K.emplace_back(3 * b + r, 3 * a + c, -value);
      }
    }
  };
  for (int copy = 0; copy < copies; ++copy) {
    for (int node = 0; node < nodes; ++node) {
      const Eigen::Vector3i at(node % nx, node / nx % ny, node / (nx * ny));
      for (int step = 14; step < 27; ++step) {  // one of each pair of opposite neighbours
        const Eigen::Vector3i d(step % 3 - 1, step / 3 % 3 - 1, step / 9 - 1);
        const Eigen::Vector3i to = at + d;
        if (d.squaredNorm() > 2 || (to.array() < 0).any() || to(0) >= nx || to(1) >= ny || to(2) >= nz) continue;
        const int other = to(0) + nx * (to(1) + ny * to(2));
        spring(copy * nodes + node, copy * nodes + other, d.cast<double>(), to(2) > nz / 2 ? soft : 1);
      }
    }
    for (const int f : held) K.emplace_back(3 * copy * nodes + f, 3 * copy * nodes + f, 1);
  }
  return from_triplets(3 * nodes * copies, K, Eigen::VectorXd::Ones(3 * nodes * copies));
}

/// All freedoms of the face k = 0 of a lattice.
inline std::vector<int> root_of(std::array<int, 3> size) {
  std::vector<int> freedoms(static_cast<size_t>(3 * size[0] * size[1]));
  for (size_t i = 0; i < freedoms.size(); ++i) freedoms[i] = static_cast<int>(i);
  return freedoms;
}

/// `count` equal strings of n unit masses, each fixed at one end and tied at the other to one base of mass 1 that
/// itself hangs on a spring of 1. Frequencies of a string between walls come count - 1 times.
inline System strings_on_one_base(int n, int count) {
  std::vector<Eigen::Triplet<double>> K;
  const int base = n * count;
  K.emplace_back(base, base, 1 + count);
  for (int s = 0; s < count; ++s) {
    for (int i = 0; i < n; ++i) {
      const int row = s * n + i;
      K.emplace_back(row, row, 2);
      const int next = i + 1 < n ? row + 1 : base;
      K.emplace_back(next, row, -1);
      K.emplace_back(row, next, -1);
    }
  }
  return from_triplets(base + 1, K, Eigen::VectorXd::Ones(base + 1));
}

}  // namespace flexboom::test
