#include "dynamics/events/laws.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexboom {

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double place_round_off = 1e-14;  // of an angle, in radians or of its size

double round_off_at(double place) { return place_round_off * std::max(1.0, std::abs(place)); }

/// Is x that place, but for round-off?
bool is_at(double place, double x) { return std::abs(x - place) <= round_off_at(place); }

}  // namespace

Laws::Laws(const std::vector<Joint>& joints, const FlightOptions& options, double round_off)
    : round_off_(round_off), tolerance_(options.tolerance), settle_(options.settle_at()) {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (!joints[i].law.given()) continue;
    laws_.push_back({.joint = i, .name = joints[i].name, .model = LawModel(joints[i]), .state = {}, .chatter = {}});
    Law& law = laws_.back();
    if (!options.stops.empty()) {
      const StopHistory& before = options.stops[i];
      law.largest_rate = before.largest_rate, law.largest_gap = before.largest_gap;
      if (before.law) law.state = *before.law;
    }
    add_switches(laws_.size() - 1);
  }
  sides_.resize(switches_.size()), armed_.resize(switches_.size()), crossed_.resize(switches_.size());
  if (!laws_.empty()) branches_.resize(joints.size());
}

void Laws::add_switches(std::size_t law) {
  using Kind = LawSwitch::Kind;
  const LawModel& m = laws_[law].model;
  for (std::size_t i = 0; i < m.ramps.size(); ++i) {
    switches_.push_back({law, Kind::ramp, i});
    if (m.ramps[i].damping > 0) switches_.push_back({law, Kind::push, i});
  }
  for (std::size_t i = 0; i < m.rate_ramps.size(); ++i) switches_.push_back({law, Kind::faster, i});
  if (m.latch) switches_.push_back({law, Kind::latch});  // first: what is slow enough does not bounce
  if (m.friction) switches_.push_back({law, Kind::turn});
  if (m.friction || m.lower || m.upper) {
    switches_.push_back({law, Kind::break_forward});
    switches_.push_back({law, Kind::break_back});
  }
  if (m.upper) switches_.push_back({law, Kind::hit_upper});
  if (m.lower) switches_.push_back({law, Kind::hit_lower});
}

bool Laws::needs_acceleration(const LawSwitch& s) {
  using Kind = LawSwitch::Kind;
  return s.kind == Kind::push || s.kind == Kind::faster || s.kind == Kind::turn;
}

bool Laws::needs_hold(const LawSwitch& s) {
  return s.kind == LawSwitch::Kind::break_forward || s.kind == LawSwitch::Kind::break_back;
}

Gap Laws::gap(const LawSwitch& s, const LawPoint& p) const {
  using Kind = LawSwitch::Kind;
  const Law& law = laws_[s.law];
  const LawModel& m = law.model;
  switch (s.kind) {
    case Kind::ramp: {
      const double side = m.ramps[s.ramp].above ? 1 : -1;
      return {side * (p.x - m.ramps[s.ramp].at), side * p.rate};
    }
    case Kind::push: {
      const LawRamp& r = m.ramps[s.ramp];
      const double side = r.above ? 1 : -1;
      return {side * (r.slope * (p.x - r.at) + r.damping * p.rate),
              side * (r.slope * p.rate + r.damping * p.acceleration)};
    }
    case Kind::faster:
      return {p.rate - m.rate_ramps[s.ramp].at, p.acceleration};
    case Kind::turn: {
      const double side = law.state.motion == Motion::forward ? 1 : -1;
      return {side * p.rate + still(law), side * p.acceleration};
    }
    case Kind::break_forward:
      return {-p.hold - bounds(law).upper, -p.hold_slope};
    case Kind::break_back:
      return {bounds(law).lower + p.hold, p.hold_slope};
    case Kind::latch:
      return {p.x - m.latch->at, p.rate};
    case Kind::hit_upper:
      return {p.x - m.upper->at - open(law, m.upper->at), p.rate};
    case Kind::hit_lower:
      return {m.lower->at - p.x - open(law, m.lower->at), -p.rate};
  }
  return {};
}

bool Laws::has_latch_at(const Law& law, const std::optional<StopLaw>& rigid_stop) {
  const auto& latch = law.model.latch;
  return latch && rigid_stop && is_at(latch->at, rigid_stop->at);
}

