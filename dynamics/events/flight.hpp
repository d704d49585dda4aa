#pragma once

#include "dynamics/model/joint_law.hpp"
#include "fem/base/stopwatch.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace flexboom {

/// How a stop was met so far: what settling is judged by, and what a flight that goes on must know.
struct StopHistory {
  double largest_rate = 0;  // of its hinge or joint [rad/s] or [m/s]
  double largest_gap = 0;   // to either side of the stop [rad] or [m]
  /// On the two sides before the last crossing and since, older first, as Approach sees them [rad/s] or [m/s].
  std::array<double, 3> sides{};
  double settled = -1;            // time after which it was no longer looked at [s], or -1
  std::optional<bool> closed{};   // at the end; unknown: as gap and rate are
  std::optional<LawState> law{};  // at the end; unknown: as the joint is and moves
};

/// What was not measured.
constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// The largest that a flight has had: what its balances are judged against. Once a motion has died, nothing else tells
/// what is much.
struct MotionScales {
  double energy = 0;            // [J]
  double shaking = 0;           // without that of wheels on their axles [J]
  double momentum = 0;          // sum over the bodies of the norms [N s]
  double angular_momentum = 0;  // the same [N m s]
};

/// Outputs that come in rows, so that a motion that is fast is seen now and then for a while.
struct CloseLooks {
  std::vector<double> at{};  // where the rows begin, ascending [s]
  std::size_t count = 1;     // outputs in each
  double step = 0;           // between them [s]
};

/// What every flight is asked for, whatever the coordinates and the method.
struct FlightOptions {
  double tolerance = 1e-6;    // relative error wanted in every output (max over time / max of the output)
  bool loads = false;         // are loads of joints to have that error, too? They are made of accelerations
  double start = 0;           // [s]
  double duration = 10;       // [s], the time at the end
  double output_step = 0.01;  // [s]
  CloseLooks close_looks{};   // empty: outputs are as above
  /// A hinge has settled when its rate on both sides of its stop stays below this fraction of its largest rate so far.
  /// Its crossings are then no longer located, and its stop counts as open, until its rate or its gap is twice what
  /// rest allows. Zero: never. Negative: a hundredth of the tolerance, no less than the tolerance or 1e-10.
  double settle = -1;
  /// Per joint: of a flight that this one goes on. Empty: none was met.
  std::vector<StopHistory> stops{};
  MotionScales largest{};  // of a flight that this one goes on
  /// Times where forces or prescribed motions are not smooth, ascending [s]: a step ends there and the method starts
  /// anew.
  std::vector<double> corners{};
  /// No step passes these times, ascending [s]: what forces do between them no step overlooks.
  std::vector<double> step_ends{};
  /// When something may be largest between two outputs, ascending [s]: geometric stiffness is looked at there, too.
  std::vector<double> telling_times{};
  long max_steps = 200'000'000;
  const std::atomic<bool>* interrupt = nullptr;                // set from outside: stop and return what there is
  std::function<void(double time, double duration)> progress;  // called now and then
  double checkpoint_every = 10;                                // wall time between two checkpoints [s]

  /// `settle`, or what stands for a negative one. Bounces that are left out change what they shake: a hundredth of the
  /// tolerance. Under 1e-10 they are below the noise of some methods, which would then not have the same contacts.
  double settle_at() const { return settle < 0 ? std::max(tolerance / 100, std::min(tolerance, 1e-10)) : settle; }
};

/// Called at the start of a flight, now and then, and where it fails: with what the flight would return if it were
/// interrupted there. The first `outputs` rows stay; a row behind them is the state there.
template <class Trajectory>
using Checkpoint = std::function<void(const Trajectory& so_far, std::size_t outputs)>;

/// How fast a hinge or joint was since it last crossed its stop. Bounces lose a part of that each. A motion that only
/// decays loses all of it: what it crosses the stop with is round-off or the method's error, and no contact.
class Approach {
 public:
  Approach() = default;
  explicit Approach(const std::array<double, 3>& sides) : sides_(sides) {}

  /// `spring`: its frequency off the stop [rad/s], by which a gap counts as a rate.
  void observe(double gap, double rate, double spring) {
    sides_[2] = std::max({sides_[2], std::abs(rate), std::abs(gap) * spring});
  }
  void restart(double rate) { sides_ = {sides_[1], sides_[2], std::abs(rate)}; }
  bool has_decayed(double rate) const { return std::abs(rate) < 1e-3 * sides_[2]; }
  /// The largest on the two sides of the stop before the last crossing, and since.
  double of_two_sides() const { return std::max({sides_[0], sides_[1], sides_[2]}); }
  double round_off() const { return 1e-14 * sides_[2]; }
  const std::array<double, 3>& sides() const { return sides_; }

 private:
  std::array<double, 3> sides_{};  // older first [rad/s] or [m/s]
};

/// Contacts that follow each other without time passing: a flight that no longer goes on.
class ChatterGuard {
 public:
  /// @throws NumericalError naming the hinge or joint after a thousand contacts within round-off of each other.
  void contact(double t, const std::string& name);

 private:
  double last_ = -1;  // [s]
  int in_a_row_ = 0;
};

/// @throws InputError naming the option that makes no sense; `stops`: how many histories there may be.
void check_options(const FlightOptions&, std::size_t stops);

/// The histories that a flight of so many stops begins with.
std::vector<StopHistory> stops_at_start(const FlightOptions&, std::size_t stops);

/// Times of outputs: the start, the multiples of the step after it, the end exactly. Or those of close looks, with the
/// start before them and the end behind.
class OutputTimes {
 public:
  explicit OutputTimes(const FlightOptions&);
  /// The time that follows `count` outputs; infinite after the end.
  double after(std::size_t count) const;

 private:
  double close_look(std::size_t number) const;

  double start_, step_, end_;
  double before_;  // multiples of the step up to the start
  CloseLooks looks_;
};

}  // namespace flexboom
