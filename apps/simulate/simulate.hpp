#pragma once

#include "apps/model/prepared_body.hpp"
#include "apps/scene/scene.hpp"
#include "apps/simulate/flight_state.hpp"
#include "apps/simulate/output_table.hpp"
#include "dynamics/methods/integrator.hpp"
#include "dynamics/simulation/tree_integrator.hpp"

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom {

/// Energies at the end of a run, by where they are and where they went [J].
struct EnergyOfRun {
  double kinetic = 0, potential = 0;  // potential: of gravity
  double work = 0;
  EnergyLedger ledger;
};

/// A motion of the bodies of a scene, and what is made of it.
struct SimulatedMotion {
  std::vector<PreparedBody> bodies;  // as with_joints has them
  TreeTrajectory motion;             // by whatever coordinates: the states are those of `tree`
  std::shared_ptr<const Tree> tree;  // of the joints that close no loop
  OutputTable outputs;
  FlightState end;                    // from which another run can go on
  std::optional<EnergyOfRun> ledger;  // none before the first row
  double prepare_seconds = 0, integrate_seconds = 0;
};

/// How far a body bends in a flight: the largest elastic displacement of any of its points.
struct Bending {
  double size = 0;       // [m]
  double of_length = 0;  // by the length of the body
  double time = 0;       // [s]
};

/// One flight of a scene as it stands.
struct Run : SimulatedMotion {
  std::vector<Bending> bending;    // per body
  std::vector<std::string> notes;  // for the plan
};

class FlightsAhead;

/// Beside a run.
struct RunHooks {
  const std::atomic<bool>* interrupt = nullptr;
  std::function<void(double time, double duration)> progress{};
  double checkpoint_every = 10;      // wall time between two checkpoints [s]
  PreparedBodies* bodies = nullptr;  // that other runs have made; nullptr: this one makes its own
  FlightsAhead* ahead = nullptr;     // that were flown before they are asked for; nullptr: none
  /// Told at every checkpoint of a flight: the run so far, whose rows begin with row `first` of the flight. Its end is
  /// the state there. Row 0 comes again where the flight begins anew.
  std::function<void(Run so_far, size_t first)> checkpoint{};

  CloseLooks close_looks{};  // instead of the outputs of the scene, where there are any

  bool stopped() const { return interrupt != nullptr && interrupt->load(); }
};

/// The balance that no run may have: far above any tolerance that is accepted for a step.
inline constexpr double broken_balance = 0.01;

/// Are loads of joints or springs among the outputs whose errors count?
bool wants_loads(const Scene&);

/// Do energy and momenta balance as well as any run must? If not, the motion is wrong whatever the tolerance was.
bool is_balanced(const IntegrationSummary&);

/// How well they do, in words.
std::string balances(const IntegrationSummary&);

/// A relative error in words; "not measured" of what is unknown.
std::string error_text(double);

/// What a scene asks of an integrator; `chosen`: the method where it leaves the choice. `max_steps` as of run_once.
IntegratorOptions integrator_options(const Scene&, const RunHooks&, std::string_view chosen, long max_steps);

/// prepare_body, or what other runs have made.
PreparedBody prepared(const BodyScene&, int refine, const std::filesystem::path& keep, const RunHooks&);

/// `max_steps` > 0 bounds its cost: NumericalError above.
Run run_once(const Scene&, const RunHooks&, int refine = 0, long max_steps = 0);
/// The same, but for how far bodies bend.
Run fly_once(const Scene&, const RunHooks&, int refine = 0, long max_steps = 0);

/// Time, numbers and modes at the end of a flight; names and stops are for the caller.
FlightState end_of(const std::vector<PreparedBody>&, double time, const Eigen::VectorXd& y,
                   const MotionScales& largest);

}  // namespace flexboom
