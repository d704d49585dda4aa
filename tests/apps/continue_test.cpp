// A run that goes on from where another one ended is the same run.

#include "apps/commands/commands.hpp"
#include "tests/apps/run_testing.hpp"
#include "tests/apps/scene_testing.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// The scene until `end`, after `from` if there is one.
RunResult fly(Scene scene, double end, const RunResult* from = nullptr) {
  scene.duration = end;
  return run_scene(from ? going_on(std::move(scene), *from) : scene, {});
}

/// Largest difference of a column at the times of `later`, by its largest value over the whole run.
double difference(const RunResult& whole, const RunResult& later, const std::string& name) {
  const VectorXd t = column(whole, "t"), t_later = column(later, "t");
  const VectorXd a = column(whole, name), b = column(later, name);
  double worst = 0;
  Index compared = 0;
  for (Index i = 0, k = 0; i < t.size(); ++i) {
    while (k < t_later.size() && t_later[k] < t[i] * (1 - 1e-12)) ++k;
    if (k == t_later.size() || std::abs(t_later[k] - t[i]) > 1e-12 * t[i]) continue;
    worst = std::max(worst, std::abs(a[i] - b[k]));
    ++compared;
  }
  EXPECT_GT(compared, 10) << name;
  const double size = a.cwiseAbs().maxCoeff();
  return size > 0 ? worst / size : worst;
}

void expect_same(const RunResult& whole, const RunResult& first, const RunResult& later, double outputs,
                 double event_times) {
  EXPECT_EQ(later.outputs.names, whole.outputs.names);
  for (const std::string& name : whole.outputs.names) {
    if (column(whole, name).cwiseAbs().maxCoeff() < 1e-15) continue;  // round-off of what is zero
    EXPECT_LT(difference(whole, later, name), outputs) << name;
  }
  std::vector<StopEvent> events = first.motion.events;
  events.insert(events.end(), later.motion.events.begin(), later.motion.events.end());
  ASSERT_EQ(events.size(), whole.motion.events.size());
  for (size_t i = 0; i < events.size(); ++i) {
    EXPECT_EQ(events[i].joint, whole.motion.events[i].joint) << i;
    EXPECT_EQ(events[i].contact, whole.motion.events[i].contact) << i;
    EXPECT_NEAR(events[i].time, whole.motion.events[i].time, event_times) << i;
  }
}

class Continue : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Formulations, Continue, testing::Values("relative", "multipliers"),
                         [](const auto& row) { return row.param; });

// Ends between two outputs, in the middle of contacts.
TEST_P(Continue, SportIsTheSameRunInTwoFlights) {
  Scene scene = scene_named("sport");
  scene.formulation = GetParam();
  const bool relative = GetParam() == "relative";
  scene.tolerance = relative ? 1e-9 : 1e-7;
  const RunResult whole = fly(scene, 0.6), first = fly(scene, 0.2137), later = fly(scene, 0.6, &first);
  EXPECT_GE(later.motion.events.size(), 10u);
  EXPECT_EQ(later.motion.time.front(), 0.2137);
  expect_same(whole, first, later, relative ? 1e-8 : 1e-5, relative ? 1e-9 : 1e-6);
  EXPECT_LT(later.motion.summary.energy_balance, relative ? 1e-8 : 1e-5);
}

// A boom's ring after a bounce is over before a long step looks for the first time, and shakes the others all the same.
TEST(GoingOn, AtAnyPhaseOfARing) {
  Scene fine = scene_named("sport-calibration"), coarse = fine;
  fine.tolerance = 1e-9, coarse.tolerance = 1e-6;
  const RunResult whole = fly(fine, 20);
  for (int k = 0; k < 40; ++k) {
    const double end = 15.5 + 0.02 * k;
    const RunResult first = fly(fine, end), later = fly(coarse, 20, &first);
    for (const char* joint : {"efield_plus", "efield_minus", "sip", "slp"})
      EXPECT_LT(difference(whole, later, fmt::format("{}.rate", joint)), 5e-6) << end;
  }
}

TEST_P(Continue, FlexibleBodiesOnJoints) {
  Scene scene = scene_named("flexible-appendage");
  scene.formulation = GetParam();
  scene.tolerance = 1e-8;
  const RunResult whole = fly(scene, 2), first = fly(scene, 1.03), later = fly(scene, 2, &first);
  expect_same(whole, first, later, 1e-5, 0);
}

