#include "dynamics/integrator.hpp"

#include "dynamics/arkode.hpp"
#include "dynamics/conservation.hpp"
#include "dynamics/cvode.hpp"
#include "dynamics/exponential.hpp"
#include "dynamics/rotation.hpp"
#include "fem/check.hpp"
#include "fem/stopwatch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace flexboom {

using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;

namespace {

constexpr std::array<IntegratorMethod, 5> methods = {{
    {"exponential", "exact in the linear part, collocation of order 8 in the rest", 0.1, nullptr, make_exponential},
    {"bdf", "CVODE backward differentiation, order 1-5, Newton with the exact Jacobian", 0.005, make_cvode_bdf},
    {"adams", "CVODE Adams-Moulton, order 1-12, Newton with the exact Jacobian", 0.001, make_cvode_adams},
    {"dirk", "ARKODE implicit Runge-Kutta, order 5, Newton with the exact Jacobian", 0.005, make_arkode_implicit},
    {"erk", "ARKODE explicit Runge-Kutta, order 6", 0.01, make_arkode_explicit},
}};

/// Sizes that each state's error is measured against: the largest value so far of the group it belongs to, and never
/// less than a small part of what the energy at the start could make of it (so that a state that starts at zero has a
/// size), or a tenth of what the method foresees.
class Scales {
 public:
  Scales(const System& system, const VectorXd& y0, double tolerance, bool rescale)
      : system_(system), rescale_(rescale), start_attitude_(1, 0, 0, 0) {
    error_.tolerance = tolerance;
    error_.scale = VectorXd::Zero(y0.size());
    largest_ = VectorXd::Zero(y0.size());
    if (!system.fixed_hub()) start_attitude_ = y0.segment<4>(system.layout().attitude());
    floors(y0);
    observe(y0);
  }

  const ErrorScale& error() const { return error_; }

  void observe(const VectorXd& y) {
    for_each_size(y, [&](int i, double size) {
      if (size <= largest_[i]) return;
      largest_[i] = size;
      error_.scale[i] = std::max(size, rescale_ ? error_.scale[i] : floor_[i]);
    });
  }

  /// Of a state that may come: a tenth of it counts, and where motion comes from the energy no more than a tenth of
  /// what that could make. Floors rise to it.
  void foresee(const VectorXd& y) {
    for_each_size(y, [&](int i, double size) {
      floor_[i] = std::max(floor_[i], 0.1 * std::min(size, bound_[i]));
      error_.scale[i] = std::max(error_.scale[i], floor_[i]);
    });
  }

  /// Errors of a gap are weighed against no less than this.
  void raise_gap(int hinge, double size) {
    const int i = system_.layout().body[static_cast<size_t>(hinge)];
    largest_[i] = std::max(largest_[i], size);
    error_.scale[i] = std::max(error_.scale[i], size);
  }

  /// Forgets the past of the hinges when asked to measure their error against recent motion.
  void restart(const VectorXd& y) {
    if (!rescale_) return;
    const int begin = 0, p = system_.layout().p, u = system_.layout().u;
    largest_.segment(begin, p + u).setZero();
    error_.scale.segment(begin, p + u) = floor_.segment(begin, p + u) * 1e-50;
    observe(y);
  }

 private:
  /// each(i, size) for every state.
  template <class Each>
  void for_each_size(const VectorXd& y, const Each& each) {
    const Layout& l = system_.layout();
    for (size_t i = 0; i < l.body.size(); ++i) {
      const int at = l.body[i], rate = l.p + l.base + at, n = system_.appendages()[i].body.n();
      // Gap and rate measure each other: at the stop the gap is zero but the motion is not.
      each(at, std::max(std::abs(y[at]), std::abs(y[rate]) * period_[i]));
      each(rate, std::max(std::abs(y[rate]), std::abs(y[at]) / period_[i]));
      // Elastic coordinates by energy: what the one with the most has, were it in this one.
      const ReducedBody& body = system_.appendages()[i].body;
      double held = 0;
      for (int k = 0; k < n; ++k) {
        const double q = y[at + 1 + k], v = y[rate + 1 + k];
        held = std::max(held, body.Ke(k, k) * q * q + body.Me(k, k) * v * v);
      }
      for (int k = 0; k < n; ++k) {
        const double q = std::abs(y[at + 1 + k]);
        each(at + 1 + k, body.Ke(k, k) > 0 ? std::max(q, std::sqrt(held / body.Ke(k, k))) : q);
        each(rate + 1 + k, std::sqrt(held / body.Me(k, k)));
      }
    }
    each(l.dissipated(), std::abs(y[l.dissipated()]));
    if (system_.fixed_hub()) return;
    for (const int first : {l.u_begin(), l.position(), l.velocity()}) {
      const double size = y.segment<3>(first).norm();
      for (int k = 0; k < 3; ++k) each(first + k, size);
    }
    const double angle = rotation_from_start(y).norm();
    for (int k = 0; k < 4; ++k) each(l.attitude() + k, std::min(1.0, 0.5 * angle));
  }

