#pragma once

#include "fem/assembly.hpp"

#include <Eigen/Core>

#include <memory>

namespace flexboom {

/// L D L^T of a sparse symmetric matrix through CHOLMOD (its only door). The symbolic analysis is made once and reused
/// by every refactor with the same pattern.
class SparseFactor {
 public:
  /// Analyses the pattern of a symmetric matrix (both triangles stored; the lower one is read).
  explicit SparseFactor(const SparseMatrix& pattern);
  ~SparseFactor();
  SparseFactor(SparseFactor&&) noexcept;
  SparseFactor& operator=(SparseFactor&&) noexcept;

  /// Factorises A (same pattern). @throws NumericalError when a zero pivot makes L D L^T impossible.
  void factorise(const SparseMatrix& A);

  /// x = A^-1 b.
  void solve(const Eigen::Ref<const Eigen::VectorXd>& b, Eigen::Ref<Eigen::VectorXd> x) const;

  /// Number of negative entries of D: the eigenvalues of A below zero (Sylvester).
  int negative_pivots() const;

  /// Entries of the factor.
  long nonzeros() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace flexboom
