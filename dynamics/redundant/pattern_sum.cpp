#include "dynamics/redundant/pattern_sum.hpp"

#include <algorithm>
#include <numeric>

namespace flexboom::redundant {

void PatternSum::finish(int size) {
  recording_ = false;
  slots_.resize(places_.size());
  std::vector<size_t> order(places_.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return std::pair(places_[a].second, places_[a].first) < std::pair(places_[b].second, places_[b].first);
  });
  starts_.assign(static_cast<size_t>(size) + 1, 0);
  for (size_t k = 0; k < order.size(); ++k) {
    const auto& [row, column] = places_[order[k]];
    if (k == 0 || places_[order[k - 1]] != places_[order[k]]) {
      rows_.push_back(row);
      ++starts_[static_cast<size_t>(column) + 1];
    }
    slots_[order[k]] = rows_.size() - 1;
  }
  std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
}

void PatternSum::begin(double* values) {
  values_ = values;
  next_ = 0;
  if (!recording_) std::fill(values, values + rows_.size(), 0.0);
}

}  // namespace flexboom::redundant