  Vector3d rotation_from_start(const VectorXd& y) const {
    Vector4d back = start_attitude_;
    back.tail<3>() *= -1;
    return rotation_vector(quaternion_product(back, y.segment<4>(system_.layout().attitude())));
  }

  /// A small part of the values that all the energy at the start could give each state.
  void floors(const VectorXd& y0) {
    constexpr double part = 1e-4;
    const Layout& l = system_.layout();
    VectorXd beside = y0;  // on its way with the hub: that energy shakes nothing
    if (!system_.fixed_hub()) beside.segment<3>(l.velocity()).setZero();
    const WorkspaceHandle work = system_.workspace();
    const Balance b = system_.balance(beside, *work);
    const double energy = std::max(b.kinetic + b.elastic, 1e-30);
    floor_ = VectorXd::Constant(y0.size(), part);
    const double spin = system_.fixed_hub() ? 0 : y0.segment<3>(l.u_begin()).norm();
    double longest = spin > 0 ? 1 / spin : 0;
    for (size_t i = 0; i < l.body.size(); ++i) {
      const Appendage& a = system_.appendages()[i];
      const int at = l.body[i], rate = l.p + l.base + at;
      const double J = a.body.J0(2, 2), k = std::max(a.hinge.mechanism.stiffness, 1e-6 * energy);
      period_.push_back(std::sqrt(J / (k + a.hinge.mechanism.stop_stiffness)));
      longest = std::max(longest, std::sqrt(J / k));
      floor_[at] = part * std::max(std::abs(y0[at]), std::sqrt(2 * energy / k));
      floor_[rate] = part * std::sqrt(2 * energy / J);
      for (int m = 0; m < a.body.n(); ++m) {
        floor_[at + 1 + m] = part * std::sqrt(2 * energy / std::max(a.body.Ke(m, m), 1e-6 * energy));
        floor_[rate + 1 + m] = part * std::sqrt(2 * energy / a.body.Me(m, m));
      }
    }
    floor_[l.dissipated()] = energy;
    if (!system_.fixed_hub()) {
      const double J = system_.whole(y0, *work).inertia.trace() / 3, v = std::sqrt(2 * energy / system_.hub().m);
      floor_.segment<3>(l.u_begin()).setConstant(part * std::sqrt(2 * energy / J));
      floor_.segment<3>(l.velocity()).setConstant(part * v);
      floor_.segment<3>(l.position()).setConstant(part * v * std::max(longest, 1e-3));
      const double turn = part * std::min(1.0, std::sqrt(2 * energy / J) * std::max(longest, 1e-3));
      // A quaternion's entries are near 1: less than its round-off can not be asked for.
      floor_.segment<4>(l.attitude()).setConstant(std::max(turn, 1e-14 / error_.tolerance));
    }
    bound_ = floor_ / part;
    error_.scale = floor_;
  }

