#include "dynamics/tree_integrator.hpp"

#include "dynamics/conservation.hpp"
#include "dynamics/ode.hpp"
#include "fem/check.hpp"
#include "fem/stopwatch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexboom {

using Eigen::VectorXd;

namespace {

/// What each state's error is measured against: the largest value so far of its group, and no less than a small part
/// of the body's size (lengths, deflections), of a radian, and of these in the time they take.
class TreeScales {
 public:
  TreeScales(const Tree& tree, const VectorXd& y0, double tolerance) : tree_(tree) {
    error_.tolerance = tolerance;
    const TreeLayout& l = tree.layout();
    double length = 0;
    for (const ReducedBody& b : tree.scene().bodies) length = std::max(length, std::sqrt(b.J0.trace() / b.m));
    error_.scale = VectorXd::Constant(l.size, part * std::max(length, 1.0));
    const double energy = std::abs(tree.balance(0, y0).kinetic) + std::abs(tree.balance(0, y0).elastic);
    for (const int i : {l.dissipated_elsewhere, l.work}) error_.scale[i] = std::max(energy, part);
    for (size_t i = 0; i < l.joints.size(); ++i) {
      const TreeLayout::Joint& j = l.joints[i];
      error_.scale[j.dissipated] = std::max(energy, part);
      const int scalars = joint_type(tree.scene().joints[i].kind).scalars;
      for (int k = 0; k < scalars; ++k)
        groups_.push_back({j.scalar + k, 1}), groups_.push_back({l.rate(j.scalar + k), 1});
      for (const int at : {j.omega, j.position, j.velocity})
        if (at >= 0) groups_.push_back({at, 3});
      // A quaternion's entries are near 1: less than its round-off can not be asked for.
      if (j.attitude >= 0) error_.scale.segment<4>(j.attitude).setConstant(1.0);
    }
    for (size_t b = 0; b < l.q.size(); ++b) {
      const ReducedBody& body = tree.scene().bodies[b];
      for (int k = 0; k < body.n(); ++k) {
        const double size = part * length * std::sqrt(body.m / body.Me(k, k));
        error_.scale[l.q[b] + k] = size;
        error_.scale[l.rate(l.q[b] + k)] = size * std::sqrt(body.Ke(k, k) / body.Me(k, k));
        groups_.push_back({l.q[b] + k, 1}), groups_.push_back({l.rate(l.q[b] + k), 1});
      }
    }
    for (size_t i = 0; i < tree.scene().wheels.size(); ++i) groups_.push_back({l.spin + static_cast<int>(i), 1});
    observe(y0);
  }

  const ErrorScale& error() const { return error_; }

  void observe(const VectorXd& y) {
    for (const Group& g : groups_) {
      const double size = y.segment(g.first, g.count).norm();
      for (int i = g.first; i < g.first + g.count; ++i) error_.scale[i] = std::max(error_.scale[i], size);
    }
    const TreeLayout& l = tree_.layout();
    for (int i = l.dissipated; i < l.size; ++i) error_.scale[i] = std::max(error_.scale[i], std::abs(y[i]));
  }

  /// Errors of a state are weighed against no less than this.
  void raise(int state, double size) { error_.scale[state] = std::max(error_.scale[state], size); }

 private:
  static constexpr double part = 1e-5;
  struct Group {
    int first, count;
  };

  const Tree& tree_;
  std::vector<Group> groups_;
  ErrorScale error_;
};

const IntegratorMethod& method_of(const IntegratorOptions& options) {
  return integrator_method(options.method == IntegratorOptions{}.method ? "adams" : options.method, MethodFor::any);
}

/// One run: the event loop around a method.
class TreeFlight {
 public:
  TreeFlight(const Tree& tree, const VectorXd& y0, const IntegratorOptions& options, const IntegratorMethod& method,
             const Checkpoint<TreeTrajectory>& so_far)
      : tree_(tree),
        options_(options),
        so_far_(so_far),
        clock_(options),
        settle_(options.settle < 0 ? options.tolerance / 100 : options.settle),
        scales_(tree, y0, method.local_share * options.tolerance),
        outputs_(options),
        ode_(ode_of(tree)),
        stepper_(method.make(ode_of(tree), scales_.error())),
        history_(stops_at_start(options, tree.scene().joints.size())),
        t_(options.start),
        y_(y0),
        next_y_(y0),
        y_dot_(y0.size()) {
    const size_t stops = tree.stops().size();
    closed_.assign(stops, 0), armed_.assign(stops, 1), crossed_.assign(stops, 0), approach_.resize(stops);
    result_.summary.method = method.name;
    result_.stiffening_effect.resize(tree.scene().bodies.size());
    for (const int joint : tree.stops()) scales_.raise(scalar(joint), history_[static_cast<size_t>(joint)].largest_gap);
    contacts_at_start();
  }

