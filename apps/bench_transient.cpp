#include "apps/bench_transient.hpp"

#include "apps/simulate.hpp"
#include "fem/check.hpp"
#include "fem/stopwatch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

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
  for (BodyScene& b : scene.bodies) b.structure = "eq14", b.modes = modes, b.modes_auto = false;
  return scene;
}

std::vector<Case> cases(const std::vector<std::string>& scenes) {
  if (!scenes.empty()) {
    std::vector<Case> list;
    for (const std::string& name : scenes) list.push_back({name, load_scene(name), "bdf"});
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

class Bench {
 public:
  Bench(double longest, const std::function<void(const TransientBench&)>& seen) : longest_(longest), seen_(seen) {}

  std::vector<TransientBench> run(const std::vector<std::string>& scenes) {
    for (const Case& c : cases(scenes)) {
      std::vector<PreparedBody> bodies;
      for (const BodyScene& b : c.scene.bodies) bodies.push_back(prepare_body(b));
      require(c.scene.formulation == "relative",
              fmt::format("scene {}: formulation is \"{}\", but this compares the methods of \"relative\"", c.name,
                          c.scene.formulation));
      const Flyable flyable = make_system(c.scene, bodies);
      references_.clear();
      for (const IntegratorMethod& method : integrator_methods()) ladder(c, flyable, std::string(method.name));
    }
    return std::move(rows_);
  }

 private:
  void ladder(const Case& c, const Flyable& f, const std::string& method) {
    for (int digits = 2; digits <= 9; ++digits) {
      TransientBench row = measured(c, f, method, std::pow(10.0, -digits));
      rows_.push_back(row);
      seen_(row);
      if (2 * row.seconds > longest_ || !row.failure.empty()) return;
    }
  }

  static Trajectory fly(const Case& c, const Flyable& f, const std::string& method, double tolerance) {
    IntegratorOptions o;
    o.method = method;
    o.tolerance = tolerance;
    o.duration = c.scene.duration;
    o.output_step = c.scene.output_step;
    return integrate(f.system, f.y0, o);
  }

  const OutputTable& reference(const Case& c, const Flyable& f, const std::string& judged) {
    const std::string method = judged == c.reference ? "exponential" : c.reference;
    const auto [place, is_new] = references_.try_emplace(method);
    if (is_new) place->second = output_table(c.scene, f.system, fly(c, f, method, 1e-11));
    return place->second;
  }

  TransientBench measured(const Case& c, const Flyable& f, const std::string& method, double tolerance) {
    TransientBench row;
    row.scene = c.name;
    row.method = method;
    row.tolerance = tolerance;
    row.simulated = c.scene.duration;
    try {
      const OutputTable& exact = reference(c, f, method);
      row.seconds = std::numeric_limits<double>::infinity();
      const Stopwatch all;
      Trajectory r;
      for (int run = 0; run < 5 && (run == 0 || all.seconds() < 0.5); ++run) {
        r = fly(c, f, method, tolerance);
        row.seconds = std::min(row.seconds, r.summary.seconds);
      }
      const OutputTable table = output_table(c.scene, f.system, r);
      row.error = largest(compare_outputs(table, exact, {}));
      row.hub_error = largest(compare_outputs(table, exact, {"hub.rotation"}));
      row.energy = r.summary.energy_balance;
      row.steps = r.summary.steps;
      row.evaluations = r.summary.rhs_evaluations;
      row.events = static_cast<long>(r.events.size());
    } catch (const NumericalError& e) {
      row.seconds = 0;
      row.failure = e.what();
    }
    return row;
  }

  double longest_;
  const std::function<void(const TransientBench&)>& seen_;
  std::map<std::string, OutputTable> references_;
  std::vector<TransientBench> rows_;
};

}  // namespace

std::vector<TransientBench> bench_transient(const std::vector<std::string>& scenes, double longest,
                                            const std::function<void(const TransientBench&)>& seen) {
  return Bench(longest, seen).run(scenes);
}

}  // namespace flexboom
