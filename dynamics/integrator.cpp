#include "dynamics/integrator.hpp"

#include "dynamics/arkode.hpp"
#include "dynamics/conservation.hpp"
#include "dynamics/cvode.hpp"
#include "dynamics/event_loop.hpp"
#include "dynamics/exponential.hpp"
#include "dynamics/ode.hpp"
#include "dynamics/rotation.hpp"
#include "dynamics/split.hpp"
#include "fem/check.hpp"

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
    for (const int spent : {l.dissipated(), l.work()}) each(spent, std::abs(y[spent]));
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
    floor_.tail<2>().setConstant(energy);
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

/// The stops of the booms: their hinges have the places of the bodies' frames.
std::vector<Stop> stops_of(const System& system) {
  std::vector<Stop> stops;
  for (const Appendage& a : system.appendages()) {
    Joint joint;
    joint.name = a.body.name, joint.mechanism = a.hinge.mechanism;
    stops.push_back(stop_of(joint, stops.size(), a.body));
  }
  return stops;
}

class SystemFlight final : public Flight<Trajectory> {
 public:
  SystemFlight(const System& system, const VectorXd& y0, const IntegratorOptions& options,
               const IntegratorMethod& method, const Checkpoint<Trajectory>& so_far)
      : Flight(options, so_far, stops_of(system), system.appendages().size()),
        system_(system),
        method_(method),
        scales_(system, y0, method.local_share * options.tolerance, options.rescale_at_events),
        stepper_(method.make != nullptr ? method.make(ode_of(system), scales_.error())
                                        : method.make_split(split(system), scales_.error())),
        y_dot_(y0.size()),
        work_(system.workspace()) {
    y_ = y0;
    contacts_.begin(*this);
    if (options.rescale_at_events) return;
    for (size_t i = 0; i < contacts_.size(); ++i) scales_.raise_gap(static_cast<int>(i), contacts_.largest_gap(i));
  }

 private:
  Gap gap(size_t stop) override {
    const int hinge = static_cast<int>(stop);
    return {system_.gap(y_.data(), hinge), system_.gap_rate(y_.data(), hinge)};
  }

  /// Stiff modes make a push of what the method's error leaves open of them.
  Push push(size_t stop, std::span<const char> closed) override {
    const ErrorScale& error = scales_.error();
    const double here = acceleration(stop, closed, y_);
    return {here, std::abs(acceleration(stop, closed, y_ + error.tolerance * error.scale) - here)};
  }

  double acceleration(size_t stop, std::span<const char> closed, const VectorXd& y) {
    system_.derivative(t_, y.data(), closed, *work_, y_dot_.data());
    return system_.gap_rate(y_dot_.data(), static_cast<int>(stop));
  }

  /// The exponential method has no error in what a hinge does when it hardly moves, and errors may be weighed by that.
  double noise(size_t stop) const override {
    const ErrorScale& error = scales_.error();
    const double of_steps = noise_of_methods * error.tolerance * error.scale[system_.layout().body[stop]];
    return method_.make_split != nullptr ? std::min(of_steps, 1e-14 * contacts_.largest_gap(stop)) : of_steps;
  }

  void put_on_stop(size_t stop) override { y_[system_.layout().body[stop]] = 0; }

  void restart() override {
    if (t_ > options_.start) {
      if (!system_.fixed_hub()) y_.segment<4>(system_.layout().attitude()).normalize();
      scales_.restart(y_);
    }
    stepper_->restart(t_, y_, contacts_.closed(), contacts_.armed());
    if (t_ == options_.start) stepper_->foresee(options_.duration, [this](const VectorXd& y) { scales_.foresee(y); });
  }

  void step(double limit, double& t, VectorXd& y) override { stepper_->step(limit, t, y, contacts_.crossed()); }
  void interpolate(std::span<const double> times, Eigen::MatrixXd& Y) override { stepper_->interpolate_all(times, Y); }
  void observe(const VectorXd& y) override { scales_.observe(y); }
  void keep_rows(size_t rows) override { result_.y.resize(rows), result_.balance.resize(rows); }

  void record(double t, VectorXd y) override {
    result_.time.push_back(t);
    if (!system_.fixed_hub()) {
      auto attitude = y.segment<4>(system_.layout().attitude());
      double& drift = result_.summary.constraint_drift;
      drift = std::max(drift, std::abs(attitude.norm() - 1));
      attitude.normalize();
    }
    result_.balance.push_back(system_.balance(y, *work_));
    result_.y.push_back(std::move(y));
  }

  void finish() override {
    IntegrationSummary& s = result_.summary;
    s.method = method_.name;
    add_counts(stepper_->counts(), s);
    double mass = system_.hub().m, inertia = system_.hub().J0.trace();
    for (const Appendage& a : system_.appendages()) mass += a.body.m, inertia += a.body.J0.trace();
    Conservation kept(mass, inertia, options_.largest);
    for (size_t i = 0; i < result_.time.size(); ++i) {
      const Balance& b = result_.balance[i];
      const Layout& l = system_.layout();
      kept.add(b.kinetic + b.elastic + result_.y[i][l.dissipated()] - result_.y[i][l.work()],
               std::abs(b.kinetic) + std::abs(b.elastic), b);
    }
    s.largest = kept.largest();
    s.energy_balance = kept.energy_balance();
    if (!system_.fixed_hub() && !system_.field()) s.momentum_drift = kept.momentum_drift();
  }

  const System& system_;
  const IntegratorMethod& method_;
  Scales scales_;
  std::unique_ptr<Stepper> stepper_;
  VectorXd y_dot_;
  WorkspaceHandle work_;
};

}  // namespace

void add_counts(const StepCounts& c, IntegrationSummary& s) {
  s.steps = c.steps;
  s.rhs_evaluations = c.rhs_evaluations;
  s.jacobian_evaluations = c.jacobian_evaluations;
  s.factorisations = c.factorisations;
  s.newton_iterations = c.newton_iterations;
  s.error_test_failures = c.error_test_failures;
}

void Stepper::interpolate_all(std::span<const double> times, Eigen::MatrixXd& Y) {
  VectorXd y(Y.rows());
  for (size_t i = 0; i < times.size(); ++i) {
    interpolate(times[i], y);
    Y.col(static_cast<Eigen::Index>(i)) = y;
  }
}

std::span<const IntegratorMethod> integrator_methods() { return methods; }

const IntegratorMethod& integrator_method(const std::string& name) {
  std::string known;
  for (const IntegratorMethod& m : methods) {
    if (m.name == name) return m;
    known += fmt::format(" '{}'", m.name);
  }
  throw InputError(fmt::format("integrator '{}' is not known; there are:{}", name, known));
}

Trajectory integrate(const System& system, const VectorXd& y0, const IntegratorOptions& options,
                     const Checkpoint<Trajectory>& so_far) {
  check_options(options, system.appendages().size());
  require(y0.size() == system.layout().size && y0.allFinite(), "the start state has the wrong size or is not finite");
  if (system.field()) system.field()->orbit.at(options.duration);  // does it last so long?
  return SystemFlight(system, y0, options, integrator_method(options.method), so_far).fly();
}

}  // namespace flexboom
