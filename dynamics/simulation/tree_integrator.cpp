#include "dynamics/simulation/tree_integrator.hpp"

#include "dynamics/events/conservation.hpp"
#include "dynamics/events/event_loop.hpp"
#include "dynamics/events/telling_moments.hpp"
#include "dynamics/methods/error_scales.hpp"
#include "dynamics/methods/linear_parts.hpp"
#include "dynamics/methods/ode.hpp"
#include "dynamics/relative/split.hpp"
#include "dynamics/simulation/method_choice.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace flexboom {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

std::vector<Stop> stops_of(const Tree& tree) {
  std::vector<Stop> stops;
  for (const int joint : tree.stops()) {
    const Joint& j = tree.scene().joints[static_cast<size_t>(joint)];
    stops.push_back(stop_of(j, static_cast<size_t>(joint), tree.scene().bodies[static_cast<size_t>(j.b.body)]));
  }
  return stops;
}

/// Does exponential collocation suit a flight? Not where few bodies tumble free of all that acts and pulls.
class Pilot {
 public:
  Pilot(const Tree& tree, double duration)
      : duration_(duration), is_small_(tree.layout().p + tree.layout().u <= small && is_isolated(tree.scene())) {}

  /// No failure: nothing of the flight is kept.
  struct Unsuitable {
    static constexpr const char* why = "all that moves is nonlinear";
  };

  /// Before the first step. @throws Unsuitable.
  void observe(double fastest) {
    fastest_ = fastest;
    constexpr double round_off = 1e-6;  // of an eigenvalue
    if (is_small_ && fastest < std::max(1 / duration_, (1 + round_off) * held)) throw Unsuitable();
  }
  std::string why() const { return fmt::format("linear motions reach {:.3g} rad/s", fastest_); }

 private:
  static constexpr int small = 12;  // coordinates and rates: explicit steps are cheaper
  double duration_;
  bool is_small_;
  double fastest_ = 0;  // [rad/s]
};

class TreeFlight final : public Flight<TreeTrajectory> {
 public:
  TreeFlight(const Tree& tree, const VectorXd& y0, const IntegratorOptions& options, const IntegratorMethod& method,
             const Checkpoint<TreeTrajectory>& so_far, const StiffeningLook& look, Pilot* pilot = nullptr)
      : Flight(options, so_far, stops_of(tree), tree.scene().joints.size(), Laws(tree.scene().joints, options)),
        tree_(tree),
        scales_(tree, y0, method.share_of(options) * options.tolerance, options.rescale_at_events),
        ode_(ode_of(tree, laws_)),
        stepper_(method.make != nullptr ? method.make(ode_of(tree, laws_), scales_.error())
                                        : method.make_split(split(tree), scales_.error())),
        exact_in_linear_part_(method.make_split != nullptr),
        accuracy_(options.accuracy > 0 ? options.accuracy : options.tolerance),
        pilot_(pilot),
        look_(look),
        work_(tree.workspace()),
        has_stiffening_(
            std::ranges::any_of(tree.scene().bodies, [](const ReducedBody& b) { return !b.Kg.spin.empty(); })),
        moments_(tree.scene().joints, options),
        effect_(tree.scene().bodies.size()),
        y_dot_(y0.size()),
        flags_(contacts_.closed()),
        crossed_(contacts_.size() + laws_.switches().size(), 0) {
    y_ = y0;
    result_.summary.method = method.name;
    for (size_t i = 0; i < contacts_.size() && !options.rescale_at_events; ++i)
      scales_.raise(scalar(i), contacts_.largest_gap(i));
    contacts_.begin(*this);
    laws_.begin(*this, t_, result_.events);
    scales_.observe(y_);  // an impact at the start changes it at once
  }

 private:
  Gap gap(size_t stop) override {
    return {tree_.gap(y_.data(), tree_.stops()[stop]), tree_.gap_rate(y_.data(), tree_.stops()[stop])};
  }

