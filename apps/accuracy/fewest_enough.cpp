#include "apps/accuracy/fewest_enough.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace flexboom {

namespace {

constexpr int most_trials = 6;

}  // namespace

FewestEnough::FewestEnough(std::vector<double> displacements, double bearable_error, size_t too_few, size_t first)
    : displacements_(std::move(displacements)),
      bearable_(bearable_error),
      enough_(displacements_.size()),
      needed_(std::min(too_few, enough_)),
      next_(needed_ > 0 ? needed_ + needed_ / 8 : first) {}

bool FewestEnough::is_settled() const {
  return is_near_ || trials_ == most_trials || enough_ <= needed_ + hardly_any();
}

size_t FewestEnough::next() const { return std::min(next_, enough_ - 1); }

size_t FewestEnough::after_too_few() const { return between(next() + 1); }

void FewestEnough::tell(double error) {
  ++trials_;
  const size_t tried = next();
  if (!(error <= bearable_)) {
    next_ = after_too_few();
    needed_ = tried + 1, error_of_fewer_ = error;
    return;
  }
  enough_ = tried, error_ = error;
  next_ = expected(tried, error);
  is_near_ = next_ + hardly_any() >= enough_;
  if (next_ < needed_) next_ = between(needed_);
}

double FewestEnough::left_out(size_t count) const {
  return std::accumulate(displacements_.begin() + static_cast<std::ptrdiff_t>(count), displacements_.end(), 0.0);
}

/// How many are enough where errors are in proportion to the displacement left out.
size_t FewestEnough::expected(size_t tried, double error) const {
  size_t count = displacements_.size();
  while (count > 0 && left_out(count - 1) * error <= left_out(tried) * bearable_) --count;
  return count;
}

size_t FewestEnough::between(size_t low) const {
  return static_cast<size_t>(std::sqrt(static_cast<double>(low * enough_)));
}

}  // namespace flexboom
