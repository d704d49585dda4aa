#include "apps/base/toml_words.hpp"
#include "apps/base/usage.hpp"
#include "apps/commands/commands.hpp"
#include "apps/commands/terminal_line.hpp"
#include "apps/results/report.hpp"
#include "apps/results/results_folder.hpp"
#include "apps/scene/scene_keys.hpp"
#include "dynamics/methods/integrator.hpp"
#include "fem/base/check.hpp"
#include "fem/base/files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <cmath>
#include <csignal>
#include <sstream>
#include <string_view>
#include <vector>

namespace flexboom {

namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may only touch lock-free atomics");

extern "C" void on_interrupt(int) { interrupted.store(true, std::memory_order_relaxed); }

/// Ctrl-C, a request to end, and a terminal that closes end the integration in order while one of these lives; a second
/// one kills. Under nohup a closed terminal is still no reason to end.
class InterruptGuard {
 public:
  InterruptGuard() {
    struct sigaction action = {};
    action.sa_handler = on_interrupt;
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    for (size_t i = 0; i < signals.size(); ++i) {
      sigaction(signals[i], &action, &before_[i]);
      if (signals[i] == SIGHUP && before_[i].sa_handler == SIG_IGN) sigaction(SIGHUP, &before_[i], nullptr);
    }
  }
  ~InterruptGuard() {
    for (size_t i = 0; i < signals.size(); ++i) sigaction(signals[i], &before_[i], nullptr);
  }
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

 private:
  static constexpr std::array signals = {SIGINT, SIGTERM, SIGHUP};
  std::array<struct sigaction, signals.size()> before_ = {};
};

/// Percent, simulated and wall time, and time left of one integration. A plan and an error budget take many; nobody
/// knows how many.
class RunProgress {
 public:
  explicit RunProgress(bool wanted) : line_(wanted) {}

  void operator()(double time, double duration) {
    if (time < time_ || flights_ == 0) {
      ++flights_;
      start_ = line_.seconds(), first_ = time;
    }
    time_ = time;
    if (time == first_ || !line_.is_due()) return;
    const double wall = line_.seconds() - start_;
    std::string text =
        fmt::format("{:.0f} %  {:.3g} of {:.3g} s simulated in {:.1f} s, {:.3g} s left", 100 * time / duration, time,
                    duration, wall, wall * (duration - time) / (time - first_));
    if (flights_ > 1) text = fmt::format("flight {} ({:.0f} s):  {}", flights_, line_.seconds(), text);
    line_.show(text);
  }

 private:
  TerminalLine line_;
  int flights_ = 0;
  double first_ = 0, time_ = 0;  // simulated, of the first call of this flight and of the last one [s]
  double start_ = 0;             // of this flight [s]
};

void override_modes(Scene& scene, const std::string& text) {
  int n = 0;
  if (text != "auto") {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), n);
    require_usage(error == std::errc() && end == text.data() + text.size() && n >= 0,
                  fmt::format("--modes: '{}' is neither a number of modes nor auto", text));
  }
  require(std::any_of(scene.bodies.begin(), scene.bodies.end(), [](const BodyScene& b) { return b.is_boom(); }),
          "--modes: this scene has no boom made from its geometry");
  for (BodyScene& b : scene.bodies) {
    if (!b.is_boom()) continue;
    b.modes_auto = text == "auto";
    b.shapes.clear();
    if (!b.modes_auto) b.modes = n;
  }
}

/// Keys of a body that say something else than a plan, whose values replace them: beside its modes.
std::vector<std::string_view> replaced_keys(const BodyScene& b, const BodyScene& planned) {
  std::vector<std::string_view> keys;
  if (b.directions_given && b.directions != planned.directions) keys.emplace_back("directions");
  if (!b.basis.corrections.empty() && b.basis.corrections != planned.basis.corrections)
    keys.emplace_back("corrections");
  if (const int usual = BeamGeometry{}.order; b.geometry.order != usual && b.geometry.order != planned.geometry.order)
    keys.emplace_back("order");
  return keys;
}

