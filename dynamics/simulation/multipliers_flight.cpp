#include "dynamics/events/event_loop.hpp"
#include "dynamics/events/telling_moments.hpp"
#include "dynamics/numerics/crossing.hpp"
#include "dynamics/numerics/ida.hpp"
#include "dynamics/redundant/balance.hpp"
#include "dynamics/redundant/constraint_watch.hpp"
#include "dynamics/redundant/frame.hpp"
#include "dynamics/redundant/multipliers.hpp"
#include "dynamics/redundant/scales.hpp"
#include "dynamics/redundant/start.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexboom {

using Eigen::VectorXd;
using namespace redundant;

namespace {

/// Part of the tolerance wanted over a run that each step is asked for.
constexpr double local_share = 0.015, local_share_of_loads = 0.0015;
/// Below that, round-off of absolute coordinates takes more steps than the digits of loads are worth.
constexpr double least_of_loads = 1.5e-13;

double local_tolerance(const FlightOptions& o) {
  const double usual = local_share * o.tolerance;
  return o.loads ? std::max(local_share_of_loads * o.tolerance, std::min(usual, least_of_loads)) : usual;
}

/// A violation of a joint at the start beyond this [m, rad, their rates] is the caller's mistake.
constexpr double open_joint = 1e-8;

std::vector<Stop> stops_of(const Equations& equations) {
  const Multibody& scene = equations.scene();
  std::vector<Stop> stops;
  for (size_t i = 0; i < scene.joints.size(); ++i) {
    if (!equations.joints()[i].stop) continue;
    Joint joint = scene.joints[i];
    if (joint.b.body < 0) std::swap(joint.a, joint.b);
    stops.push_back(stop_of(joint, i, scene.bodies[static_cast<size_t>(joint.b.body)]));
  }
  return stops;
}

/// Steps, rows and stops of one run by IDA.
class MultipliersFlight final : public Flight<MultibodyTrajectory>, public DaeProblem {
 public:
  MultipliersFlight(const Multipliers& system, Equations& equations, const std::vector<BodyState>& start,
                    const MultipliersOptions& options, const Checkpoint<MultibodyTrajectory>& so_far)
      : Flight(options, so_far, stops_of(equations), system.multibody().joints.size(),
               Laws(system.multibody().joints, options, 1e-15)),
        equations_(equations),
        scene_(system.multibody()),
        options_(options) {
    const size_t joints = scene_.joints.size();
    memory_ = {std::vector<char>(joints, 0), std::vector<double>(joints, 0.0), {}};
    frame_ = std::make_unique<FlightFrame>(equations_, start, t_);
    start_on_constraints(frame_->seen(start));
    begin_contacts();
    const double soon = t_ + 1e-14 * options.duration;  // what jumps at the start has jumped
    equations_.make_consistent(soon, y_, y_dot_, memory_);
    const double shaking = std::max(balance_of(equations_, y_, memory_).shaking(), options_.largest.shaking);
    scales_ =
        std::make_unique<StateScales>(equations_, y_, y_dot_, shaking, local_tolerance(options), options.duration);
    make_method();
  }

 private:
  /// For the unknowns as they are numbered.
  void make_method() {
    if (ida_) past_ += ida_->counts();
    assembly_ = {};
    if (y_dot_.size() != y_.size()) equations_.make_consistent(t_, y_, y_dot_, memory_);
    record_pattern();
    ida_ = std::make_unique<Ida>(*this);
    renumbered_ = false;
  }