/// A rate that is none: the start of a motion may be wrong by so much, and a rate between two bodies by its round-off.
double Laws::still(const Law& law) const {
  return std::max(1e-3 * tolerance_ * std::max(law.largest_rate, 1e-6), 100 * round_off_);
}

/// How far beyond a rigid stop a joint is not yet, where a motion can not be put to a place exactly.
double Laws::open(const Law& law, double place) const {
  if (round_off_ == 0) return 0;
  const double noise = law.has_left ? 0.1 * tolerance_ * law.largest_gap : 0;
  return std::max(noise, round_off_ * std::max(1.0, std::abs(place)));
}

Laws::Bounds Laws::bounds(const Law& law) {
  const double friction = law.model.friction ? law.model.friction->breakaway : 0;
  Bounds b = {-friction, friction};
  if (law.state.latched || law.state.rests_at > 0) b.upper = infinite;
  if (law.state.latched || law.state.rests_at < 0) b.lower = -infinite;
  return b;
}

void Laws::event(const Law& law, double t, EventKind kind, double rate, bool contact) {
  events_->push_back({t, static_cast<int>(law.joint), contact, rate, kind});
}

void Laws::refresh(LawMotion& motion) {
  for (const Law& law : laws_) branches_[law.joint] = law.model.branch(law.state);
  motion.take_branches();
}

void Laws::arm() {
  using Kind = LawSwitch::Kind;
  for (std::size_t i = 0; i < switches_.size(); ++i) {
    const LawSwitch& s = switches_[i];
    const LawState& state = laws_[s.law].state;
    const bool held = state.motion == Motion::held;
    char side = 0;
    bool armed = !held;
    if (s.kind == Kind::ramp) side = state.beyond[s.ramp];
    if (s.kind == Kind::push) side = state.pushes[s.ramp], armed = armed && state.beyond[s.ramp];
    if (s.kind == Kind::faster) side = state.faster[s.ramp];
    if (s.kind == Kind::latch) {  // at a rigid stop, a blow is what brings a joint to its latch
      const Law& law = laws_[s.law];
      side = state.past_latch;
      armed = armed && !has_latch_at(law, law.model.upper) && !has_latch_at(law, law.model.lower);
    }
    if (s.kind == Kind::turn) side = 1, armed = armed && state.motion != Motion::free;
    if (s.kind == Kind::break_forward) armed = held && bounds(laws_[s.law]).upper < infinite;
    if (s.kind == Kind::break_back) armed = held && bounds(laws_[s.law]).lower > -infinite;
    sides_[i] = side, armed_[i] = armed, crossed_[i] = 0;
  }
}

/// What rests sticks until it is known whether it can.
void Laws::guess_state(Law& law, Gap way) {
  const LawModel& m = law.model;
  LawState& s = law.state;
  const double x = way.value, rate = way.rate;
  s = {};
  for (const LawRamp& r : m.ramps) {
    const double side = r.above ? 1 : -1, depth = side * (x - r.at);
    s.beyond.push_back(is_at(r.at, x) ? side * rate > 0 : depth > 0);
    s.pushes.push_back(s.beyond.back() && (r.damping == 0 || r.slope * depth + r.damping * side * rate > 0));
  }
  for (const LawRamp& r : m.rate_ramps) s.faster.push_back(rate > r.at);
  if (m.latch) {
    const double beyond = x - m.latch->at;
    s.past_latch = beyond > 0 || (beyond == 0 && rate > 0);
    s.latched = is_at(m.latch->at, x) && std::abs(rate) <= m.latch->rate;
  }
  const bool rests = std::abs(rate) <= still(law);
  if (m.upper && x >= m.upper->at - round_off_at(m.upper->at) && rests) s.rests_at = 1;
  if (m.lower && x <= m.lower->at + round_off_at(m.lower->at) && rests) s.rests_at = -1;
  if (m.friction) s.motion = rate > 0 ? Motion::forward : Motion::back;
  if (s.rests_at != 0 || (m.friction && rests)) s.motion = Motion::held;
}

