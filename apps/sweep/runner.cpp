#include "apps/sweep/runner.hpp"

#include "apps/accuracy/planner.hpp"
#include "apps/accuracy/time_error.hpp"
#include "apps/model/static_shapes.hpp"
#include "apps/simulate/steady_motion.hpp"
#include "fem/base/check.hpp"
#include "fem/base/stopwatch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <limits>
#include <utility>

namespace flexboom {

SweepRunner::SweepRunner(SceneSource source, SweepValues values, bool loads, bool keep_trajectories)
    : source_(std::move(source)),
      values_(std::move(values)),
      loads_(loads),
      keep_trajectories_(keep_trajectories),
      scene_(source_.read()) {
  std::vector<std::string> plan;
  const double given = scene_.integrator_tolerance;
  scene_.bodies_kept_in = source_.bodies_kept_in();
  Scene planned = with_steady_motions(scene_);
  Planner(planned).choose(planned, hooks(), plan);
  for (size_t i = 0; i < scene_.bodies.size(); ++i)  // each run has its own steady motion
    if (scene_.bodies[i].modes_auto) planned.bodies[i].basis.motion = scene_.bodies[i].basis.motion;
  scene_ = std::move(planned);
  set_options(scene_);
  validate(scene_);
  for (const BodyScene& b : with_joints(with_steady_motions(scene_)).bodies)
    if (b.is_boom()) bodies_.get(b, 0, scene_.bodies_kept_in);
  settle();
  if (scene_.integrator_tolerance != given) digits_share_ = scene_.digits_share();
  note_columns(scene_);
}

/// How much tighter than its accuracy the scene as it stands must be flown: so are all runs.
void SweepRunner::settle() {
  if (wanted_pointings(scene_).empty()) return;
  std::vector<std::string> plan;
  try {
    Run run = run_once(scene_, hooks());
    settle_pointing(scene_, run, hooks(), plan);
  } catch (const std::exception&) {  // is reported as a run, where it is one
  }
}

RunHooks SweepRunner::hooks() {
  RunHooks r;
  r.bodies = &bodies_;
  return r;
}

void SweepRunner::look_for_columns(size_t runs) {
  for (size_t run = 0; run < std::min(runs, values_.runs()); ++run) {
    try {
      note_columns(scene_of_run(run));
    } catch (const std::exception&) {  // is reported as a run
    }
  }
}

/// Which columns there are shows in the shortest run.
void SweepRunner::note_columns(Scene scene) {
  scene.duration = scene.output_step;
  for (const std::string& name : simulate(scene).outputs.names)
    if (std::find(columns_.begin(), columns_.end(), name) == columns_.end()) columns_.push_back(name);
}

namespace {

/// Those that were chosen for the scene as it stands. Modes of a steady motion are those of the motion of the run.
void take_modes(BodyScene& b, const BodyScene& planned) {
  b.modes = planned.modes;
  b.open_directions();
  if (!b.basis_given) b.basis.name = planned.basis.name;
  if (b.basis.name == "clamped") b.shapes = planned.shapes;
  add_static_shapes(b.basis.corrections, planned.basis.corrections);
}

}  // namespace

/// What the command line asks of every run, and what was chosen once for all of them.
void SweepRunner::set_options(Scene& scene) const {
  for (size_t i = 0; i < scene.bodies.size(); ++i)
    if (BodyScene& b = scene.bodies[i]; std::exchange(b.modes_auto, false)) take_modes(b, scene_.bodies[i]);
  if (digits_share_) scene.limit_digits_share(*digits_share_);
  if (loads_) ask_for_loads(scene);
}

Scene SweepRunner::scene_of_run(size_t run) const {
  Scene scene = with_values(source_, values_.variations(), values_.of_run(run)).read();
  set_options(scene);
  return scene;
}

Run SweepRunner::simulate(const Scene& scene) { return fly_once(scene, hooks()); }

RunOutcome SweepRunner::run(size_t run) {
  const Stopwatch start;
  RunOutcome outcome;
  outcome.run = run;
  const auto fail = [&](RunStatus status, std::string message) {
    outcome.status = status, outcome.message = std::move(message);
  };
  try {
    Run flown = simulate(scene_of_run(run));
    for (const Quantity& q : quantities_) outcome.quantities.push_back(value_of(q, flown.outputs));
    if (keep_trajectories_) outcome.trajectory = std::move(flown.outputs);
    const IntegrationSummary& s = flown.motion.summary;
    if (!is_balanced(s)) fail(RunStatus::numerical, fmt::format("{}: the motion is wrong", balances(s)));
  } catch (const InputError& error) {
    fail(RunStatus::input, error.what());
  } catch (const NumericalError& error) {
    fail(RunStatus::numerical, error.what());
  } catch (const std::exception& error) {
    fail(RunStatus::crashed, fmt::format("internal error: {}", error.what()));
  }
  if (outcome.status != RunStatus::ok) outcome.quantities.clear(), outcome.trajectory.reset();
  outcome.quantities.resize(quantities_.size(), std::numeric_limits<double>::quiet_NaN());
  outcome.seconds = start.seconds();
  return outcome;
}

}  // namespace flexboom
