#pragma once

#include <chrono>
#include <utility>

namespace flexboom {

/// Runs from its making.
class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  /// Seconds since the last lap, or the start.
  double lap() {
    const Clock::time_point begin = std::exchange(lap_, Clock::now());
    return std::chrono::duration<double>(lap_ - begin).count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now(), lap_ = start_;
};

}  // namespace flexboom