  /// Stiff modes make a push of what the method's error leaves open of them.
  Push push(size_t stop, std::span<const char> closed) override {
    const ErrorScale& error = scales_.error();
    const double here = acceleration(stop, closed, y_);
    return {here, std::abs(acceleration(stop, closed, y_ + error.tolerance * error.scale) - here)};
  }

  double acceleration(size_t stop, std::span<const char> closed, const VectorXd& y) {
    ode_->derivative(t_, y.data(), closed, y_dot_.data());
    return ode_->gap_rate(y_dot_.data(), static_cast<int>(stop));
  }

  /// The exponential method has no error in what a hinge does when it hardly moves. What no symmetry would move at all
  /// has the round-off of what turns.
  double noise(size_t stop) const override {
    const ErrorScale& error = scales_.error();
    const double of_steps = error.tolerance * error.scale[scalar(stop)];
    const double of_method = exact_in_linear_part_ ? std::min(of_steps, 1e-14 * contacts_.largest_gap(stop)) : of_steps;
    return std::max(of_method, 1e-16 * fastest_turn_ * contacts_.stop(stop).period);
  }

  void put_on_stop(size_t stop) override { y_[scalar(stop)] = 0; }

  int scalar(size_t stop) const { return tree_.layout().joints[static_cast<size_t>(tree_.stops()[stop])].scalar; }

  Gap joint_way(size_t joint) override {
    const int i = static_cast<int>(joint);
    return {tree_.gap(y_.data(), i), tree_.gap_rate(y_.data(), i)};
  }
  double joint_acceleration(size_t joint) override {
    evaluate(laws_.branches());
    return tree_.gap_rate(y_dot_.data(), static_cast<int>(joint));
  }
  double hold_load(size_t joint) override {
    evaluate(laws_.branches());
    return tree_.hold_load(static_cast<int>(joint), y_.data(), *work_);
  }
  void put(size_t joint, double x) override { y_[tree_.layout().joints[joint].scalar] = x; }
  void put_to_rest(size_t joint) override { y_[tree_.layout().rate(tree_.layout().joints[joint].scalar)] = 0; }
  void lose(size_t joint, LawLoss loss, double energy) override {
    y_[tree_.layout().joints[joint].losses + static_cast<int>(loss)] += energy;
  }

  /// Everything is affine in a load: what a load makes of accelerations, an impulse makes of rates. The load is as
  /// large as the others, else its part were round-off.
  void prepare_blow(size_t joint) override {
    std::vector<LawBranch> loaded(laws_.branches().begin(), laws_.branches().end());
    std::vector<double> hold(loaded.size(), 0.0);
    evaluate(laws_.branches());
    const VectorXd before = y_dot_;
    for (size_t i = 0; i < hold.size(); ++i)
      if (loaded[i].held) hold[i] = tree_.hold_load(static_cast<int>(i), y_.data(), *work_);
    double load = 1;
    for (int round = 0; round < 2; ++round) {
      loaded[joint].spring = laws_.branches()[joint].spring + load;
      evaluate(loaded);
      blow_ = (y_dot_ - before) / load;
      hold_of_blow_.assign(hold.size(), 0.0);
      for (size_t i = 0; i < hold.size(); ++i)
        if (loaded[i].held)
          hold_of_blow_[i] = (tree_.hold_load(static_cast<int>(i), y_.data(), *work_) - hold[i]) / load;
      load = 1e3 * (1 + before.cwiseAbs().maxCoeff()) / std::abs(rate_of_blow(joint));
    }
  }
  double rate_of_blow(size_t joint) override { return tree_.gap_rate(blow_.data(), static_cast<int>(joint)); }
  double hold_of_blow(size_t joint) override { return hold_of_blow_[joint]; }
  void strike(double impulse) override { y_ += impulse * blow_; }

  void evaluate(std::span<const LawBranch> laws) {
    tree_.derivative(t_, y_.data(), contacts_.by_joint(contacts_.closed()), *work_, y_dot_.data(), laws);
  }

