#pragma once

#include <optional>
#include <vector>

namespace flexboom {

/// Where each label of a file is found: by a table when labels are dense, by bisection when they are not. Memory grows
/// with the number of labels, never with their size.
class LabelIndex {
 public:
  explicit LabelIndex(const std::vector<long>& labels);

  /// Index of a label, -1 when there is none.
  int find(long label) const;

  /// A label that occurs more than once.
  std::optional<long> duplicate() const { return duplicate_; }

 private:
  long lowest_ = 0;
  std::vector<int> table_;      // dense: by label - lowest_
  std::vector<long> labels_;    // sparse: ascending
  std::vector<int> positions_;  // sparse: of labels_
  std::optional<long> duplicate_;
};

}  // namespace flexboom