/// The modes, elements and stiffening of a plan, but for a stiffening that the body is given.
void take_model(BodyScene& b, const BodyScene& planned) {
  b.modes = planned.modes, b.shapes = planned.shapes, b.directions = planned.directions;
  b.modes_auto = planned.modes_auto, b.directions_given = planned.directions_given;
  b.basis.corrections = planned.basis.corrections;
  if (b.basis.name != planned.basis.name) b.basis = planned.basis;
  b.solid = planned.solid, b.geometry.order = planned.geometry.order;
  if (b.stiffening == "auto") b.stiffening = planned.stiffening;
  if (b.geometry.segments.size() != planned.geometry.segments.size()) return;
  for (size_t i = 0; i < b.geometry.segments.size(); ++i)
    b.geometry.segments[i].elements = planned.geometry.segments[i].elements;
}

/// Are their modes, wanted in equal numbers from equal elements, others?
bool have_other_modes(BodyScene a, const BodyScene& b) {
  take_model(a, b);
  a.stiffening = b.stiffening, a.backend = b.backend;
  a.damping = b.damping, a.other_damping = b.other_damping;
  return to_toml(a) != to_toml(b);
}

/// Bodies get the modes, elements and stiffening that they have in another scene of the same bodies. The integrator
/// gets the tolerance that it has there.
void take_plan(Scene& scene, const std::filesystem::path& from) {
  const Scene planned = load_scene((std::filesystem::is_directory(from) ? from / "scene.toml" : from).string());
  if (planned.step_tolerance() < scene.tolerance) scene.integrator_tolerance = planned.step_tolerance();
  for (BodyScene& b : scene.bodies) {
    if (!b.is_boom() || !b.is_flexible()) continue;  // what is said to be rigid takes no modes
    const auto p = std::ranges::find(planned.bodies, b.name, &BodyScene::name);
    if (p == planned.bodies.end() || !p->is_boom()) {
      std::vector<std::string_view> names;
      for (const BodyScene& other : planned.bodies)
        if (other.is_boom()) names.push_back(other.name);
      throw InputError(fmt::format("--plan: {} has no boom \"{}\"; {}it has \"{}\"", from.string(), b.name,
                                   toml_reader::question(b.name, names), fmt::join(names, "\", \"")));
    }
    require(
        b.basis.name == p->basis.name || !b.basis_given,
        fmt::format("--plan: body {} has the basis \"{}\" here and \"{}\" in {}, whose modes are others; drop --plan",
                    b.name, b.basis.name, p->basis.name, from.string()));
    require(
        p->structure != "rigid",
        fmt::format("--plan: body {} is rigid in {}, which has no modes for it; drop --plan", b.name, from.string()));
    const std::vector<std::string_view> replaced = replaced_keys(b, *p);
    if (!replaced.empty())
      scene.warnings.push_back(fmt::format("--plan: body {} has {} as in {}, not as the scene says", b.name,
                                           fmt::join(replaced, ", "), from.string()));
    take_model(b, *p);
    if (have_other_modes(b, *p))
      scene.warnings.push_back(fmt::format(
          "--plan: body {} is another one in {}: its modes are chosen by their places in the order of frequencies, "
          "which may be other modes here; an error budget shows what that costs, and without --plan they are chosen "
          "anew",
          b.name, from.string()));
  }
}

/// Did the run of this folder end, killed or failed, before it had a first state?
bool never_flew(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "summary.json";
  if (!std::filesystem::exists(file) || std::filesystem::exists(folder / "state.toml")) return false;
  const nlohmann::json document = nlohmann::json::parse(file_bytes(file), nullptr, false);
  if (!document.is_object() || !document.contains("status")) return false;
  return document["status"] == "running" || document["status"] == "failed";
}