  const System& system_;
  bool rescale_;
  Vector4d start_attitude_;
  std::vector<double> period_;
  VectorXd floor_, bound_, largest_;
  ErrorScale error_;
};

/// Which stops are closed, which crossings are looked for.
struct Contacts {
  std::vector<char> closed, armed;
  std::vector<StopHistory> history;
};

/// Stops at the start: closed beyond the threshold; exactly on it, by where the hinge is going, and at rest there by
/// where it is pushed. Those that had settled are as good as open.
Contacts contacts_at_start(const System& system, const VectorXd& y, const IntegratorOptions& options) {
  const size_t n = system.appendages().size();
  Contacts c{std::vector<char>(n, 0), std::vector<char>(n, 0), stops_at_start(options, n)};
  VectorXd y_dot(y.size());
  system.derivative(options.start, y.data(), c.closed, *system.workspace(), y_dot.data());
  for (size_t i = 0; i < n; ++i) {
    const int hinge = static_cast<int>(i);
    const double gap = system.gap(y.data(), hinge), rate = system.gap_rate(y.data(), hinge);
    const double push = system.gap_rate(y_dot.data(), hinge);
    c.armed[i] = system.appendages()[i].hinge.mechanism.stop_stiffness > 0 && c.history[i].settled < 0;
    c.closed[i] =
        c.armed[i] && c.history[i].closed.value_or(gap > 0 || (gap == 0 && (rate > 0 || (rate == 0 && push > 0))));
  }
  return c;
}

/// One run: the event loop around a method.
class Flight {
 public:
  Flight(const System& system, const VectorXd& y0, const IntegratorOptions& options, const IntegratorMethod& method,
         const Checkpoint<Trajectory>& so_far)
      : system_(system),
        options_(options),
        so_far_(so_far),
        clock_(options),
        settle_(options.settle < 0 ? options.tolerance / 100 : options.settle),
        scales_(system, y0, method.local_share * options.tolerance, options.rescale_at_events),
        stepper_(method.make_of_system ? method.make_of_system(system, scales_.error())
                                       : method.make(ode_of(system), scales_.error())),
        contacts_(contacts_at_start(system, y0, options)),
        outputs_(options),
        t_(options.start),
        y_(y0),
        next_y_(y0),
        y_dot_(y0.size()),
        samples_(y0.size(), 16),
        work_(system.workspace()),
        crossed_(contacts_.closed.size(), 0),
        approach_(crossed_.size()),
        asleep_(crossed_.size(), 0.0) {
    for (size_t i = 0; i < crossed_.size(); ++i) {
      const int hinge = static_cast<int>(i);
      approach_[i].observe(system.gap(y0.data(), hinge), system.gap_rate(y0.data(), hinge), spring_rate(i));
    }
    if (options.rescale_at_events) return;
    for (size_t i = 0; i < crossed_.size(); ++i)
      scales_.raise_gap(static_cast<int>(i), contacts_.history[i].largest_gap);
  }

