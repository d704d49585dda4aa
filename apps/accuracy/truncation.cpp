#include "apps/accuracy/truncation.hpp"

#include "apps/accuracy/drive_spectra.hpp"
#include "apps/accuracy/motion_spectra.hpp"
#include "apps/accuracy/variants.hpp"
#include "apps/model/static_shapes.hpp"
#include "apps/simulate/flights_ahead.hpp"
#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexboom {

namespace {

/// @throws InputError where a body from a file is loaded where the one with more modes has no static shapes.
void require_static_shapes(const Scene& scene) {
  for (const BodyScene& b : scene.bodies) {
    const std::vector<std::string> markers = loads_without_shapes(scene, b);
    if (!markers.empty())
      throw InputError(
          fmt::format("body {} is loaded at {}, where its file has no static shapes; reduce it again, with "
                      "--loads-at of four places at most",
                      b.name, fmt::join(markers, ", ")));
  }
}

/// Rates of joints that do not float converge as 1 / n where a torque is there at once. It turns the root of a body as
/// fast as that part of it turns which has felt it: more modes, a smaller part.
bool is_rate_of_joint(const std::string& output, const std::vector<JointScene>& joints) {
  return std::ranges::any_of(joints, [&output](const JointScene& joint) {
    return !joint_type(joint.kind).floats && output.starts_with(joint.name + ".rate");
  });
}

/// The scene as flown with the elements of `richer`, of beams that tones give a reach. Nothing: there are none.
std::optional<Scene> with_elements_of(const Scene& richer, const ErrorBudget& budget, Scene flown) {
  bool any = false;
  for (size_t i = 0; i < flown.bodies.size(); ++i) {
    BodyScene& b = flown.bodies[i];
    if (b.structure != "beam" || !budget.reach.contains(b.name)) continue;
    b.geometry = richer.bodies[i].geometry;
    any = true;
  }
  return any ? std::optional(std::move(flown)) : std::nullopt;
}

/// How many modes beyond show the truncation: as many as are kept where loads are outputs, for these converge slowly.
ModesBeyond number_beyond(const ErrorBudget& budget) {
  return {.as_many = std::ranges::any_of(budget.outputs, is_load, &OutputErrors::name)};
}

/// All modes by those beyond, of the body where that is most.
double modes_by_modes_beyond(const Scene& flown, const Scene& richer) {
  const auto modes = [](const BodyScene& b) {
    return b.reduced ? b.reduced->n() : b.shapes.empty() ? b.modes : static_cast<int>(std::ssize(b.shapes));
  };
  double most = 0;
  for (size_t i = 0; i < flown.bodies.size(); ++i) {
    const int all = modes(richer.bodies[i]), beyond = all - modes(flown.bodies[i]);
    if (beyond > 0) most = std::max(most, static_cast<double>(all) / beyond);
  }
  return most;
}

}  // namespace

Truncation::Truncation(Measuring& m, const Scene& scene, const Scene& flown, const Run& run, const StillKinds& still)
    : m_(m), scene_(scene), flown_(flown), run_(run), still_(still) {
  const std::vector<JointScene> joints = with_joints(scene).joints;
  for (const OutputErrors& o : m.budget.outputs)
    if (is_rate_of_joint(o.name, joints)) slow_.insert(o.name);
}

void Truncation::look() {
  if (!are_found_ || std::exchange(seen_, to_toml(flown_)) == seen_) return;
  give_up_ahead(m_.repeats.hooks);
  const double found = m_.measured("truncation", [this] {
    take();
    if (beyond_) fly_ahead(beyond_->scene, m_.repeats.hooks, 0, bearable_steps(run_));
    return 0.0;
  });
  are_found_ = !std::isnan(found);
}

void Truncation::measure() {
  if (!are_found_) return;
  m_.budget.truncation = m_.measured("truncation", [this] {
    constexpr double of_truncation = 1.0 / 3;
    const RunHooks& hooks = m_.repeats.hooks;
    ShakenModes shaken;  // found while the modes beyond are flown
    if (beyond_) shaken = shaken_modes(flown_, run_, number_beyond(m_.budget), m_.budget.reach, hooks);
    Finding finding = found();
    const double least = std::max(counting_effect * scene_.tolerance, of_truncation * largest(finding.differences));
    if (any_counts(shaken, least)) {
      take(shaken, least);
      finding = found();
    }
    return m_.enter(&OutputErrors::truncation, finding);
  });
}