/// The integrator is as much tighter than the accuracy as that of the run in a folder was.
void take_digits(Scene& scene, const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "scene.toml";
  if (!std::filesystem::exists(file)) return;
  scene.limit_digits_share(load_scene(file.string()).digits_share());
}

/// The numbers of a saved state mean the same where bodies and joints are the same. @throws InputError where a joint
/// has another kind.
void warn_of_changes(Scene& scene, const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "scene.toml";
  if (!std::filesystem::exists(file)) return;
  const Scene before = load_scene(file.string());
  const auto warn = [&](std::string_view what, const std::string& name) {
    scene.warnings.push_back(
        fmt::format("--continue: {} {} is another one in {}: it goes on from the numbers of that one", what, name,
                    folder.string()));
  };
  for (const BodyScene& b : scene.bodies) {
    const auto p = std::ranges::find(before.bodies, b.name, &BodyScene::name);
    if (!b.is_boom() || !b.is_elastic() || p == before.bodies.end()) continue;
    BodyScene same = *p;
    same.basis.motion = b.basis.motion;  // that of the state comes with it
    if (have_other_modes(same, b)) warn("body", b.name);
  }
  const auto is_same = [](const PlaceScene& a, const PlaceScene& b) {
    return a.body == b.body && a.marker == b.marker && a.point.isApprox(b.point) && a.axes().isApprox(b.axes());
  };
  for (const JointScene& j : scene.joints) {
    const auto p = std::ranges::find(before.joints, j.name, &JointScene::name);
    if (p == before.joints.end()) continue;
    require(p->kind == j.kind, fmt::format("--continue: joint {} is a {} in {}, and a {} here", j.name,
                                           joint_type(p->kind).name, folder.string(), joint_type(j.kind).name));
    if (!is_same(p->a, j.a) || !is_same(p->b, j.b)) warn("joint", j.name);
  }
}

/// The scene begins with a saved state, whose modes and static shapes replace those of the scene unless they are asked
/// for.
void go_on(Scene& scene, const RunArguments& a, bool quiet) {
  const std::filesystem::path& from = a.from;
  if (never_flew(from)) {
    if (!quiet)
      print_note(fmt::format("--continue: the run in {} ended before its motion began; this one begins at 0 s",
                             from.string()));
    return;
  }
  auto saved = std::make_shared<const SavedState>(SavedState::read(from, a.force));
  require(saved->time() < scene.duration,
          fmt::format("--continue: {} is of t = {:g} s, the run ends at {:g} s; --duration is the time at the end",
                      saved->file().string(), saved->time(), scene.duration));
  for (BodyScene& b : scene.bodies) {
    const auto modes = saved->modes().find(b.name);
    const bool planned = std::exchange(b.modes_auto, false);
    if ((!planned && a.modes.has_value()) || !b.is_elastic() || modes == saved->modes().end()) continue;
    b.modes = modes->second;
    if (planned) b.open_directions();
    const auto shapes = saved->shapes().find(b.name);
    b.shapes = shapes == saved->shapes().end() ? std::vector<int>() : shapes->second;
    if (const auto statics = saved->corrections().find(b.name); statics != saved->corrections().end())
      b.basis.corrections = statics->second;
  }
  take_digits(scene, from);
  warn_of_changes(scene, from);
  scene.from = std::move(saved);
}

Scene scene_of(const RunArguments& a, bool quiet) {
  Scene scene = load_scene(a.scene);
  const std::filesystem::path file = a.scene;
  scene.bodies_kept_in = builtin_scene(a.scene) != nullptr ? std::filesystem::path("results") / "bodies"
                                                           : file.parent_path() / (file.stem().string() + "-bodies");
  if (a.duration) scene.duration = *a.duration;
  if (a.tolerance) scene.tolerance = *a.tolerance;
  if (a.output_step) scene.output_step = *a.output_step;
  if (a.vtu_step) scene.vtu_step = *a.vtu_step;
  if (a.integrator) scene.integrator = *a.integrator;
  if (a.formulation) scene.formulation = *a.formulation;
  if (!a.plan.empty()) take_plan(scene, a.plan);
  if (a.modes) override_modes(scene, *a.modes);
  if (a.structure)
    for (BodyScene& b : scene.bodies)
      if (b.is_boom()) b.structure = *a.structure;
  if (a.no_budget) scene.error_budget = false;
  scene.verify = a.verify;
  if (a.loads) ask_for_loads(scene);
  if (!a.from.empty()) go_on(scene, a, quiet);
  validate(scene);
  return scene;
}

