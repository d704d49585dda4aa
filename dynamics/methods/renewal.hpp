#pragma once

#include <algorithm>

namespace flexboom {

/// When the linear part L of a flight is taken anew, where the flight is. Counts are of the whole flight.
///
/// What stiffens slowly, as a blade that is spun up, makes no step fail: steps become short, or need many sweeps. So
/// now and then L is taken anew to see whether that helps. Where it does not, four times as many steps go by until the
/// next.
class Renewal {
 public:
  /// n: size of the state. Eigenvectors cost n^3, a step n to n^2.
  explicit Renewal(long n) : shortest_wait_(2 * block + n + n * n / 60), wait_(shortest_wait_) {}

  void taken(long steps) { taken_ = steps, is_own_ = true; }

  /// L of other places takes over. A series of steps begins.
  void restart(long steps, long evaluations, double t) {
    taken_ = steps, is_own_ = false, judges_ = false;
    begin_block(steps, evaluations, t);
  }

  /// Was L taken where the flight is, a few steps ago? What fails then is not its fault.
  bool is_fresh(long steps) const { return is_own_ && steps - taken_ < fresh; }

  /// Before a step that goes on: should L be taken anew?
  bool is_due(long steps, long evaluations, double t) {
    if (steps < begun_ + block) return false;
    const double pace = (t - t_) / static_cast<double>(std::max(1L, evaluations - evaluations_));
    if (judges_) wait_ = pace > worth_it * pace_ ? shortest_wait_ : 4 * wait_;
    pace_ = pace;
    judges_ = steps - taken_ >= wait_;
    begin_block(steps, evaluations, t);
    return judges_;
  }

 private:
  static constexpr long block = 24, fresh = 20;  // steps
  static constexpr double worth_it = 1.3;        // times the time that an evaluation brings

  void begin_block(long steps, long evaluations, double t) { begun_ = steps, evaluations_ = evaluations, t_ = t; }

  long shortest_wait_, wait_;  // taking L costs a tenth of so many steps
  long taken_ = 0, begun_ = 0, evaluations_ = 0;
  double t_ = 0, pace_ = 0;  // pace: time by evaluation, of a block of steps
  bool is_own_ = false, judges_ = false;
};

}  // namespace flexboom
