#include "dynamics/events/flight.hpp"

#include "fem/base/check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace flexboom {
namespace {

using Times = std::vector<double>;

Times output_times(double start, double end, double step) {
  FlightOptions o;
  o.start = start, o.duration = end, o.output_step = step;
  const OutputTimes times(o);
  Times all;
  for (double t = times.after(0); std::isfinite(t) && all.size() < 100; t = times.after(all.size())) all.push_back(t);
  return all;
}

TEST(OutputTimes, AreTheStartMultiplesOfTheStepAndTheEnd) {
  EXPECT_EQ(output_times(0, 1, 0.25), (Times{0, 0.25, 0.5, 0.75, 1}));
  EXPECT_EQ(output_times(0, 1, 0.4), (Times{0, 0.4, 0.8, 1}));
  EXPECT_EQ(output_times(0, 1, 5), (Times{0.0, 1.0}));
  EXPECT_EQ(output_times(0.3, 1, 0.25), (Times{0.3, 0.5, 0.75, 1}));
  EXPECT_EQ(output_times(0.5, 1, 0.25), (Times{0.5, 0.75, 1}));
  EXPECT_EQ(output_times(0.9, 1, 0.25), (Times{0.9, 1}));
}

// 0.1 and its multiples are no binary fractions: no output may come twice.
TEST(OutputTimes, RoundOffMakesNoOutput) {
  for (int k = 0; k < 30; ++k) {
    const Times times = output_times(k * 0.1, 3, 0.1);
    EXPECT_EQ(times.size(), static_cast<size_t>(31 - k)) << k;
    EXPECT_EQ(times.back(), 3);
  }
}

TEST(OutputTimes, MayBeRowsOfCloseLooks) {
  FlightOptions o;
  o.duration = 1, o.close_looks = {.at = {0.25, 0.5}, .count = 3, .step = 0.0625};
  const auto all = [&o] {
    const OutputTimes times(o);
    Times r;
    for (double t = times.after(0); std::isfinite(t); t = times.after(r.size())) r.push_back(t);
    return r;
  };
  EXPECT_EQ(all(), (Times{0, 0.25, 0.3125, 0.375, 0.5, 0.5625, 0.625, 1}));
  o.close_looks.at[0] = 0;
  EXPECT_EQ(all(), (Times{0, 0.0625, 0.125, 0.5, 0.5625, 0.625, 1}));
  o.close_looks.at[0] = 0.4;
  EXPECT_THROW(check_options(o, 0), InputError);
}

TEST(ChatterGuard, AThousandContactsAtOneTimeAreAnErrorThatNamesTheJoint) {
  ChatterGuard guard;
  for (int i = 0; i < 5000; ++i) guard.contact(1e-3 * i, "slow");
  for (int i = 0; i < 1000; ++i) guard.contact(5, "hinge");
  try {
    guard.contact(5 * (1 + 1e-15), "hinge");
    ADD_FAILURE() << "no error";
  } catch (const NumericalError& error) {
    EXPECT_NE(std::string(error.what()).find("\"hinge\" chatters"), std::string::npos) << error.what();
  }
}

TEST(FlightOptions, ThatMakeNoSenseAreNamed) {
  const auto refused = [](auto change) {
    FlightOptions o;
    change(o);
    try {
      check_options(o, 2);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refused([](FlightOptions&) {}), "");
  EXPECT_NE(refused([](FlightOptions& o) { o.tolerance = 0; }).find("tolerance"), std::string::npos);
  EXPECT_NE(refused([](FlightOptions& o) { o.duration = NAN; }).find("duration"), std::string::npos);
  EXPECT_NE(refused([](FlightOptions& o) { o.start = -1; }).find("start"), std::string::npos);
  EXPECT_NE(refused([](FlightOptions& o) { o.start = o.duration; }).find("start"), std::string::npos);
  EXPECT_NE(refused([](FlightOptions& o) { o.output_step = -1; }).find("output step"), std::string::npos);
  EXPECT_NE(refused([](FlightOptions& o) { o.output_step = 1e-6; }).find("too many"), std::string::npos);
  EXPECT_NE(refused([](FlightOptions& o) { o.stops.resize(3); }).find("histories"), std::string::npos);
}

}  // namespace
}  // namespace flexboom