/// What reference runs say, and what was estimated of the same outputs.
void print_checks(const RunResult& r) {
  for (const ReferenceCheck& c : r.checks) {
    if (!c.missing.empty()) {
      fmt::print("verify, {}: no reference: {}\n", c.what, c.missing);
      continue;
    }
    const auto worst = std::ranges::max_element(c.differences, {}, &OutputDifference::error);
    if (worst != c.differences.end())
      fmt::print("verify, {} ({}): differs by {:.1e} in {} at t = {:.6g} s\n", c.what, c.method, worst->error,
                 worst->name, worst->time);
  }
}

void print_summary(const RunResult& r, const std::filesystem::path& folder) {
  const IntegrationSummary& s = r.motion.summary;
  const double simulated = r.motion.time.back() - r.motion.time.front();
  for (const std::string& line : r.plan) fmt::print("{}\n", line);
  fmt::print("\n{:g} s in {:.3f} s ({:.0f} times real time): {} steps, {} evaluations, {} events\n", simulated,
             r.integrate_seconds, simulated / std::max(r.integrate_seconds, 1e-9), s.steps, s.rhs_evaluations,
             r.motion.events.size());
  fmt::print("{} (relative)\n", balances(s));
  if (r.budget.measured)
    fmt::print("errors of the outputs: discretisation {}, truncation {}, time {}, linearisation {}; total {}\n",
               error_text(r.budget.discretisation), error_text(r.budget.truncation), error_text(r.budget.time),
               error_text(r.budget.linearisation), error_text(r.budget.total()));
  if (r.budget.measured && r.budget.worst() != nullptr)
    fmt::print("worst output: {}\n", description(*r.budget.worst()));
  print_checks(r);
  fmt::print("results: {}\n", folder.string());
}

/// The line is gone again before anything else is printed.
RunResult run_with_progress(const Scene& scene, bool wanted, double checkpoint_every, ResultsFolder& results) {
  RunProgress progress(wanted);
  return run_scene(scene, {&interrupted, [&progress](double t, double T) { progress(t, T); }, checkpoint_every},
                   [&results](const RunResult& so_far, size_t first) { results.add(so_far, first); });
}

void write_report(const std::filesystem::path& folder) {
  write_file(folder / "report.html", report_html(folder));
  write_file(folder / "overview.svg", overview_svg(folder));
}

/// Of a run that failed: as much as there is.
void try_to_report(const std::filesystem::path& folder) {
  try {
    write_report(folder);
  } catch (const std::exception&) {  // it has no rows yet
  }
}

/// The run and its files; a run that fails leaves what it came to.
RunResult run_into(ResultsFolder& results, const Scene& scene, const RunArguments& a, const CommonOptions& common) {
  try {
    RunResult r = run_with_progress(scene, !common.quiet && !common.json, a.checkpoint, results);
    results.write(r);
    if (a.report) write_report(results.path());
    return r;
  } catch (const InputError& e) {
    results.refuse(e.what());
    throw;
  } catch (const std::exception& e) {
    results.fail(e.what());
    if (a.report) try_to_report(results.path());
    throw;
  }
}

/// Faults of a scene or body as the document of `check --json`; the error itself goes its usual way.
void print_faults(const std::string& text) {
  nlohmann::ordered_json faults = nlohmann::ordered_json::array();
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) faults.push_back(line);
  fmt::print("{}\n", nlohmann::ordered_json{{"ok", false}, {"faults", faults}}.dump(2));
}

