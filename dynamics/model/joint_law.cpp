#include "dynamics/model/joint_law.hpp"

#include "dynamics/model/joint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexboom {

namespace {

/// The line of the first two points, and a ramp at each other point but the last.
void add_table(const LawTable& table, double offset, double& load, double& slope, double& origin,
               std::vector<LawRamp>& ramps) {
  if (table.at.size() < 2) return;
  const auto slope_of = [&](size_t i) { return (table.load[i + 1] - table.load[i]) / (table.at[i + 1] - table.at[i]); };
  load = table.load[0], slope = -slope_of(0), origin = table.at[0] - offset;
  for (size_t i = 1; i + 1 < table.at.size(); ++i)
    ramps.push_back({.at = table.at[i] - offset, .slope = slope_of(i - 1) - slope_of(i)});
}

double depth(const LawRamp& r, double x) { return r.above ? std::max(0.0, x - r.at) : std::min(0.0, x - r.at); }

}  // namespace

bool JointLaw::given() const {
  return !spring.at.empty() || !spring.load.empty() || !damper.at.empty() || !damper.load.empty() || preload != 0 ||
         backlash != 0 || friction || lower_stop || upper_stop || latch;
}

LawModel::LawModel(const Joint& joint) {
  const HingeMechanism& m = joint.mechanism;
  const JointLaw& law = joint.law;
  const double offset = m.threshold;
  load = law.preload, origin = m.rest - offset, damping = m.damping;
  if (law.backlash > 0) {
    for (const bool above : {false, true})
      ramps.push_back({.at = origin + (above ? law.backlash : -law.backlash),
                       .slope = m.stiffness,
                       .above = above,
                       .of = LawRamp::Of::backlash});
  } else {
    stiffness = m.stiffness;
  }
  add_table(law.spring, offset, table_load, table_slope, table_origin, ramps);
  double drag_load = 0, drag_slope = 0, drag_origin = 0;
  add_table(law.damper, 0, drag_load, drag_slope, drag_origin, rate_ramps);
  drag = drag_load + drag_slope * drag_origin, damping += drag_slope;
  const auto add_stop = [&](const std::optional<StopLaw>& stop, bool above, std::optional<StopLaw>& rigid) {
    if (!stop) return;
    if (stop->restitution) {
      rigid = stop;
      rigid->at -= offset;
    } else {
      ramps.push_back({stop->at - offset, stop->stiffness, stop->damping, above, LawRamp::Of::stop});
    }
  };
  if (m.stop_stiffness > 0) ramps.push_back({0, m.stop_stiffness, 0, true, LawRamp::Of::stop});
  add_stop(law.lower_stop, false, lower), add_stop(law.upper_stop, true, upper);
  friction = law.friction, latch = law.latch;
  if (latch) latch->at -= offset;
}

LawBranch LawModel::branch(const LawState& s) const {
  LawBranch b;
  b.held = s.motion == LawState::Motion::held;
  b.spring = load + stiffness * origin + table_load + table_slope * table_origin;
  b.stiffness = stiffness + table_slope;
  b.drag = drag, b.damping = damping;
  for (size_t i = 0; i < ramps.size(); ++i) {
    if (!s.beyond[i]) continue;
    const LawRamp& r = ramps[i];
    b.spring += r.slope * r.at, b.stiffness += r.slope;
    if (s.pushes[i])
      b.stop_damping += r.damping;
    else
      b.unused += r.slope * r.at, b.unused_slope += r.slope;
  }
  for (size_t i = 0; i < rate_ramps.size(); ++i)
    if (s.faster[i]) b.drag += rate_ramps[i].slope * rate_ramps[i].at, b.damping += rate_ramps[i].slope;
  if (s.motion == LawState::Motion::forward) b.friction = -friction->coulomb;
  if (s.motion == LawState::Motion::back) b.friction = friction->coulomb;
  return b;
}

bool LawModel::fits(const LawState& s) const {
  using Motion = LawState::Motion;
  const bool rests = s.rests_at != 0, has_its_stop = (s.rests_at > 0 ? upper : lower).has_value();
  const bool moves_so = s.motion == Motion::held   ? friction || rests || s.latched
                        : s.motion == Motion::free ? !friction
                                                   : friction.has_value();
  return s.beyond.size() == ramps.size() && s.pushes.size() == ramps.size() && s.faster.size() == rate_ramps.size() &&
         moves_so && (!rests || has_its_stop) && (!s.latched || latch);
}

