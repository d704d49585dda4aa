#include "apps/accuracy/output_errors.hpp"

#include "fem/base/check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace flexboom {
namespace {

using Eigen::MatrixXd;

/// Two times; the columns of a hub that turns and of a boom that bends.
OutputTable table(std::vector<std::string> names, std::initializer_list<double> first,
                  std::initializer_list<double> second) {
  OutputTable r;
  r.names = std::move(names);
  r.values.resize(2, std::ssize(r.names));
  Eigen::Index row = 0;
  for (const auto& values : {first, second}) {
    Eigen::Index column = 0;
    for (const double value : values) r.values(row, column++) = value;
    ++row;
  }
  return r;
}

const std::vector<std::string> hub = {"t", "hub.rate.x", "hub.rate.y", "hub.rate.z"};
const std::vector<std::string> boom = {"t", "boom.tip.x", "boom.tip.y", "boom.tip.z"};

OutputDifference only(const std::vector<OutputDifference>& differences) {
  EXPECT_EQ(differences.size(), 1u);
  return differences.at(0);
}

TEST(OutputErrors, AVectorIsOneOutputAndItsWorstTimeIsNamed) {
  const OutputTable a = table(hub, {0, 3, 4e-6, 0}, {1, 1, 0, 2e-6}), b = table(hub, {0, 3, 0, 0}, {1, 1, 0, 0});
  const OutputDifference d = only(compare_outputs(a, b, {}));
  EXPECT_EQ(d.name, "hub.rate");
  EXPECT_EQ(d.scale, 3);
  EXPECT_DOUBLE_EQ(d.error, 4e-6 / 3);
  EXPECT_EQ(d.time, 0);
}

TEST(OutputErrors, AnglesAgainstTheOrbitCountWhereTheyAreNamedAndTurnOnPastHalfATurn) {
  const std::vector<std::string> lvlh = {"t", "lvlh.yaw"};
  const OutputTable a = table(lvlh, {0, 3.14}, {1, 3.1415}), b = table(lvlh, {0, 3.14}, {1, -3.1415});
  EXPECT_TRUE(compare_outputs(a, b, {}).empty());
  EXPECT_NEAR(only(compare_outputs(a, b, {"lvlh.yaw"})).error, 2 * (std::numbers::pi - 3.1415) / 3.1415, 1e-12);
}

TEST(OutputErrors, WhatNoSymmetryMovesHasTheRoundOffOfTheScene) {
  const OutputTable a = table(boom, {0, 0, 5e-15, 0}, {1, 0, -4e-15, 0}),
                    b = table(boom, {0, 0, 0, 0}, {1, 0, 1e-15, 0});
  EXPECT_GT(only(compare_outputs(a, b, {})).error, 1);  // 500 %, of nothing
  EXPECT_LT(only(compare_outputs(a, b, {}, {.tolerance = 1e-6, .length = 2})).error, 1e-6);
  // Another output of its unit may be larger than the scene is long.
  std::vector<std::string> names = boom;
  names.emplace_back("hub.position.x");
  const OutputTable far_a = table(names, {0, 0, 5e-9, 0, 1e6}, {1, 0, 0, 0, 1e6});
  const OutputTable far_b = table(names, {0, 0, 0, 0, 1e6}, {1, 0, 0, 0, 1e6});
  EXPECT_LT(largest(compare_outputs(far_a, far_b, {}, {.tolerance = 1e-6, .length = 2})), 1e-6);
  const OutputTable near_a = table(names, {0, 0, 5e-9, 0, 1}, {1, 0, 0, 0, 1});
  const OutputTable near_b = table(names, {0, 0, 0, 0, 1}, {1, 0, 0, 0, 1});
  EXPECT_GT(largest(compare_outputs(near_a, near_b, {}, {.tolerance = 1e-6, .length = 2})), 1e-3);
}

// Bodies that are alike do not cancel to the last digit where their coordinates are nearly dependent.
TEST(OutputErrors, WhatIsZeroInBothRunsHasNoError) {
  const auto error = [](double size) {
    const OutputTable a = table(boom, {0, 0, size, 0}, {1, 0, -size, 0}), b = table(boom, {0, 0, 0, 0}, {1, 0, 0, 0});
    return only(compare_outputs(a, b, {}, {.tolerance = 1e-6, .length = 2})).error;
  };
  EXPECT_LT(error(1e-11), 1e-6);
  EXPECT_GT(error(3e-11), 1e-3);  // no zero any more
}

// An axial pulse turns nothing: what a rate then is comes from forces that cancel, not from other rates.
TEST(OutputErrors, RatesHaveTheRoundOffOfTheEnergy) {
  const std::vector<std::string> names = {"t", "hub.rate.z", "energy.kinetic"};
  const OutputTable a = table(names, {0, 2e-14, 8}, {1, 0, 8}), b = table(names, {0, 0, 8}, {1, 1e-14, 8});
  EXPECT_GT(only(compare_outputs(a, b, {}, {.tolerance = 1e-6, .length = 2})).error, 0.1);
  EXPECT_LT(only(compare_outputs(a, b, {}, {.tolerance = 1e-6, .length = 2, .inertia = 1})).error, 1e-6);
}

TEST(OutputErrors, AbsoluteErrorsOfAUnitDoNotCount) {
  const OutputTable a = table(hub, {0, 1e-9, 0, 0}, {1, 1e-9, 0, 0}), b = table(hub, {0, 2e-9, 0, 0}, {1, 2e-9, 0, 0});
  EXPECT_DOUBLE_EQ(only(compare_outputs(a, b, {})).error, 0.5);
  const auto with = [&](const char* text) {
    return only(compare_outputs(a, b, {}, {.tolerance = 1e-3, .absolute = {absolute_error(text)}})).error;
  };
  EXPECT_LE(with("1.001e-9 rad/s"), 1e-3);
  EXPECT_GT(with("0.999e-9 rad/s"), 1e-3);
  EXPECT_DOUBLE_EQ(with("1 rad"), 0.5);  // another unit
}

TEST(OutputErrors, RatesOfSlidersAreMetresPerSecond) {
  const std::vector<std::string> names = {"t", "slide.length", "slide.rate"};
  const OutputTable a = table(names, {0, 1, 1e-9}, {1, 1, 1e-9}), b = table(names, {0, 1, 2e-9}, {1, 1, 2e-9});
  const auto with = [&](const char* text) {
    return only(compare_outputs(a, b, {"slide.rate"}, {.tolerance = 1e-3, .absolute = {absolute_error(text)}})).error;
  };
  EXPECT_LE(with("1.001e-9 m/s"), 1e-3);
  EXPECT_GT(with("1 rad/s"), 0.1);  // another unit
}

TEST(OutputErrors, AnOutputMayHaveAnAccuracyOfItsOwn) {
  const OutputTable a = table(hub, {0, 3, 4e-6, 0}, {1, 1, 0, 0}), b = table(hub, {0, 3, 0, 0}, {1, 1, 0, 0});
  constexpr double tolerance = 1e-5;
  const auto wanted = [&](const char* text) {
    return only(compare_outputs(a, b, {text}, {.tolerance = tolerance, .length = 2}));
  };
  EXPECT_DOUBLE_EQ(wanted("hub.rate").error, 4e-6 / 3);
  // Where the error is what is wanted, it is the tolerance.
  EXPECT_DOUBLE_EQ(wanted("hub.rate 4e-6 rad/s").error, tolerance);
  EXPECT_DOUBLE_EQ(wanted("hub.rate 8e-6 rad/s").error, tolerance / 2);
  EXPECT_DOUBLE_EQ(wanted("hub.rate 4e-3").error, 4e-6 / 3 * tolerance / 4e-3);
  EXPECT_EQ(wanted("hub.rate 4e-3").name, "hub.rate");
  EXPECT_EQ(wanted("hub.rate 4e-3").size, 3);
  for (const char* text : {"hub.rate 4e-6 rad/s", "hub.rate 4e-3"})
    EXPECT_DOUBLE_EQ(wanted(text).error * wanted(text).scale, 4e-6) << text;
}

TEST(OutputErrors, WantedOutputsAreANameAnAccuracyAndAUnit) {
  EXPECT_EQ(wanted_output("boom.tip").accuracy, 0);
  EXPECT_EQ(wanted_output("boom.tip 1e-3").accuracy, 1e-3);
  EXPECT_EQ(wanted_output("clamp.torque 2e-3 N m").unit, "N m");
  for (const char* text :
       {"boom.tip ", "boom.tip x", "boom.tip 0", "boom.tip -1", "boom.tip nan", "boom.tip 1e-3m", "boom.tip 1e-3 "})
    EXPECT_THROW(wanted_output(text), InputError) << text;
}

TEST(OutputErrors, AUnitMustBeThatOfTheOutput) {
  const std::vector<std::string> outputs = {"hinge.angle", "hinge.rate", "slide.length", "slide.rate", "slide.drive"};
  for (const char* text : {"boom.tip 1e-3 rad", "boom.q 1e-3 m", "clamp.torque 1 N", "hinge.rate 1 m/s",
                           "slide.rate 1 rad/s", "slide.drive 1 N m", "hinge.drive 1 N"})
    EXPECT_THROW(wanted_output(text, outputs), InputError) << text;
  for (const char* text : {"boom.tip 1e-3 m", "boom.q 1e-3", "hinge.rate 1 rad/s", "slide.rate 1 m/s",
                           "slide.drive 1 N", "hinge.drive 1 N m"})
    EXPECT_NO_THROW(wanted_output(text, outputs)) << text;
}

TEST(OutputErrors, AbsoluteErrorsAreNumbersWithAUnit) {
  EXPECT_EQ(absolute_error("2e-3 N m").unit, "N m");
  EXPECT_EQ(absolute_error("2e-3 N m").size, 2e-3);
  for (const char* text : {"", "1e-9", "1e-9rad", "1e-9 deg", "-1 rad", "0 m", "nan m", "inf m", "rad", "1e-9 rad "})
    EXPECT_THROW(absolute_error(text), InputError) << text;
}

TEST(OutputErrors, EveryUnitIsThatOfAnOutput) {
  EXPECT_EQ(unit_of("hub.rotation", {}), "rad");
  EXPECT_EQ(unit_of("boom.tip", {}), "m");
  EXPECT_EQ(unit_of("slide.length", {}), "m");
  EXPECT_EQ(unit_of("wheel.spin", {}), "rad/s");
  EXPECT_EQ(unit_of("lvlh.roll", {}), "rad");
  EXPECT_EQ(unit_of("boom.q", {}), "");
  EXPECT_EQ(unit_of("hinge.drive", {}), "N m");
  EXPECT_EQ(unit_of("universal.drive2", {}), "N m");
  EXPECT_TRUE(is_load("universal.drive2"));
  EXPECT_FALSE(is_load("hub.rate"));
}

TEST(ErrorBudget, TotalIsThatOfTheWorstOutput) {
  ErrorBudget budget;
  budget.outputs = {{{1e-3, 1e-4, 1e-5, 1e-6}, "a.tip", 1, 2.0}, {{0, 5e-3, 1e-5, 1e-6}, "b.rate", 1, 3.0}};
  ASSERT_NE(budget.worst(), nullptr);
  EXPECT_EQ(budget.worst()->name, "b.rate");
  EXPECT_DOUBLE_EQ(budget.total(), 5.011e-3);
  EXPECT_EQ(description(*budget.worst()), "b.rate at t = 3 s, most of it truncation");
  EXPECT_TRUE(budget.within(6e-3));
  EXPECT_FALSE(budget.within(5e-3));
}

TEST(ErrorBudget, WhatIsUnknownIsNeverMetAndHidesNoKnownError) {
  ErrorBudget budget;
  budget.outputs = {{{1e-3, 1e-4, 1e-5, 1e-6}, "a.tip", 1, 2.0},
                    {{0, unknown, 1e-5, 1e-6}, "b.rate", 1, 3.0},
                    {{0, unknown, 1, 1}, "c.rate", 1, 0}};
  EXPECT_EQ(budget.worst()->name, "c.rate");
  EXPECT_TRUE(std::isnan(budget.total()));
  EXPECT_FALSE(budget.within(1e3));
}

TEST(ErrorBudget, CoordinatesHaveNoErrorsOfAnotherBasis) {
  ErrorBudget budget;
  budget.outputs = {{{unknown, unknown, 1e-5, 1e-6}, "a.q", 1, 2.0}};
  EXPECT_DOUBLE_EQ(budget.total(), 1.1e-5);
}

}  // namespace
}  // namespace flexboom