  /// Stops come before the switches of laws.
  void restart() override {
    flags_ = contacts_.closed();
    flags_.insert(flags_.end(), laws_.sides().begin(), laws_.sides().end());
    levels_.clear();
    for (size_t i = 0; i < contacts_.size(); ++i) levels_.push_back(contacts_.level(i, *this));
    for (const char armed : laws_.armed()) levels_.push_back(armed ? 0 : no_level);
    const bool starts = t_ == options_.start;
    if (!starts) {
      for (const TreeLayout::Joint& j : tree_.layout().joints)
        if (j.attitude >= 0) y_.segment<4>(j.attitude).normalize();
      scales_.restart(y_);
    }
    stepper_->restart(t_, y_, flags_, levels_);
    if (starts && pilot_ != nullptr) pilot_->observe(stepper_->fastest());
    if (starts) stepper_->predict(options_.duration, [this](const VectorXd& y) { scales_.predict(y); });
  }
  void step(double limit, double& t, VectorXd& y) override {
    stepper_->step(limit, t, y, crossed_);
    const auto stops = static_cast<std::ptrdiff_t>(contacts_.size());
    std::copy(crossed_.begin(), crossed_.begin() + stops, contacts_.crossed().begin());
    std::copy(crossed_.begin() + stops, crossed_.end(), laws_.crossed().begin());
  }
  void interpolate(std::span<const double> times, Eigen::MatrixXd& Y) override { stepper_->interpolate(times, Y); }
  void observe(const VectorXd& y) override {
    scales_.observe(y);
    for (const TreeLayout::Joint& j : tree_.layout().joints)
      if (j.omega >= 0) fastest_turn_ = std::max(fastest_turn_, y.segment<3>(j.omega).norm());
    if (has_stiffening_ && moments_.at(t_, [&](size_t joint) {
          const auto i = static_cast<int>(joint);
          return tree_.gap(y.data(), i) + tree_.scene().joints[joint].mechanism.threshold;
        }))
      look_between(y);
  }
  void keep_rows(size_t rows) override {
    result_.y.resize(rows), result_.balance.resize(rows);
    if (!laws_.empty()) result_.laws.resize(rows);
  }

  void record(double t, VectorXd y) override {
    for (const TreeLayout::Joint& j : tree_.layout().joints) {
      if (j.attitude < 0) continue;
      auto attitude = y.segment<4>(j.attitude);
      result_.summary.constraint_drift = std::max(result_.summary.constraint_drift, std::abs(attitude.norm() - 1));
      attitude.normalize();
    }
    tree_.impose(t, y);
    result_.balance.push_back(tree_.balance(t, y, *work_));
    if (t == output_time()) look_at_stiffening(t, y);
    result_.time.push_back(t);
    result_.y.push_back(std::move(y));
    if (!laws_.empty()) result_.laws.emplace_back(laws_.branches().begin(), laws_.branches().end());
  }

  /// At every output of a short list, at some of a long one: an eigenvalue problem for each body.
  void look_at_stiffening(double t, const VectorXd& y) {
    if (!has_stiffening_) return;
    const double outputs = (options_.duration - options_.start) / options_.output_step;
    const auto stride = static_cast<size_t>(outputs / looks_at_stiffening) + 1;
    if (result_.time.size() % stride != 0) return;
    flexboom::observe(stiffening(t, y), t, effect_);
    if (look_) look_(effect_);
  }
  void look_between(VectorXd y) {
    tree_.impose(t_, y);
    observe_size(stiffening(t_, y), effect_);
    if (look_) look_(effect_);
  }
  std::vector<StiffeningEffect> stiffening(double t, const VectorXd& y) {
    return tree_.stiffening_effect(t, y, contacts_.by_joint(contacts_.closed()), *work_, laws_.branches());
  }