  TreeTrajectory fly() {
    record(t_, y_);
    checkpoint();
    try {
      stepper_->restart(t_, y_, closed_, armed_);
      while (t_ < options_.duration && !stopped()) {
        advance();
        if (clock_.due() && t_ < options_.duration) checkpoint();
      }
    } catch (const NumericalError&) {
      checkpoint();
      throw;
    }
    finish();
    return std::move(result_);
  }

 private:
  void contacts_at_start() {
    ode_->derivative(t_, y_.data(), closed_, y_dot_.data());
    for (size_t i = 0; i < closed_.size(); ++i) {
      const int stop = static_cast<int>(i);
      const double gap = ode_->gap(y_.data(), stop), rate = ode_->gap_rate(y_.data(), stop);
      const double push = ode_->gap_rate(y_dot_.data(), stop);
      armed_[i] = history(i).settled < 0;
      approach_[i].observe(gap, rate, spring_rate(i));
      closed_[i] =
          armed_[i] && history(i).closed.value_or(gap > 0 || (gap == 0 && (rate > 0 || (rate == 0 && push > 0))));
    }
  }

  bool stopped() {
    const bool stop = options_.interrupt != nullptr && options_.interrupt->load(std::memory_order_relaxed);
    result_.summary.interrupted = result_.summary.interrupted || stop;
    return stop;
  }

  /// What an interruption here would leave.
  void checkpoint() {
    if (so_far_) {
      const size_t outputs = result_.time.size();
      const IntegrationSummary summary = result_.summary;
      const std::vector<LargestStiffening> effect = result_.stiffening_effect;
      result_.summary.interrupted = true;
      finish();
      so_far_(result_, outputs);
      result_.summary = summary, result_.stiffening_effect = effect;
      result_.time.resize(outputs), result_.y.resize(outputs), result_.balance.resize(outputs);
      result_.warnings.clear();
    }
    clock_.restart();
  }

  void advance() {
    double next_t = t_;
    next_y_ = y_;
    stepper_->step(limit(), next_t, next_y_, crossed_);
    if (++steps_ > options_.max_steps)
      throw NumericalError(
          fmt::format("{} steps were not enough: t = {:.9g} s of {:g} s", steps_, next_t, options_.duration));
    if (!next_y_.allFinite()) throw NumericalError(fmt::format("the state is not finite at t = {:.9g} s", next_t));
    t_ = next_t, y_.swap(next_y_);
    for (double next = output_time(); next <= t_; next = output_time()) {
      VectorXd sample = y_;
      if (next < t_) stepper_->interpolate(next, sample);
      record(next, sample);
    }
    scales_.observe(y_);
    const bool corner = std::binary_search(options_.corners.begin(), options_.corners.end(), t_);
    if (switch_contacts() || corner) {
      stepper_->restart(t_, y_, closed_, armed_);
      ++result_.summary.restarts;
    }
    if (options_.progress && steps_ % 256 == 0) options_.progress(t_, options_.duration);
  }

  /// Where the next step must end at the latest.
  double limit() const {
    double end = options_.step_to_outputs ? std::min(options_.duration, output_time()) : options_.duration;
    const auto corner = std::upper_bound(options_.corners.begin(), options_.corners.end(), t_);
    if (corner != options_.corners.end()) end = std::min(end, *corner);
    return end;
  }

  double output_time() const { return outputs_.after(result_.time.size()); }

  void record(double t, VectorXd y) {
    for (const TreeLayout::Joint& j : tree_.layout().joints) {
      if (j.attitude < 0) continue;
      auto attitude = y.segment<4>(j.attitude);
      result_.summary.constraint_drift = std::max(result_.summary.constraint_drift, std::abs(attitude.norm() - 1));
      attitude.normalize();
    }
    tree_.impose(t, y);
    result_.balance.push_back(tree_.balance(t, y));
    look_at_stiffening(t, y);
    result_.time.push_back(t);
    result_.y.push_back(std::move(y));
  }

  /// At every output of a short list, at some of a long one: an eigenvalue problem for each body.
  void look_at_stiffening(double t, const VectorXd& y) {
    const double outputs = (options_.duration - options_.start) / options_.output_step;
    const auto stride = static_cast<size_t>(outputs / 500) + 1;
    if (result_.time.size() % stride != 0) return;
    std::vector<char> contact(tree_.scene().joints.size(), 0);
    for (size_t i = 0; i < closed_.size(); ++i) contact[static_cast<size_t>(tree_.stops()[i])] = closed_[i];
    observe(tree_.stiffening_effect(t, y, contact), t, result_.stiffening_effect);
  }

