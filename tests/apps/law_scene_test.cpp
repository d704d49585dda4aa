// Scenes whose joints have laws: keys, runs in both formulations, with everything else that a scene may have.

#include "apps/accuracy/error_budget.hpp"
#include "apps/results/results.hpp"
#include "apps/scene/scene.hpp"
#include "apps/scene/scene_law.hpp"
#include "run_testing.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace flexboom {
namespace {

const std::vector<std::string> laws = {
    "friction = { coulomb = 0.1, breakaway = 0.15 }",
    "lower_stop = { at = -0.2, restitution = 0.5 }\nupper_stop = { at = 0.45, restitution = 0.3 }",
    "latch = { at = 0.35, rate = 3.0 }",
    "backlash = 0.05\npreload = 0.02",
    "lower_stop = { at = -0.1, stiffness = 150.0, damping = 0.3 }\nupper_stop = { at = 0.4, stiffness = 150.0, damping "
    "= 0.3 }",
    "spring = { at = [-1.0, 0.0, 0.4, 1.0], load = [0.5, 0.3, 0.0, -0.5] }\ndamper = { rate = [-1.0, 0.0, 0.5, 1.0], "
    "load = "
    "[0.1, 0.0, -0.05, -0.3] }",
};

/// A satellite with a flexible panel, hinged by a law.
std::string scene_text(const std::string& law, const std::string& more = "", const std::string& settings = "") {
  return fmt::format(R"(format = "flexboom-scene-1"
name = "law"
duration = 1.2
output_step = 0.05
{}
[accuracy]
tolerance = 1e-9
budget = false
[[bodies]]
name = "hub"
mass = 20.0
inertia = [2.0, 2.5, 3.0]
[[bodies]]
name = "panel"
modes = 2
stiffening = "on"
damping = {{ rule = "modal", value = 0.01 }}
[[bodies.segments]]
shape = "rectangle"
height = 0.02
width = 0.3
length = 1.2
material = {{ E = 5e9, nu = 0.3, rho = 150 }}
[[joints]]
name = "flight"
kind = "free"
b = {{ body = "hub" }}
start_omega = [0.02, -0.01, 0.3]
[[joints]]
name = "hinge"
kind = "hinge"
a = {{ body = "hub", point = [0.3, 0.0, 0.0] }}
b = {{ body = "panel", marker = "root" }}
stiffness = 2.0
rest = 0.3
damping = 0.02
start = -0.09
loads = true
{}
{}
)",
                     settings, law, more);
}

RunResult run(const std::string& text, const std::string& formulation = "relative") {
  Scene scene = parse_scene(text, "law.toml");
  scene.formulation = formulation;
  return run_scene(scene, {});
}

void expect_same(const RunResult& a, const RunResult& b, double tolerance = 1e-6) {
  EXPECT_EQ(event_rows(a, 0).size() > 0, event_rows(b, 0).size() > 0);
  ASSERT_EQ(a.motion.events.size(), b.motion.events.size()) << event_rows(a, 0) << event_rows(b, 0);
  for (size_t i = 0; i < a.motion.events.size(); ++i) {
    EXPECT_EQ(event_name(a.motion.events[i]), event_name(b.motion.events[i]));
    EXPECT_NEAR(a.motion.events[i].time, b.motion.events[i].time, tolerance);
  }
  for (const OutputDifference& d : compare_outputs(a.outputs, b.outputs, {})) {
    if (!d.name.starts_with("energy") && !d.name.ends_with("force") && !d.name.ends_with("torque") &&
        !d.name.ends_with("position") && !d.name.ends_with("velocity")) {
      EXPECT_LT(d.error, 100 * tolerance) << d.name;
    }
  }
  EXPECT_LT(a.motion.summary.energy_balance, 1e-7);
  EXPECT_LT(b.motion.summary.energy_balance, 1e-7);
  ASSERT_TRUE(a.ledger && b.ledger);
  for (size_t k = 0; k < law_losses.size(); ++k)
    EXPECT_NEAR(a.ledger->ledger.laws[k], b.ledger->ledger.laws[k], tolerance);
}

