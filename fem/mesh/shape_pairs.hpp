#pragma once

#include <Eigen/Core>

// Symmetric matrices over shapes, packed: a row for each pair, the lower triangle column by column.
namespace flexboom {

constexpr Eigen::Index number_of_pairs(Eigen::Index shapes) { return shapes * (shapes + 1) / 2; }

/// Adds the second variation of factor * a b. a, b: rows, one entry per shape.
template <class A, class B>
void add_pairs(Eigen::Ref<Eigen::VectorXd> pairs, double factor, const A& a, const B& b) {
  const Eigen::Index count = a.size();
  for (Eigen::Index k = 0, first = 0; k < count; first += count - k, ++k) {
    pairs.segment(first, count - k) += factor * (a(k) * b.tail(count - k) + b(k) * a.tail(count - k)).transpose();
  }
}

/// The matrix of n shapes, in full.
inline Eigen::MatrixXd unpacked(const Eigen::Ref<const Eigen::VectorXd>& pairs, Eigen::Index n) {
  Eigen::MatrixXd A(n, n);
  for (Eigen::Index k = 0, first = 0; k < n; first += n - k, ++k) {
    A.col(k).tail(n - k) = pairs.segment(first, n - k);
    A.row(k).tail(n - k) = pairs.segment(first, n - k).transpose();
  }
  return A;
}

}  // namespace flexboom