  bool switch_contacts() {
    bool changed = false;
    for (size_t i = 0; i < crossed_.size(); ++i) {
      const int joint = tree_.stops()[i];
      const double rate = tree_.gap_rate(y_.data(), joint);
      history(i).largest_rate = std::max(history(i).largest_rate, std::abs(rate));
      history(i).largest_gap = std::max(history(i).largest_gap, std::abs(tree_.gap(y_.data(), joint)));
      const bool slipped = slipped_through(i), crossed = crossed_[i] != 0 || slipped;
      if (crossed && has_decayed(i, rate)) {
        settle(i);
        changed = true;
      } else if (crossed) {
        double& gap = y_[scalar(joint)];
        const bool contact = slipped ? gap > 0 : crossed_[i] > 0;
        if (!slipped) gap = 0;  // on the stop, exactly: the root is good to round-off of t
        closed_[i] = contact;
        result_.events.push_back({t_, joint, contact, rate});
        chatter_.contact(t_, tree_.scene().joints[static_cast<size_t>(joint)].name);
        changed = true;
        approach_[i].restart(rate);
        if (std::abs(rate) * period(i) < small(i) && !pushed(i)) settle(i);
      } else if (!armed_[i] &&
                 (std::abs(rate) * period(i) > 2 * small(i) || tree_.gap(y_.data(), joint) > 2 * small(i))) {
        history(i).settled = -1;
        armed_[i] = 1;
        closed_[i] = tree_.gap(y_.data(), joint) > 0;
        changed = true;
      }
      approach_[i].observe(tree_.gap(y_.data(), joint), rate, spring_rate(i));
    }
    return changed;
  }

  void settle(size_t i) {
    history(i).settled = t_;
    armed_[i] = closed_[i] = 0;
  }

  int scalar(int joint) const { return tree_.layout().joints[static_cast<size_t>(joint)].scalar; }
  StopHistory& history(size_t stop) { return history_[static_cast<size_t>(tree_.stops()[stop])]; }
  const StopHistory& history(size_t stop) const { return history_[static_cast<size_t>(tree_.stops()[stop])]; }

  /// Is the gap on the wrong side of the flag, with no crossing found?
  bool slipped_through(size_t i) const {
    if (!armed_[i] || crossed_[i] != 0) return false;
    const double gap = tree_.gap(y_.data(), tree_.stops()[i]);
    return closed_[i] ? gap < -noise(i) : gap > noise(i);
  }

  /// What the method's error leaves open of a gap.
  double noise(size_t i) const {
    const ErrorScale& error = scales_.error();
    return error.tolerance * error.scale[scalar(tree_.stops()[i])];
  }

  /// Size of motions about the stop that are not followed: those the scene does not ask for, and those that are hardly
  /// more than noise, whose crossings would be as dense as the steps.
  double small(size_t i) const { return std::max(settle_ * history(i).largest_rate * period(i), 10 * noise(i)); }

  /// Time scale of a joint on its stop [s].
  double period(size_t i) const {
    const HingeMechanism& m = joint(i).mechanism;
    return std::sqrt(inertia(i) / (m.stiffness + m.stop_stiffness));
  }

  /// Of a joint off its stop [rad/s].
  double spring_rate(size_t i) const { return std::sqrt(joint(i).mechanism.stiffness / inertia(i)); }

  const Joint& joint(size_t stop) const { return tree_.scene().joints[static_cast<size_t>(tree_.stops()[stop])]; }
  double inertia(size_t stop) const {
    const ReducedBody& body = tree_.scene().bodies[static_cast<size_t>(joint(stop).b.body)];
    return joint(stop).kind == JointKind::slider ? body.m : body.J0.trace();
  }

  /// Does something push a joint that is on its stop, so that it will not stay there?
  bool pushed(size_t i) { return std::abs(push(i, y_)) > 2 * small(i); }

  /// What pushes a joint, as the way that it goes within its period on the stop.
  double push(size_t i, const VectorXd& y) {
    ode_->derivative(t_, y.data(), closed_, y_dot_.data());
    return period(i) * period(i) * ode_->gap_rate(y_dot_.data(), static_cast<int>(i));
  }

  /// Is a crossing at this rate but the end of a motion that has died out on its way to the stop?
  bool has_decayed(size_t i, double rate) {
    if (!approach_[i].has_decayed(rate) || !(std::abs(rate) * period(i) < small(i))) return false;
    // Stiff modes make a push of what the method's error leaves open of them.
    const ErrorScale& error = scales_.error();
    const double here = push(i, y_), beside = push(i, y_ + error.tolerance * error.scale);
    return std::abs(here) <= 2 * small(i) + std::abs(beside - here);
  }