TEST(LawScene, ReadsBackWhatItWrites) {
  for (const std::string& law : laws) {
    const std::string once = to_toml(parse_scene(scene_text(law), "law.toml"));
    EXPECT_EQ(to_toml(parse_scene(once, "again.toml")), once);
    for (const std::string& key : {law.substr(0, law.find(' '))}) EXPECT_NE(once.find(key + " = "), std::string::npos);
  }
}

TEST(LawScene, StiffenedPanelsFlyTheSameInBothFormulations) {
  for (const std::string& law : laws) {
    SCOPED_TRACE(law);
    expect_same(run(scene_text(law)), run(scene_text(law), "multipliers"));
  }
}

TEST(LawScene, GoWithOrbitAndWheels) {
  for (const std::string& law : laws) {
    SCOPED_TRACE(law);
    const std::string text =
        scene_text(law,
                   "[[wheels]]\nname = \"wheel\"\nbody = \"hub\"\ninertia = 0.05\nspin = 20.0\n"
                   "torque = \"0.1*sin(3*t)\"\n[orbit]\naltitude = 4e5\ngravity = \"differential\"");
    expect_same(run(text), run(text, "multipliers"), 1e-5);
  }
}

TEST(LawScene, GoOnFromTheStateOfAnEarlierRun) {
  for (const std::string& law : laws)
    for (const char* formulation : {"relative", "multipliers"}) {
      SCOPED_TRACE(law + formulation);
      Scene scene = parse_scene(scene_text(law), "law.toml");
      scene.formulation = formulation;
      const RunResult whole = run_scene(scene, {});
      Scene half = scene;
      half.duration = 0.6;
      const RunResult first = run_scene(half, {}), second = run_scene(going_on(scene, first), {});
      EXPECT_EQ(first.motion.events.size() + second.motion.events.size(), whole.motion.events.size());
      EXPECT_NEAR(column(second, "hinge.angle").tail(1)[0], column(whole, "hinge.angle").tail(1)[0], 1e-6);
      for (size_t k = 0; k < law_losses.size(); ++k)
        EXPECT_NEAR(second.ledger->ledger.laws[k], whole.ledger->ledger.laws[k], 1e-6);
    }
}

// Friction, a rigid stop with restitution and a latch: rebounds that a coarse tolerance leaves out shift the latch.
TEST(LawScene, ALatchingPanelIsAsGoodAsItsTolerance) {
  const auto flown = [](const std::string& method, double tolerance) {
    Scene scene = load_scene("latching-panel");
    scene.error_budget = false;
    scene.integrator = method, scene.tolerance = tolerance;
    return run_scene(scene, {}).outputs;
  };
  const OutputTable reference = flown("adams", 1e-10);
  for (const char* method : {"adams", "erk"}) {
    for (const double tolerance : {1e-5, 1e-7})
      EXPECT_LT(largest(compare_outputs(without_coordinates(flown(method, tolerance)), without_coordinates(reference),
                                        {"hinge.angle", "hinge.rate"})),
                30 * tolerance)
          << method << tolerance;
  }
}

/// A rigid hub that floats.
std::string on_a_free_hub(const std::string& settings) {
  return "format = \"flexboom-scene-1\"\nname = \"free\"\n" + settings + R"(
[accuracy]
tolerance = 1e-9
budget = false
[[bodies]]
name = "hub"
mass = 20.0
inertia = [3.0, 2.0, 4.0]
[[joints]]
name = "flight"
kind = "free"
b = { body = "hub" }
)";
}

