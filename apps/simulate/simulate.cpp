#include "apps/simulate/simulate.hpp"

#include "apps/base/deflection.hpp"
#include "apps/scene/wanted_accuracy.hpp"
#include "apps/simulate/multipliers_flight.hpp"
#include "apps/simulate/steady_motion.hpp"
#include "apps/simulate/tree_flight.hpp"
#include "fem/base/stopwatch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexboom {

using Eigen::VectorXd;

bool wants_loads(const Scene& scene) {
  if (scene.outputs.empty()) return std::ranges::any_of(scene.joints, &JointScene::loads) || !scene.springs.empty();
  return std::ranges::any_of(scene.outputs, [](const std::string& text) { return is_load(wanted_output(text).name); });
}

IntegratorOptions integrator_options(const Scene& scene, const RunHooks& hooks, std::string_view chosen,
                                     long max_steps) {
  IntegratorOptions o;
  o.method = scene.integrator == "auto" ? chosen : scene.integrator;
  o.tolerance = scene.step_tolerance();
  o.accuracy = scene.tolerance;
  if (scene.from) o.start = scene.from->time(), o.largest = scene.from->largest();
  o.loads = !scene.error_budget && wants_loads(scene);  // else the budget measures them
  o.duration = scene.duration;
  o.output_step = scene.output_step;
  o.close_looks = hooks.close_looks;
  o.settle = scene.settle;
  o.rescale_at_events = scene.rescale_at_events;
  o.interrupt = hooks.interrupt;
  o.progress = hooks.progress;
  o.checkpoint_every = hooks.checkpoint_every;
  if (max_steps > 0) o.max_steps = max_steps;
  return o;
}

FlightState end_of(const std::vector<PreparedBody>& bodies, double time, const VectorXd& y,
                   const MotionScales& largest) {
  FlightState end;
  end.time = time;
  end.y = y;
  end.largest = largest;
  for (const PreparedBody& p : bodies) {
    end.modes[p.body.name] = p.modes;
    if (!p.shapes.empty()) end.shapes[p.body.name] = p.shapes;
    for (const Coordinate& c : p.body.coordinates)
      if (c.kind == "attachment") end.corrections[p.body.name].push_back(c.interface + "." + c.direction);
  }
  return end;
}

namespace {

/// How far each body bends, over at most `most_deflections` rows.
std::vector<Bending> bending_of(const Run& run) {
  std::vector<Bending> bending;
  const Eigen::Index stride = run.outputs.values.rows() / most_deflections + 1;
  for (const PreparedBody& p : run.bodies) {
    Bending& most = bending.emplace_back();
    if (p.body.n() == 0) continue;
    const Deflection deflection(p.body);
    const Eigen::MatrixXd q = coordinates_of(run.outputs, p.body);
    for (Eigen::Index row = 0; row < q.rows(); row += stride) {
      const double size = deflection.largest(q.row(row).transpose());
      if (size > most.size) most = {size, size / deflection.length(), run.outputs.values(row, 0)};
    }
  }
  return bending;
}

}  // namespace

PreparedBody prepared(const BodyScene& b, int refine, const std::filesystem::path& keep, const RunHooks& hooks) {
  return hooks.bodies != nullptr ? hooks.bodies->get(b, refine, keep) : prepare_body(b, refine, keep);
}

Run fly_once(const Scene& given, const RunHooks& hooks, int refine, long max_steps) {
  const Stopwatch start;
  const Scene scene = with_joints(with_steady_motions(given));
  std::vector<PreparedBody> bodies;
  for (const BodyScene& b : scene.bodies) bodies.push_back(prepared(b, refine, scene.bodies_kept_in, hooks));
  const double seconds = start.seconds();
  const auto fly = scene.formulation == "multipliers" ? fly_by_multipliers : fly_tree;
  Run r = fly(scene, std::move(bodies), hooks, max_steps);
  r.prepare_seconds += seconds;
  return r;
}

Run run_once(const Scene& scene, const RunHooks& hooks, int refine, long max_steps) {
  Run r = fly_once(scene, hooks, refine, max_steps);
  r.bending = bending_of(r);
  return r;
}

std::string error_text(double error) { return std::isnan(error) ? "not measured" : fmt::format("{:.1e}", error); }

std::string balances(const IntegrationSummary& s) {
  return fmt::format("energy balance {}, momentum drift {}", error_text(s.energy_balance),
                     error_text(s.momentum_drift));
}

bool is_balanced(const IntegrationSummary& s) {
  return s.energy_balance <= broken_balance && !(s.momentum_drift > broken_balance);  // which may be unknown
}

}  // namespace flexboom
