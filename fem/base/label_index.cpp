#include "fem/base/label_index.hpp"

#include "fem/base/at.hpp"

#include <algorithm>
#include <numeric>

namespace flexboom {
namespace {

constexpr unsigned long sparsest = 4;  // entries of the table per label

}  // namespace

LabelIndex::LabelIndex(const std::vector<long>& labels) {
  if (labels.empty()) return;
  const auto [low, high] = std::ranges::minmax(labels);
  lowest_ = low;
  const unsigned long extent = static_cast<unsigned long>(high) - static_cast<unsigned long>(low);
  const int count = static_cast<int>(labels.size());
  if (extent / sparsest < labels.size()) {
    table_.assign(extent + 1, -1);
    for (int i = 0; i < count; ++i) {
      int& place = table_[static_cast<size_t>(labels[at(i)] - low)];
      if (place >= 0) duplicate_ = labels[at(i)];
      place = i;
    }
    return;
  }
  positions_.resize(labels.size());
  std::iota(positions_.begin(), positions_.end(), 0);
  std::ranges::sort(positions_, {}, [&labels](int i) { return labels[at(i)]; });
  for (const int i : positions_) labels_.push_back(labels[at(i)]);
  const auto twin = std::ranges::adjacent_find(labels_);
  if (twin != labels_.end()) duplicate_ = *twin;
}

int LabelIndex::find(long label) const {
  if (!table_.empty()) {
    const unsigned long place = static_cast<unsigned long>(label) - static_cast<unsigned long>(lowest_);
    return place < table_.size() ? table_[place] : -1;
  }
  const auto found = std::ranges::lower_bound(labels_, label);
  if (found == labels_.end() || *found != label) return -1;
  return positions_[static_cast<size_t>(found - labels_.begin())];
}

}  // namespace flexboom
