#pragma once

#include "fem/linear_algebra/sparse.hpp"

#include <Eigen/Core>

#include <cstdint>

namespace flexboom {

/// n x columns numbers in (-0.5, 0.5), the same every time for a seed, so that runs repeat to the last digit.
Eigen::MatrixXd random_block(Eigen::Index n, Eigen::Index columns, std::uint64_t seed);

/// An M-orthonormal basis that grows by blocks. M times the basis is not kept: a product with M costs less than the
/// memory.
class MassBasis {
 public:
  MassBasis(const SparseMatrix& M, Eigen::Index capacity);

  Eigen::Index size() const { return size_; }
  Eigen::Index capacity() const { return V_.cols(); }
  auto vectors() const { return V_.leftCols(size_); }                                     // n x size
  auto vectors(Eigen::Index first) const { return V_.middleCols(first, size_ - first); }  // n x (size - first)

  /// What is left of W outside the basis, and the coefficients of what was inside (size x columns of W).
  Eigen::MatrixXd project_out(Eigen::MatrixXd& W, const Eigen::MatrixXd& M_W) const;

  /// Appends an orthonormal basis Q of what the columns of W have outside the basis, directions shorter than
  /// `negligible` (in the M norm) left out. Returns the coefficients of W in the basis as it is then:
  /// W = V coefficients up to `negligible`; the last rows belong to Q.
  /// Q may have any number of columns from none to those of W, and never more than there is room for.
  Eigen::MatrixXd append(Eigen::MatrixXd W, double negligible);

  /// The basis becomes V(:, 0 : S.rows()) S followed by the vectors from S.rows() on. S has orthonormal columns.
  void rotate(const Eigen::MatrixXd& S);

  /// Forgets all vectors but the first `size`.
  void truncate(Eigen::Index size) { size_ = size; }

 private:
  const SparseMatrix& M_;
  Eigen::MatrixXd V_;  // n x capacity
  Eigen::Index size_ = 0;
};

}  // namespace flexboom
