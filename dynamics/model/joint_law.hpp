#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// What a hinge or a slider does beyond the paper's spring hinge: a sum of pieces. Angles [rad] and torques [N m] of a
/// hinge are lengths [m] and forces [N] of a slider; loads act on b along +z.
namespace flexboom {

struct Joint;

/// A load over an angle or a rate, linear between its points and beyond them.
struct LawTable {
  std::vector<double> at, load;  // at: ascending
};

/// Coulomb friction. A joint at rest sticks until its load passes `breakaway`.
struct FrictionLaw {
  double coulomb = 0, breakaway = 0;
};

/// The end of a joint's way: a pad (spring and damper, which only push), or rigid with a coefficient of restitution.
struct StopLaw {
  double at = 0, stiffness = 0, damping = 0;
  std::optional<double> restitution{};
};

/// Locks the joint at an angle that it passes no faster than `rate`; for good.
struct LatchLaw {
  double at = 0, rate = 0;
};

struct JointLaw {
  LawTable spring, damper;  // empty: none; beside the linear ones of the mechanism
  double preload = 0;       // constant load
  double backlash = 0;      // half the width about the rest in which the linear spring has no load
  std::optional<FrictionLaw> friction{};
  std::optional<StopLaw> lower_stop{}, upper_stop{};
  std::optional<LatchLaw> latch{};

  bool given() const;
};

/// What is wrong with the law of a joint: a key below the joint, "upper_stop.restitution", and words.
struct LawFault {
  std::string key, text;
};
std::vector<LawFault> law_faults(const Joint&);

/// Where a law takes energy besides dampers.
enum class LawLoss : int { friction, stop, impact, latch };
inline constexpr std::array<std::string_view, 4> law_losses = {"friction", "stop", "impact", "latch"};

/// The discrete state of a law. Between events it stays, and the law is linear.
struct LawState {
  enum class Motion : char { free, forward, back, held };
  Motion motion = Motion::free;  // held: sticks, rests at a rigid stop or is latched
  int rests_at = 0;              // rigid stop that it rests at: 1 upper, -1 lower
  bool latched = false, past_latch = false;
  std::vector<char> beyond, pushes;  // per ramp of the way: is it in it, is there a load
  std::vector<char> faster;          // per ramp of the rate

  bool operator==(const LawState&) const = default;
};
inline constexpr std::array<std::string_view, 4> law_motions = {"free", "forward", "back", "held"};

/// A law in one discrete state, x the angle less the threshold of the mechanism:
///     load = (spring - stiffness x) + (drag - damping rate) + friction - stop_damping rate - (unused - unused_slope x)
/// `unused` is what a pad that is left too fast does not give back. With it the stored energy goes by x alone.
struct LawBranch {
  bool held = false;  // the joint does not move
  double spring = 0, stiffness = 0, drag = 0, damping = 0, friction = 0, stop_damping = 0, unused = 0, unused_slope = 0;

  template <class T>
  T load(const T& x, const T& rate) const {
    return (spring + drag + friction - unused) - (stiffness - unused_slope) * x - (damping + stop_damping) * rate;
  }
  template <class T>
  T damper_power(const T& rate) const {
    return (damping * rate - T(drag)) * rate;
  }
  /// Losses by friction and stop; those by impact and latch are sudden.
  template <class T>
  T power(LawLoss loss, const T& x, const T& rate) const {
    if (loss == LawLoss::friction) return -friction * rate;
    if (loss == LawLoss::stop) return stop_damping * (rate * rate) + (unused - unused_slope * x) * rate;
    return T(0.0);
  }
};

/// A part of a law that is linear on one side of a place and nothing on the other.
struct LawRamp {
  enum class Of : char { table, backlash, stop };
  double at = 0, slope = 0;  // load = -slope (x - at) beyond; x: angle less threshold, or rate
  double damping = 0;        // of a stop
  bool above = true;         // beyond: x > at, else x < at
  Of of = Of::table;
};

/// A joint's law and mechanism, made ready: everything over x, the angle less the threshold.
struct LawModel {
  double load = 0, stiffness = 0, origin = 0;  // load - stiffness (x - origin), where no ramp is
  double table_load = 0, table_slope = 0, table_origin = 0;
  double drag = 0, damping = 0;
  std::vector<LawRamp> ramps, rate_ramps;
  std::optional<FrictionLaw> friction;
  std::optional<StopLaw> lower, upper;  // rigid ones
  std::optional<LatchLaw> latch;

  explicit LawModel(const Joint&);
  LawBranch branch(const LawState&) const;
  /// Energy in springs and in pads of stops [J].
  double spring_energy(double x) const;
  double stop_energy(double x) const;
  bool can_hold() const { return friction || lower || upper || latch; }
  /// Can this law be in a state, which a run of another law may have left?
  bool fits(const LawState&) const;
};

}  // namespace flexboom