// Their attitudes do not tell how often they have turned.
TEST(ContinueScene, UniversalJointsKeepTheirTurns) {
  Scene scene = parse_scene(R"toml(format = "flexboom-scene-1"
name = "turns"
duration = 4.0
output_step = 0.1
[accuracy]
tolerance = 1e-8
budget = false
[[bodies]]
name = "rotor"
mass = 1.0
inertia = [0.1, 0.1, 0.2]
[[joints]]
name = "u"
kind = "universal"
b = { body = "rotor" }
start_rate = [2.0, 0.0]
)toml",
                            "turns.toml");
  for (const char* of_first : {"relative", "multipliers"})
    for (const char* of_later : {"relative", "multipliers"}) {
      scene.formulation = of_first;
      const RunResult first = fly(scene, 1.8);
      scene.formulation = of_later;
      const RunResult second = fly(scene, 3, &first), third = fly(scene, 4, &second);
      for (const RunResult* part : {&second, &third}) {
        const VectorXd t = column(*part, "t"), angle = column(*part, "u.angle1");
        EXPECT_LT((angle - 2 * t).cwiseAbs().maxCoeff(), 1e-7) << of_first << " " << of_later;
      }
    }
  scene.joints[0].start = {4, 0}, scene.formulation = "multipliers";
  EXPECT_NEAR(column(fly(scene, 1), "u.angle1")[0], 4, 1e-12);
}

// Round-off of places far from the orbit's reference is that of attitudes, too, where an arm joins two bodies.
TEST(ContinueScene, FarFromTheReferenceOfAnOrbit) {
  Scene scene = parse_scene(R"toml(format = "flexboom-scene-1"
name = "far"
duration = 12000.0
output_step = 100.0
[accuracy]
tolerance = 1e-10
budget = false
[orbit]
altitude = 500e3
eccentricity = 0.3
gravity = "differential"
[[bodies]]
name = "hub"
mass = 120.0
inertia = [20.0, 14.0, 9.0]
[[bodies]]
name = "tip"
mass = 10.0
inertia = [0.1, 0.1, 0.02]
[[joints]]
kind = "free"
b = { body = "hub" }
start_omega = [0.0004, -0.0012, 0.0003]
start_velocity = [0.01, 0.02, -0.03]
[[joints]]
name = "arm"
kind = "fixed"
a = { body = "hub", point = [0.0, 0.0, 3.0] }
b = { body = "tip" }
)toml",
                            "far.toml");
  const RunResult whole = fly(scene, 12000), first = fly(scene, 7000);
  EXPECT_GT(column(first, "hub.position.x").cwiseAbs().maxCoeff(), 100);
  scene.formulation = "multipliers";
  const RunResult later = fly(scene, 12000, &first);
  expect_same(whole, first, later, 1e-7, 0);  // 3e-8 of the work of gravity, 1e-9 of the rest
  EXPECT_LT(later.motion.summary.steps, 30'000);
}

// With few digits, so that booms come to rest on their stops.
TEST(ContinueScene, WhatHasSettledStaysSettled) {
  Scene scene = scene_named("sport");
  scene.tolerance = 1e-2;
  const RunResult whole = fly(scene, 6), first = fly(scene, 4), later = fly(scene, 6, &first);
  int settled = 0;
  for (const StopHistory& stop : first.motion.summary.stops) settled += stop.settled >= 0;
  EXPECT_GT(settled, 0);
  EXPECT_EQ(first.motion.events.size() + later.motion.events.size(), whole.motion.events.size());
  ASSERT_EQ(later.motion.summary.stops.size(), first.motion.summary.stops.size());
  for (size_t i = 0; i < first.motion.summary.stops.size(); ++i)
    EXPECT_GE(later.motion.summary.stops[i].largest_rate, first.motion.summary.stops[i].largest_rate);
}

// Turns are commanded from the start of the scene on, whenever a run begins; nothing moves in the first ten seconds.
TEST_P(Continue, WheelsKeepTurning) {
  Scene scene = scene_named("sport-calibration");
  scene.formulation = GetParam();
  scene.tolerance = 1e-6;
  const RunResult whole = fly(scene, 16), first = fly(scene, 12.25), later = fly(scene, 16, &first);
  EXPECT_GT(column(whole, "sport.rotation.x").cwiseAbs().maxCoeff(), 1e-3);
  for (const char* name : {"sport.rotation.x", "sport.rate.x", "sip.q1", "energy.kinetic", "energy.work"})
    EXPECT_LT(difference(whole, later, name), 1e-3) << name;  // booms that shake by 1e-4 rad, at 1e-6
}

