#include "dynamics/events/contacts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace flexboom {

using Eigen::Vector3d;

namespace {

constexpr double one_time = 1e-12;  // relative: times this close are one
constexpr double slow = 1e-6;       // ways within a period on the stop that may be round-off [rad] or [m]

}  // namespace

std::string_view event_name(const StopEvent& e) {
  constexpr std::array<std::string_view, 10> names = {"",     "kink",   "engage", "disengage", "stick",
                                                      "slip", "impact", "rest",   "leave",     "latch"};
  if (e.kind == EventKind::stop) return e.contact ? "contact" : "release";
  return names[static_cast<std::size_t>(e.kind)];
}

Stop stop_of(const Joint& joint, std::size_t index, const ReducedBody& beyond) {
  double inertia = beyond.m;
  if (joint.kind == JointKind::hinge) {
    const Vector3d at = joint.b.marker.empty() ? joint.b.position : marker(beyond, joint.b.marker).position;
    const Vector3d axis = joint.b.axes.col(2), centre = beyond.mc0 / beyond.m, arm = centre - at;
    inertia =
        axis.dot(beyond.J0 * axis) + beyond.m * (axis.cross(arm).squaredNorm() - axis.cross(centre).squaredNorm());
  }
  const HingeMechanism& m = joint.mechanism;
  return {index, joint.name, m.stop_stiffness > 0, std::sqrt(inertia / (m.stiffness + m.stop_stiffness)),
          std::sqrt(m.stiffness / inertia)};
}

Contacts::Contacts(std::vector<Stop> stops, const FlightOptions& options, std::size_t joints)
    : stops_(std::move(stops)),
      settle_(options.settle_at()),
      tolerance_(options.tolerance),
      history_(stops_at_start(options, joints)),
      closed_(stops_.size(), 0),
      armed_(stops_.size(), 0),
      crossed_(stops_.size(), 0),
      approach_(stops_.size()),
      asleep_(stops_.size(), 0.0),
      came_back_(stops_.size(), -1),
      met_(stops_.size(), -1),
      held_(stops_.size(), 0) {
  for (std::size_t i = 0; i < size(); ++i) {
    armed_[i] = stops_[i].is_there && history_[stops_[i].joint].settled < 0;
    approach_[i] = Approach(history_[stops_[i].joint].sides);
  }
}

void Contacts::begin(StopMotion& motion) {
  const std::vector<char> open(size(), 0);
  for (std::size_t i = 0; i < size(); ++i) {
    const Gap gap = motion.gap(i);
    approach_[i].observe(gap.value, gap.rate, stops_[i].spring_rate);
    if (!armed_[i]) continue;
    const double place = motion.place();
    const bool on = std::abs(gap.value) < place;
    held_[i] = on && place > place_of_one_number && std::abs(gap.rate) * stops_[i].period < place;
    const bool goes = gap.rate > 0 || (gap.rate == 0 && on && motion.push(i, open).acceleration > 0);
    closed_[i] = history_[stops_[i].joint].closed.value_or(on ? goes && held_[i] == 0 : gap.value > 0);
    if (held_[i] != 0) follows_the_push(i, motion);
  }
}

bool Contacts::update(StopMotion& motion, double t, std::vector<StopEvent>& events) {
  bool changed = false;
  for (std::size_t i = 0; i < size(); ++i) {
    const Gap gap = motion.gap(i);
    StopHistory& history = history_[stops_[i].joint];
    history.largest_rate = std::max(history.largest_rate, std::abs(gap.rate));
    history.largest_gap = std::max(history.largest_gap, std::abs(gap.value));
    if (!stops_[i].is_there) continue;
    const double noise = held_[i] != 0 ? std::max(motion.noise(i), still(motion)) : motion.noise(i);
    const bool slipped = slipped_through(i, gap, noise);
    if (held_[i] != 0 && std::abs(gap.value) > still(motion)) {
      held_[i] = 0;
      changed = true;
    } else if (held_[i] != 0 && follows_the_push(i, motion)) {
      events.push_back({t, static_cast<int>(stops_[i].joint), closed_[i] != 0, gap.rate});
      changed = true;
    }
    if (!armed_[i]) {
      if (crossed_[i] != 0 || std::max(std::abs(gap.rate) * stops_[i].period, gap.value) > level(i, motion)) {
        wake(i, gap);
        changed = true;
      }
    } else if (crossed_[i] != 0 || slipped) {
      changed = true;
      if (has_decayed(i, gap, motion)) {
        settle(i, t);
      } else if (comes_back(i, gap, t, motion)) {
        motion.put_on_stop(i);
      } else if (trembles(i, gap, t)) {
        hold(i, events, motion);
      } else {
        met_[i] = t;
        closed_[i] = slipped ? gap.value > 0 : crossed_[i] > 0;
        if (!slipped) motion.put_on_stop(i);  // exactly: the root is good to round-off of t
        events.push_back({t, static_cast<int>(stops_[i].joint), closed_[i] != 0, gap.rate});
        chatter_.contact(t, stops_[i].name);
        approach_[i].restart(gap.rate);
        if (approach_[i].of_two_sides() * stops_[i].period < small(i, motion) && !is_pushed(i, motion)) settle(i, t);
      }
    }
    approach_[i].observe(gap.value, gap.rate, stops_[i].spring_rate);
  }
  return changed;
}

