// Both formulations refuse the same, in the same words.

#include "dynamics/model/multibody_check.hpp"
#include "dynamics/model/hub_with_booms.hpp"
#include "dynamics/redundant/multipliers.hpp"
#include "dynamics/relative/tree.hpp"
#include "fem/base/check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

namespace flexboom {
namespace {

/// Two rigid bodies on hinges, with everything that may be wrong.
Multibody arm() {
  Multibody scene;
  for (const char* name : {"upper", "fore"})
    scene.bodies.push_back(rigid_body(name, 1, {0.5, 0, 0}, Eigen::Vector3d(0.1, 0.4, 0.4).asDiagonal()));
  for (int i = 0; i < 2; ++i) {
    Joint joint;
    joint.name = i == 0 ? "shoulder" : "elbow";
    joint.a.body = i - 1;
    if (i == 1) joint.a.position = {1, 0, 0};
    joint.b.body = i;
    joint.mechanism = {1, 0, 0.1, 10, 0.5};
    scene.joints.push_back(joint);
  }
  SpringDamper spring;
  spring.name = "tether";
  spring.a.body = 0, spring.b.body = 1;
  spring.stiffness = 1;
  scene.springs.push_back(spring);
  Load load;
  load.name = "push";
  load.at.body = 1;
  scene.loads.push_back(load);
  ReactionWheel wheel;
  wheel.name = "wheel";
  wheel.inertia = 0.01;
  wheel.torque = [](double) { return 0.0; };
  scene.wheels.push_back(wheel);
  return scene;
}

template <class Make>
std::string message(const Make& make) {
  try {
    make();
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

TEST(MultibodyCheck, BothFormulationsRefuseTheSame) {
  const double nan = std::nan("");
  const struct {
    std::function<void(Multibody&)> spoil;
    const char* words;
  } cases[] = {
      {[](Multibody& s) { s.joints[1].mechanism.stop_stiffness = -1; },
       "joint elbow: stiffness, damping and stop stiffness"},
      {[](Multibody& s) { s.joints[0].mechanism.stiffness = -1; },
       "joint shoulder: stiffness, damping and stop stiffness"},
      {[](Multibody& s) { s.joints[0].mechanism.damping = -1; },
       "joint shoulder: stiffness, damping and stop stiffness"},
      {[=](Multibody& s) { s.joints[0].mechanism.stop_stiffness = nan; },
       "joint shoulder: stiffness, damping and stop"},
      {[=](Multibody& s) { s.joints[0].mechanism.threshold = nan; }, "joint shoulder: rest and threshold"},
      {[](Multibody& s) { s.joints[0].kind = JointKind::fixed; }, "joint shoulder: a fixed joint has no mechanism"},
      {[](Multibody& s) { s.joints[0].a.axes(0, 0) += 1e-11; }, "joint shoulder, place a: the columns of its axes"},
      {[](Multibody& s) { s.joints[1].b.axes.col(2) *= -1; }, "joint elbow, place b: the columns of its axes"},
      {[=](Multibody& s) { s.joints[1].b.position.x() = nan; }, "joint elbow, place b: its position is not finite"},
      {[](Multibody& s) { s.joints[0].a.marker = "m"; }, "joint shoulder, place a: the inertial frame has no marker"},
      {[](Multibody& s) { s.joints[0].b.body = 7; }, "joint shoulder, place b: there is no body 7"},
      {[](Multibody& s) { s.joints[0].prescribed.resize(2); }, "joint shoulder: motion can be prescribed"},
      {[](Multibody& s) {
         const auto zero = [](double) { return 0.0; };
         s.joints[0].prescribed = {{zero, zero, zero}};
       },
       "joint shoulder: it has a stop beside a prescribed motion"},
      {[](Multibody& s) {
         s.joints[0].kind = JointKind::spherical, s.joints[0].mechanism = {0, 0, 0, 0, 0};
         s.joints[0].law.friction = FrictionLaw{1, 1};
       },
       "joint shoulder: friction a spherical joint has none"},
      {[](Multibody& s) {
         s.joints[0].law.spring = {{0, 1}, {0}};
       },
       "joint shoulder: spring has 2 places and 1 loads"},
      {[](Multibody& s) { s.springs[0].free_length = -1; }, "spring tether: stiffness, damping and free length"},
      {[](Multibody& s) { s.springs[0].b.axes(0, 0) = 2; }, "spring tether, place b: the columns of its axes"},
      {[](Multibody& s) { s.loads[0].at.body = -1; }, "load push: it acts on the inertial frame"},
      {[](Multibody& s) { s.wheels[0].inertia = 0; }, "wheel wheel: its inertia 0 must be positive"},
      {[](Multibody& s) { s.wheels[0].axis *= 1 + 1e-11; }, "wheel wheel: its axis must be a unit vector"},
      {[](Multibody& s) { s.wheels[0].body = 2; }, "wheel wheel: there is no body 2"},
      {[=](Multibody& s) { s.gravity.z() = nan; }, "the gravity is not finite"},
  };
  EXPECT_EQ(message([] { Tree{arm()}; }), "");
  EXPECT_EQ(message([] { Multipliers{arm()}; }), "");
  for (const auto& c : cases) {
    Multibody bad = arm();
    c.spoil(bad);
    const std::string by_tree = message([&] { Tree{bad}; }), by_multipliers = message([&] { Multipliers{bad}; });
    EXPECT_NE(by_tree.find(c.words), std::string::npos) << c.words << "\n" << by_tree;
    EXPECT_EQ(by_multipliers, by_tree);
  }
}

// A hub's hinges have the same springs and stops.
TEST(MultibodyCheck, OfAHubAsWell) {
  Hinge hinge;
  hinge.name = "boom";
  hinge.mechanism.stop_stiffness = -1;
  const ReducedBody body = rigid_body("boom", 1, {0.5, 0, 0}, Eigen::Vector3d(0.1, 0.4, 0.4).asDiagonal());
  EXPECT_NE(message([&] {
              Tree{hub_with_booms(body, {{body, hinge}})};
            }).find("joint boom: stiffness, damping and stop stiffness"),
            std::string::npos);
}

}  // namespace
}  // namespace flexboom
