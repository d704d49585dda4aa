#include "dynamics/crossing.hpp"
#include "dynamics/ida.hpp"
#include "dynamics/multipliers.hpp"
#include "dynamics/multipliers_balance.hpp"
#include "dynamics/multipliers_frame.hpp"
#include "dynamics/multipliers_scales.hpp"
#include "dynamics/multipliers_start.hpp"
#include "fem/check.hpp"
#include "fem/stopwatch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexboom {

using Eigen::VectorXd;
using namespace redundant;

namespace {

/// Part of the tolerance wanted over a run that each step is asked for.
constexpr double local_share = 0.015;
/// A violation of a joint at the start beyond this [m, rad, their rates] is the caller's mistake.
constexpr double open_joint = 1e-8;

/// One run: the events around IDA.
class MultipliersFlight final : public DaeProblem {
 public:
  MultipliersFlight(const Multipliers& system, const std::vector<BodyState>& start, const MultipliersOptions& options,
                    const Checkpoint<MultibodyTrajectory>& so_far)
      : equations_(system.impl()),
        scene_(system.multibody()),
        options_(options),
        so_far_(so_far),
        clock_(options),
        outputs_(options),
        settle_(options.settle < 0 ? options.tolerance / 100 : options.settle),
        t_(options.start),
        history_(stops_at_start(options, scene_.joints.size())) {
    const size_t joints = scene_.joints.size();
    memory_ = {std::vector<char>(joints, 0), std::vector<double>(joints, 0.0)};
    for (size_t i = 0; i < joints; ++i)
      if (equations_.joints()[i].stop) stops_.push_back(i);
    for (const size_t joint : stops_) armed_.push_back(history_[joint].settled < 0);
    crossed_.assign(stops_.size(), 0), approach_.resize(stops_.size()), asleep_.assign(stops_.size(), 0.0);
    check_sizes(start);
    frame_ = std::make_unique<FlightFrame>(equations_, start, t_);
    start_on_constraints(frame_->seen(start));
    begin_contacts();
    equations_.make_consistent(t_, y_, y_dot_, memory_);
    const Balance b = balance_of(equations_, y_, memory_);
    scales_ = std::make_unique<StateScales>(
        equations_, y_, y_dot_, std::max(std::abs(b.kinetic) + std::abs(b.elastic), options_.largest.energy),
        local_share * options.tolerance, options.duration);
    record_pattern();
    ida_ = std::make_unique<Ida>(*this, options.linear_solver);
  }