double LawModel::spring_energy(double x) const {
  const double stretch = x - origin, along = x - table_origin;
  double energy = 0.5 * stiffness * stretch * stretch - load * stretch;
  energy += 0.5 * table_slope * along * along - table_load * along;
  for (const LawRamp& r : ramps)
    if (r.of != LawRamp::Of::stop) energy += 0.5 * r.slope * depth(r, x) * depth(r, x);
  return energy;
}

double LawModel::stop_energy(double x) const {
  double energy = 0;
  for (const LawRamp& r : ramps)
    if (r.of == LawRamp::Of::stop) energy += 0.5 * r.slope * depth(r, x) * depth(r, x);
  return energy;
}

namespace {

/// Collects what is wrong with one law. Written so that NaN fails.
class LawCheck {
 public:
  explicit LawCheck(const Joint& joint) : joint_(joint), law_(joint.law) {}

  std::vector<LawFault> run() {
    if (!law_.given()) return {};
    where_it_may_be();
    if (!std::isfinite(law_.preload)) add("preload", "must be a finite number");
    table("spring", law_.spring), table("damper", law_.damper);
    damper();
    backlash();
    friction();
    stop("lower_stop", law_.lower_stop), stop("upper_stop", law_.upper_stop);
    ends();
    latch();
    return std::move(faults_);
  }

 private:
  void add(std::string key, std::string text) { faults_.push_back({std::move(key), std::move(text)}); }

  void not_negative(const std::string& key, double value) {
    if (!(value >= 0 && std::isfinite(value))) add(key, fmt::format("is {}; it must be zero or positive", value));
  }

  /// The first piece that is there.
  std::string_view first_key() const {
    const std::array<std::pair<std::string_view, bool>, 8> keys = {
        {{"spring", !law_.spring.at.empty() || !law_.spring.load.empty()},
         {"damper", !law_.damper.at.empty() || !law_.damper.load.empty()},
         {"preload", law_.preload != 0},
         {"backlash", law_.backlash != 0},
         {"friction", law_.friction.has_value()},
         {"lower_stop", law_.lower_stop.has_value()},
         {"upper_stop", law_.upper_stop.has_value()},
         {"latch", true}}};
    return std::ranges::find_if(keys, [](const auto& k) { return k.second; })->first;
  }

  void where_it_may_be() {
    const JointType& type = joint_type(joint_.kind);
    if (type.scalars != 1 || type.turns)
      add(std::string(first_key()), fmt::format("a {} joint has none; hinges and sliders have", type.name));
    else if (!joint_.prescribed.empty())
      add(std::string(first_key()), "is given beside motion, which no law can change; give one of them");
  }

  void table(const char* key, const LawTable& t) {
    if (t.at.empty() && t.load.empty()) return;
    const auto finite = [](const std::vector<double>& v) {
      return std::ranges::all_of(v, [](double x) { return std::isfinite(x); });
    };
    if (t.at.size() != t.load.size())
      add(key, fmt::format("has {} places and {} loads; it needs one load for each", t.at.size(), t.load.size()));
    else if (t.at.size() < 2)
      add(key, "has one point; a line needs two");
    else if (!finite(t.at) || !finite(t.load))
      add(key, "has a value that is not a finite number");
    else if (std::ranges::adjacent_find(t.at, std::greater_equal<>()) != t.at.end())
      add(key, "does not ascend; each angle, length or rate must be larger than the one before");
  }

