// What events make of the states of laws.

#include "dynamics/events/laws.hpp"

#include <algorithm>
#include <cmath>

namespace flexboom {

namespace {

int direction_of(const LawSwitch& s) { return s.kind == LawSwitch::Kind::hit_upper ? 1 : -1; }

}  // namespace

void Laws::apply(LawMotion& motion, const LawSwitch& s, int direction, double t) {
  using Kind = LawSwitch::Kind;
  Law& law = laws_[s.law];
  LawState& state = law.state;
  const Gap way = motion.joint_way(law.joint);
  const bool held = state.motion == Motion::held;
  switch (s.kind) {
    case Kind::ramp:
      motion.put(law.joint, law.model.ramps[s.ramp].at);
      return apply_ramp(law, s.ramp, direction > 0, way.rate, t);
    case Kind::push:
      state.pushes[s.ramp] = state.beyond[s.ramp] && direction > 0;
      return;
    case Kind::faster:
      state.faster[s.ramp] = direction > 0;
      return event(law, t, EventKind::kink, way.rate);
    case Kind::turn:
      if (!held) come_to_rest(motion, law, t);
      return;
    case Kind::break_forward:
    case Kind::break_back:
      if (held) let_go(law, s.kind == Kind::break_forward ? 1 : -1, t);
      return refresh(motion);
    case Kind::latch:
      state.past_latch = direction > 0;
      if (std::abs(way.rate) > law.model.latch->rate || held) return;
      return latch(motion, law, t);
    case Kind::hit_upper:
    case Kind::hit_lower:
      motion.put(law.joint, (s.kind == Kind::hit_upper ? law.model.upper : law.model.lower)->at);
      if (!held && way.rate * direction_of(s) > 0) hit(motion, law, t);
  }
}

void Laws::apply_ramp(Law& law, std::size_t ramp, bool beyond, double rate, double t) {
  law.state.beyond[ramp] = law.state.pushes[ramp] = beyond;
  switch (law.model.ramps[ramp].of) {
    case LawRamp::Of::stop:
      return event(law, t, EventKind::stop, rate, beyond);
    case LawRamp::Of::backlash:
      return event(law, t, beyond ? EventKind::engage : EventKind::disengage, rate);
    case LawRamp::Of::table:
      return event(law, t, EventKind::kink, rate);
  }
}

void Laws::hold(LawMotion& motion, Law& law) {
  law.state.motion = Motion::held;
  refresh(motion);
  motion.put_to_rest(law.joint);
}

/// Friction has taken the rate: it sticks, goes on, or goes back.
void Laws::come_to_rest(LawMotion& motion, Law& law, double t) {
  const Motion before = law.state.motion;
  const double rate = motion.joint_way(law.joint).rate;
  hold(motion, law);
  const double load = -motion.hold_load(law.joint);
  const Bounds b = bounds(law);
  if (load >= b.lower && load <= b.upper) return event(law, t, EventKind::stick, rate);
  law.state.motion = load > b.upper ? Motion::forward : Motion::back;
  if (law.state.motion != before) event(law, t, EventKind::slip, rate);
  refresh(motion);
}

/// What was held goes where the load pushes it.
void Laws::let_go(Law& law, double load, double t) {
  event(law, t, law.state.rests_at != 0 ? EventKind::leave : EventKind::slip, 0);
  law.has_left = law.state.rests_at != 0;
  law.state.rests_at = 0;
  law.state.motion = !law.model.friction ? Motion::free : load > 0 ? Motion::forward : Motion::back;
}

/// Joint by joint, the one first that its load tears away most.
bool Laws::let_go_what_slips(LawMotion& motion, double t) {
  constexpr double round_off = 1e-11;  // of a load
  bool any = false;
  for (std::size_t round = 0; round <= laws_.size(); ++round) {
    Law* worst = nullptr;
    double most = 0, of_worst = 0;
    for (Law& law : laws_) {
      if (law.state.motion != Motion::held || law.state.latched) continue;
      const double load = -motion.hold_load(law.joint);
      const Bounds b = bounds(law);
      const double excess = std::max(load - b.upper, b.lower - load);
      const double size = std::abs(load) + (law.model.friction ? law.model.friction->breakaway : 0);
      if (excess <= round_off * size || excess <= most) continue;
      worst = &law, most = excess, of_worst = load;
    }
    if (worst == nullptr) break;
    let_go(*worst, of_worst, t);
    refresh(motion);
    any = true;
  }
  return any;
}

/// Slow enough, where the latch is.
void Laws::latch(LawMotion& motion, Law& law, double t) {
  motion.put(law.joint, law.model.latch->at);
  event(law, t, EventKind::latch, motion.joint_way(law.joint).rate);
  strike(motion, law, 0, LawLoss::latch);
  law.state.latched = true;
  hold(motion, law);
  follow_rates(motion, t);
}

/// A rigid stop: Newton's rule for the rate, through the inertia of everything that hangs together. Where a latch is at
/// the stop, what arrives or comes back slowly enough is caught.
void Laws::hit(LawMotion& motion, Law& law, double t) {
  const double rate = motion.joint_way(law.joint).rate;
  const int end = rate > 0 ? 1 : -1;
  const std::optional<StopLaw>& stop = end > 0 ? law.model.upper : law.model.lower;
  const double restitution = *stop->restitution, rebound = std::abs(restitution * rate);
  const bool has_latch = has_latch_at(law, stop);
  const auto is_caught = [&](double speed) { return has_latch && speed <= law.model.latch->rate; };
  if (is_caught(std::abs(rate))) return latch(motion, law, t);
  event(law, t, EventKind::impact, rate);
  law.has_left = false;
  refresh(motion);
  const bool frees_others = !is_momentary(law, std::abs(rate), end * motion.joint_acceleration(law.joint));
  strike(motion, law, -restitution * rate, LawLoss::impact, frees_others);
  if (is_caught(rebound)) return latch(motion, law, t);
  if (rebound > still(law)) {
    follow_rates(motion, t);
    if (!is_captured(motion, law, rebound)) return;
    strike(motion, law, 0, LawLoss::impact, false);  // a part of the first is taken back
    if (has_latch) return latch(motion, law, t);
  }
  law.state.rests_at = end;
  follow_rates(motion, t);
  if (law.state.motion == Motion::held) event(law, t, EventKind::rest, 0);
}

/// Would it come back at once, with a rate that nobody asks for, or from a height that the method does not know?
bool Laws::is_captured(LawMotion& motion, Law& law, double rebound) const {
  const double rate = motion.joint_way(law.joint).rate;
  const double towards = -motion.joint_acceleration(law.joint) * (rate > 0 ? 1 : -1);
  return is_momentary(law, rebound, towards) || (towards > 0 && rebound < settle_ * law.largest_rate);
}

/// Is a joint at a rigid stop so slow, against the acceleration towards the stop, that it is there again at once? Or
/// does it come no farther than its place is known?
bool Laws::is_momentary(const Law& law, double speed, double towards) const {
  constexpr double at_once = 1e-9;  // [s]
  const double height = speed * speed / (2 * std::max(towards, 1e-300));
  // What an error of a step makes of a place.
  const double open = std::max(0.1 * tolerance_ * law.largest_gap, 10 * round_off_);
  return towards > 0 && (2 * speed < at_once * towards || height < open);
}

/// A blow along one joint that gives it a new rate. Friction is no match for it: what sticks slips; what rests at a
/// stop leaves it where the stop would have to pull. A momentary one frees none of these: two joints that are
/// pressed onto their stops would throw each other off them for ever.
void Laws::strike(LawMotion& motion, Law& law, double new_rate, LawLoss loss, bool frees_others) {
  const double rate = motion.joint_way(law.joint).rate;
  if (rate == new_rate) return;
  const auto loosen = [&](Law& l) { l.state.motion = l.model.friction ? Motion::forward : Motion::free; };
  loosen(law);
  for (Law& other : laws_)
    if (frees_others && other.state.motion == Motion::held && !other.state.latched && other.state.rests_at == 0)
      loosen(other);
  for (std::size_t round = 0; round <= laws_.size(); ++round) {
    refresh(motion);
    motion.prepare_blow(law.joint);
    if (!frees_others) break;
    const double sense = new_rate > rate ? 1 : -1;
    const auto pulls = [&](const Law& l) {
      return l.state.motion == Motion::held && !l.state.latched &&
             l.state.rests_at * sense * motion.hold_of_blow(l.joint) > 0;
    };
    const auto pulled = std::ranges::find_if(laws_, pulls);
    if (pulled == laws_.end()) break;
    loosen(*pulled);
  }
  const double impulse = (new_rate - rate) / motion.rate_of_blow(law.joint);
  motion.strike(impulse);
  motion.lose(law.joint, loss, -0.5 * impulse * (rate + new_rate));
  for (Law& l : laws_) l.largest_rate = std::max(l.largest_rate, std::abs(motion.joint_way(l.joint).rate));
}

/// After a blow: friction against the rate that each joint has now.
void Laws::follow_rates(LawMotion& motion, double t) {
  std::vector<Law*> resting;
  for (Law& law : laws_) {
    if (law.state.motion == Motion::held) continue;
    const double rate = motion.joint_way(law.joint).rate;
    if (law.state.rests_at != 0 && std::abs(rate) > still(law)) law.state.rests_at = 0;
    if (!law.model.friction && law.state.rests_at == 0) continue;
    if (std::abs(rate) <= still(law)) {
      law.state.motion = Motion::held;
      resting.push_back(&law);
    } else {
      law.state.motion = rate > 0 ? Motion::forward : Motion::back;
    }
  }
  refresh(motion);
  for (const Law* law : resting) motion.put_to_rest(law->joint);
  let_go_what_slips(motion, t);
}

}  // namespace flexboom
