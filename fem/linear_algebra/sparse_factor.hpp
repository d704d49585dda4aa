#pragma once

#include "fem/base/check.hpp"
#include "fem/linear_algebra/sparse.hpp"

#include <memory>
#include <string>

namespace flexboom {

/// `indefinite`: L D L^T column by column, which counts negative pivots. `definite`: L L^T in dense blocks, many times
/// faster, for positive definite matrices only.
enum class FactorKind { indefinite, definite };

/// What a factor is and what it cost.
struct FactorSummary {
  std::string ordering;        // Ordering::name
  long nonzeros = 0;           // entries of L
  double flops = 0;            // of one factorisation
  double bytes = 0;            // of L
  double analyse_seconds = 0;  // ordering and symbolic analysis, once
  double factor_seconds = 0;   // the last factorisation
};

/// A pivot is zero or not positive where it must be.
class SingularMatrix : public NumericalError {
 public:
  SingularMatrix(const std::string& text, int row) : NumericalError(text), unknown(row) {}
  int unknown;  // row of the matrix
};

/// Factor of a sparse symmetric matrix through CHOLMOD (its only door but for orderings). The symbolic analysis is made
/// once and reused by every refactor with the same pattern.
class SparseFactor {
 public:
  /// Analyses the pattern of a symmetric matrix; the lower triangle is read.
  explicit SparseFactor(const SparseMatrix& pattern, FactorKind = FactorKind::indefinite);
  ~SparseFactor();
  SparseFactor(SparseFactor&&) noexcept;
  SparseFactor& operator=(SparseFactor&&) noexcept;

  /// Factorises A (same pattern). @throws SingularMatrix when a pivot is zero or, of a definite one, not positive.
  void factorise(const SparseMatrix& A);

  /// X = A^-1 B for any number of columns; of a definite one 16 cost what 2 alone do. X may be B itself. Work space is
  /// kept from call to call: not for two threads at once.
  void solve(const Eigen::Ref<const Eigen::MatrixXd>& B, Eigen::Ref<Eigen::MatrixXd> X) const;

  /// Number of negative entries of D: the eigenvalues of A below zero (Sylvester). Zero of a definite factor.
  int negative_pivots() const;

  FactorKind kind() const;

  /// "5.1.2", of CHOLMOD.
  static std::string library_release();

  FactorSummary summary() const;
  long nonzeros() const { return summary().nonzeros; }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace flexboom