void Truncation::take(const ShakenModes& shaken, double least) {
  beyond_ = modes_beyond(shaken, least);
  if (beyond_) slow_per_change_ = std::max(2.0, modes_by_modes_beyond(flown_, beyond_->scene));
}

/// Nothing where no body is elastic. The modes are flown with few digits first: more only where the answer would drown
/// in the error of time integration. Those among `shaken` are taken in whose effect is more than the least.
/// @throws InputError where the scene has no more modes.
std::optional<Truncation::Beyond> Truncation::modes_beyond(const ShakenModes& shaken, double least) {
  const RunHooks& hooks = m_.repeats.hooks;
  require_richer(scene_, &RicherBodies::more_modes, "more modes");
  require_static_shapes(scene_);
  if (!any_elastic(scene_)) return {};
  if (scene_.from) throw InputError("a saved state knows nothing of modes beyond its own");
  const DriveSpectra drives(flown_);
  const ModesBeyond beyond = number_beyond(m_.budget);
  m_.budget.reach = with_shaken(reach_of_drives(flown_, beyond, drives, hooks), shaken, least);
  Scene more = with_more_modes(flown_, beyond, m_.budget.reach, hooks);
  require_drives_shown(more, drives, hooks);
  require_reached(more, m_.budget.reach, hooks);
  Beyond r{without_kinds(std::move(more), m_.budget.has_stiffened ? StillKinds{} : still_, hooks)};
  r.kept = with_elements_of(r.scene, m_.budget, flown_);
  constexpr double few_digits = 1e-5;
  r.has_few_digits = flown_.tolerance < few_digits;
  if (r.has_few_digits) r.scene.tolerance = few_digits, r.scene.integrator_tolerance = 0;
  return r;
}

/// What modes beyond those of a run change, and what still more would.
Finding Truncation::found() {
  if (!beyond_) return {};
  const Repeats& repeats = m_.repeats;
  const double time_error = m_.budget.time;
  const auto borne = [this](const std::vector<OutputDifference>& changes) { return are_borne(changes); };
  Scene& more = beyond_->scene;
  std::optional<Run> with_finer_elements;
  if (beyond_->kept) with_finer_elements = repeats.repeated(run_, *beyond_->kept);
  const Run& kept = with_finer_elements ? *with_finer_elements : run_;
  // A digit more may be wanted as well.
  if (!beyond_->has_few_digits && repeats.may_be_of_time(repeats.floors.tolerance, time_error))
    fly_ahead(with_a_digit_more(more), repeats.hooks, 0, bearable_steps(run_));
  Finding r{repeats.change(kept, more, beyond_->has_few_digits ? unknown : time_error, 0, borne)};
  give_up_ahead(repeats.hooks);
  const double noise = time_error > flown_.step_tolerance() ? time_error / flown_.step_tolerance() : 1;
  if (beyond_->has_few_digits && largest(r.differences) <= 10 * noise * more.tolerance) {
    more.tolerance = flown_.tolerance, more.integrator_tolerance = flown_.integrator_tolerance;
    r.differences = repeats.change(kept, more, time_error, 0, borne);
  }
  for (OutputDifference& d : r.differences) d.error *= per_change(d.name);
  return r;
}

/// The truncation of an output for what modes beyond change. A motion converges like 1 / n^2 or faster, so that as many
/// modes more change three quarters of the error or more. A jump of an acceleration rings all modes of a body, and a
/// load of its joint converges like their effective mass: as 1 / n. As many modes more change half of it then.
double Truncation::per_change(const std::string& output) const {
  return is_load(output) ? 2 : slow_.contains(output) ? slow_per_change_ : 1.25;
}

/// Would these truncations keep the tolerance with the other parts, though the repeat has an error of time of its own?
bool Truncation::are_borne(const std::vector<OutputDifference>& changes) const {
  return std::ranges::all_of(m_.budget.outputs, [&](const OutputErrors& o) {
    const auto d = std::ranges::find(changes, o.name, &OutputDifference::name);
    if (d == changes.end()) return true;
    return o.known() + per_change(o.name) * (d->error + o.time) <= m_.repeats.floors.tolerance;
  });
}

}  // namespace flexboom