// Two panels that are pressed onto their rigid stops of a light hub, and rattle there. What one does last moves the
// other.
TEST(LawScene, TwoJointsComeToRestAtTheirStopsTogether) {
  std::string text = on_a_free_hub("duration = 0.01\noutput_step = 0.001");
  for (const auto& [panel, side] : {std::pair("p", 1), std::pair("q", -1)})
    text += fmt::format(R"([[bodies]]
name = "{0}"
modes = 2
damping = {{ rule = "modal", value = 0.01 }}
segments = [{{ shape = "rectangle", height = 0.01, width = 0.2, length = 1.0, material = {{ E = 7e9, nu = 0.33, rho = 700 }} }}]
[[joints]]
name = "hinge_{0}"
kind = "hinge"
a = {{ body = "hub", point = [{1}, 0.0, 0.0], x = [{2}, 0.0, 0.0], z = [0.0, 0.0, 1.0] }}
b = {{ body = "{0}", marker = "root" }}
start = 1.3
start_rate = 0.5
preload = -0.1
upper_stop = {{ at = 1.3, restitution = 0.5 }}
friction = {{ coulomb = 0.02, breakaway = 0.04 }}
)",
                        panel, 0.3 * side, side);
  const auto events = [&](const char* formulation, double tolerance) {
    Scene scene = parse_scene(text, "rattle.toml");
    scene.formulation = formulation;
    scene.tolerance = tolerance;
    std::string r;
    for (const StopEvent& e : run_scene(scene, {}).motion.events) r += fmt::format("{} {}\n", e.joint, event_name(e));
    return r;
  };
  const std::string seen = events("relative", 1e-8);
  EXPECT_LT(std::ranges::count(seen, '\n'), 100) << seen;
  EXPECT_TRUE(seen.ends_with("rest\n")) << seen;
  EXPECT_EQ(events("multipliers", 1e-8), seen);
  const std::string more = events("relative", 1e-10);  // smaller bounces
  EXPECT_LT(std::ranges::count(more, '\n'), 100) << more;
  EXPECT_GT(more.size(), seen.size());
}

TEST(LawScene, AStartOnAPadIsNoEvent) {
  for (const double rate : {-0.3, 0.0})
    for (const double preload : {-0.3, 0.3}) {
      const std::string text = on_a_free_hub("duration = 1.0\noutput_step = 0.05") + fmt::format(R"([[bodies]]
name = "panel"
mass = 2.0
inertia = [0.01, 0.2, 0.2]
centre = [0.5, 0.0, 0.0]
[[joints]]
name = "hinge"
kind = "hinge"
a = {{ body = "hub", point = [0.3, 0.0, 0.0] }}
b = {{ body = "panel" }}
start = -0.1
start_rate = {}
preload = {}
lower_stop = {{ at = -0.1, stiffness = 50.0, damping = 1.0 }}
)",
                                                                                                 rate, preload);
      SCOPED_TRACE(fmt::format("rate {}, preload {}", rate, preload));
      const auto times = [&](const char* formulation) {
        std::vector<double> r;
        for (const StopEvent& e : run(text, formulation).motion.events) r.push_back(e.time);
        return r;
      };
      const std::vector<double> seen = times("relative"), by_multipliers = times("multipliers");
      EXPECT_EQ(seen.empty(), rate == 0);  // pressed onto it, or off it for good
      ASSERT_EQ(seen.size(), by_multipliers.size());
      for (size_t i = 0; i < seen.size(); ++i) {
        EXPECT_GT(seen[i], 1e-3);
        EXPECT_NEAR(seen[i], by_multipliers[i], 1e-8);
      }
    }
}