  int size() const override { return equations_.size(); }
  VectorXd differential() const override {
    VectorXd id = VectorXd::Zero(size());
    id.head(equations_.motion()).setOnes();
    id.tail(equations_.energies()).setOnes();
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
  int roots() const override { return static_cast<int>(contacts_.size() + laws_.switches().size()); }
  void root_values(double t, const double* y, double* values) override {
    // Round-off of a gap must not look like a crossing: it counts as on the side of the flag.
    constexpr double round_off = 2e-16;
    for (size_t i = 0; i < contacts_.size(); ++i) {
      const double g = gap(i, y).value - levels_[i];
      const double side = contacts_.closed()[i] ? round_off : -round_off;
      values[i] = std::isinf(g) ? 1.0 : std::abs(g) <= round_off ? side : g;
    }
    Consistent at(*this, t, y);
    for (size_t i = 0; i < laws_.switches().size(); ++i) {
      const double side = laws_.sides()[i] ? round_off : -round_off;
      const double g = laws_.armed()[i] ? switch_value(laws_.switches()[i], at) : 1.0;
      values[contacts_.size() + i] = std::abs(g) <= round_off_of(laws_.switches()[i]) ? side : g;
    }
  }

  /// Where nothing else keeps a gap off zero after its crossing.
  static double round_off_of(const LawSwitch& s) {
    using Kind = LawSwitch::Kind;
    return s.kind == Kind::ramp || s.kind == Kind::latch || s.kind == Kind::faster ? 1e-14 : 1e-300;
  }

  /// Accelerations and multipliers at a state of the method; found when they are asked for.
  struct Consistent {
    MultipliersFlight& flight;
    double t;
    VectorXd y, y_dot;

    Consistent(MultipliersFlight& of, double time, const double* state)
        : flight(of), t(time), y(Eigen::Map<const VectorXd>(state, of.size())) {}
    void find() {
      if (y_dot.size() == 0) flight.equations_.make_consistent(t, y, y_dot, flight.memory_);
    }
    double hold(size_t joint) {
      find();
      const int row = flight.equations_.holding(joint);
      return row < 0 ? 0 : y[row];
    }
    double acceleration(size_t joint) {
      find();
      return flight.way_acceleration(joint, y, y_dot);
    }
  };

  double switch_value(const LawSwitch& s, Consistent& at) {
    const size_t joint = laws_.joint_of(s);
    const Gap way = this->way(joint, at.y.data());
    LawPoint p{way.value, way.rate};
    if (Laws::needs_hold(s)) p.hold = at.hold(joint);
    return laws_.gap(s, p).value;
  }

  /// Of a joint.
  Gap way(size_t joint, const double* y) {
    const DriveMotion<double> c = equations_.gap(joint, y, memory_.near[joint]);
    return {c.value, c.rate};
  }
  /// Of a stop.
  Gap gap(size_t stop, const double* y) { return way(contacts_.stop(stop).joint, y); }
  Gap gap(size_t stop) override { return gap(stop, y_.data()); }

  /// By the change of the rate over a short time.
  double way_acceleration(size_t joint, const VectorXd& y, const VectorXd& y_dot) {
    constexpr double h = 1e-7;
    return (way(joint, (y + h * y_dot).eval().data()).rate - way(joint, (y - h * y_dot).eval().data()).rate) / (2 * h);
  }

  Push push(size_t stop, std::span<const char> closed) override {
    VectorXd y = y_, y_dot;
    JointMemory memory = memory_;
    memory.closed = contacts_.by_joint(closed);
    equations_.make_consistent(t_, y, y_dot, memory);
    return {way_acceleration(contacts_.stop(stop).joint, y, y_dot), 0};
  }

  Gap joint_way(size_t joint) override { return way(joint, y_.data()); }
  double joint_acceleration(size_t joint) override { return Consistent(*this, t_, y_.data()).acceleration(joint); }
  double hold_load(size_t joint) override { return Consistent(*this, t_, y_.data()).hold(joint); }
  void lose(size_t joint, LawLoss loss, double energy) override {
    y_[equations_.losses(joint) + 1 + static_cast<int>(loss)] += energy;
  }

  /// A joint that is held has a row more, or one less when it is let go.
  void take_branches() override {
    memory_.laws.assign(laws_.branches().begin(), laws_.branches().end());
    bool other_rows = false;
    for (size_t i = 0; i < laws_.size(); ++i) {
      const size_t joint = laws_.joint(i);
      const bool held = memory_.laws[joint].held;
      if (held == equations_.joints()[joint].held_at.has_value()) continue;
      const double at = joint_way(joint).value + scene_.joints[joint].mechanism.threshold;
      equations_.hold(joint, held ? std::optional(at) : std::nullopt);
      other_rows = true;
    }
    if (other_rows) choose_rows();
  }

  /// Numbers the unknowns anew; IDA, where there is one, starts with them again.
  void choose_rows() {
    const VectorXd motion = y_.head(equations_.motion()), energies = y_.tail(equations_.energies());
    const RankReport rank = constraint_rank(equations_, t_, y_.data());
    watch_.follow(rank);
    equations_.keep_rows(rank.kept);
    y_ = VectorXd::Zero(equations_.size());
    y_.head(motion.size()) = motion, y_.tail(energies.size()) = energies;
    renumbered_ = true;
  }

  /// Everything is affine in a load: what a load makes of accelerations, an impulse makes of rates. The load is as
  /// large as the others, else its part were round-off.
  void prepare_blow(size_t joint) override {
    Consistent before(*this, t_, y_.data());
    before.find();
    const double others = before.y_dot.head(equations_.motion()).cwiseAbs().maxCoeff();
    double load = 1;
    for (int round = 0; round < 2; ++round) {
      memory_.laws[joint].spring = laws_.branches()[joint].spring + load;
      Consistent after(*this, t_, y_.data());
      after.find();
      memory_.laws[joint].spring = laws_.branches()[joint].spring;
      blow_ = (after.y_dot - before.y_dot) / load;
      held_blow_ = (after.y - before.y) / load;
      load = 1e3 * (1 + others) / std::abs(rate_of_blow(joint));
    }
  }
  double rate_of_blow(size_t joint) override {  // rates are linear in the velocities
    return way(joint, (y_ + blow_).eval().data()).rate - joint_way(joint).rate;
  }
  double hold_of_blow(size_t joint) override {
    const int row = equations_.holding(joint);
    return row < 0 ? 0 : held_blow_[row];
  }
  void strike(double impulse) override { y_ += impulse * blow_; }

  double place() const override { return 1e-14; }  // attitudes of two bodies make an angle
  double noise(size_t stop) const override {
    constexpr double of_steps = 0.3;
    return std::max(place(), of_steps * local_share * options_.tolerance * contacts_.largest_gap(stop));
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
    watch_.follow(rank);
    equations_.keep_rows(rank.kept);
    y_ = equations_.pack(start);
    y_[equations_.dissipated()] = options_.dissipated, y_[equations_.work()] = options_.work;
    for (size_t i = 0; i < options_.lost.size(); ++i)
      for (size_t k = 0; k < options_.lost[i].size(); ++k)
        y_[equations_.losses(i) + static_cast<int>(k)] = options_.lost[i][k];
    equations_.project(t_, y_);
    equations_.row_values(t_, y_.data(), values);
    require_closed(violation(equations_, values.g_dot), "m/s", "rad/s",
                   "can not follow: its motion is prescribed against other joints', by");
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
    memory_.closed = contacts_.by_joint(contacts_.closed());
    if (laws_.empty()) return;
    laws_.begin(*this, t_, result_.events);
    equations_.project(t_, y_);
  }

  void follow_turns() {
    for (size_t i = 0; i < scene_.joints.size(); ++i)
      if (scene_.joints[i].kind == JointKind::hinge) memory_.near[i] = way(i, y_.data()).value;
  }

  void record_pattern() {
    equations_.newton(t_, 1, y_.data(), y_dot_.data(), memory_, assembly_);
    assembly_.finish(size());
  }

  void restart() override {
    memory_.closed = contacts_.by_joint(contacts_.closed());
    for (size_t i = 0; i < contacts_.size(); ++i) levels_[i] = contacts_.level(i, *this);
    if (renumbered_) make_method();
    if (t_ > options_.start) {
      equations_.project(t_, y_);
      equations_.make_consistent(t_, y_, y_dot_, memory_);
    }
    ida_->restart(t_, y_, y_dot_);
  }

  void step(double limit, double& t, VectorXd& y) override {
    before_.resize(static_cast<size_t>(roots()));
    for (size_t i = 0; i < contacts_.size(); ++i) before_[i] = clearance(i, y);
    for (size_t i = 0; i < laws_.switches().size(); ++i) before_[contacts_.size() + i] = switch_clearance(i, y);
    const double t0 = t;
    std::vector<int>& crossed = contacts_.crossed();
    crossed_.assign(static_cast<size_t>(roots()), 0);
    try {
      ida_->step(limit, t, y, crossed_);
      std::copy_n(crossed_.begin(), crossed.size(), crossed.begin());
    } catch (const NumericalError& error) {
      watch_.require_independent(t, y, 3e-2);
      const std::string body = body_without_inertia(equations_, t, y.data());
      if (!body.empty()) throw NumericalError(fmt::format("t = {:.9g} s: {}", t, body));
      throw;
    }
    if (std::ranges::all_of(crossed_, [](int c) { return c == 0; })) find_short_contacts(t0, t, y);
    // Only a crossing away from where the flag is counts: the state may lie a rounding error behind the stop.
    for (size_t i = 0; i < contacts_.size(); ++i) {
      const double rate = gap(i, y.data()).rate;
      const bool counts = crossed[i] != 0 && (contacts_.closed()[i] ? rate < 0 : rate > 0);
      crossed[i] = !counts ? 0 : contacts_.closed()[i] ? -1 : 1;
    }
    for (size_t i = 0; i < laws_.switches().size(); ++i) {
      const int direction = crossed_[contacts_.size() + i], away = laws_.sides()[i] ? -1 : 1;
      const bool goes_back = switch_clearance(i, y).slope > 0;  // after a blow, within round-off of the stop
      laws_.crossed()[i] = laws_.armed()[i] && direction == away && !goes_back ? away : 0;
    }
    watch_.note_drift(t, y, 1e-6 + options_.tolerance, result_.summary);
    if (steps() % 16 == 0) watch_.require_independent(t, y, 1e-7);
  }

  Clearance clearance(size_t i, const VectorXd& y) {
    const double side = contacts_.closed()[i] ? 1 : -1;
    const Gap g = gap(i, y.data());
    return {0, side * (g.value - levels_[i]), side * g.rate};
  }

  /// Of a switch that goes by the way alone; others have no short crossings worth looking for.
  Clearance switch_clearance(size_t i, const VectorXd& y) {
    const LawSwitch& s = laws_.switches()[i];
    if (!laws_.armed()[i] || Laws::needs_hold(s) || Laws::needs_acceleration(s)) return {0, 1, 0};
    const Gap way = this->way(laws_.joint_of(s), y.data()), g = laws_.gap(s, {way.value, way.rate});
    const double side = laws_.sides()[i] ? 1 : -1;
    return {0, side * g.value, side * g.rate};
  }

  /// IDA looks at the signs at both ends of a step: a contact that begins and ends within it is found here.
  void find_short_contacts(double t0, double& t, VectorXd& y) {
    const double length = t - t0;
    double first = 1;  // share of the step
    for (size_t i = 0; i < before_.size(); ++i) {
      const bool of_law = i >= contacts_.size();
      const size_t k = of_law ? i - contacts_.size() : i;
      const auto clear = [&](double c, const VectorXd& state) {
        const Clearance here = of_law ? switch_clearance(k, state) : clearance(k, state);
        return Clearance{c, here.value, here.slope * length};
      };
      if (!(of_law ? laws_.armed()[k] != 0 : std::isfinite(levels_[k])) || !(before_[i].slope < 0)) continue;
      const Clearance from{0, before_[i].value, before_[i].slope * length}, to = clear(1, y);
      if (!(to.slope > 0) || to.value < 0) continue;
      const auto at = [&](double c) {
        sample_.resize(size());
        ida_->interpolate(t0 + c * length, sample_);
        return clear(c, sample_);
      };
      const double root = crossing_between(at, from, to, 4e-16 * t / length);
      // At round-off of the gap it may be no crossing to those who look at the rate. Then the step ends where it ended,
      // for the next one starts there.
      if (root >= first || !(at(root).slope < 0)) continue;
      std::ranges::fill(crossed_, 0);
      crossed_[i] = (of_law ? laws_.sides()[k] : contacts_.closed()[k]) ? -1 : 1;
      first = root;
    }
    if (first == 1) return;
    std::copy_n(crossed_.begin(), contacts_.size(), contacts_.crossed().begin());
    t = t0 + first * length;
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
    if (moments_.at(
            t_, [&](size_t joint) { return way(joint, y.data()).value + scene_.joints[joint].mechanism.threshold; }))
      result_.telling.emplace_back(t_, state_of(t_, y).first);
  }

  void keep_rows(size_t rows) override { result_.states.resize(rows), result_.balance.resize(rows); }

  void record(double t, VectorXd y) override {
    auto [state, balance] = state_of(t, std::move(y));
    result_.time.push_back(t);
    result_.states.push_back(std::move(state));
    result_.balance.push_back(balance);
  }

  /// Its multipliers are those of the motion, not interpolated.
  std::pair<MultibodyState, Balance> state_of(double t, VectorXd y) {
    VectorXd y_dot;
    equations_.make_consistent(t, y, y_dot, memory_);
    MultibodyState s;
    s.bodies = equations_.unpack(y.data());
    for (const BodyPlaces& at : equations_.places())
      s.accelerations.push_back({y_dot.segment<3>(at.v), y_dot.segment<3>(at.w), y_dot.segment(at.u, at.n)});
    for (size_t i = 0; i < scene_.joints.size(); ++i) {
      const JointKind kind = scene_.joints[i].kind;
      Gap c;
      if (kind == JointKind::hinge || kind == JointKind::slider) c = way(i, y.data());
      s.coordinate.push_back(c.value + scene_.joints[i].mechanism.threshold);
      s.rate.push_back(c.rate);
    }
    s.loads = equations_.loads(t, y.data());
    for (size_t i = 0; i < scene_.wheels.size(); ++i) {
      const ReactionWheel& w = scene_.wheels[i];
      s.spin.push_back(y[equations_.wheel(i)] / w.inertia - w.axis.dot(s.bodies[static_cast<size_t>(w.body)].omega));
    }
    s.lost.resize(scene_.joints.size());
    for (size_t i = 0; i < scene_.joints.size(); ++i)
      if (const int first = equations_.losses(i); first >= 0)
        s.lost[i].assign(y.data() + first, y.data() + first + 1 + (equations_.joints()[i].law ? law_losses.size() : 0));
    s.laws = memory_.laws;
    Balance balance = balance_of(equations_, y, memory_);
    frame_->leave(t, s, balance);
    s.ledger = balance.ledger, s.work = balance.work, s.dissipated = balance.dissipated;
    return {std::move(s), balance};
  }

  void finish() override {
    MultipliersSummary& s = result_.summary;
    static_cast<DaeCounts&>(s) = past_;
    s += ida_->counts();
    set_drifts(scene_, options_.largest, result_);
  }

  Equations& equations_;
  const Multibody& scene_;
  const MultipliersOptions& options_;
  ConstraintWatch watch_{equations_};
  TellingMoments moments_{scene_.joints, options_};
  JointMemory memory_;
  std::vector<double> levels_ = std::vector<double>(contacts_.size());  // of the stops' gaps, where a step ends
  std::vector<Clearance> before_;                                       // of the stops and switches, before the step
  std::vector<int> crossed_;                                            // the same
  bool renumbered_ = false;
  DaeCounts past_;
  VectorXd y_dot_, sample_;
  VectorXd blow_, held_blow_;  // changes of the state and of multipliers per impulse
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