// What is left of a motion that has died is noise. Its balances are those of the whole flight.
TEST_P(Continue, AfterTheMotionHasDied) {
  for (const std::string& text :
       {with(swing_on_hinge, "P2 = 0.02", "P2 = 1"), with(swing_on_joints, "damping = 0.02", "damping = 1")}) {
    Scene scene = parse_scene(text, "dies.toml");
    scene.formulation = GetParam();
    scene.error_budget = false;
    const RunResult first = fly(scene, 20), later = fly(scene, 21, &first), latest = fly(scene, 22, &later);
    const double left = column(later, "energy.kinetic").maxCoeff();
    EXPECT_LT(left, 1e-12 * column(first, "energy.kinetic").maxCoeff());
    for (const RunResult* r : {&later, &latest}) {
      EXPECT_TRUE(is_balanced(r->motion.summary)) << r->motion.summary.energy_balance;
      EXPECT_LE(r->motion.summary.energy_balance, 1e-6);
      EXPECT_LE(r->motion.summary.momentum_drift, 1e-6);
      EXPECT_GE(r->end.largest.energy, first.end.largest.energy);
    }
  }
}

// A turn from rest to rest leaves nothing: no energy is in the dampers, and none in the wheels' work.
TEST_P(Continue, AfterATurnFromRestToRest) {
  Scene scene = parse_scene(R"toml(format = "flexboom-scene-1"
name = "turn"
duration = 4
output_step = 0.05
[[bodies]]
name = "hub"
mass = 8.5
inertia = [0.13, 0.1, 0.06]
[[joints]]
name = "hub"
kind = "free"
b = { body = "hub" }
[[wheels]]
name = "wheel"
body = "hub"
inertia = 0.001
torque = "0.01*sin(pi*t)*(t < 2)"
)toml",
                            "turn.toml");
  scene.formulation = GetParam();
  scene.error_budget = false;
  const RunResult first = fly(scene, 2.5), later = fly(scene, 4, &first);
  EXPECT_TRUE(is_balanced(later.motion.summary)) << later.motion.summary.energy_balance;
  EXPECT_GE(later.end.largest.energy, column(first, "energy.kinetic").maxCoeff());
}

// Nothing has ever moved; and nothing but a shape moves, so that there are no momenta.
TEST_P(Continue, NothingToBalance) {
  for (std::string text : {with(swing_on_hinge, "start_angle = 1.5", "start_angle = 1.5707963267948966"),
                           with(swing_on_joints, "start = 0.07", "start = 0")}) {
    Scene scene = parse_scene(text, "rests.toml");
    scene.formulation = GetParam();
    scene.error_budget = false;
    const RunResult r = fly(scene, 1);
    EXPECT_EQ(r.motion.summary.energy_balance, 0);
    EXPECT_EQ(r.motion.summary.momentum_drift, 0);
  }
}

TEST(ContinueState, NamesEveryNumberOfAnotherScene) {
  const RunResult first = fly(scene_named("sport"), 0.1);
  Scene more = scene_named("sport");
  for (BodyScene& b : more.bodies) b.modes = 3;
  try {
    fly(more, 1, &first);
    FAIL();
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("state.toml:"), std::string::npos) << text;
    EXPECT_NE(text.find("sip.q3"), std::string::npos) << text;
  }
}

TEST(ContinueState, BadFilesAreRefusedWithTheirPlace) {
  const RunResult first = fly(scene_named("sport"), 0.1);
  const std::string good = to_toml(first.end, "sport");
  const std::vector<std::string> names = first.end.names;
  EXPECT_EQ(state_of(good).values(names), first.end.y);  // bit for bit
  EXPECT_EQ(state_of(good).time(), 0.1);
  const auto replaced = [&good](const std::string& key, const std::string& value) {
    const size_t at = good.find(key + " = "), end = good.find('\n', at);
    return good.substr(0, at) + key + " = " + value + good.substr(end);
  };
  const std::pair<std::string, const char*> cases[] = {
      {replaced("format", "\"flexboom-scene-1\""), "state.toml:1:"},
      {replaced("time", "-1.0"), "time: "},
      {replaced("time", "\"late\""), "time: "},
      {replaced("\"sip.gap\"", "nan"), "must be a finite number"},
      {replaced("\"sip.gap\"", "true"), "sip.gap"},
      {replaced("energy", "-1.0"), "largest.energy: must not be negative"},
      {replaced("angular_momentum", "inf"), "largest.angular_momentum: must be a finite number"},
      {replaced("\"sip.gap\"", "0.1\n\"sip.gab\" = 1.0"), "not of this scene: sip.gab"},
      {replaced("\"hub.attitude.w\"", "0.5"), "not of length 1"},
      {good.substr(0, good.find("[state]")), "state"},
      {good.substr(0, good.size() / 2), "state.toml:"},
      {"", "the file is empty"},
  };
  for (const auto& [text, words] : cases) {
    try {
      state_of(text, true).values(names);
      FAIL() << words;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  }
}

// What is promised of a run that is killed.
TEST(Checkpoints, AreTenSecondsApart) { EXPECT_EQ(RunArguments().checkpoint, 10); }

}  // namespace
}  // namespace flexboom