  Trajectory fly() {
    record(t_, y_);
    checkpoint();
    try {
      stepper_->restart(t_, y_, contacts_.closed, contacts_.armed);
      stepper_->foresee(options_.duration, [this](const VectorXd& y) { scales_.foresee(y); });
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
  bool stopped() {
    const bool stop = options_.interrupt != nullptr && options_.interrupt->load(std::memory_order_relaxed);
    result_.summary.interrupted = result_.summary.interrupted || stop;
    return stop;
  }

  /// What an interruption here would leave.
  void checkpoint() {
    if (so_far_) {
      const size_t outputs = result_.time.size();
      const IntegrationSummary before = result_.summary;
      result_.summary.interrupted = true;
      finish();
      so_far_(result_, outputs);
      result_.summary = before;
      result_.time.resize(outputs), result_.y.resize(outputs), result_.balance.resize(outputs);
    }
    clock_.restart();
  }

  void advance() {
    double next_t = t_;
    next_y_ = y_;
    stepper_->step(options_.duration, next_t, next_y_, crossed_);
    if (++steps_ > options_.max_steps)
      throw NumericalError(
          fmt::format("{} steps were not enough: t = {:.9g} s of {:g} s", steps_, next_t, options_.duration));
    if (!next_y_.allFinite()) throw NumericalError(fmt::format("the state is not finite at t = {:.9g} s", next_t));
    t_ = next_t, y_.swap(next_y_);
    write_outputs();
    scales_.observe(y_);
    if (switch_contacts()) {
      if (!system_.fixed_hub()) y_.segment<4>(system_.layout().attitude()).normalize();
      scales_.restart(y_);
      stepper_->restart(t_, y_, contacts_.closed, contacts_.armed);
      ++result_.summary.restarts;
    }
    if (options_.progress && steps_ % 256 == 0) options_.progress(t_, options_.duration);
  }

  void write_outputs() {
    for (outputs_within_step(); !times_.empty() && !stopped(); outputs_within_step()) {
      stepper_->interpolate_all(times_, samples_);
      for (size_t i = 0; i < times_.size(); ++i) {
        if (options_.progress && result_.time.size() % 1024 == 0) options_.progress(times_[i], options_.duration);
        record(times_[i], samples_.col(static_cast<Eigen::Index>(i)));
      }
    }
    if (outputs_.after(result_.time.size()) == t_ && !stopped()) record(t_, y_);
  }

  /// The next ones before its end, as many as go at once.
  void outputs_within_step() {
    times_.clear();
    for (Eigen::Index i = 0; i < samples_.cols(); ++i) {
      const double next = outputs_.after(result_.time.size() + times_.size());
      if (!(next < t_)) break;
      times_.push_back(next);
    }
  }

  void record(double t, const Eigen::Ref<const VectorXd>& y) {
    result_.time.push_back(t);
    result_.y.emplace_back(y);
    if (!system_.fixed_hub()) {
      auto attitude = result_.y.back().segment<4>(system_.layout().attitude());
      double& drift = result_.summary.constraint_drift;
      drift = std::max(drift, std::abs(attitude.norm() - 1));
      attitude.normalize();
    }
    result_.balance.push_back(system_.balance(result_.y.back(), *work_));
  }

  /// Applies crossings and settling. True when something changed and the method must start again.
  bool switch_contacts() {
    bool changed = false;
    for (size_t i = 0; i < crossed_.size(); ++i) {
      const int hinge = static_cast<int>(i);
      const double rate = system_.gap_rate(y_.data(), hinge);
      double &largest = contacts_.history[i].largest_rate, &reach = contacts_.history[i].largest_gap;
      largest = std::max(largest, std::abs(rate));
      reach = std::max(reach, std::abs(system_.gap(y_.data(), hinge)));
      const bool slipped = slipped_through(i);
      if ((crossed_[i] != 0 || slipped) && has_decayed(i, rate)) {
        settle(i);
        changed = true;
      } else if (crossed_[i] != 0 || slipped) {
        double& gap = y_[system_.layout().body[i]];
        const bool contact = slipped ? gap > 0 : crossed_[i] > 0;
        if (!slipped) gap = 0;  // on the stop, exactly: the root is good to round-off of t
        contacts_.closed[i] = contact;
        result_.events.push_back({t_, hinge, contact, rate});
        chatter_.contact(t_, system_.appendages()[i].body.name);
        changed = true;
        approach_[i].restart(rate);
        if (std::abs(rate) < settle_ * largest && !pushed(i, settle_ * largest)) settle(i);
      } else if (contacts_.history[i].settled >= 0 && std::abs(rate) > 2 * std::max(settle_ * largest, asleep_[i])) {
        wake(i);
        changed = true;
      }
      approach_[i].observe(system_.gap(y_.data(), hinge), rate, spring_rate(i));
    }
    return changed;
  }

  /// Is a crossing at this rate but the end of a motion that has died out on its way to the stop?
  bool has_decayed(size_t i, double rate) {
    if (!approach_[i].has_decayed(rate)) return false;
    const ErrorScale& error = scales_.error();
    const Layout& l = system_.layout();
    const double noise = 10 * error.tolerance * error.scale[l.p + l.base + l.body[i]];  // errors of steps add up
    asleep_[i] = std::max({settle_ * contacts_.history[i].largest_rate, approach_[i].round_off(), noise});
    if (!(std::abs(rate) < asleep_[i])) return false;
    // Stiff modes make a push of what the method's error leaves open of them.
    const double here = push(i, y_), beside = push(i, y_ + error.tolerance * error.scale);
    return std::abs(here) <= 2 * asleep_[i] + std::abs(beside - here);
  }

  /// Of a rigid boom off its stop [rad/s].
  double spring_rate(size_t i) const {
    const Appendage& a = system_.appendages()[i];
    return std::sqrt(a.hinge.mechanism.stiffness / a.body.J0(2, 2));
  }

  /// Is the gap on the wrong side of the flag, with no crossing found? A root finder sees no sign change where the gap
  /// starts at zero and stays there for a while.
  bool slipped_through(size_t i) const {
    if (!contacts_.armed[i] || crossed_[i] != 0) return false;
    const double gap = system_.gap(y_.data(), static_cast<int>(i));
    const double noise = scales_.error().tolerance * scales_.error().scale[system_.layout().body[i]];
    return contacts_.closed[i] ? gap < -noise : gap > noise;
  }

  /// Does something push a hinge that is on its stop, so that it will not stay there? A boom that is pressed against
  /// its stop swings in it, and comes back to where the stop begins with no rate left.
  bool pushed(size_t i, double least_rate) { return std::abs(push(i, y_)) > 2 * least_rate; }

  /// What pushes a hinge, as the rate that it gives within its period on the stop.
  double push(size_t i, const VectorXd& y) {
    system_.derivative(t_, y.data(), contacts_.closed, *work_, y_dot_.data());
    const Appendage& a = system_.appendages()[i];
    const double period = std::sqrt(a.body.J0(2, 2) / (a.hinge.mechanism.stiffness + a.hinge.mechanism.stop_stiffness));
    return period * system_.gap_rate(y_dot_.data(), static_cast<int>(i));
  }

  void settle(size_t i) {
    contacts_.history[i].settled = t_;
    contacts_.armed[i] = 0;
    contacts_.closed[i] = 0;
  }

  void wake(size_t i) {
    contacts_.history[i].settled = -1;
    asleep_[i] = 0;
    contacts_.armed[i] = 1;
    contacts_.closed[i] = system_.gap(y_.data(), static_cast<int>(i)) > 0;
  }

  void finish() {
    IntegrationSummary& s = result_.summary;
    const StepCounts c = stepper_->counts();
    s.method = options_.method;
    s.steps = c.steps;
    s.rhs_evaluations = c.rhs_evaluations;
    s.jacobian_evaluations = c.jacobian_evaluations;
    s.factorisations = c.factorisations;
    s.newton_iterations = c.newton_iterations;
    s.error_test_failures = c.error_test_failures;
    s.seconds = watch_.seconds();
    s.stops = contacts_.history;
    for (size_t i = 0; i < s.stops.size(); ++i) s.stops[i].closed = contacts_.closed[i] != 0;
    if (s.interrupted && result_.time.back() < t_) record(t_, y_);
    conservation(s);
  }

  double dissipated(size_t output) const { return result_.y[output][system_.layout().dissipated()]; }

  /// Energy and momentum balances over the outputs.
  void conservation(IntegrationSummary& s) const {
    double mass = system_.hub().m, inertia = system_.hub().J0.trace();
    for (const Appendage& a : system_.appendages()) mass += a.body.m, inertia += a.body.J0.trace();
    Conservation kept(mass, inertia, options_.largest);
    for (size_t i = 0; i < result_.time.size(); ++i) {
      const Balance& b = result_.balance[i];
      kept.add(b.kinetic + b.elastic + dissipated(i), std::abs(b.kinetic) + std::abs(b.elastic), b);
    }
    s.largest = kept.largest();
    s.energy_balance = kept.energy_balance();
    if (!system_.fixed_hub() && !system_.field()) s.momentum_drift = kept.momentum_drift();
  }

  const System& system_;
  const IntegratorOptions& options_;
  const Checkpoint<Trajectory>& so_far_;
  CheckpointClock clock_;
  Stopwatch watch_;
  double settle_;
  Scales scales_;
  std::unique_ptr<Stepper> stepper_;
  Contacts contacts_;
  OutputTimes outputs_;
  double t_;
  VectorXd y_, next_y_, y_dot_;
  std::vector<double> times_;  // of outputs within a step, and their states
  Eigen::MatrixXd samples_;
  WorkspaceHandle work_;
  std::vector<int> crossed_;
  std::vector<Approach> approach_;
  ChatterGuard chatter_;
  std::vector<double> asleep_;  // rates below this do not wake a hinge that has settled on its way [rad/s]
  long steps_ = 0;
  Trajectory result_;
};

}  // namespace

void Stepper::interpolate_all(std::span<const double> times, Eigen::MatrixXd& Y) {
  VectorXd y(Y.rows());
  for (size_t i = 0; i < times.size(); ++i) {
    interpolate(times[i], y);
    Y.col(static_cast<Eigen::Index>(i)) = y;
  }
}

std::span<const IntegratorMethod> integrator_methods() { return methods; }

const IntegratorMethod& integrator_method(const std::string& name, MethodFor wanted) {
  std::string known;
  for (const IntegratorMethod& m : methods) {
    if (wanted == MethodFor::any && m.make == nullptr) continue;
    if (m.name == name) return m;
    known += fmt::format(" '{}'", m.name);
  }
  throw InputError(fmt::format("integrator '{}' is not known{}; there are:{}", name,
                               wanted == MethodFor::any ? " for trees" : "", known));
}

Trajectory integrate(const System& system, const VectorXd& y0, const IntegratorOptions& options,
                     const Checkpoint<Trajectory>& so_far) {
  check_options(options, system.appendages().size());
  require(y0.size() == system.layout().size && y0.allFinite(), "the start state has the wrong size or is not finite");
  if (system.field()) system.field()->orbit.at(options.duration);  // does it last so long?
  return Flight(system, y0, options, integrator_method(options.method, MethodFor::system), so_far).fly();
}

}  // namespace flexboom