/// What `check` says of a file without faults.
nlohmann::ordered_json checked(const std::string& name) {
  if (is_body_file(name)) {
    const BodyScene body = read_body(name);
    std::vector<std::string> warnings;
    warn_of_body(body, warnings);
    return {{"body", body.name}, {"warnings", warnings}, {"ok", true}};
  }
  const Scene scene = load_scene(name);
  const bool certified = std::ranges::all_of(scene.bodies, [](const BodyScene& b) {
    return !b.reduced || std::ranges::all_of(b.reduced->certificate, &BodyCheck::passed);
  });
  return {{"scene", scene.name},           {"bodies", scene.bodies.size()}, {"hinges", scene.hinges.size()},
          {"joints", scene.joints.size()}, {"warnings", scene.warnings},    {"ok", certified}};
}

}  // namespace

int run_command(const RunArguments& a, const CommonOptions& common) {
  require(!std::isnan(a.checkpoint), "--checkpoint: is not a number of seconds");
  const Scene scene = scene_of(a, common.quiet);
  const std::filesystem::path folder = common.out.empty() ? std::filesystem::path("results") / scene.name : common.out;
  ResultsFolder results(folder, scene, builtin_scene(a.scene) ? "" : a.scene);
  const InterruptGuard guard;
  const RunResult result = run_into(results, scene, a, common);
  const IntegrationSummary& s = result.motion.summary;
  const std::string wrong =
      is_balanced(s) ? ""
                     : fmt::format("{}: the motion in {}, or its energies, are wrong", balances(s), folder.string());
  if (!wrong.empty()) results.fail(wrong);
  if (common.json) {
    fmt::print("{}\n", results.summary().dump(2));
  } else if (!common.quiet) {
    print_summary(result, folder);
    if (a.report) fmt::print("report: {}\n", (folder / "report.html").string());
  }
  if (!common.quiet)
    for (const std::string& w : result.warnings) print_note("warning: " + w);
  if (!wrong.empty()) throw NumericalError(wrong);
  if (!interrupted.load()) return exit_ok;
  if (!common.quiet)
    print_note(
        s.interrupted
            ? fmt::format("interrupted at t = {:g} s; what was computed is in {}", result.end.time, folder.string())
            : fmt::format("interrupted after the run, which is whole, in {}; its errors may not have been measured",
                          folder.string()));
  return exit_interrupted;
}

int check_command(const std::string& name, const CommonOptions& common) {
  try {
    const nlohmann::ordered_json found = checked(name);
    if (common.json) {
      fmt::print("{}\n", found.dump(2));
    } else if (!common.quiet) {
      for (const auto& w : found["warnings"]) print_note("warning: " + w.get<std::string>());
      const bool tree = found.value("joints", 0) > 0;
      if (found.contains("scene"))
        fmt::print("{}: {} bodies, {} {}: {}\n", found["scene"].get<std::string>(), found["bodies"].get<int>(),
                   found[tree ? "joints" : "hinges"].get<int>(), tree ? "joints" : "hinges",
                   found["ok"].get<bool>() ? "no faults" : "a body fails its own checks");
      else
        fmt::print("{}: no faults\n", found["body"].get<std::string>());
    }
    if (!found["ok"].get<bool>()) return exit_check_failed;
  } catch (const InputError& e) {
    if (common.json) print_faults(e.what());
    throw;
  }
  return exit_ok;
}

int report_command(const std::filesystem::path& folder, const CommonOptions& common) {
  const std::filesystem::path file = (common.out.empty() ? folder : common.out) / "report.html";
  if (!common.out.empty()) prepare_folder(common.out);
  write_file(file, report_html(folder));
  if (common.json) {
    fmt::print("{}\n", nlohmann::ordered_json{{"report", file.string()}}.dump(2));
  } else if (!common.quiet) {
    fmt::print("report: {}\n", file.string());
  }
  return exit_ok;
}

}  // namespace flexboom