/// What starts at rest on the place of a ramp is on the side where its push takes it.
void Laws::go_where_pushed(LawMotion& motion, Law& law) {
  LawState& s = law.state;
  if (s.motion == Motion::held) return;
  const Gap way = motion.joint_way(law.joint);
  for (std::size_t k = 0; k < law.model.ramps.size(); ++k) {
    const LawRamp& r = law.model.ramps[k];
    if (!is_at(r.at, way.value)) continue;
    motion.put(law.joint, r.at);
    if (std::abs(way.rate) > still(law)) continue;
    s.beyond[k] = s.pushes[k] = (r.above ? 1 : -1) * motion.joint_acceleration(law.joint) > 0;
    refresh(motion);
  }
}

void Laws::begin(LawMotion& motion, double t, std::vector<StopEvent>& events) {
  if (empty()) return;
  events_ = &events;
  std::vector<char> guessed(laws_.size(), 0), latches(laws_.size(), 0);
  for (std::size_t i = 0; i < laws_.size(); ++i) {
    Law& law = laws_[i];
    const Gap way = motion.joint_way(law.joint);
    const bool goes_on = law.model.fits(law.state) && law.largest_rate > 0;
    law.largest_rate = std::max(law.largest_rate, std::abs(way.rate));
    law.largest_gap = std::max(law.largest_gap, std::abs(way.value));
    if (goes_on) continue;
    guess_state(law, way);
    guessed[i] = 1;
    latches[i] = law.state.latched;
    law.state.latched = false;
  }
  refresh(motion);
  for (std::size_t i = 0; i < laws_.size(); ++i)
    if (guessed[i]) go_where_pushed(motion, laws_[i]);
  for (std::size_t i = 0; i < laws_.size(); ++i) {
    Law& law = laws_[i];
    const Gap way = motion.joint_way(law.joint);
    if (latches[i]) {
      event(law, t, EventKind::latch, way.rate);
      law.state.latched = true;
      if (law.state.motion != Motion::held) strike(motion, law, 0, LawLoss::latch);
      hold(motion, law);
      follow_rates(motion, t);
    }
    for (const int end : {1, -1}) {  // on the stop, going there
      const auto& stop = end > 0 ? law.model.upper : law.model.lower;
      if (!stop || law.state.motion == Motion::held || !(end * way.rate > 0)) continue;
      if (end * (way.value - stop->at) >= -round_off_at(stop->at)) hit(motion, law, t);
    }
  }
  let_go_what_slips(motion, t);
  refresh(motion);
  arm();
}

bool Laws::update(LawMotion& motion, double t, std::vector<StopEvent>& events) {
  if (empty()) return false;
  events_ = &events;
  bool changed = false, breakable = false;
  const std::vector<int> crossed = crossed_;
  for (Law& law : laws_) {
    const Gap way = motion.joint_way(law.joint);
    law.largest_rate = std::max(law.largest_rate, std::abs(way.rate));
    law.largest_gap = std::max(law.largest_gap, std::abs(way.value));
    breakable = breakable || (law.state.motion == Motion::held && !law.state.latched);
  }
  for (std::size_t i = 0; i < switches_.size(); ++i) {
    if (!armed_[i]) continue;
    int direction = crossed[i];
    if (direction == 0 && !needs_hold(switches_[i]) &&
        switches_[i].kind != LawSwitch::Kind::push) {  // a root finder may miss a change of sign where the gap begins
      const Law& law = laws_[switches_[i].law];
      const Gap way = motion.joint_way(law.joint);
      const double noise = 10 * tolerance_ * std::max(law.largest_gap + law.largest_rate, 1e-6);
      const double value = gap(switches_[i], {way.value, way.rate}).value;
      if (sides_[i] ? value < -noise : value > noise) direction = sides_[i] ? -1 : 1;
    }
    if (direction == 0) continue;
    apply(motion, switches_[i], direction, t);
    laws_[switches_[i].law].chatter.contact(t, laws_[switches_[i].law].name);
    changed = true;
  }
  if (changed) refresh(motion);
  if ((changed || breakable) && let_go_what_slips(motion, t)) changed = true;
  if (changed) arm();
  return changed;
}

void Laws::add_histories(std::vector<StopHistory>& all) const {
  for (const Law& law : laws_) {
    StopHistory& h = all[law.joint];
    h.largest_rate = law.largest_rate, h.largest_gap = law.largest_gap;
    h.law = law.state;
  }
}

}  // namespace flexboom
