#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <utility>
#include <vector>

namespace flexboom::redundant {

/// Sums what is added, always in the same order, into the values of a matrix with a fixed pattern.
class PatternSum {
 public:
  /// While recording, collects the pattern; `finish` sorts it by columns.
  void add(int row, int column, double value) {
    if (recording_)
      places_.emplace_back(row, column);
    else
      values_[slots_[next_++]] += value;
  }
  template <class M>
  void add_block(int row, int column, const M& block) {
    for (Eigen::Index j = 0; j < block.cols(); ++j)
      for (Eigen::Index i = 0; i < block.rows(); ++i)
        add(row + static_cast<int>(i), column + static_cast<int>(j), block(i, j));
  }
  void finish(int size);
  /// Starts over in these values.
  void begin(double* values);

  const std::vector<int>& starts() const { return starts_; }  // columns of the sparse matrix
  const std::vector<int>& rows() const { return rows_; }

 private:
  bool recording_ = true;
  std::vector<std::pair<int, int>> places_;
  std::vector<size_t> slots_;
  std::vector<int> starts_, rows_;
  size_t next_ = 0;
  double* values_ = nullptr;
};

}  // namespace flexboom::redundant
