#include "apps/bench/transient.hpp"

#include "apps/accuracy/output_errors.hpp"
#include "apps/accuracy/variants.hpp"
#include "apps/simulate/simulate.hpp"
#include "fem/base/check.hpp"
#include "fem/base/stopwatch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace flexboom {
namespace {

struct Case {
  std::string name;
  Scene scene;
  std::string reference;  // method
};

Scene sport(int modes, double duration) {
  Scene scene = load_scene("sport");
  scene.duration = duration;
  for (BodyScene& b : scene.bodies) b.structure = "eq14", b.modes = modes, b.modes_auto = false, b.shapes.clear();
  return scene;
}

std::vector<Case> cases(const std::vector<std::string>& scenes) {
  if (!scenes.empty()) {
    std::vector<Case> list;
    list.reserve(scenes.size());
    for (const std::string& name : scenes) {
      list.push_back({name, load_scene(name), "bdf"});
    }
    return list;
  }
  std::vector<Case> list{{"sport", sport(2, 10), "bdf"},
                         {"sport, 8 modes", sport(8, 2), "bdf"},
                         {"sport, undamped", sport(2, 0.5), "adams"},
                         {"sport, tumbling", sport(2, 5), "bdf"}};
  for (BodyScene& b : list[2].scene.bodies) b.damping = {};
  for (HingeScene& h : list[2].scene.hinges) h.hinge.mechanism.damping = 0;
  list[3].scene.start_rate = {0.3, -0.2, 0.5};
  return list;
}

constexpr const char* by_multipliers = "ida";

/// Those that fly the scene: of relative coordinates, then that of multipliers, which alone closes loops.
std::vector<std::string> methods_of(const Scene& scene) {
  const bool laws = std::ranges::any_of(scene.joints, [](const JointScene& j) { return j.law.given(); });
  std::vector<std::string> names;
  if (std::ranges::none_of(scene.joints, &JointScene::closes_loop))
    for (const IntegratorMethod& m : integrator_methods())
      if (m.make != nullptr || !laws) names.emplace_back(m.name);  // what splits the equations knows no laws
  names.emplace_back(by_multipliers);
  return names;
}

class TransientLadder {
 public:
  TransientLadder(double longest, const std::function<void(const TransientBench&)>& seen)
      : longest_(longest), seen_(seen) {}

  std::vector<TransientBench> run(const std::vector<std::string>& scenes) {
    for (const Case& c : cases(scenes)) {
      references_.clear();
      for (const std::string& method : methods_of(c.scene)) ladder(c, method);
    }
    return std::move(rows_);
  }

 private:
  void ladder(const Case& c, const std::string& method) {
    double reference = 0;  // its tolerance
    for (int digits = 2; digits <= 9; ++digits) {
      const double tolerance = std::pow(10.0, -digits);
      if (!(tolerance > 9 * reference)) return;  // it is no better
      TransientBench row = measured(c, method, tolerance);
      reference = row.reference;
      rows_.push_back(row);
      seen_(row);
      if (2 * row.seconds > longest_ || !row.failure.empty()) return;
    }
  }

  static Run fly(const Case& c, const std::string& method, double tolerance, long max_steps = 0) {
    Scene scene = c.scene;
    scene.integrator = method;
    scene.formulation = method == by_multipliers ? "multipliers" : "relative";
    scene.tolerance = tolerance;
    return run_once(scene, {}, 0, max_steps);
  }

  struct Reference {
    OutputTable outputs;
    double tolerance = 0;
    std::string failure{};  // why there is none
  };

  /// By the tightest tolerance from 1e-11 on that does not drown in round-off.
  static Reference fly_tightly(const Case& c, const std::string& method) {
    constexpr double tightest = 1e-11, tight = 1e-8;
    try {
      const Run run = fly(c, method, tight);
      for (double tolerance = tightest; tolerance < tight / 5; tolerance *= 10) {
        try {
          return {fly(c, method, tolerance, bearable_steps(run)).outputs, tolerance};
        } catch (const NumericalError&) {  // the next one may do
        }
      }
      return {run.outputs, tight};
    } catch (const NumericalError& e) {
      return {.outputs = {}, .failure = e.what()};
    }
  }

  /// By a method that is not judged, where there is another that does not fail. @throws NumericalError.
  const Reference& reference(const Case& c, const std::string& judged) {
    std::vector<std::string> methods = methods_of(c.scene);
    std::stable_partition(methods.begin(), methods.end(), [&](const std::string& m) { return m == c.reference; });
    if (methods.size() > 1) std::erase(methods, judged);
    for (const std::string& method : methods) {
      const auto [place, is_new] = references_.try_emplace(method);
      if (is_new) place->second = fly_tightly(c, method);
      if (place->second.failure.empty()) return place->second;
    }
    throw NumericalError("there is no reference: " + references_.at(methods.front()).failure);
  }

  TransientBench measured(const Case& c, const std::string& method, double tolerance) {
    TransientBench row;
    row.scene = c.name;
    row.method = method;
    row.tolerance = tolerance;
    row.simulated = c.scene.duration;
    try {
      const Reference& other = reference(c, method);
      const OutputTable& exact = other.outputs;
      row.reference = other.tolerance;
      row.seconds = std::numeric_limits<double>::infinity();
      const Stopwatch all;
      Run r;
      for (int run = 0; run < 5 && (run == 0 || all.seconds() < 0.5); ++run) {
        r = fly(c, method, tolerance);
        row.seconds = std::min(row.seconds, r.motion.summary.seconds);
      }
      const OutputFloors floors = floors_of(c.scene, r.bodies);  // what symmetry makes zero is round-off
      row.error = largest(compare_outputs(r.outputs, exact, {}, floors));
      const std::vector<OutputDifference> hub = compare_outputs(r.outputs, exact, {"hub.rotation"}, floors);
      row.hub_error = hub.empty() ? std::numeric_limits<double>::quiet_NaN() : largest(hub);
      row.energy = r.motion.summary.energy_balance;
      row.steps = r.motion.summary.steps;
      row.evaluations = r.motion.summary.rhs_evaluations;
      row.events = static_cast<long>(r.motion.events.size());
    } catch (const NumericalError& e) {
      row.seconds = 0;
      row.failure = e.what();
    }
    return row;
  }

  double longest_;
  const std::function<void(const TransientBench&)>& seen_;
  std::map<std::string, Reference> references_;
  std::vector<TransientBench> rows_;
};

}  // namespace

std::vector<TransientBench> bench_transient(const std::vector<std::string>& scenes, double longest,
                                            const std::function<void(const TransientBench&)>& seen) {
  return TransientLadder(longest, seen).run(scenes);
}

}  // namespace flexboom