double Contacts::level(std::size_t i, const StopMotion& motion) const {
  if (!stops_[i].is_there || held_[i] != 0) return no_level;
  return armed_[i] ? 0 : 2 * std::max(small(i, motion), asleep_[i]);
}

std::vector<char> Contacts::by_joint(std::span<const char> of_stops) const {
  std::vector<char> flags(history_.size(), 0);
  for (size_t i = 0; i < stops_.size(); ++i) flags[stops_[i].joint] = of_stops[i];
  return flags;
}

std::vector<StopHistory> Contacts::histories() const {
  std::vector<StopHistory> all = history_;
  for (std::size_t i = 0; i < size(); ++i) {
    all[stops_[i].joint].closed = closed_[i] != 0;
    all[stops_[i].joint].sides = approach_[i].sides();
  }
  return all;
}

/// Is the gap on the wrong side of the flag, with no crossing found? A root finder sees no sign change where the gap
/// starts at zero and stays there for a while.
bool Contacts::slipped_through(std::size_t i, Gap gap, double noise) const {
  if (!armed_[i] || crossed_[i] != 0) return false;
  return closed_[i] ? gap.value < -noise : gap.value > noise;
}

/// Size of motions about the stop that are not followed. They are those that the scene does not ask for, and those that
/// are hardly more than noise. Crossings of the latter would be as dense as the steps.
double Contacts::small(std::size_t i, const StopMotion& motion) const {
  return std::max(settle_ * history_[stops_[i].joint].largest_rate * stops_[i].period, motion.noise(i));
}

/// Gap within which a joint that is held is on its stop. A gap that is made of several numbers has their errors, too.
double Contacts::still(const StopMotion& motion) const {
  const bool is_rough = motion.place() > place_of_one_number;
  return is_rough ? std::max(motion.place(), 1e-3 * tolerance_) : motion.place();
}

/// Is a crossing at this rate but the end of a motion that has died out on its way to the stop?
bool Contacts::has_decayed(std::size_t i, Gap gap, StopMotion& motion) {
  if (!approach_[i].has_decayed(gap.rate)) return false;
  const double period = stops_[i].period;
  asleep_[i] = std::max(small(i, motion), approach_[i].round_off() * period);
  if (!(std::abs(gap.rate) * period < asleep_[i])) return false;
  const Push push = motion.push(i, closed_);
  return std::abs(push.acceleration) * period * period <= 2 * asleep_[i] + push.open * period * period;
}

/// Is the wrong side but noise of a joint that rests on its stop? What pushes it turns it back then, before it is
/// farther away than its place is known. Only where no crossing was found: a search would go on finding it.
bool Contacts::comes_back(std::size_t i, Gap gap, double t, StopMotion& motion) {
  const double known = std::min(100 * motion.noise(i), motion.place());
  const bool is_small = std::abs(gap.rate) * stops_[i].period < slow && std::abs(gap.value) < known;
  if (crossed_[i] != 0 || !is_small || t == came_back_[i]) return false;
  const double back = (gap.value < 0 ? 1 : -1) * motion.push(i, closed_).acceleration;
  if (!(gap.rate * gap.rate < 2 * back * known)) return false;
  came_back_[i] = t;
  return true;
}

/// Has a crossing brought a joint back to the stop that it met or left but round-off before?
bool Contacts::trembles(std::size_t i, Gap gap, double t) const {
  return crossed_[i] != 0 && std::abs(gap.rate) * stops_[i].period < slow && std::abs(t - met_[i]) <= one_time * t;
}

/// A joint that is pushed off its stop, or into it, from rest is within round-off of it for a while. Where it goes is
/// decided by the push, and there it is looked at again. The event before stays where it says the same.
void Contacts::hold(std::size_t i, std::vector<StopEvent>& events, StopMotion& motion) {
  const auto joint = static_cast<int>(stops_[i].joint);
  motion.put_on_stop(i);
  closed_[i] = motion.push(i, closed_).acceleration > 0;
  const auto before = std::find_if(events.rbegin(), events.rend(),
                                   [&](const StopEvent& e) { return e.joint == joint && e.kind == EventKind::stop; });
  if (before != events.rend() && before->time == met_[i] && before->contact != (closed_[i] != 0))
    events.erase(std::next(before).base());
  held_[i] = 1;
}

/// Does a joint that is on its stop but for round-off begin to be pressed onto it, or off it?
bool Contacts::follows_the_push(std::size_t i, StopMotion& motion) {
  const double way = motion.push(i, closed_).acceleration * stops_[i].period * stops_[i].period;
  if (std::abs(way) < 2 * still(motion) || (way > 0) == (closed_[i] != 0)) return false;
  closed_[i] = way > 0;
  return true;
}

/// Does something push a joint that is on its stop, so that it will not stay there? One that is pressed against its
/// stop swings in it, and comes back to where the stop begins with no rate left.
bool Contacts::is_pushed(std::size_t i, StopMotion& motion) const {
  const double period = stops_[i].period;
  return std::abs(motion.push(i, closed_).acceleration) * period * period > 2 * small(i, motion);
}

void Contacts::settle(std::size_t i, double t) {
  history_[stops_[i].joint].settled = t;
  armed_[i] = closed_[i] = 0;
}

void Contacts::wake(std::size_t i, Gap gap) {
  history_[stops_[i].joint].settled = -1;
  asleep_[i] = 0;
  armed_[i] = 1;
  closed_[i] = gap.value > 0;
}

}  // namespace flexboom