  void finish() override {
    IntegrationSummary& s = result_.summary;
    static_cast<StepCounts&>(s) = stepper_->counts();
    Conservation kept(tree_.scene().bodies, options_.largest);
    for (const Balance& b : result_.balance) kept.add(b);
    s.largest = kept.largest();
    s.energy_balance = kept.energy_balance();
    if (is_isolated(tree_.scene())) s.momentum_drift = kept.momentum_drift();
    result_.stiffening_effect = effect_;
    result_.warnings = stiffening_warnings(tree_.scene(), effect_, options_.duration, accuracy_,
                                           [this](int body) { return tree_.stiffening(body); });
  }

  const Tree& tree_;
  ErrorScales scales_;
  std::unique_ptr<Ode> ode_;
  std::unique_ptr<Stepper> stepper_;
  bool exact_in_linear_part_;
  double accuracy_;
  double fastest_turn_ = 0;  // of a floating body [rad/s]
  Pilot* pilot_;
  const StiffeningLook& look_;
  TreeWorkspaceHandle work_;
  bool has_stiffening_;  // has any body a Kg?
  TellingMoments moments_;
  std::vector<LargestStiffening> effect_;  // per body
  VectorXd y_dot_, blow_;                  // blow: change of the state per impulse
  std::vector<double> hold_of_blow_;       // per joint
  std::vector<char> flags_;                // of stops and switches
  std::vector<double> levels_;             // of their gaps, where a step ends
  std::vector<int> crossed_;
};

}  // namespace

/// Let go, or after a blow, the root of a body with many modes flies off for an instant as if it carried nothing. What
/// presses a body no longer than that does not buckle it.
void observe(const std::vector<StiffeningEffect>& effect, double t, std::vector<LargestStiffening>& largest) {
  observe_size(effect, largest);
  for (size_t b = 0; b < effect.size(); ++b) {
    LargestStiffening& l = largest[b];
    l.shortening = std::max(l.shortening, effect[b].shortening);
    const double lasting = std::min(effect[b].softening, std::exchange(l.last_softening, effect[b].softening));
    if (lasting > l.softening) l.softening = lasting, l.time = t;
  }
}

void observe_size(const std::vector<StiffeningEffect>& effect, std::vector<LargestStiffening>& largest) {
  for (size_t b = 0; b < effect.size(); ++b) largest[b].size = std::max(largest[b].size, effect[b].size);
}

double change_without_stiffening(const ReducedBody& body, double size, double duration) {
  double slowest = std::numeric_limits<double>::infinity(), damping = 0;
  for (int k = 0; k < body.n(); ++k) {
    const double omega = body.frequency(k);
    if (omega > 0 && omega < slowest) slowest = omega, damping = 0.5 * body.De(k, k) / (body.Me(k, k) * omega);
  }
  if (!std::isfinite(slowest)) return size;
  const double x = std::min(slowest * duration, 1 / damping);
  return size * std::max(1.0, 0.5 * x * std::exp(-damping * x));
}

std::vector<std::string> stiffening_warnings(const Multibody& scene, const std::vector<LargestStiffening>& effect,
                                             double duration, double tolerance,
                                             const std::function<Stiffening(int body)>& stiffening) {
  std::vector<std::string> warnings;
  for (size_t b = 0; b < effect.size(); ++b) {
    const std::string& name = scene.bodies[b].name;
    const double change = change_without_stiffening(scene.bodies[b], effect[b].size, duration);
    if (change > tolerance && stiffening(static_cast<int>(b)) == Stiffening::off)
      warnings.push_back(fmt::format(
          "body {}: its geometric stiffness is off; it reaches {:.2g} of its stiffness, which changes about "
          "{:.2g}, more than the tolerance {:.2g}{}",
          name, effect[b].size, change, tolerance,
          effect[b].size > 0.1 ? ": without it the motion can be wrong or diverge" : ""));
    if (effect[b].softening > 1)
      warnings.push_back(
          fmt::format("body {}: at t = {:.6g} s its geometric stiffness takes {:.2g} of its stiffness "
                      "away: it buckles, and what follows is beyond the theory",
                      name, effect[b].time, effect[b].softening));
  }
  return warnings;
}

