// Contacts of one scene, whatever flies it and however it is written.

#include "apps/simulate/tree_flight.hpp"
#include "tests/apps/run_testing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <initializer_list>

namespace flexboom {
namespace {

using Eigen::VectorXd;

/// A built-in scene of a hub with hinged booms, with what only a tree has beside it: shorthand is written out then.
Scene written_out(const std::string& name) {
  std::string text = builtin_scene(name);
  if (const size_t orbit = text.find("[orbit]"); orbit != std::string::npos)
    text.erase(orbit, text.find("\n[", orbit) - orbit);
  text.insert(text.find("\n["), "\ngravity = [0, 0, 0]\n");
  Scene scene = parse_scene(text, name);
  scene.integrator = "bdf";
  return scene;
}

TEST(Contacts, SportWrittenOutFliesAsTheSceneOfItsHub) {
  Scene scene = scene_named("sport");
  scene.duration = 1;
  scene.tolerance = 1e-9;
  Scene joined = written_out("sport");
  joined.duration = scene.duration, joined.tolerance = scene.tolerance;
  for (Scene* either : {&scene, &joined})
    for (BodyScene& b : either->bodies)
      if (b.is_boom()) b.stiffening = "off";
  const RunResult hub = run_scene(scene, {}), tree = run_scene(joined, {});
  for (const char* name : {"hub.rotation.x", "hub.rotation.z", "hub.position.y", "sip.angle", "sip.rate", "slp.angle",
                           "sip.q1", "efield_plus.tip.y", "energy.kinetic", "energy.dissipated"}) {
    const VectorXd a = column(hub, name), b = column(tree, name);
    EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-6 * a.cwiseAbs().maxCoeff()) << name;  // two methods at 1e-9
  }
  ASSERT_GT(hub.motion.events.size(), 5u);
  ASSERT_GE(tree.motion.events.size(), 5u);
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(tree.motion.events[i].time, hub.motion.events[i].time, 1e-8) << i;
    EXPECT_EQ(tree.motion.events[i].contact, hub.motion.events[i].contact) << i;
  }
}

/// Joints and kinds of all contacts are the same, whatever flew the scene, and the times of those faster than a
/// hundredth of the fastest: what a method leaves open of a gap moves a slow contact in proportion to 1 / rate.
void expect_same_contacts(const RunResult& a, const RunResult& b, const std::string& what) {
  const auto names = [](const RunResult& r) {
    if (r.scene.is_tree) return joint_names(r.scene);
    std::vector<std::string> of_joints = {"hub"};
    for (const HingeScene& h : r.scene.hinges) of_joints.push_back(h.body);
    return of_joints;
  };
  const std::vector<std::string> of_a = names(a), of_b = names(b);
  const auto &one = a.motion.events, &two = b.motion.events;
  EXPECT_EQ(one.size(), two.size()) << what;
  double worst = 0, fastest = 0;
  for (const StopEvent& e : one) fastest = std::max(fastest, std::abs(e.rate));
  for (size_t i = 0; i < std::min(one.size(), two.size()); ++i) {
    const bool same = of_a[static_cast<size_t>(one[i].joint)] == of_b[static_cast<size_t>(two[i].joint)] &&
                      one[i].contact == two[i].contact;
    ASSERT_TRUE(same) << what << ", contact " << i << " at " << one[i].time << " and " << two[i].time;
    if (std::abs(one[i].rate) > 0.01 * fastest) worst = std::max(worst, std::abs(one[i].time - two[i].time));
  }
  EXPECT_LT(worst, 1e-9) << what;
  std::printf("contacts, %s: %zu and %zu, %.1e s apart\n", what.c_str(), one.size(), two.size(), worst);
}

/// The contacts of `first` by other methods.
void expect_same_by(std::initializer_list<const char*> methods, Scene scene, const RunResult& first) {
  for (const char* method : methods) {
    scene.integrator = method;
    expect_same_contacts(first, run_scene(scene, {}), scene.name + " by " + method);
  }
}

Scene precise(const std::string& name) {
  Scene scene = scene_named(name);
  scene.tolerance = 1e-10, scene.integrator_tolerance = 0;
  return scene;
}

TEST(SlowContacts, OfSportAreTheSameByEveryMethodAndFormulation) {
  Scene scene = precise("sport");
  scene.duration = 4;
  const RunResult first = run_scene(scene, {});
  ASSERT_GT(first.motion.events.size(), 10u);
  expect_same_by({"bdf", "adams", "dirk"}, scene, first);
  scene.integrator = "auto", scene.formulation = "multipliers";
  expect_same_contacts(first, run_scene(scene, {}), "multipliers");
  Scene joined = written_out("sport");
  joined.duration = scene.duration, joined.tolerance = scene.tolerance;
  joined.error_budget = false, joined.integrator = "exponential";
  expect_same_contacts(first, run_scene(joined, {}), "written out");
}

TEST(SlowContacts, OfPanelsThatUnfoldAreTheSameByEveryMethod) {
  const Scene scene = precise("wing-satellite");
  const RunResult first = run_scene(scene, {});
  ASSERT_EQ(first.motion.events.size(), 12u);
  expect_same_by({"adams", "bdf"}, scene, first);
}

TEST(SlowContacts, OfALatchAreTheSameByEveryMethod) {
  const Scene scene = precise("latching-panel");
  const RunResult first = run_scene(scene, {});
  ASSERT_EQ(first.motion.events.size(), 43u);
  expect_same_by({"bdf", "dirk", "erk"}, scene, first);
}

// Of the boom that leans on its spring in the first of its turns.
TEST(SlowContacts, OfATurnWithWheelsAreTheSameByEveryMethod) {
  Scene scene = precise("sport-calibration");
  scene.duration = 14.9;
  const RunResult first = run_scene(scene, {});
  ASSERT_EQ(first.motion.events.size(), 7u);
  expect_same_by({"adams", "bdf"}, scene, first);
}

}  // namespace
}  // namespace flexboom
