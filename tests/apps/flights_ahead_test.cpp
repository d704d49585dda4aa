// Flights that other cores fly before they are asked for.

#include "apps/simulate/flights_ahead.hpp"

#include "run_testing.hpp"

#include <memory>
#include <thread>

namespace flexboom {
namespace {

class FlightsAheadTest : public ::testing::Test {
 protected:
  FlightsAheadTest() {
    hooks.bodies = &bodies, hooks.ahead = &ahead, hooks.interrupt = &interrupt;
    scene.duration = 2;
  }
  void SetUp() override {
    if (std::thread::hardware_concurrency() < 2) GTEST_SKIP() << "one core flies nothing ahead";
  }

  PreparedBodies bodies;
  std::atomic<bool> interrupt = false;
  FlightsAhead ahead;
  RunHooks hooks;
  Scene scene = scene_named("sport");
};

TEST_F(FlightsAheadTest, AreTheFlightsThatWouldBeFlown) {
  Scene finer = scene, other = scene;
  other.tolerance /= 10;
  fly_ahead(scene, hooks);
  fly_ahead(finer, hooks, 2);
  EXPECT_FALSE(ahead.take(other, hooks));
  EXPECT_FALSE(ahead.take(scene, hooks, 1));
  const auto of_scene = ahead.take(scene, hooks), of_finer = ahead.take(finer, hooks, 2);
  ASSERT_TRUE(of_scene && of_finer);
  RunHooks alone;  // with the same bodies: made anew, their shapes differ by round-off
  alone.bodies = &bodies;
  EXPECT_EQ(of_scene->outputs.values, run_once(scene, alone).outputs.values);
  EXPECT_EQ(of_finer->outputs.values, run_once(finer, alone, 2).outputs.values);
  EXPECT_NE(of_finer->outputs.values, of_scene->outputs.values);
  EXPECT_FALSE(ahead.take(scene, hooks)) << "it is taken once";
}

TEST_F(FlightsAheadTest, WhatWasFlownIsKept) {
  flexboom::Run run = run_once(scene, hooks);
  const Eigen::MatrixXd values = run.outputs.values;
  keep_flown(scene, std::move(run), hooks);
  EXPECT_EQ(fly(scene, hooks, 0, 1).outputs.values, values) << "one step more would be an error";
  EXPECT_THROW(fly(scene, hooks, 0, 1), NumericalError);
}

TEST_F(FlightsAheadTest, FailWhereTheyAreAskedFor) {
  fly_ahead(scene, hooks, 0, 1);
  EXPECT_THROW(fly(scene, hooks), NumericalError);
  EXPECT_NO_THROW(fly(scene, hooks));
}

// It would tumble for minutes.
TEST_F(FlightsAheadTest, EndWhereNobodyWantsThem) {
  scene = scene_named("tumbling");
  scene.duration = 1e7, scene.output_step = 1e5;
  fly_ahead(scene, hooks);
  give_up_ahead(hooks);
  EXPECT_FALSE(ahead.take(scene, hooks));
  fly_ahead(scene, hooks);
  interrupt = true;
  EXPECT_TRUE(fly(scene, hooks).motion.summary.interrupted);
}

// Two bodies of one file have one text: that which the file keeps, and that which it has for error estimates.
TEST_F(FlightsAheadTest, BodiesThatWereReadAreToldApart) {
  const auto read = [this] {
    Scene r = scene;
    BodyScene& b = r.bodies.front();
    b.reduced = std::make_shared<const ReducedBody>(prepared(b, 0, {}, hooks).body);
    return r;
  };
  const Scene one = read(), two = read();
  ASSERT_EQ(to_toml(one), to_toml(two));
  fly_ahead(one, hooks);
  EXPECT_FALSE(ahead.take(two, hooks));
  EXPECT_TRUE(ahead.take(one, hooks));
}

}  // namespace
}  // namespace flexboom
