#pragma once

#include "dynamics/events/contacts.hpp"
#include "dynamics/numerics/method_failure.hpp"
#include "fem/base/check.hpp"

#include <Eigen/Core>

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom {

class Ode;
class SplitProblem;

struct IntegratorOptions : FlightOptions {
  std::string method = "auto";
  double accuracy = 0;  // what left-out stiffness is held against; 0: the tolerance
  /// Measure errors against the motion since the last event instead of the largest motion: late, tiny contacts keep
  /// their relative accuracy. Costs steps.
  bool rescale_at_events = false;
};

struct StepCounts {
  long steps = 0, rhs_evaluations = 0, jacobian_evaluations = 0, factorisations = 0, newton_iterations = 0,
       error_test_failures = 0;
};

/// What an integration did, and how well it kept what must be kept.
struct IntegrationSummary : StepCounts {
  std::string method;
  std::string why_method;  // where the program chose it
  long restarts = 0;
  double seconds = 0;
  double energy_balance = 0;        // max |E + dissipated - E0| / max E
  double momentum_drift = unknown;  // max change of both momenta, each over its scale; unknown where they change
  double constraint_drift = 0;      // max | |quaternion| - 1 |; the joints are exact in relative coordinates
  MotionScales largest;             // what energy_balance and momentum_drift are relative to
  std::vector<StopHistory> stops;   // per joint
  bool interrupted = false;
};

/// What a method needs to weigh an error: |error_i| is measured in units of tolerance * scale_i.
struct ErrorScale {
  double tolerance = 1e-7;  // per step
  Eigen::VectorXd scale;    // one per state, never zero
};

/// One integration method on one system. Each step is smooth: the contact flags are constant between restarts.
class Stepper {
 public:
  virtual ~Stepper() = default;
  /// Starts again at (t, y) with these stops closed. A gap that crosses its level ends a step; at an infinite one,
  /// none.
  virtual void restart(double t, const Eigen::VectorXd& y, std::span<const char> contact,
                       std::span<const double> levels) = 0;
  /// One step, not beyond t_end. Fills t and y, and crossed[i] with +1 (gap rises through its level), -1 or 0. When
  /// something was crossed, (t, y) is there.
  virtual void step(double t_end, double& t, Eigen::VectorXd& y, std::span<int> crossed) = 0;
  /// States that the motion may come near until t_end, as far as that is known without flying there: sizes to weigh
  /// errors by. After a restart.
  virtual void predict(double /*t_end*/, const std::function<void(const Eigen::VectorXd& y)>&) {}
  /// Largest eigenvalue of the linear part that the last step took out, where the method takes one [1/s].
  virtual double fastest() const { return 0; }
  /// States within the last step, a column each; Y has the size of a state, and as many columns or more.
  virtual void interpolate(std::span<const double> times, Eigen::MatrixXd& Y) = 0;
  virtual StepCounts counts() const = 0;
};

struct IntegratorMethod {
  std::string_view name;
  std::string_view what;
  /// Part of the tolerance wanted over a whole run that each step is asked for. Errors of undamped motion grow with its
  /// periods, so this is a start, not a promise: a run's error budget measures what was reached.
  double local_share;
  double local_share_of_loads;  // the same where loads of joints are wanted: low orders know accelerations worst
  double share_of(const FlightOptions& o) const { return o.loads ? local_share_of_loads : local_share; }
  /// One of the two is null.
  std::unique_ptr<Stepper> (*make)(std::unique_ptr<Ode>, const ErrorScale&);
  std::unique_ptr<Stepper> (*make_split)(std::unique_ptr<SplitProblem>, const ErrorScale&) = nullptr;
};

/// The table of methods: "exponential", "bdf", "adams", "dirk", "erk".
std::span<const IntegratorMethod> integrator_methods();

/// @throws InputError for a name that is not in the table, listing those that are.
const IntegratorMethod& integrator_method(const std::string& name);

}  // namespace flexboom
