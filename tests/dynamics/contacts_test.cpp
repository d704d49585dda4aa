#include "dynamics/events/contacts.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace flexboom {
namespace {

/// One joint on its stop, at a rate, and pushed.
struct OneStop final : StopMotion {
  double place = 0, rate = 0, acceleration = 0;
  int puts = 0;
  Gap gap(std::size_t) override { return {place, rate}; }
  Push push(std::size_t, std::span<const char>) override { return {acceleration, 0}; }
  double noise(std::size_t) const override { return 1e-18; }
  void put_on_stop(std::size_t) override { ++puts; }
};

/// The events of a crossing at this rate, outwards or back, of a joint that was in motion before.
std::vector<StopEvent> events_of(double rate, double acceleration) {
  FlightOptions options;
  options.tolerance = 1e-6;
  Contacts contacts({{0, "hinge", true, 0.01, 1}}, options, 1);
  OneStop motion;
  motion.rate = rate < 0 ? 1 : -1;
  contacts.begin(motion);
  motion.rate = rate, motion.acceleration = acceleration;
  contacts.crossed()[0] = rate < 0 ? -1 : 1;
  std::vector<StopEvent> events;
  EXPECT_TRUE(contacts.update(motion, 1, events));
  EXPECT_EQ(motion.puts, 1);
  return events;
}

TEST(Contacts, ACrossingIsTold) {
  ASSERT_EQ(events_of(0.5, -3).size(), 1u);
  EXPECT_TRUE(events_of(0.5, -3)[0].contact);
  ASSERT_EQ(events_of(-0.5, 3).size(), 1u);
  EXPECT_FALSE(events_of(-0.5, 3)[0].contact);
}

/// The events of a joint that is found on the other side, with no crossing seen.
std::vector<StopEvent> events_beyond(double place, double acceleration) {
  FlightOptions options;
  Contacts contacts({{0, "hinge", true, 0.01, 1}}, options, 1);
  OneStop motion;
  motion.rate = place < 0 ? 1 : -1;
  contacts.begin(motion);
  motion.place = place, motion.rate = 0, motion.acceleration = acceleration;
  std::vector<StopEvent> events;
  EXPECT_TRUE(contacts.update(motion, 1, events));
  return events;
}

// A joint that rests on its stop is beside it by round-off when a load sets in, on either side.
TEST(Contacts, RoundOffIsNoneWhereWhatPushesTurnsItBack) {
  EXPECT_TRUE(events_beyond(1e-17, -3).empty());
  EXPECT_TRUE(events_beyond(-1e-17, 3).empty());
  EXPECT_EQ(events_beyond(1e-17, 3).size(), 1u);    // pressed against its stop
  EXPECT_EQ(events_beyond(-1e-17, -3).size(), 1u);  // and off it
  EXPECT_EQ(events_beyond(1e-12, -3).size(), 1u);   // farther than round-off
  EXPECT_EQ(events_of(1e-9, -3).size(), 1u);        // a crossing that was found
}

// A load sets in on a joint at rest on its stop: crossings that are found are round-off until it has moved away.
TEST(Contacts, AJointThatTremblesOnItsStopGoesWhereItIsPushed) {
  for (const double side : {-1., 1.}) {
    FlightOptions options;
    Contacts contacts({{0, "hinge", true, 0.01, 1}}, options, 1);
    OneStop motion;
    motion.rate = 1;  // in motion before, beyond its stop
    contacts.begin(motion);
    std::vector<StopEvent> events;
    motion.rate = -1e-9, motion.acceleration = 3 * side;
    contacts.crossed()[0] = -1;
    contacts.update(motion, 10, events);
    ASSERT_EQ(events.size(), 1u);
    motion.rate = 1e-9;
    contacts.crossed()[0] = 1;
    contacts.update(motion, 10 + 2e-13, events);
    EXPECT_EQ(events.size(), side > 0 ? 0u : 1u);  // a release says the same as the push
    events.clear();
    EXPECT_EQ(contacts.closed()[0] != 0, side > 0);
    EXPECT_EQ(contacts.level(0, motion), no_level);
    contacts.crossed()[0] = 0;
    motion.place = 1e-15 * side;  // away from it: it is looked at again
    EXPECT_TRUE(contacts.update(motion, 10 + 1e-8, events));
    EXPECT_TRUE(events.empty());
    EXPECT_EQ(contacts.level(0, motion), 0);
    contacts.crossed()[0] = side > 0 ? -1 : 1;
    motion.place = 0, motion.rate = -0.1 * side;
    contacts.update(motion, 11, events);
    ASSERT_EQ(events.size(), 1u);
    EXPECT_EQ(events[0].contact, side < 0);
  }
}

/// A joint whose gap is the difference of large numbers.
struct RoughStop final : StopMotion {
  double place_ = 0, rate = 0, acceleration = 0;
  Gap gap(std::size_t) override { return {place_, rate}; }
  Push push(std::size_t, std::span<const char>) override { return {acceleration, 0}; }
  double noise(std::size_t) const override { return place(); }
  double place() const override { return 1e-14; }
};

// It rests on its stop from the start, beside it by round-off, until something presses it on or off.
TEST(Contacts, AJointAtRestFromTheStartIsMetWhenItIsPressed) {
  for (const double side : {-1., 1.}) {
    FlightOptions options;
    Contacts contacts({{0, "hinge", true, 0.01, 1}}, options, 1);
    RoughStop motion;
    motion.place_ = 3e-16, motion.rate = -1e-16;
    contacts.begin(motion);
    EXPECT_FALSE(contacts.closed()[0]);
    EXPECT_EQ(contacts.level(0, motion), no_level);
    std::vector<StopEvent> events;
    for (const double place : {-5e-11, 5e-11, -1e-16}) {  // errors of the method
      motion.place_ = place;
      EXPECT_FALSE(contacts.update(motion, 1, events));
    }
    motion.acceleration = 2 * side;
    EXPECT_EQ(contacts.update(motion, 10, events), side > 0);
    motion.place_ = 1e-8 * side;
    contacts.update(motion, 10.1, events);
    ASSERT_EQ(events.size(), side > 0 ? 1u : 0u);
    EXPECT_EQ(contacts.closed()[0] != 0, side > 0);
    if (side > 0) {
      EXPECT_EQ(events[0].time, 10);
    }
    EXPECT_EQ(contacts.level(0, motion), 0);
  }
}

}  // namespace
}  // namespace flexboom
