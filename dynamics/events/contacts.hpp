#pragma once

#include "dynamics/events/flight.hpp"
#include "dynamics/model/multibody.hpp"

#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom {

/// The level of a gap that nobody looks at.
inline constexpr double no_level = std::numeric_limits<double>::infinity();

/// What an event is. `stop`: touches or leaves a spring stop; others are of a JointLaw.
enum class EventKind : char { stop, kink, engage, disengage, stick, slip, impact, rest, leave, latch };

/// A crossing of a stop, or another event of a joint.
struct StopEvent {
  double time = 0;  // [s]
  int joint = 0;
  bool contact = true;  // true: touches the stop, false: leaves it
  double rate = 0;      // of the joint there, before what comes of it [rad/s] or [m/s]
  EventKind kind = EventKind::stop;
};

/// "contact", "release" or the name of the kind.
std::string_view event_name(const StopEvent&);

/// Round-off of a gap that is one number of the state [rad] or [m].
inline constexpr double place_of_one_number = 4e-16;

/// How far beyond its stop a joint is, and how fast it goes there.
struct Gap {
  double value = 0;  // [rad] or [m]
  double rate = 0;   // per second
};

/// What accelerates a gap, and how much of that the error of the method leaves open.
struct Push {
  double acceleration = 0;  // [rad/s^2] or [m/s^2]
  double open = 0;
};

/// What contacts ask about a motion, at the state that it has reached. Stops are numbered from 0.
class StopMotion {
 public:
  virtual ~StopMotion() = default;
  virtual Gap gap(std::size_t stop) = 0;
  /// With these stops closed, one flag per stop.
  virtual Push push(std::size_t stop, std::span<const char> closed) = 0;
  /// What the error of the method leaves open of a gap.
  virtual double noise(std::size_t stop) const = 0;
  /// Round-off of a gap [rad] or [m]. More where it is made of several numbers of the state.
  virtual double place() const { return place_of_one_number; }
  /// Makes the gap zero, where it is one number of the state.
  virtual void put_on_stop(std::size_t) {}
};

/// A hinge or slider that may have a stop.
struct Stop {
  std::size_t joint = 0;   // index into histories
  std::string name;        // of the joint
  bool is_there = true;    // false: nothing is ever met
  double period = 0;       // of the joint on its stop, over 2 pi [s]
  double spring_rate = 0;  // of the joint off its stop [rad/s]
};

/// The stop of a hinge or slider; its time scales are those of the body beyond it as if it were rigid.
Stop stop_of(const Joint&, std::size_t index, const ReducedBody& beyond);

/// Which stops are closed, which are still looked at, and what came of them. The only place where that is decided.
class Contacts {
 public:
  /// `joints`: number of histories.
  Contacts(std::vector<Stop>, const FlightOptions&, std::size_t joints);

  /// A stop is closed as a flight that this one goes on left it. Without such a flight, it is closed where the joint is
  /// beyond the stop. Exactly on the stop, it is decided by where the joint goes. At rest there, it is decided by where
  /// the joint is pushed. Stops that had settled are as good as open. A joint at rest whose gap is made of several
  /// numbers is looked at again when it has moved by more than their round-off.
  void begin(StopMotion&);

  /// Applies the crossings that a step ended at, and what settles or wakes.
  /// @return whether something changed, and the method must start again.
  /// @throws NumericalError where contacts follow each other without time passing.
  bool update(StopMotion&, double t, std::vector<StopEvent>&);

  std::size_t size() const { return stops_.size(); }
  const Stop& stop(std::size_t i) const { return stops_[i]; }
  double largest_gap(std::size_t i) const { return history_[stops_[i].joint].largest_gap; }

  /// The gap at which a step must end: zero; of a joint that has settled, where it wakes; `no_level` without a stop.
  double level(std::size_t i, const StopMotion&) const;

  /// One entry per stop. crossed: +1 where the gap rises through its level, -1 where it falls.
  const std::vector<char>& closed() const { return closed_; }
  std::vector<int>& crossed() { return crossed_; }
  /// Flags of stops, one entry per joint.
  std::vector<char> by_joint(std::span<const char> of_stops) const;

  /// One entry per joint, with what is closed now.
  std::vector<StopHistory> histories() const;

 private:
  bool slipped_through(std::size_t i, Gap, double noise) const;
  bool has_decayed(std::size_t i, Gap, StopMotion&);
  bool comes_back(std::size_t i, Gap, double t, StopMotion&);
  bool trembles(std::size_t i, Gap, double t) const;
  bool follows_the_push(std::size_t i, StopMotion&);
  void hold(std::size_t i, std::vector<StopEvent>&, StopMotion&);
  bool is_pushed(std::size_t i, StopMotion&) const;
  double small(std::size_t i, const StopMotion&) const;
  double still(const StopMotion&) const;
  void settle(std::size_t i, double t);
  void wake(std::size_t i, Gap);

  std::vector<Stop> stops_;
  double settle_, tolerance_;
  std::vector<StopHistory> history_;  // per joint
  std::vector<char> closed_, armed_;
  std::vector<int> crossed_;
  std::vector<Approach> approach_;
  std::vector<double> asleep_;     // ways below this do not wake a joint that has settled on its way [rad] or [m]
  std::vector<double> came_back_;  // when it last did [s]; or -1
  std::vector<double> met_;        // time of the last crossing [s]; or -1
  std::vector<char> held_;         // not looked at as long as it is on its stop but for round-off
  ChatterGuard chatter_;
};

}  // namespace flexboom
