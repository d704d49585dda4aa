#pragma once

#include "dynamics/events/contacts.hpp"

#include <optional>
#include <span>
#include <vector>

namespace flexboom {

/// What laws ask of a motion at the state that it has reached, and do to it. Joints are those of the scene.
class LawMotion {
 public:
  virtual ~LawMotion() = default;
  /// Angle less the threshold of the mechanism, and its rate.
  virtual Gap joint_way(std::size_t joint) = 0;
  virtual double joint_acceleration(std::size_t joint) = 0;
  /// What holds a joint that is held pushes b with.
  virtual double hold_load(std::size_t joint) = 0;
  /// Branches have changed.
  virtual void take_branches() {}

  /// Finds what a sudden load does to the motion: changes of rates, and what joints that are held get, per impulse.
  virtual void prepare_blow(std::size_t joint) = 0;
  virtual double rate_of_blow(std::size_t joint) = 0;
  virtual double hold_of_blow(std::size_t joint) = 0;
  virtual void strike(double impulse) = 0;

  /// Angle exactly there, where it is one number of the state.
  virtual void put(std::size_t /*joint*/, double /*x*/) {}
  /// At rest but for round-off: exactly so.
  virtual void put_to_rest(std::size_t /*joint*/) {}
  virtual void lose(std::size_t joint, LawLoss, double energy) = 0;
};

/// A quantity whose change of sign is an event of a law.
struct LawSwitch {
  enum class Kind : char { ramp, push, faster, turn, break_forward, break_back, latch, hit_upper, hit_lower };
  std::size_t law = 0;
  Kind kind = Kind::ramp;
  std::size_t ramp = 0;
};

/// A joint at an instant, as far as a switch needs it.
struct LawPoint {
  double x = 0, rate = 0;           // angle less threshold
  double acceleration = 0;          // of the angle
  double hold = 0, hold_slope = 0;  // load that holds it, its change in time
};

/// The discrete states of all laws of a scene, and what events make of them. The only place where that is decided.
class Laws {
 public:
  Laws() = default;
  /// Histories of the options go on where they know a state. round_off: to which a motion can be put to a place.
  Laws(const std::vector<Joint>&, const FlightOptions&, double round_off = 0);

  bool empty() const { return laws_.empty(); }

  /// At the start of a flight: a joint that is beyond a rigid stop is none of ours.
  /// @throws NumericalError as update.
  void begin(LawMotion&, double t, std::vector<StopEvent>&);

  /// Applies what a step ended at. @return whether something changed, and the method must start again.
  /// @throws NumericalError where events follow each other without time passing.
  bool update(LawMotion&, double t, std::vector<StopEvent>&);

  /// One per joint of the scene, or empty where no joint has a law.
  std::span<const LawBranch> branches() const { return branches_; }
  const LawModel& model(std::size_t law) const { return laws_[law].model; }
  std::size_t joint(std::size_t law) const { return laws_[law].joint; }
  std::size_t size() const { return laws_.size(); }

  // One entry per switch. sides: 1 where the gap must stay positive; crossed: as of Contacts.
  const std::vector<LawSwitch>& switches() const { return switches_; }
  const std::vector<char>& sides() const { return sides_; }
  const std::vector<char>& armed() const { return armed_; }
  std::vector<int>& crossed() { return crossed_; }
  std::size_t joint_of(const LawSwitch& s) const { return laws_[s.law].joint; }

  /// Does the gap take the acceleration, or the load that holds?
  static bool needs_acceleration(const LawSwitch&);
  static bool needs_hold(const LawSwitch&);
  Gap gap(const LawSwitch&, const LawPoint&) const;

  /// Sets the state of each joint with a law.
  void add_histories(std::vector<StopHistory>&) const;

 private:
  using Motion = LawState::Motion;
  struct Law {
    std::size_t joint;
    std::string name;
    LawModel model;
    LawState state;
    double largest_rate = 0, largest_gap = 0;
    bool has_left = false;  // a rigid stop, from rest: so slowly that noise would meet it again
    ChatterGuard chatter;
  };
  struct Bounds {
    double lower, upper;  // of the load on a joint that is held, between which it stays
  };

  void add_switches(std::size_t law);
  void guess_state(Law&, Gap);
  void go_where_pushed(LawMotion&, Law&);
  void refresh(LawMotion&);
  void arm();
  double still(const Law&) const;
  double open(const Law&, double place) const;
  static Bounds bounds(const Law&);
  void event(const Law&, double t, EventKind, double rate, bool contact = false);
  void apply(LawMotion&, const LawSwitch&, int direction, double t);
  void apply_ramp(Law&, std::size_t ramp, bool beyond, double rate, double t);
  void come_to_rest(LawMotion&, Law&, double t);
  void hold(LawMotion&, Law&);
  void let_go(Law&, double load, double t);
  bool let_go_what_slips(LawMotion&, double t);
  void hit(LawMotion&, Law&, double t);
  void latch(LawMotion&, Law&, double t);
  static bool has_latch_at(const Law&, const std::optional<StopLaw>& rigid_stop);
  bool is_captured(LawMotion&, Law&, double rebound) const;
  bool is_momentary(const Law&, double speed, double towards) const;
  void strike(LawMotion&, Law&, double new_rate, LawLoss, bool frees_others = true);
  void follow_rates(LawMotion&, double t);

  std::vector<Law> laws_;
  std::vector<LawSwitch> switches_;
  std::vector<char> sides_, armed_;
  std::vector<int> crossed_;
  std::vector<LawBranch> branches_;
  std::vector<StopEvent>* events_ = nullptr;  // of the call that runs
  double round_off_ = 0, tolerance_ = 0, settle_ = 0;
};

}  // namespace flexboom
