// The model of a scene that leaves it to the program: runs with fewer modes beside one with many.

#include "apps/accuracy/planner.hpp"

#include "apps/accuracy/basis_choice.hpp"
#include "apps/accuracy/error_budget.hpp"
#include "apps/accuracy/fewest_enough.hpp"
#include "apps/accuracy/time_error.hpp"
#include "apps/accuracy/variants.hpp"
#include "apps/model/prepared_body.hpp"
#include "apps/model/static_shapes.hpp"
#include "apps/simulate/flights_ahead.hpp"
#include "fem/base/check.hpp"
#include "fem/booms/solid_boom.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>

namespace flexboom {

using Eigen::VectorXd;

namespace {

constexpr double unmoved = 1e-12;    // of the largest displacement: round-off of one that is zero
constexpr int most_candidates = 96;  // per body
constexpr int fewest = few_modes;    // candidates per body
constexpr int for_budget = 8;        // modes beside the candidates that show their truncation
constexpr int most_rounds = 5;       // improvements
constexpr double not_near = 10;      // times the tolerance: more modes that hardly help do not get there
constexpr double first_near = 100;   // the same, where more have not been looked at
constexpr int most_doublings = 2;    // of the candidates, before a budget shows what they leave out
constexpr double nearly_all = 0.85;  // of the candidates: where so many are needed, more would be, too

/// The largest |q| of every coordinate of a body.
VectorXd amplitudes(const Run& run, const ReducedBody& body) {
  return coordinates_of(run.outputs, body).cwiseAbs().colwise().maxCoeff().transpose();
}

/// "bending_y 2, torsion 1" of kinds.
std::string counted(const std::vector<std::string>& kinds) {
  std::map<std::string, int> count;
  for (const std::string& kind : kinds) ++count[kind];
  std::vector<std::string> parts;
  parts.reserve(count.size());
  for (const auto& [kind, n] : count) parts.push_back(fmt::format("{} {}", n, kind));
  return parts.empty() ? "none" : fmt::format("{}", fmt::join(parts, ", "));
}

/// What is taken of a basis without a choice, and what is left out.
std::string words_of_whole(const BodyScene& b, int made, double error) {
  const std::string taken = b.modes > 0 ? fmt::format("the first {}", b.modes) : "none";
  return fmt::format(
      "modes of {}: {} of basis \"{}\"; left out: {} that change the outputs by {:.1e} together with those of all "
      "bodies",
      b.name, taken, b.basis.name, made - b.modes, error);
}

}  // namespace

Planner::Planner(const Scene& scene) {
  for (size_t i = 0; i < scene.bodies.size(); ++i)
    if (scene.bodies[i].modes_auto && scene.bodies[i].is_flexible()) open_.push_back(i);
}

Scene Planner::with_candidates(const Scene& scene, int candidates, int made, const RunHooks& hooks) const {
  Scene all = scene;
  for (const size_t i : open_) {
    BodyScene& b = all.bodies[i];
    b.modes_auto = false;
    b.open_directions();
    const int share = b.directions == "all" ? 1 : 2, wanted = candidates / share;
    int modes = wanted;
    if (b.basis.name == "clamped") modes = made / share + (scene.error_budget ? for_budget : 0);
    b = with_modes(b, modes, scene.bodies_kept_in, hooks);
    b = with_static_shapes(b, moving_static_shapes(scene, b));
    const auto shown = candidates < made || !has_choice(scene, b.name) ? shown_.end() : shown_.find(b.name);
    if (shown != shown_.end()) b.modes = std::max(b.modes, shown->second.modes);
    if (b.modes <= wanted) continue;
    b.shapes.resize(static_cast<size_t>(wanted));
    std::iota(b.shapes.begin(), b.shapes.end(), 1);
    if (shown == shown_.end()) continue;
    std::ranges::copy_if(shown->second.shapes, std::back_inserter(b.shapes), [&](int k) { return k > wanted; });
  }
  return without_kinds(all, still_, hooks);
}

std::vector<std::string> Planner::moving_static_shapes(const Scene& scene, const BodyScene& body) const {
  std::vector<std::string> shapes = static_shapes_of_loads(scene, body);
  const auto still = still_.find(body.name);
  if (still == still_.end()) return shapes;
  const std::map<std::string, std::string> moves = {{"Fx", "axial"},   {"Fy", "bending_y"}, {"Fz", "bending_z"},
                                                    {"Mx", "torsion"}, {"My", "bending_z"}, {"Mz", "bending_y"}};
  std::erase_if(shapes, [&](const std::string& shape) {
    return still->second.contains(moves.at(shape.substr(shape.rfind('.') + 1)));
  });
  return shapes;
}

/// Only clamped modes are independent of each other; other bases are whole.
bool Planner::has_choice(const Scene& scene, const std::string& body) const {
  return std::ranges::any_of(
      open_, [&](size_t i) { return scene.bodies[i].name == body && scene.bodies[i].basis.name == "clamped"; });
}

/// The largest displacement first.
std::vector<Planner::Candidate> Planner::ranked(const Scene& scene, const Run& run) const {
  std::vector<Candidate> list;
  for (const PreparedBody& p : run.bodies) {
    if (p.body.n() == 0 || !has_choice(scene, p.body.name)) continue;
    const VectorXd q = amplitudes(run, p.body);
    for (int k = 0; k < p.coordinates_of_modes(); ++k)  // behind them are static shapes, which are no candidates
      list.push_back({p.body.name, p.shapes.empty() ? k + 1 : p.shapes[static_cast<size_t>(k)],
                      p.body.coordinates[static_cast<size_t>(k)].kind, q[k] * std::sqrt(p.body.Me(k, k) / p.body.m)});
  }
  std::ranges::stable_sort(list, std::greater(), &Candidate::displacement);
  return list;
}

void Planner::note_still(const std::vector<Candidate>& list) {
  if (list.empty() || !(list.front().displacement > 0)) return;
  std::map<std::pair<std::string, std::string>, double> largest;  // displacement of a kind of a body
  for (const Candidate& c : list) {
    double& most = largest[{c.body, c.kind}];
    most = std::max(most, c.displacement);
  }
  // One is evidence enough: the first mode of a kind takes part in any motion of the root that reaches others.
  for (const auto& [of, most] : largest)
    if (most <= unmoved * list.front().displacement && of.second != "other") still_[of.first].insert(of.second);
}

void Planner::note_shown(Scene& planned, const Reach& of_budget, const RunHooks& hooks) {
  Reach reach = reach_of_drives(planned, {}, DriveSpectra(planned), hooks);
  for (const auto& [body, wanted] : of_budget) reach[body] = std::max(reach[body], wanted);
  const Scene more = with_more_modes(planned, {}, reach, hooks);
  for (const size_t i : open_) {
    planned.bodies[i].geometry = more.bodies[i].geometry;
    if (planned.bodies[i].basis.name != "clamped" || planned.bodies[i].directions != "all") continue;
    shown_[planned.bodies[i].name] = more.bodies[i];
  }
}

Scene Planner::with_first(const Scene& all, const std::vector<Candidate>& list, size_t count) const {
  Scene scene = all;
  for (const size_t i : open_) {
    BodyScene& b = scene.bodies[i];
    if (!has_choice(all, b.name)) continue;
    b.shapes.clear();
    for (size_t k = 0; k < count; ++k)
      if (list[k].body == b.name) b.shapes.push_back(list[k].shape);
    std::ranges::sort(b.shapes);
    if (b.shapes.empty()) b.modes = 0;
  }
  return scene;
}

std::optional<Run> Planner::with_all(Scene& scene, const RunHooks& hooks, Scene& open, Scene& all,
                                     std::vector<std::string>& plan) {
  Scene with_few = with_candidates(scene, fewest, candidates_, hooks);
  Run few = fly(with_few, hooks);
  const auto made_ready = [&](int candidates) {
    open = with_candidates(scene, candidates, candidates, hooks);
    all = with_a_digit_more(as_flown(open, few));  // errors of its time are no part of differences
    all.integrator_tolerance = std::max(all.integrator_tolerance, least_tolerance);
  };
  const auto bearable = [&few] { return 2 * bearable_steps(few); };  // of a tighter tolerance
  if (!std::exchange(is_timed_, true)) {
    if (candidates_ > fewest) {
      made_ready(candidates_);
      fly_ahead(all, hooks, 0, bearable());
    }
    const Settling asked{scene.tolerance / 3, 6};
    try {
      settle_time_error(with_few, few, floors_of(scene, few.bodies), asked, hooks, plan);
    } catch (const NumericalError& e) {  // no more digits can be had: those that were reached count
      plan.push_back(fmt::format("time integration: no tighter than {:.0e}: {}", with_few.step_tolerance(), e.what()));
    }
    if (with_few.integrator_tolerance != scene.integrator_tolerance) give_up_ahead(hooks);
    scene.integrator_tolerance = with_few.integrator_tolerance;
  }
  const auto run = [&](int candidates, long max_steps) {
    made_ready(candidates);
    return fly(all, hooks, 0, max_steps);
  };
  for (; candidates_ > fewest && !hooks.stopped(); candidates_ /= 2) {
    try {
      Run made = run(candidates_, bearable());
      costly_ = costly_ || made.motion.summary.steps > bearable() / 3;  // with more of them it will not be bearable
      return made;
    } catch (const NumericalError&) {
      costly_ = true;
      plan.push_back(
          fmt::format("modes: a run with {} of each body fails or takes more than {} steps", candidates_, bearable()));
      if (candidates_ / 2 <= chosen_from_) return {};
    }
  }
  return run(fewest, 0);
}

Scene Planner::with_first_of_whole(Scene scene, size_t modes) const {
  for (const size_t i : open_)
    if (BodyScene& b = scene.bodies[i]; !has_choice(scene, b.name))
      b.modes = std::min(b.modes, static_cast<int>(modes));
  return scene;
}

size_t Planner::most_of_whole(const Scene& scene) const {
  int most = 0;
  for (const size_t i : open_)
    if (const BodyScene& b = scene.bodies[i]; !has_choice(scene, b.name)) most = std::max(most, b.modes);
  return static_cast<size_t>(most);
}

void Planner::choose_bases(Scene& scene, const RunHooks& hooks, std::vector<std::string>& plan) const {
  long bearable = 0;  // not known yet
  const auto flown = [&](const Scene& of, int modes) {
    const Scene tried = with_candidates(of, modes, std::max(candidates_, modes), hooks);
    Run run = run_once(tried, hooks, 0, bearable);
    if (bearable == 0) keep_flown(tried, run, hooks), bearable = bearable_steps(run);
    return run;
  };
  try {
    take_modes_of_the_motion(scene, open_, flown, plan);
  } catch (const NumericalError&) {  // its modes at rest fly as well as they can
  }
}

bool Planner::choose(Scene& scene, const RunHooks& hooks, std::vector<std::string>& plan) {
  if (open_.empty()) return false;
  const Scene given = scene;
  std::optional<Scene> cheap = by_cheapest_means(scene);
  if (chosen_from_ == 0) choose_bases(cheap ? *cheap : scene, hooks, plan);
  const bool has_chosen = choose_as_flown(cheap ? *cheap : scene, hooks, plan);
  if (cheap) {
    cheap->formulation = scene.formulation, cheap->integrator = scene.integrator;
    cheap->integrator_tolerance = scene.integrator_tolerance;
    scene = *std::move(cheap);
  }
  if (has_chosen && !given.error_budget) warn_of_tones(given, scene, hooks);
  return has_chosen;
}

/// Of drives that move faster vibrations than those of the candidates: no budget shows them.
void Planner::warn_of_tones(const Scene& given, Scene& chosen, const RunHooks& hooks) const {
  try {
    require_drives_shown(with_candidates(given, candidates_, candidates_, hooks), DriveSpectra(given), hooks);
  } catch (const InputError& e) {
    chosen.warnings.push_back(fmt::format("the modes may be too few, and the error budget is off: {}", e.what()));
  }
}

bool Planner::choose_as_flown(Scene& scene, const RunHooks& hooks, std::vector<std::string>& plan) {
  Scene given = scene;
  bool has_chosen = false, was_far = false;
  std::vector<std::string> words;
  // The budget shows what the candidates leave out, unless that is clear before. Without it they are enough where fewer
  // of them are.
  for (int step = 0;; ++step) {
    Scene other = given;
    words.clear();
    const std::optional<Choice> choice = choose_among_candidates(other, hooks, words);
    plan.insert(plan.end(), words.begin(), words.end());
    if (!choice) break;
    scene = std::move(other), has_chosen = true;
    given.integrator_tolerance = scene.integrator_tolerance;
    const bool is_enough = choice->needed < (given.error_budget ? nearly_all : 1);
    const double error = choice->error_of_fewer / scene.tolerance;
    const double after_a_look = was_far ? 1 : not_near, allowed = step == 0 ? first_near : after_a_look;
    hopeless_ = given.error_budget && !is_enough && error > allowed;
    was_far = error > not_near;  // a second look must show that more of them help
    if (is_enough || hooks.stopped()) return true;
    if (step == most_doublings || costly_ || hopeless_ || 2 * candidates_ > most_candidates) break;
    candidates_ *= 2;
    plan.push_back(
        fmt::format("modes: {:.0f} % of those that move are needed; they are chosen again, from {} of each body",
                    100 * choice->needed, candidates_));
  }
  if (given.error_budget) return has_chosen;
  scene.warnings.push_back(
      fmt::format("the modes may be too few for {:.1e}: all of the {} of each body that move are needed, and the error "
                  "budget is off",
                  scene.tolerance, chosen_from_));
  return has_chosen;
}

std::optional<Planner::Choice> Planner::choose_among_candidates(Scene& scene, const RunHooks& hooks,
                                                                std::vector<std::string>& plan) {
  Scene open, all;
  const std::optional<Run> reference = with_all(scene, hooks, open, all, plan);
  if (!reference) return {};
  chosen_from_ = candidates_;
  const OutputTable wanted = without_coordinates(reference->outputs);
  const OutputFloors floors = floors_of(scene, reference->bodies);
  const std::vector<Candidate> list = ranked(all, *reference);
  note_still(list);
  const auto moving_by = [&](double share) {
    return static_cast<size_t>(std::ranges::count_if(
        list, [&](const Candidate& c) { return c.displacement > share * list.front().displacement; }));
  };
  const size_t moved = moving_by(unmoved);
  std::vector<double> displacements;
  for (size_t k = 0; k < moved; ++k) displacements.push_back(list[k].displacement);
  const double bearable = scene.tolerance / 3;
  FewestEnough search(std::move(displacements), bearable, too_few_, moving_by(scene.tolerance / 10));
  const auto error_of = [&](const Scene& tried) {
    try {
      Run run = fly(tried, hooks, 0, bearable_steps(*reference));
      const double e = largest(compare_outputs(without_coordinates(run.outputs), wanted, scene.outputs, floors));
      if (e <= bearable) keep_flown(tried, std::move(run), hooks), give_up_ahead(hooks);
      return e;
    } catch (const NumericalError&) {
      return unknown;
    }
  };
  while (!search.is_settled() && !hooks.stopped()) {
    if (const size_t after = search.after_too_few(); after > search.next() && after < search.enough())
      fly_ahead(with_first(all, list, after), hooks, 0, bearable_steps(*reference));
    search.tell(error_of(with_first(all, list, search.next())));
  }
  give_up_ahead(hooks);
  kept_ = search.enough();
  const Scene best = with_first(all, list, kept_);
  const size_t most = most_of_whole(all);
  FewestEnough of_whole(std::vector<double>(most, 1.0), bearable, too_few_of_whole_, 2);
  while (!of_whole.is_settled() && !hooks.stopped())
    of_whole.tell(error_of(with_first_of_whole(best, of_whole.next())));
  kept_of_whole_ = of_whole.enough();
  const Scene chosen = with_first_of_whole(with_first(open, list, kept_), kept_of_whole_);
  for (const size_t i : open_) {
    const BodyScene& b = scene.bodies[i] = chosen.bodies[i];
    plan.push_back(has_choice(all, b.name) ? words_of_choice(b.name, list, moved, search.error())
                                           : words_of_whole(b, all.bodies[i].modes, of_whole.error()));
  }
  const auto needed = [](size_t kept, size_t of) {
    return of > 0 ? static_cast<double>(kept) / static_cast<double>(of) : 0;
  };
  const Choice free{needed(kept_, moved), search.error_of_fewer()},
      whole{needed(kept_of_whole_, most), of_whole.error_of_fewer()};
  return whole.needed > free.needed ? whole : free;
}

std::string Planner::words_of_choice(const std::string& body, const std::vector<Candidate>& list, size_t moved,
                                     double error) const {
  std::vector<std::string> taken, small, still;
  for (size_t k = 0; k < list.size(); ++k)
    if (list[k].body == body) (k < kept_ ? taken : k < moved ? small : still).push_back(list[k].kind);
  const auto known_still = still_.find(body);  // by earlier candidates, where these have none of the kind
  const bool fewer_kinds = known_still != still_.end() && std::ranges::none_of(list, [&](const Candidate& c) {
                             return c.body == body && known_still->second.contains(c.kind);
                           });
  return fmt::format(
      "modes of {}: {}, of {} modes; left out: {} that nothing moves, {} that change the outputs by {:.1e} together "
      "with those of all bodies{}",
      body, counted(taken), taken.size() + small.size() + still.size(), counted(still), counted(small), error,
      fewer_kinds ? fmt::format("; no more of {}, which nothing moved", fmt::join(known_still->second, ", ")) : "");
}

/// A force that is there at once, when a run begins, moves the effective masses of all modes: what is left out of it
/// falls as 1 / n, whatever happens later. Can no number of candidates make it small enough?
bool Planner::is_hopeless_front(const OutputErrors& o, double tolerance) const {
  return o.name.ends_with(".force") && o.when == 0 && o.truncation > most_candidates / candidates_ * tolerance;
}

const OutputErrors* Planner::worst_to_mend(const Scene& scene, const ErrorBudget& budget,
                                           std::vector<std::string>& plan) const {
  const auto is_front = [&](const OutputErrors& o) { return is_hopeless_front(o, scene.tolerance); };
  const OutputErrors* worst = nullptr;
  for (const OutputErrors& o : budget.outputs)
    if (!is_front(o) && (worst == nullptr || o.known() > worst->known())) worst = &o;
  const bool is_met = worst == nullptr || worst->known() <= scene.tolerance;
  if (const auto front = std::ranges::find_if(budget.outputs, is_front); is_met && front != budget.outputs.end())
    plan.push_back(
        fmt::format("truncation: {:.1e} in {}; more modes are not tried: it is there at the start, and falls as 1 / n",
                    front->truncation, front->name));
  return is_met ? nullptr : worst;
}

bool Planner::improve(Scene& scene, const ErrorBudget& budget, const RunHooks& hooks, std::vector<std::string>& plan) {
  if (open_.empty()) return false;
  if (budget.has_stiffened) still_.clear();  // geometric stiffness couples kinds
  const OutputErrors* worst = worst_to_mend(scene, budget, plan);
  if (worst == nullptr || !budget.measured || budget.within(scene.tolerance) || hooks.stopped() ||
      steps_++ >= most_rounds)
    return false;
  const auto known = [](double part) { return std::isnan(part) ? 0 : part; };
  const double truncation = known(worst->truncation), discretisation = known(worst->discretisation);
  // A repeat has an error of time of its own. Where those are large, what is no more than both is no truncation.
  const double time = known(worst->time), of_both = time > scene.tolerance / 3 ? 2 * time : time;
  const double others = std::max(of_both, known(worst->linearisation));
  if (std::max(truncation, discretisation) <= others) return false;
  return truncation >= discretisation ? choose_from_more(scene, *worst, budget.reach, hooks, plan)
                                      : take_finer_elements(scene, *worst, plan);
}

bool Planner::choose_from_more(Scene& scene, const OutputErrors& worst, const Reach& reach, const RunHooks& hooks,
                               std::vector<std::string>& plan) {
  const double before = std::exchange(truncation_, worst.truncation);
  const bool is_far = truncation_ > before / 2 && truncation_ > not_near * scene.tolerance;
  const bool stays = truncation_ > 0.9 * before;  // what more modes cannot mend: a direction that is left out
  const std::string_view why = costly_                          ? "flights with more take too many steps"
                               : hopeless_                      ? "nearly all are needed, and one fewer is far too few"
                               : is_far                         ? "it falls too slowly"
                               : stays                          ? "more modes do not change it"
                               : candidates_ >= most_candidates ? "there are as many as are tried"
                                                                : "";
  if (!why.empty()) {
    plan.push_back(
        fmt::format("truncation: {:.1e} in {}; more modes are not tried: {} (modes = n takes as many as wanted)",
                    worst.truncation, worst.name, why));
    return false;
  }
  candidates_ = std::min(candidates_ + candidates_ / 2, most_candidates);
  note_shown(scene, reach, hooks);
  too_few_ = kept_ + 1, too_few_of_whole_ = kept_of_whole_ + 1;
  plan.push_back(fmt::format("truncation: {:.1e} in {}; modes are chosen again, from {} of each body", worst.truncation,
                             worst.name, candidates_));
  const Scene fewer = scene;
  for (const size_t i : open_) scene.bodies[i].modes_auto = true;
  const bool has_chosen = choose(scene, hooks, plan) && !hooks.stopped();
  if (!has_chosen) scene = fewer;
  return has_chosen;
}

bool Planner::take_finer_elements(Scene& scene, const OutputErrors& worst, std::vector<std::string>& plan) {
  const double before = std::exchange(discretisation_, worst.discretisation);
  if (worst.discretisation > before / 2) {
    plan.push_back(fmt::format("discretisation: {:.1e} in {}; finer elements are not tried: they hardly change it",
                               worst.discretisation, worst.name));
    return false;
  }
  Scene better = scene;
  for (const size_t i : open_) {
    BodyScene& b = better.bodies[i];
    if (b.structure == "beam") b.geometry = refined(b.geometry, 2);
    if (b.structure != "solid") continue;
    const auto finer = refined(chosen(b.geometry, b.solid), 1);
    if (!finer) return false;
    b.solid = *finer;
    if (!is_bearable(mesh_of(b, 1))) return false;  // the budget takes a step more
  }
  scene = std::move(better);
  plan.push_back(fmt::format("discretisation: {:.1e} in {}; finer elements", worst.discretisation, worst.name));
  return true;
}

}  // namespace flexboom
