#include "dynamics/crossing.hpp"
#include "dynamics/event_loop.hpp"
#include "dynamics/ida.hpp"
#include "dynamics/multipliers.hpp"
#include "dynamics/multipliers_balance.hpp"
#include "dynamics/multipliers_frame.hpp"
#include "dynamics/multipliers_scales.hpp"
#include "dynamics/multipliers_start.hpp"
#include "fem/check.hpp"

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

std::vector<Stop> stops_of(const Equations& equations) {
  const Multibody& scene = equations.scene();
  std::vector<Stop> stops;
  for (size_t i = 0; i < scene.joints.size(); ++i) {
    const Joint& joint = scene.joints[i];
    if (equations.joints()[i].stop)
      stops.push_back(stop_of(joint, i, scene.bodies[static_cast<size_t>(std::max(joint.b.body, 0))]));
  }
  return stops;
}

/// Steps, rows and stops of one run by IDA.
class MultipliersFlight final : public Flight<MultibodyTrajectory>, public DaeProblem {
 public:
  MultipliersFlight(const Multipliers& system, Equations& equations, const std::vector<BodyState>& start,
                    const MultipliersOptions& options, const Checkpoint<MultibodyTrajectory>& so_far)
      : Flight(options, so_far, stops_of(equations), system.multibody().joints.size()),
        equations_(equations),
        scene_(system.multibody()),
        options_(options) {
    const size_t joints = scene_.joints.size();
    memory_ = {std::vector<char>(joints, 0), std::vector<double>(joints, 0.0)};
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

 private:
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
  int roots() const override { return static_cast<int>(contacts_.size()); }
  void root_values(double, const double* y, double* values) override {
    // Round-off of a gap must not look like a crossing: it counts as on the side of the flag.
    constexpr double round_off = 2e-16;
    for (size_t i = 0; i < contacts_.size(); ++i) {
      const double g = gap(i, y).value;
      const double side = contacts_.closed()[i] ? round_off : -round_off;
      values[i] = !contacts_.armed()[i] ? 1.0 : std::abs(g) <= round_off ? side : g;
    }
  }

  DriveMotion<double> gap(size_t stop, const double* y) {
    const size_t joint = contacts_.stop(stop).joint;
    return equations_.gap(joint, y, memory_.near[joint]);
  }
  Gap gap(size_t stop) override {
    const DriveMotion<double> g = gap(stop, y_.data());
    return {g.value, g.rate};
  }

  /// By the change of the rate over a short time.
  Push push(size_t stop, std::span<const char> closed) override {
    constexpr double h = 1e-7;
    VectorXd y = y_;
    JointMemory memory = memory_;
    set_closed(closed, memory);
    VectorXd y_dot;
    equations_.make_consistent(t_, y, y_dot, memory);
    const double before = gap(stop, (y - h * y_dot).eval().data()).rate,
                 after = gap(stop, (y + h * y_dot).eval().data()).rate;
    return {(after - before) / (2 * h), 0};
  }

  double noise(size_t stop) const override {
    constexpr double of_steps = 3, round_off = 1e-14;
    return std::max(round_off, of_steps * local_share * options_.tolerance * contacts_.largest_gap(stop));
  }

  void set_closed(std::span<const char> closed, JointMemory& memory) const {
    for (size_t i = 0; i < contacts_.size(); ++i) memory.closed[contacts_.stop(i).joint] = closed[i];
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

  /// Angles near what was asked for.
  void begin_contacts() {
    for (size_t i = 0; i < scene_.joints.size(); ++i) {
      const HingeMechanism& m = scene_.joints[i].mechanism;
      const double angle = options_.angles.empty() ? m.rest : options_.angles[i];
      memory_.near[i] = angle - m.threshold;
    }
    follow_turns();
    contacts_.begin(*this);
    set_closed(contacts_.closed(), memory_);
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

  void restart() override {
    set_closed(contacts_.closed(), memory_);
    if (t_ > options_.start) {
      equations_.project(t_, y_);
      equations_.make_consistent(t_, y_, y_dot_, memory_);
    }
    ida_->restart(t_, y_, y_dot_);
  }

  void step(double limit, double& t, VectorXd& y) override {
    before_.resize(contacts_.size());
    for (size_t i = 0; i < contacts_.size(); ++i) before_[i] = clearance(i, y);
    const double t0 = t;
    std::vector<int>& crossed = contacts_.crossed();
    try {
      ida_->step(limit, t, y, crossed);
    } catch (const NumericalError& error) {
      if (constraint_rank(equations_, t, y.data()).margin < 3e-2 * margin_) throw_locked(t, y);
      const std::string body = body_without_inertia(equations_, t, y.data());
      if (!body.empty()) throw NumericalError(fmt::format("t = {:.9g} s: {}", t, body));
      throw;
    }
    if (std::ranges::all_of(crossed, [](int c) { return c == 0; })) find_short_contacts(t0, t, y);
    // Only a crossing away from where the flag is counts: the state may lie a rounding error behind the stop.
    for (size_t i = 0; i < contacts_.size(); ++i) {
      const double rate = gap(i, y.data()).rate;
      const bool counts = crossed[i] != 0 && (contacts_.closed()[i] ? rate < 0 : rate > 0);
      crossed[i] = !counts ? 0 : contacts_.closed()[i] ? -1 : 1;
    }
    watch_constraints(t, y);
  }

  [[noreturn]] void throw_locked(double t, const VectorXd& y) {
    throw NumericalError(fmt::format("joint \"{}\" locks at t = {:.6g} s: the joints leave no consistent velocity",
                                     locked_joint(equations_, t, y.data()), t));
  }

  /// Drift, rows that were left out, and whether the constraints are still independent.
  void watch_constraints(double t, const VectorXd& y) {
    equations_.row_violations(t, y.data(), rows_.data(), rates_.data());
    const Violation g = violation(equations_, rows_), g_dot = violation(equations_, rates_);
    MultipliersSummary& s = result_.summary;
    s.position_drift = std::max(s.position_drift, g.position);
    s.angle_drift = std::max(s.angle_drift, g.angle);
    s.velocity_drift = std::max(s.velocity_drift, g_dot.position);
    s.angular_velocity_drift = std::max(s.angular_velocity_drift, g_dot.angle);
    for (const BodyPlaces& at : equations_.places())
      s.quaternion_drift = std::max(s.quaternion_drift, std::abs(y.segment<4>(at.p).norm() - 1));
    if (std::max(g.position, g.angle) > 1e-6 + options_.tolerance) {
      const RowName worst = g.position > g.angle ? g.worst_position : g.worst_angle;
      throw NumericalError(fmt::format(
          "{}: violated by {:.3g} at t = {:.6g} s; it depended on other joints at the start and does so no more",
          describe(equations_, worst), std::max(g.position, g.angle), t));
    }
    if (steps() % 16 == 0 && constraint_rank(equations_, t, y.data()).margin < 1e-7 * margin_) throw_locked(t, y);
  }

  Clearance clearance(size_t i, const VectorXd& y) {
    const double side = contacts_.closed()[i] ? 1 : -1;
    const DriveMotion<double> g = gap(i, y.data());
    return {0, side * g.value, side * g.rate};
  }

  /// IDA looks at the signs at both ends of a step: a contact that begins and ends within it is found here.
  void find_short_contacts(double t0, double& t, VectorXd& y) {
    const double length = t - t0;
    double first = length;
    std::vector<int>& crossed = contacts_.crossed();
    for (size_t i = 0; i < contacts_.size(); ++i) {
      if (!contacts_.armed()[i] || !(before_[i].slope < 0)) continue;
      Clearance to = clearance(i, y);
      to.c = length;
      if (!(to.slope > 0) || to.value < 0) continue;
      const auto at = [&](double c) {
        sample_.resize(size());
        ida_->interpolate(t0 + c, sample_);
        Clearance here = clearance(i, sample_);
        here.c = c;
        return here;
      };
      const double root = crossing_between(at, before_[i], to, 4e-16 * t);
      // At round-off of the gap it may be no crossing to those who look at the rate: then the step ends where it ended,
      // for the next one starts there.
      if (root >= first || !(at(root).slope < 0)) continue;
      std::ranges::fill(crossed, 0);
      crossed[i] = contacts_.closed()[i] ? -1 : 1;
      first = root;
    }
    if (first == length) return;
    t = t0 + first;
    ida_->interpolate(t, y);
  }

  void interpolate(std::span<const double> times, Eigen::MatrixXd& Y) override {
    sample_.resize(size());
    for (size_t i = 0; i < times.size(); ++i) {
      ida_->interpolate(times[i], sample_);
      Y.col(static_cast<Eigen::Index>(i)) = sample_;
    }
  }

  void observe(const VectorXd& y) override {
    scales_->observe(y);
    follow_turns();
  }

  void keep_rows(size_t rows) override { result_.states.resize(rows), result_.balance.resize(rows); }

  /// Multipliers of an output are those of its motion, not interpolated.
  void record(double t, VectorXd y) override {
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

  void finish() override {
    MultipliersSummary& s = result_.summary;
    const DaeCounts c = ida_->counts();
    s.steps = c.steps, s.residual_evaluations = c.residual_evaluations, s.factorisations = c.factorisations;
    s.newton_iterations = c.newton_iterations, s.error_test_failures = c.error_test_failures;
    s.convergence_failures = c.convergence_failures;
    set_drifts(scene_, options_.largest, result_);
  }

  Equations& equations_;
  const Multibody& scene_;
  const MultipliersOptions& options_;
  double margin_ = 1;
  JointMemory memory_;
  std::vector<Clearance> before_;  // of the stops, before the step
  VectorXd y_dot_, sample_, rows_, rates_;
  redundant::PatternSum assembly_;
  std::unique_ptr<FlightFrame> frame_;
  std::unique_ptr<StateScales> scales_;
  std::unique_ptr<Ida> ida_;
};

}  // namespace

MultibodyTrajectory integrate_multipliers(const Multipliers& system, const std::vector<BodyState>& start,
                                          const MultipliersOptions& options,
                                          const Checkpoint<MultibodyTrajectory>& so_far) {
  check_options(options, system.multibody().joints.size());
  require(options.angles.empty() || options.angles.size() == system.multibody().joints.size(),
          "one angle per joint is needed");
  if (system.multibody().field) system.multibody().field->orbit.at(options.duration);  // does it last so long?
  Equations equations(system.impl());
  return MultipliersFlight(system, equations, start, options, so_far).fly();
}

}  // namespace flexboom