std::vector<char> closed_stops(const Tree& tree, const Eigen::Ref<const VectorXd>& y) {
  std::vector<char> closed(tree.scene().joints.size(), 0);
  for (const int joint : tree.stops()) closed[static_cast<size_t>(joint)] = tree.gap(y.data(), joint) > 0;
  return closed;
}

TreeTrajectory integrate(const Tree& tree, const VectorXd& y0, const IntegratorOptions& o,
                         const Checkpoint<TreeTrajectory>& so_far, const StiffeningLook& look) {
  check_options(o, tree.scene().joints.size());
  require(y0.size() == tree.layout().size && y0.allFinite(), "the start state has the wrong size or is not finite");
  if (tree.scene().field) tree.scene().field->orbit.at(o.duration);  // does it last so long?
  const bool has_laws = std::ranges::any_of(tree.scene().joints, [](const Joint& j) { return j.law.given(); });
  require(!has_laws || o.method == "auto" || integrator_method(o.method).make != nullptr,
          fmt::format("method '{}' simulates no laws of joints; 'adams', 'bdf', 'dirk' and 'erk' do", o.method));
  VectorXd start = y0;
  tree.impose(o.start, start);
  const auto flown = [&](const std::string& method, Pilot* pilot) {
    return TreeFlight(tree, start, o, integrator_method(method), so_far, look, pilot).fly();
  };
  const auto fly = [&](const std::string& method, const std::string& why) {
    TreeTrajectory r = flown(method, nullptr);
    r.summary.why_method = why;
    return r;
  };
  if (o.method != "auto") return fly(o.method, "");
  const auto fly_by_others = [&](const std::string& why) {
    const std::string method = method_beside_exponential(tree, start, o);
    try {
      return fly(method, why);
    } catch (const MethodFailure& failure) {
      return fly("bdf", fmt::format("{}, and {} could not: {}", why, method, failure.what()));
    }
  };
  if (has_laws) return fly_by_others("joints have laws");
  if (const std::string fault = split_fault(tree); !fault.empty())
    return fly_by_others("exponential collocation cannot: " + fault);
  try {
    Pilot pilot(tree, o.duration - o.start);
    TreeTrajectory r = flown("exponential", &pilot);
    r.summary.why_method = pilot.why();
    return r;
  } catch (const Pilot::Unsuitable& reason) {
    return fly("erk", reason.why);
  } catch (const MethodFailure& failure) {
    return fly("bdf", fmt::format("exponential collocation could not: {}", failure.what()));
  }
}

std::vector<Stiffening> stiffening_where_it_counts(const Tree& tree, VectorXd y, double duration, double tolerance,
                                                   std::span<const double> times) {
  const Multibody& scene = tree.scene();
  const std::vector<char> open(scene.joints.size(), 0);
  std::vector<Stiffening> choice(scene.bodies.size(), Stiffening::off);
  const bool goes_with_time =
      scene.field || !scene.loads.empty() ||
      std::ranges::any_of(scene.joints, [](const Joint& joint) { return !joint.prescribed.empty(); }) ||
      std::ranges::any_of(scene.wheels, [](const ReactionWheel& w) { return static_cast<bool>(w.torque); });
  const int samples = goes_with_time ? 100 : 0;
  std::vector<double> looks(times.begin(), times.end());
  for (int i = 0; i <= samples; ++i) looks.push_back(i == 0 ? 0 : duration * i / samples);
  const TreeWorkspaceHandle work = tree.workspace();
  for (const double t : looks) {
    tree.impose(t, y);
    const std::vector<StiffeningEffect> effect = tree.stiffening_effect(t, y, open, *work);
    for (size_t b = 0; b < effect.size(); ++b)
      if (change_without_stiffening(scene.bodies[b], effect[b].size, duration) > tolerance) choice[b] = Stiffening::on;
  }
  return choice;
}

}  // namespace flexboom