  MultibodyTrajectory fly() {
    record(t_, y_);
    checkpoint();
    try {
      ida_->restart(t_, y_, y_dot_);
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

  int size() const override { return equations_.size(); }
  VectorXd differential() const override {
    VectorXd id = VectorXd::Zero(size());
    id.head(equations_.motion()).setOnes();
    id[equations_.work()] = id[equations_.dissipated()] = 1;
    return id;
  }
  void residual(double t, const double* y, const double* y_dot, double* F) override {
    equations_.residual(t, y, y_dot, memory_, F);
  }
  void newton_matrix(double t, double c, const double* y, const double* y_dot, double* values) override {
    assembly_.begin(values);
    equations_.newton(t, c, y, y_dot, memory_, assembly_);
  }
  std::span<const int> column_starts() const override { return assembly_.starts(); }
  std::span<const int> rows() const override { return assembly_.rows(); }
  void weights(double* w) const override { scales_->weights(w); }
  int roots() const override { return static_cast<int>(stops_.size()); }
  void root_values(double, const double* y, double* values) override {
    // Round-off of a gap must not look like a crossing: it counts as on the side of the flag.
    constexpr double round_off = 2e-16;
    for (size_t i = 0; i < stops_.size(); ++i) {
      const double g = gap(i, y).value;
      const double side = memory_.closed[stops_[i]] ? round_off : -round_off;
      values[i] = !armed_[i] ? 1.0 : std::abs(g) <= round_off ? side : g;
    }
  }

 private:
  DriveMotion<double> gap(size_t stop, const double* y) {
    return equations_.gap(stops_[stop], y, memory_.near[stops_[stop]]);
  }

  void check_sizes(const std::vector<BodyState>& start) const {
    require(start.size() == scene_.bodies.size(),
            fmt::format("{} bodies need as many states, {} were given", scene_.bodies.size(), start.size()));
    for (size_t i = 0; i < start.size(); ++i)
      for (const VectorXd* q : {&start[i].q, &start[i].q_dot})
        require(q->size() == 0 || q->size() == scene_.bodies[i].n(),
                fmt::format("body \"{}\" has {} elastic coordinates, {} were given", scene_.bodies[i].name,
                            scene_.bodies[i].n(), q->size()));
  }

  void start_on_constraints(const std::vector<BodyState>& start) {
    y_ = equations_.pack(start);
    require(y_.allFinite(), "the start state is not finite");
    Equations::RowValues values;
    equations_.row_values(t_, y_.data(), values);
    require_closed(violation(equations_, values.g), "m", "rad", "is open by");
    check_branches(equations_, t_, y_.data());
    const RankReport rank = constraint_rank(equations_, t_, y_.data());
    for (const RowName& n : rank.left_out) result_.summary.redundant.push_back(describe(equations_, n));
    margin_ = rank.margin;
    equations_.keep_rows(rank.kept);
    y_ = equations_.pack(start);
    y_[equations_.dissipated()] = options_.dissipated, y_[equations_.work()] = options_.work;
    equations_.project(t_, y_);
    equations_.row_values(t_, y_.data(), values);
    require_closed(violation(equations_, values.g_dot), "m/s", "rad/s",
                   "can not follow: its motion is prescribed against other joints', by");
    rows_ = rates_ = VectorXd::Zero(equations_.all_rows());
  }

  void require_closed(const Violation& v, const char* metres, const char* radians, const char* what) const {
    const bool place = v.position > open_joint + frame_->round_off();
    if (!place && !(v.angle > open_joint)) return;
    throw InputError(fmt::format("{}: it {} {:.3g} {} at the start; see close_joints",
                                 describe(equations_, place ? v.worst_position : v.worst_angle), what,
                                 place ? v.position : v.angle, place ? metres : radians));
  }

  /// Angles near what was asked for, stops closed beyond their threshold; on it by where the joint goes.
  void begin_contacts() {
    for (size_t i = 0; i < scene_.joints.size(); ++i) {
      const HingeMechanism& m = scene_.joints[i].mechanism;
      const double angle = options_.angles.empty() ? m.rest : options_.angles[i];
      memory_.near[i] = angle - m.threshold;
    }
    follow_turns();
    VectorXd y = y_;
    equations_.make_consistent(t_, y, y_dot_, memory_);
    for (size_t i = 0; i < stops_.size(); ++i) {
      const DriveMotion<double> g = gap(i, y_.data());
      const double push = rate_of_rate(i, y);
      approach_[i].observe(g.value, g.rate, spring_rate(i));
      const bool on = std::abs(g.value) < 4e-16;
      const bool beyond = on ? g.rate > 0 || (g.rate == 0 && push > 0) : g.value > 0;
      memory_.closed[stops_[i]] = armed_[i] && history_[stops_[i]].closed.value_or(beyond);
    }
  }

  /// Second derivative of a joint's coordinate at y, y_dot_, by the change over a short time.
  double rate_of_rate(size_t stop, const VectorXd& y) {
    constexpr double h = 1e-7;
    const double before = gap(stop, (y - h * y_dot_).eval().data()).rate,
                 after = gap(stop, (y + h * y_dot_).eval().data()).rate;
    return (after - before) / (2 * h);
  }

  void follow_turns() {
    for (size_t i = 0; i < scene_.joints.size(); ++i)
      if (scene_.joints[i].kind == JointKind::hinge)
        memory_.near[i] = equations_.gap(i, y_.data(), memory_.near[i]).value;
  }

  void record_pattern() {
    equations_.newton(t_, 1, y_.data(), y_dot_.data(), memory_, assembly_);
    assembly_.finish(size(), options_.linear_solver == "dense");
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
      const MultipliersSummary before = result_.summary;
      result_.summary.interrupted = true;
      finish();
      so_far_(result_, outputs);
      result_.summary = before;
      result_.time.resize(outputs), result_.states.resize(outputs), result_.balance.resize(outputs);
    }
    clock_.restart();
  }

  /// One step, and what it met. Where it fails, state and outputs are those before.
  void advance() {
    before_.resize(stops_.size());
    for (size_t i = 0; i < stops_.size(); ++i) before_[i] = clearance(i, y_);
    const double t0 = t_;
    y_before_ = y_;
    try {
      step();
    } catch (const NumericalError&) {
      t_ = t0, y_.swap(y_before_);
      throw;
    }
    write_outputs();
    scales_->observe(y_);
    follow_turns();
    if (switch_contacts() || at_corner()) {
      equations_.project(t_, y_);
      equations_.make_consistent(t_, y_, y_dot_, memory_);
      ida_->restart(t_, y_, y_dot_);
      ++result_.summary.restarts;
    }
    if (options_.progress && steps_ % 256 == 0) options_.progress(t_, options_.duration);
  }

  void step() {
    const double t0 = t_;
    try {
      ida_->step(limit(), t_, y_, crossed_);
    } catch (const NumericalError& error) {
      if (constraint_rank(equations_, t_, y_.data()).margin < 3e-2 * margin_) throw_locked();
      const std::string body = body_without_inertia(equations_, t_, y_.data());
      if (!body.empty()) throw NumericalError(fmt::format("t = {:.9g} s: {}", t_, body));
      throw;
    }
    if (++steps_ > options_.max_steps)
      throw NumericalError(
          fmt::format("{} steps were not enough: t = {:.9g} s of {:g} s", steps_, t_, options_.duration));
    if (!y_.allFinite()) throw NumericalError(fmt::format("the state is not finite at t = {:.9g} s", t_));
    if (std::all_of(crossed_.begin(), crossed_.end(), [](int c) { return c == 0; })) find_short_contacts(t0);
    watch_constraints();
  }

  /// Where the next step must end at the latest. What is nearer than round-off is reached.
  double limit() const {
    const double reached = t_ + round_off();
    double end = options_.duration;
    const auto corner = std::upper_bound(options_.corners.begin(), options_.corners.end(), reached);
    if (corner != options_.corners.end()) end = std::min(end, *corner);
    if (const double output = output_time(); options_.step_to_outputs && output > reached) end = std::min(end, output);
    return end;
  }

  bool at_corner() const {
    return std::any_of(options_.corners.begin(), options_.corners.end(),
                       [this](double c) { return std::abs(c - t_) <= round_off(); });
  }

  double round_off() const { return 1e-14 * options_.duration; }

  [[noreturn]] void throw_locked() {
    throw NumericalError(fmt::format("joint \"{}\" locks at t = {:.6g} s: the joints leave no consistent velocity",
                                     locked_joint(equations_, t_, y_.data()), t_));
  }

  /// Drift, rows that were left out, and whether the constraints are still independent.
  void watch_constraints() {
    equations_.row_violations(t_, y_.data(), rows_.data(), rates_.data());
    const Violation g = violation(equations_, rows_), g_dot = violation(equations_, rates_);
    MultipliersSummary& s = result_.summary;
    s.position_drift = std::max(s.position_drift, g.position);
    s.angle_drift = std::max(s.angle_drift, g.angle);
    s.velocity_drift = std::max(s.velocity_drift, g_dot.position);
    s.angular_velocity_drift = std::max(s.angular_velocity_drift, g_dot.angle);
    for (const BodyPlaces& at : equations_.places())
      s.quaternion_drift = std::max(s.quaternion_drift, std::abs(y_.segment<4>(at.p).norm() - 1));
    if (std::max(g.position, g.angle) > 1e-6 + options_.tolerance) {
      const RowName worst = g.position > g.angle ? g.worst_position : g.worst_angle;
      throw NumericalError(fmt::format(
          "{}: violated by {:.3g} at t = {:.6g} s; it depended on other joints at the start and does so no more",
          describe(equations_, worst), std::max(g.position, g.angle), t_));
    }
    if (steps_ % 16 == 0 && constraint_rank(equations_, t_, y_.data()).margin < 1e-7 * margin_) throw_locked();
  }

  Clearance clearance(size_t i, const VectorXd& y) {
    const double side = memory_.closed[stops_[i]] ? 1 : -1;
    const DriveMotion<double> g = gap(i, y.data());
    return {0, side * g.value, side * g.rate};
  }

  /// IDA looks at the signs at both ends of a step: a contact that begins and ends within it is found here.
  void find_short_contacts(double t0) {
    const double length = t_ - t0;
    double first = length;
    for (size_t i = 0; i < stops_.size(); ++i) {
      if (!armed_[i] || !(before_[i].slope < 0)) continue;
      Clearance to = clearance(i, y_);
      to.c = length;
      if (!(to.slope > 0) || to.value < 0) continue;
      const auto at = [&](double c) {
        sample_.resize(size());
        ida_->interpolate(t0 + c, sample_);
        Clearance here = clearance(i, sample_);
        here.c = c;
        return here;
      };
      const double root = crossing_between(at, before_[i], to, 4e-16 * t_);
      // At round-off of the gap it may be no crossing to those who look at the rate: then the step ends where it ended,
      // for the next one starts there.
      if (root >= first || !(at(root).slope < 0)) continue;
      std::fill(crossed_.begin(), crossed_.end(), 0);
      crossed_[i] = memory_.closed[stops_[i]] ? -1 : 1;
      first = root;
    }
    if (first == length) return;
    t_ = t0 + first;
    ida_->interpolate(t_, y_);
  }

  bool switch_contacts() {
    bool changed = false;
    for (size_t i = 0; i < stops_.size(); ++i) {
      const size_t joint = stops_[i];
      const DriveMotion<double> g = gap(i, y_.data());
      double &largest = history_[joint].largest_rate, &reach = history_[joint].largest_gap;
      largest = std::max(largest, std::abs(g.rate));
      reach = std::max(reach, std::abs(g.value));
      const double noise = options_.tolerance * reach;
      const bool closed = memory_.closed[joint];
      const bool slipped = armed_[i] && crossed_[i] == 0 && (closed ? g.value < -noise : g.value > noise);
      // Only a crossing away from where the flag is counts: the state may lie a rounding error behind the stop.
      const bool crossed = (crossed_[i] != 0 && (closed ? g.rate < 0 : g.rate > 0)) || slipped;
      if (crossed && has_decayed(i, g.rate)) {
        settle(i);
        changed = true;
      } else if (crossed) {
        memory_.closed[joint] = !closed;
        result_.events.push_back({t_, static_cast<int>(joint), !closed, g.rate});
        chatter_.contact(t_, scene_.joints[joint].name);
        changed = true;
        approach_[i].restart(g.rate);
        if (std::abs(g.rate) * period(i) < small(i) && !pushed(i, small(i))) settle(i);
      } else if (!armed_[i] && std::max(std::abs(g.rate) * period(i), g.value) > 2 * std::max(small(i), asleep_[i])) {
        history_[joint].settled = -1;
        asleep_[i] = 0;
        armed_[i] = 1;
        memory_.closed[joint] = g.value > 0;
        changed = true;
      }
      approach_[i].observe(g.value, g.rate, spring_rate(i));
    }
    return changed;
  }

  void settle(size_t i) {
    history_[stops_[i]].settled = t_;
    armed_[i] = 0;
    memory_.closed[stops_[i]] = 0;
  }

  /// Is a crossing at this rate but the end of a motion that has died out on its way to the stop?
  bool has_decayed(size_t i, double rate) {
    if (!approach_[i].has_decayed(rate)) return false;
    const double noise = local_share * options_.tolerance * history_[stops_[i]].largest_gap;
    asleep_[i] = std::max({small(i), approach_[i].round_off() * period(i), noise});
    return std::abs(rate) * period(i) < asleep_[i] && !pushed(i, asleep_[i]);
  }

  double inertia(size_t i) const {
    const Joint& joint = scene_.joints[stops_[i]];
    const ReducedBody& body = scene_.bodies[static_cast<size_t>(std::max(joint.b.body, 0))];
    return joint.kind == JointKind::hinge ? body.J0.trace() / 3 : body.m;
  }

  /// Time scale of a joint on its stop [s].
  double period(size_t i) const {
    const HingeMechanism& m = scene_.joints[stops_[i]].mechanism;
    return std::sqrt(inertia(i) / (m.stiffness + m.stop_stiffness));
  }

  /// Of a joint off its stop [rad/s].
  double spring_rate(size_t i) const { return std::sqrt(scene_.joints[stops_[i]].mechanism.stiffness / inertia(i)); }

  /// Size of motions about the stop that are not followed: those the scene does not ask for, and round-off of the gap.
  double small(size_t i) const {
    constexpr double round_off = 1e-14;
    return std::max(settle_ * history_[stops_[i]].largest_rate * period(i), round_off);
  }

  /// Does something push a joint that is on its stop, so that it will not stay there?
  bool pushed(size_t i, double least) {
    VectorXd y = y_;
    equations_.make_consistent(t_, y, y_dot_, memory_);
    return std::abs(rate_of_rate(i, y)) * period(i) * period(i) > 2 * least;
  }

  void write_outputs() {
    for (double next = output_time(); next <= t_ && !stopped(); next = output_time()) {
      if (next == t_) {
        record(next, y_);
      } else {
        sample_.resize(size());
        ida_->interpolate(next, sample_);
        record(next, sample_);
      }
    }
  }

  double output_time() const { return outputs_.after(result_.time.size()); }

  /// Multipliers of an output are those of its motion, not interpolated.
  void record(double t, VectorXd y) {
    VectorXd y_dot;
    equations_.make_consistent(t, y, y_dot, memory_);
    MultibodyState s;
    s.bodies = equations_.unpack(y.data());
    for (const BodyPlaces& at : equations_.places())
      s.accelerations.push_back({y_dot.segment<3>(at.v), y_dot.segment<3>(at.w)});
    for (size_t i = 0; i < scene_.joints.size(); ++i) {
      const JointKind kind = scene_.joints[i].kind;
      DriveMotion<double> c;
      if (kind == JointKind::hinge || kind == JointKind::slider) c = equations_.gap(i, y.data(), memory_.near[i]);
      s.coordinate.push_back(c.value + scene_.joints[i].mechanism.threshold);
      s.rate.push_back(c.rate);
    }
    s.loads = equations_.loads(t, y.data());
    for (size_t i = 0; i < scene_.wheels.size(); ++i) {
      const ReactionWheel& w = scene_.wheels[i];
      s.spin.push_back(y[equations_.wheel(i)] / w.inertia - w.axis.dot(s.bodies[static_cast<size_t>(w.body)].omega));
    }
    s.work = y[equations_.work()], s.dissipated = y[equations_.dissipated()];
    Balance balance = balance_of(equations_, y, memory_);
    frame_->leave(t, s, balance);
    result_.time.push_back(t);
    result_.states.push_back(std::move(s));
    result_.balance.push_back(balance);
  }

  void finish() {
    MultipliersSummary& s = result_.summary;
    if (s.interrupted && result_.time.back() < t_) record(t_, y_);
    const DaeCounts c = ida_->counts();
    s.steps = c.steps, s.residual_evaluations = c.residual_evaluations, s.factorisations = c.factorisations;
    s.newton_iterations = c.newton_iterations, s.error_test_failures = c.error_test_failures;
    s.convergence_failures = c.convergence_failures;
    s.seconds = watch_.seconds();
    s.stops = history_;
    for (const size_t joint : stops_) s.stops[joint].closed = memory_.closed[joint] != 0;
    set_drifts(scene_, options_.largest, result_);
  }

  Equations equations_;
  const Multibody& scene_;
  const MultipliersOptions& options_;
  const Checkpoint<MultibodyTrajectory>& so_far_;
  CheckpointClock clock_;
  Stopwatch watch_;
  OutputTimes outputs_;
  double settle_, margin_ = 1, t_;
  std::vector<StopHistory> history_;  // per joint
  JointMemory memory_;
  std::vector<size_t> stops_;  // joints with a stop
  std::vector<char> armed_;    // per stop
  std::vector<int> crossed_;
  std::vector<Approach> approach_;  // per stop
  ChatterGuard chatter_;
  std::vector<double> asleep_;  // motions below this do not wake a joint that has settled on its way [rad] or [m]
  std::vector<Clearance> before_;
  VectorXd y_, y_before_, y_dot_, sample_, rows_, rates_;
  redundant::PatternSum assembly_;
  std::unique_ptr<FlightFrame> frame_;
  std::unique_ptr<StateScales> scales_;
  std::unique_ptr<Ida> ida_;
  long steps_ = 0;
  MultibodyTrajectory result_;
};

}  // namespace

MultibodyTrajectory integrate_multipliers(const Multipliers& system, const std::vector<BodyState>& start,
                                          const MultipliersOptions& options,
                                          const Checkpoint<MultibodyTrajectory>& so_far) {
  check_options(options, system.multibody().joints.size());
  require(options.angles.empty() || options.angles.size() == system.multibody().joints.size(),
          "one angle per joint is needed");
  return MultipliersFlight(system, start, options, so_far).fly();
}

}  // namespace flexboom