// The energy of a preload at the rest of its spring is round-off of the place times the preload.
TEST(LawScene, APreloadSetsOffFromRest) {
  const std::string text = R"(format = "flexboom-scene-1"
name = "preload"
duration = 0.2
output_step = 0.02
[accuracy]
tolerance = 1e-7
budget = false
[[bodies]]
name = "boom"
modes = 2
segments = [{ shape = "rectangle", height = 0.01, width = 0.2, length = 1.0, material = { E = 7e9, nu = 0.33, rho = 700 } }]
[[bodies]]
name = "hub"
mass = 20.0
inertia = [3.0, 2.0, 4.0]
[[joints]]
name = "turn"
kind = "hinge"
b = { body = "hub" }
[[joints]]
name = "slide"
kind = "slider"
a = { body = "hub", point = [0.3, 0.0, 0.0], x = [0.0, 1.0, 0.0], z = [1.0, 0.0, 0.0] }
b = { body = "boom", marker = "root" }
start = 0.05
rest = 0.05
stiffness = 40.0
preload = 0.2
)";
  const OutputTable by_tree = run(text).outputs, by_multipliers = run(text, "multipliers").outputs;
  const auto length = std::ranges::find(by_tree.names, "slide.length") - by_tree.names.begin();
  EXPECT_GT(by_tree.values.col(length).maxCoeff(), 0.051);
  EXPECT_LT((by_tree.values.col(length) - by_multipliers.values.col(length)).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(LawScene, SummaryTellsWhereTheEnergyWent) {
  const RunResult r = run(scene_text(laws[0]));
  const auto energy = summary_json(r, 0)["energy"];
  double sum = energy["kinetic"].get<double>() - energy["work"].get<double>();
  for (const char* where : {"stored", "lost"})
    for (const auto& [source, value] : energy[where].items()) sum += value.get<double>();
  const double start = column(r, "energy.kinetic")[0] + column(r, "energy.elastic")[0];
  EXPECT_NEAR(sum, start, 1e-8 * start);
  EXPECT_GT(energy["lost"]["friction"].get<double>(), 1e-3);
}

// What holds a joint that sticks is sought along the motion: not beyond the end, where an orbit with J2 is not known.
TEST(LawScene, StictionAtTheEndOfAnOrbitWithJ2) {
  for (const char* integrator : {"adams", "bdf", "dirk", "erk"}) {
    Scene scene =
        parse_scene(scene_text("friction = { coulomb = 100 }", "[orbit]\naltitude = 400e3\nJ2 = true\n"), "law.toml");
    scene.duration = 0.5;
    scene.integrator = integrator;
    const RunResult r = run_scene(scene, {});
    EXPECT_EQ(r.motion.time.back(), 0.5) << integrator;
    const Eigen::VectorXd angle = column(r, "hinge.angle");
    EXPECT_LT((angle.array() - angle[0]).abs().maxCoeff(), 1e-9) << integrator;
  }
}

TEST(LawScene, HingesOfAHubHaveThemToo) {
  const auto with = [](const std::string& law) {
    std::string text = builtin_scene("sport");
    const size_t hinge = text.find("[[hinges]]") + 11;
    return parse_scene(text.insert(hinge, law + "\n"), "sport.toml");
  };
  const Scene scene = with("friction = { coulomb = 1e-5 }");
  EXPECT_TRUE(scene.is_tree);
  EXPECT_EQ(scene.joints[1].law.friction->breakaway, 1e-5);
  EXPECT_FALSE(load_scene("sport").is_tree);
}

std::string law_fault(const std::string& law, const std::string& kind = "hinge") {
  std::string text = scene_text(law);
  if (kind != "hinge") {
    text.replace(text.find("kind = \"hinge\""), 14, "kind = \"" + kind + "\"");
    for (const char* key : {"stiffness = 2.0\n", "rest = 0.3\n", "damping = 0.02\n", "start = -0.09\n"})
      text.erase(text.find(key), std::string(key).size());
  }
  try {
    parse_scene(text, "law.toml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(LawScene, BadCombinationsAreErrors) {
  const std::vector<std::vector<std::string>> table = {
      {"upper_stop = { at = 1.0, restitution = 0.5, stiffness = 3.0 }", "upper_stop.restitution", "rigid or a pad"},
      {"upper_stop = { at = 1.0, restitution = 1.5 }", "upper_stop.restitution", "from 0 to 1"},
      {"upper_stop = { at = 1.0 }", "upper_stop", "needs a stiffness"},
      {"upper_stop = { at = 1.0, stiffness = -3.0 }", "upper_stop.stiffness", "zero or positive"},
      {"upper_stop = { at = -1.0, restitution = 0.5 }", "upper_stop.at", "starts beyond"},
      {"upper_stop = { at = 1.0, stiffness = 3.0 }\nstop_stiffness = 2.0", "upper_stop", "beside stop_stiffness"},
      {"upper_stop = { at = 1.0, stiffness = 3.0 }\nlower_stop = { at = 1.0, stiffness = 3.0 }", "lower_stop.at",
       "below"},
      {"upper_stop = { at = 1.0, stiffness = 3.0 }\nlatch = { at = 1.1, rate = 0.1 }", "latch.at", "between the stops"},
      {"latch = { at = 1.1, rate = 0.0 }", "latch.rate", "positive"},
      {"latch = { at = 1.1 }", "latch.rate", "missing"},
      {"friction = { coulomb = 0.2, breakaway = 0.1 }", "friction.breakaway", "less than coulomb"},
      {"friction = { coulomb = -0.2 }", "friction.coulomb", "zero or positive"},
      {"friction = { coulomb = 0.2, static = 0.3 }", "friction.static", "unknown"},
      {"backlash = -0.1", "backlash", "zero or positive"},
      {"spring = { at = [0.0, 1.0], load = [1.0] }", "spring", "one load for each"},
      {"spring = { at = [0.0], load = [1.0] }", "spring", "needs two"},
      {"spring = { at = [1.0, 0.0], load = [1.0, 0.0] }", "spring", "ascend"},
      {"damper = { rate = [-1.0, 1.0], load = [-1.0, 1.0] }", "damper", "drives"},
      {"damper = { rate = [-1.0, 1.0], load = [1.0, -0.5] }", "damper", "at rest"},
      {"friction = { coulomb = 0.2 }\nmotion = \"t\"", "friction", "beside motion"},
  };
  for (const auto& row : table) {
    const std::string fault = law_fault(row[0]);
    EXPECT_NE(fault.find("joints[1]." + row[1]), std::string::npos) << row[0] << "\n" << fault;
    EXPECT_NE(fault.find(row[2]), std::string::npos) << row[0] << "\n" << fault;
    EXPECT_NE(fault.find("law.toml:"), std::string::npos) << fault;
  }
  try {
    parse_scene(scene_text("preload = 1.0", "", "[integrator]\nmethod = \"exponential\""), "law.toml");
    ADD_FAILURE() << "no fault";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("simulates no laws"), std::string::npos) << error.what();
  }
  EXPECT_NE(law_fault("preload = 1.0", "spherical").find("hinges and sliders have"), std::string::npos);
  EXPECT_NE(law_fault("backlash = 0.1", "slider").find("needs a stiffness"), std::string::npos);
}

TEST(LawScene, StateTextReadsBack) {
  LawState s{LawState::Motion::held, -1, true, true, {1, 0, 1}, {1, 0, 0}, {}};
  EXPECT_EQ(law_state_of(law_state_text(s)), s);
  for (const char* bad : {"", "held", "moves - - - - - -", "held - - - 1 - -", "held - - - 2 1 -"})
    EXPECT_THROW(law_state_of(bad), InputError) << bad;
}

/// A rigid body on a skew hinge of a hub that turns: the hinge's rate is the difference of rates, with their round-off.
Scene on_a_turning_hub(double start, const std::string& law) {
  return parse_scene(fmt::format(R"(format = "flexboom-scene-1"
name = "turning"
duration = 0.3
output_step = 0.02
[accuracy]
tolerance = 1e-8
budget = false
[[bodies]]
name = "hub"
mass = 20.0
inertia = [2.0, 3.0, 4.0]
[[bodies]]
name = "p"
mass = 2.0
inertia = [0.2, 0.3, 0.3]
[[joints]]
name = "f"
kind = "free"
b = {{ body = "hub" }}
start_omega = [0.3, -0.7, 0.5]
[[joints]]
name = "j"
kind = "hinge"
a = {{ body = "hub", point = [0.3, 0.2, 0.0], x = [0.6, 0.0, -0.8], z = [0.8, 0.0, 0.6] }}
b = {{ body = "p" }}
start = {}
preload = 0.8
{}
)",
                                 start, law),
                     "turning.toml");
}

TEST(LawScene, WhatIsHeldAtTheStartStays) {
  for (const double start : {-0.123, 0.0, 0.3, 0.7, 1.1, -2.0}) {
    const std::string stop = fmt::format("upper_stop = {{ at = {}, restitution = 0.5 }}", start);
    for (const std::string& law : {std::string("friction = { coulomb = 0.05, breakaway = 5.0 }"), stop}) {
      Scene scene = on_a_turning_hub(start, law);
      for (const char* formulation : {"relative", "multipliers"}) {
        scene.formulation = formulation;
        const RunResult r = run_scene(scene, {});
        const Eigen::VectorXd angle = column(r, "j.angle");
        EXPECT_LT((angle.array() - start).abs().maxCoeff(), 1e-12) << start << " " << law << " " << formulation;
        EXPECT_TRUE(r.motion.events.empty()) << start << " " << law << " " << formulation;
      }
    }
  }
}

}  // namespace
}  // namespace flexboom