  /// It must take energy at every rate.
  void damper() {
    const LawTable& t = law_.damper;
    if (t.at.empty() || std::ranges::any_of(faults_, [](const LawFault& f) { return f.key == "damper"; })) return;
    Joint alone;
    alone.law.damper = t;
    const LawModel model(alone);
    double at_rest = model.drag, scale = 0;
    for (const LawRamp& r : model.rate_ramps)
      if (r.at < 0) at_rest += r.slope * r.at;
    for (size_t i = 0; i < t.at.size(); ++i) {
      scale = std::max(scale, std::abs(t.load[i]));
      if (t.at[i] * t.load[i] > 0)
        return add("damper",
                   fmt::format("drives the joint at a rate of {}: its load must have the other sign", t.at[i]));
    }
    if (std::abs(at_rest) > 1e-12 * scale)
      add("damper",
          fmt::format("has a load of {:.6g} at rest; it must be zero there (friction has its own key)", at_rest));
    const size_t last = t.at.size() - 1;
    if (t.load[1] > t.load[0] && t.at[0] < 0)
      add("damper", "drives the joint at high negative rates: its line must not rise before the first point");
    if (t.load[last] > t.load[last - 1] && t.at[last] > 0)
      add("damper", "drives the joint at high rates: its line must not rise beyond the last point");
  }

  void backlash() {
    if (law_.backlash == 0) return;
    not_negative("backlash", law_.backlash);
    if (!(joint_.mechanism.stiffness > 0))
      add("backlash", "needs a stiffness: it is the way about rest in which that spring has no load");
  }

  void friction() {
    if (!law_.friction) return;
    const auto& [coulomb, breakaway] = *law_.friction;
    if (!(coulomb >= 0 && std::isfinite(coulomb))) return not_negative("friction.coulomb", coulomb);
    if (!(breakaway > 0 && std::isfinite(breakaway)))
      add("friction.breakaway", fmt::format("is {}; it must be positive", breakaway));
    else if (breakaway < coulomb)
      add("friction.breakaway",
          fmt::format("is {}, less than coulomb, {}; what holds at rest is no less than what holds in motion",
                      breakaway, coulomb));
  }

  void stop(const std::string& key, const std::optional<StopLaw>& s) {
    if (!s) return;
    if (!std::isfinite(s->at)) add(key + ".at", "must be a finite number");
    not_negative(key + ".stiffness", s->stiffness), not_negative(key + ".damping", s->damping);
    if (s->restitution) {
      if (s->stiffness != 0 || s->damping != 0)
        add(key + ".restitution", "is given beside stiffness or damping; a stop is rigid or a pad, give one of them");
      if (!(*s->restitution >= 0 && *s->restitution <= 1))
        add(key + ".restitution", fmt::format("is {}; it must lie from 0 to 1", *s->restitution));
    } else if (!(s->stiffness > 0)) {
      add(key, "needs a stiffness, or a restitution of a rigid stop");
    }
  }

  void ends() {
    if (law_.upper_stop && joint_.mechanism.stop_stiffness > 0)
      add("upper_stop", "is given beside stop_stiffness, which is a stop at threshold; give one of them");
    if (!law_.lower_stop) return;
    if (joint_.mechanism.stop_stiffness > 0 && !(law_.lower_stop->at < joint_.mechanism.threshold))
      add("lower_stop.at", fmt::format("is {}; it must lie below threshold, {}, where the other stop is",
                                       law_.lower_stop->at, joint_.mechanism.threshold));
    if (law_.upper_stop && !(law_.lower_stop->at < law_.upper_stop->at))
      add("lower_stop.at",
          fmt::format("is {}; it must lie below upper_stop.at, {}", law_.lower_stop->at, law_.upper_stop->at));
  }

  void latch() {
    if (!law_.latch) return;
    const double at = law_.latch->at;
    if (!std::isfinite(at)) add("latch.at", "must be a finite number");
    if (!(law_.latch->rate > 0)) add("latch.rate", fmt::format("is {}; it must be positive", law_.latch->rate));
    const bool below = law_.lower_stop && at < law_.lower_stop->at,
               beyond = law_.upper_stop && at > law_.upper_stop->at;
    if (below || beyond)
      add("latch.at", fmt::format("is {}, {} at {}; it must lie between the stops", at,
                                  below ? "below lower_stop" : "beyond upper_stop",
                                  below ? law_.lower_stop->at : law_.upper_stop->at));
  }

  const Joint& joint_;
  const JointLaw& law_;
  std::vector<LawFault> faults_;
};

}  // namespace

std::vector<LawFault> law_faults(const Joint& joint) { return LawCheck(joint).run(); }

}  // namespace flexboom