  void finish() {
    IntegrationSummary& s = result_.summary;
    const StepCounts c = stepper_->counts();
    s.steps = c.steps, s.rhs_evaluations = c.rhs_evaluations, s.jacobian_evaluations = c.jacobian_evaluations;
    s.factorisations = c.factorisations, s.newton_iterations = c.newton_iterations;
    s.error_test_failures = c.error_test_failures;
    s.seconds = watch_.seconds();
    s.stops = history_;
    for (size_t i = 0; i < closed_.size(); ++i) s.stops[static_cast<size_t>(tree_.stops()[i])].closed = closed_[i] != 0;
    if (s.interrupted && result_.time.back() < t_) record(t_, y_);
    conservation(s);
    result_.warnings = stiffening_warnings(tree_.scene(), result_.stiffening_effect, options_.tolerance,
                                           [this](int body) { return tree_.stiffening(body); });
  }

  void conservation(IntegrationSummary& s) const {
    constexpr double digits = 1e-12;  // what is left of a potential energy that hardly changes
    Conservation kept(tree_.scene().bodies, options_.largest);
    for (const TreeBalance& b : result_.balance)
      kept.add(b.energy(),
               std::max({b.kinetic + b.elastic, std::abs(b.work), b.dissipated, digits * std::abs(b.potential)}), b);
    s.largest = kept.largest();
    s.energy_balance = kept.energy_balance();
    if (is_isolated(tree_.scene())) s.momentum_drift = kept.momentum_drift();
  }

  const Tree& tree_;
  const IntegratorOptions& options_;
  const Checkpoint<TreeTrajectory>& so_far_;
  CheckpointClock clock_;
  Stopwatch watch_;
  double settle_;
  TreeScales scales_;
  OutputTimes outputs_;
  std::unique_ptr<Ode> ode_;
  std::unique_ptr<Stepper> stepper_;
  std::vector<char> closed_, armed_;
  std::vector<int> crossed_;
  std::vector<Approach> approach_;
  ChatterGuard chatter_;
  std::vector<StopHistory> history_;  // per joint
  double t_;
  VectorXd y_, next_y_, y_dot_;
  long steps_ = 0;
  TreeTrajectory result_;
};

}  // namespace

void observe(const std::vector<StiffeningEffect>& effect, double t, std::vector<LargestStiffening>& largest) {
  for (size_t b = 0; b < effect.size(); ++b) {
    largest[b].size = std::max(largest[b].size, effect[b].size);
    if (effect[b].softening > largest[b].softening) largest[b].softening = effect[b].softening, largest[b].time = t;
  }
}

std::vector<std::string> stiffening_warnings(const Multibody& scene, const std::vector<LargestStiffening>& effect,
                                             double tolerance, const std::function<Stiffening(int body)>& stiffening) {
  std::vector<std::string> warnings;
  for (size_t b = 0; b < effect.size(); ++b) {
    const std::string& name = scene.bodies[b].name;
    if (effect[b].size > tolerance && stiffening(static_cast<int>(b)) == Stiffening::off)
      warnings.push_back(
          fmt::format("body {}: its geometric stiffness is off; it reaches {:.2g} of its stiffness, more than the "
                      "tolerance {:.2g}{}",
                      name, effect[b].size, tolerance,
                      effect[b].size > 0.1 ? ": without it the motion can be wrong or diverge" : ""));
    if (effect[b].softening > 1)
      warnings.push_back(
          fmt::format("body {}: at t = {:.6g} s its geometric stiffness takes {:.2g} of its stiffness "
                      "away: it buckles, and what follows is beyond the theory",
                      name, effect[b].time, effect[b].softening));
  }
  return warnings;
}

TreeTrajectory integrate(const Tree& tree, const VectorXd& y0, const IntegratorOptions& o,
                         const Checkpoint<TreeTrajectory>& so_far) {
  check_options(o, tree.scene().joints.size());
  require(y0.size() == tree.layout().size && y0.allFinite(), "the start state has the wrong size or is not finite");
  VectorXd start = y0;
  tree.impose(o.start, start);
  return TreeFlight(tree, start, o, method_of(o), so_far).fly();
}

std::vector<Stiffening> stiffening_where_it_counts(const Multibody& scene, const TreeState& state, double duration,
                                                   double tolerance) {
  const Tree tree(scene);
  VectorXd y = tree.pack(state);
  const std::vector<char> open(scene.joints.size(), 0);
  std::vector<Stiffening> choice(scene.bodies.size(), Stiffening::off);
  constexpr int samples = 100;
  for (int i = 0; i <= samples; ++i) {
    const double t = duration * i / samples;
    tree.impose(t, y);
    const std::vector<StiffeningEffect> effect = tree.stiffening_effect(t, y, open);
    for (size_t b = 0; b < effect.size(); ++b)
      if (effect[b].size > tolerance) choice[b] = Stiffening::on;
  }
  return choice;
}

}  // namespace flexboom
