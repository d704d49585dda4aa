// Laws of hinges and sliders against closed forms of one freedom, by every method and in both formulations.

#include "dynamics/events/laws.hpp"

#include "laws_testing.hpp"
#include "reduction/body/reduced_body.hpp"
#include "reduction/invariants/eq14.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace flexboom {
namespace {

using std::numbers::pi;
using testing::fly;
using testing::law_options;
using testing::LawFlight;
using testing::one_joint;
using testing::one_start;

constexpr double digits = 1e-9;

class Law : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(EveryMethod, Law, ::testing::ValuesIn(testing::every_method),
                         [](const auto& instance) { return instance.param; });

constexpr double J = 2, k = 8, omega = 2;  // of the oscillator [kg m^2], [N m/rad], [rad/s]
HingeMechanism spring(double stiffness = k, double damping = 0) { return {stiffness, 0, damping, 0, 0}; }

void expect_balanced(const LawFlight& f) {
  EXPECT_LT(f.energy_balance, digits);
  double scale = std::abs(f.energy.front()) + f.ledger.back().lost();
  for (const EnergyLedger& l : f.ledger) scale = std::max(scale, std::abs(l.stored()));
  for (const double e : f.energy) EXPECT_NEAR(e, f.energy.front(), digits * scale);
}

// What a run left goes on only under a law that can be in that state.
TEST(LawModel, FitsStatesOfItsOwn) {
  using Motion = LawState::Motion;
  const auto model = [](const JointLaw& law) {
    Joint joint;
    joint.mechanism = {1, 0, 0, 0, 0}, joint.law = law;
    return LawModel(joint);
  };
  JointLaw preloaded, rubbing, stopped, latching;
  preloaded.preload = 1;
  rubbing.friction = FrictionLaw{1, 1};
  stopped.upper_stop = StopLaw{.at = 1, .restitution = 0.5};
  latching.latch = LatchLaw{1, 1};
  std::vector<LawState> states(7);  // free, slides, sticks, rests at either end, latched, beyond a ramp
  states[1].motion = Motion::forward;
  for (size_t i = 2; i < 6; ++i) states[i].motion = Motion::held;
  states[3].rests_at = 1, states[4].rests_at = -1;
  states[5].latched = true;
  states[6].beyond = states[6].pushes = {1};
  const auto fitting = [&](const JointLaw& law) {
    std::string which;
    for (const LawState& s : states) which += model(law).fits(s) ? '1' : '0';
    return which;
  };
  EXPECT_EQ(fitting(preloaded), "1000000");
  EXPECT_EQ(fitting(rubbing), "0110000");
  EXPECT_EQ(fitting(stopped), "1001000");
  EXPECT_EQ(fitting(latching), "1000010");
}

// Half-cycles about -+ coulomb / k; every one takes pi / omega and 2 coulomb / k of the amplitude.
TEST_P(Law, CoulombFrictionTakesTheSameFromEveryHalfCycleUntilItSticks) {
  JointLaw law;
  law.friction = FrictionLaw{1.0, 2.1};
  const double start = 1.03, lag = 1 / k;
  const LawFlight f =
      fly(one_joint(JointKind::hinge, J, spring(), law), one_start(start, 0), GetParam(), law_options(1e-11, 8, 0.05));
  EXPECT_EQ(f.kinds(), "slip slip slip slip stick");
  ASSERT_EQ(f.events.size(), 5U);
  for (size_t i = 1; i < 5; ++i) EXPECT_NEAR(f.events[i].time, static_cast<double>(i) * pi / omega, digits);
  double way = 0;
  for (size_t i = 0; i < f.time.size(); ++i) {
    const double t = f.time[i], half = std::min(4.0, std::floor(t * omega / pi)),
                 sign = std::fmod(half, 2) == 0 ? 1 : -1;
    const double peak = sign * (start - 2 * lag * half);
    const double exact = half == 4 ? peak : sign * lag + (peak - sign * lag) * std::cos(omega * t - half * pi);
    EXPECT_NEAR(f.coordinate[i][0], exact, digits) << t;
  }
  for (int half = 0; half < 4; ++half) way += 2 * (start - 2 * lag * half) - 2 * lag;
  EXPECT_NEAR(f.ledger.back().laws[static_cast<size_t>(LawLoss::friction)], way * 1.0, digits);
  EXPECT_EQ(f.rate.back()[0], f.rate[f.rate.size() - 2][0]);
  expect_balanced(f);
}

// Breaks where the load passes what holds; from there J x'' = slope t - coulomb.
TEST_P(Law, StickingEndsWhereTheLoadPassesWhatHolds) {
  for (const double breakaway : {0.5, 0.8}) {
    JointLaw law;
    law.friction = FrictionLaw{0.5, breakaway};
    Multibody scene = one_joint(JointKind::hinge, J, spring(0), law);
    Load load;
    load.at.body = 0;
    constexpr double slope = 0.3;
    load.torque[2] = [](double t) { return slope * t; };
    scene.loads.push_back(load);
    const LawFlight f = fly(scene, one_start(0.2, 0), GetParam(), law_options(1e-11, 5, 0.1));
    EXPECT_EQ(f.kinds(), "slip");
    const double begin = breakaway / slope;
    EXPECT_NEAR(f.events.at(0).time, begin, digits);
    for (size_t i = 0; i < f.time.size(); ++i) {
      const double t = f.time[i], d = std::max(0.0, t - begin);
      const double exact = 0.2 + (slope * d * d * d / 6 + (breakaway - 0.5) * d * d / 2) / J;
      EXPECT_NEAR(f.coordinate[i][0], exact, digits) << t;
    }
    expect_balanced(f);
  }
}

// A ball: t_n = t_1 (1 + 2 e + ... + 2 e^n), rates v e^n. It rests where it would not rise above what a step
// leaves open.
TEST_P(Law, BallBouncesUntilItRests) {
  JointLaw law;
  constexpr double e = 0.6, g = 9.81, height = 1.3, mass = 3, tolerance = 2e-12;
  law.lower_stop = StopLaw{.at = 0.4, .restitution = e};
  Multibody scene = one_joint(JointKind::slider, mass, spring(0), law);
  scene.gravity = {0, 0, -g};
  const LawFlight f = fly(scene, one_start(0.4 + height, 0), GetParam(), law_options(tolerance, 4, 0.05));
  const double first = std::sqrt(2 * height / g), v = g * first, least = 0.1 * tolerance * (0.4 + height);
  double t = first, rate = v;
  size_t bounces = 0;
  for (const StopEvent& i : f.of_kind("impact")) {
    const double known = rate > 1e-2 ? digits : 1e-6;  // an error in height is one of the rate, over the rate
    EXPECT_NEAR(i.time, t, known);
    EXPECT_NEAR(i.rate, -rate, known);
    EXPECT_GT(rate * rate / (2 * g), least);
    rate *= e, ++bounces;
    t += 2 * rate / g;
  }
  EXPECT_LT(rate * rate / (2 * g), least);
  EXPECT_GT(bounces, 20U);
  ASSERT_EQ(f.events.size(), bounces + 1);
  EXPECT_EQ(f.events.back().kind, EventKind::rest);
  EXPECT_NEAR(f.events.back().time, first * (1 + e) / (1 - e), 2e-5);
  EXPECT_NEAR(f.coordinate.back()[0], 0.4, digits);
  EXPECT_NEAR(f.ledger.back().laws[static_cast<size_t>(LawLoss::impact)], mass * g * height, 1e-8 * mass * g * height);
  expect_balanced(f);
}

TEST_P(Law, RigidStopsAtBothEndsGiveBackWhatTheyDo) {
  JointLaw law;
  law.lower_stop = StopLaw{.at = -0.5, .restitution = 1};
  law.upper_stop = StopLaw{.at = 0.25, .restitution = 0.5};
  const LawFlight f =
      fly(one_joint(JointKind::hinge, J, spring(0), law), one_start(0, 1), GetParam(), law_options(1e-11, 10, 0.1));
  double t = 0.25, rate = 1;
  for (const StopEvent& e : f.events) {
    EXPECT_EQ(event_name(e), "impact");
    EXPECT_NEAR(e.time, t, digits);
    EXPECT_NEAR(e.rate, rate, digits);
    rate = rate > 0 ? -0.5 * rate : -rate;
    t += 0.75 / std::abs(rate);
  }
  EXPECT_GT(t, 10);
  EXPECT_EQ(f.events.size(), 5U);
  expect_balanced(f);
}

// Damped swing until it passes the latch slowly enough.
TEST_P(Law, LatchLocksAtTheFirstSlowPassAndNothingMovesAfter) {
  JointLaw law;
  law.latch = LatchLaw{.at = 0.3, .rate = 1.2};
  constexpr double c = 0.4;
  const LawFlight f = fly(one_joint(JointKind::hinge, J, spring(k, c), law), one_start(-1, 0), GetParam(),
                          law_options(1e-11, 10, 0.05));
  const double decay = c / (2 * J), w = std::sqrt(k / J - decay * decay);
  const auto x = [&](double t) { return -std::exp(-decay * t) * (std::cos(w * t) + decay / w * std::sin(w * t)); };
  const auto rate = [&](double t) { return std::exp(-decay * t) * (w + decay * decay / w) * std::sin(w * t); };
  double latched = 0;
  for (double t = 0; latched == 0; t += 1e-3) {
    double a = t, b = t + 1e-3;
    if ((x(a) - 0.3) * (x(b) - 0.3) > 0) continue;
    for (int i = 0; i < 60; ++i) ((x(a) - 0.3) * (x((a + b) / 2) - 0.3) > 0 ? a : b) = (a + b) / 2;
    if (std::abs(rate(a)) <= 1.2) latched = a;
  }
  EXPECT_GT(latched, pi / w);  // the first passes are too fast
  EXPECT_EQ(f.kinds(), "latch");
  EXPECT_NEAR(f.events.at(0).time, latched, digits);
  EXPECT_NEAR(f.events.at(0).rate, rate(latched), digits);
  for (size_t i = 0; i < f.time.size(); ++i) {
    EXPECT_NEAR(f.coordinate[i][0], f.time[i] < latched ? x(f.time[i]) : 0.3, digits);
    if (f.time[i] > latched) {
      EXPECT_NEAR(f.rate[i][0], 0, 1e-12);
    }
  }
  EXPECT_NEAR(f.ledger.back().laws[static_cast<size_t>(LawLoss::latch)], J / 2 * rate(latched) * rate(latched), digits);
  expect_balanced(f);
}

// A latch at a rigid stop, whatever round-off makes of the place: it catches what comes, or comes back, slowly enough.
TEST_P(Law, LatchAtARigidStopCatchesWhatIsSlowEnoughThere) {
  constexpr double torque = 0.5, e = 0.5;
  const auto flown = [&](double at, double rate, double restitution) {
    JointLaw law;
    law.preload = at > 0 ? torque : -torque;
    (at > 0 ? law.upper_stop : law.lower_stop) = StopLaw{.at = at, .restitution = restitution};
    law.latch = LatchLaw{.at = at, .rate = rate};
    return fly(one_joint(JointKind::hinge, J, spring(0), law), one_start(0, 0), GetParam(), law_options(1e-10, 8, 0.5));
  };
  for (const double at : {0.1, -0.2, 0.3, 0.31, -0.5, 0.7}) {
    SCOPED_TRACE(at);
    const double a = torque / J, arrives = std::sqrt(2 * a * std::abs(at)), first = arrives / a;
    const LawFlight caught = flown(at, 1.01 * arrives, e);
    EXPECT_EQ(caught.kinds(), "latch");
    EXPECT_NEAR(caught.events.at(0).time, first, 1e-8);
    const LawFlight comes_back = flown(at, 0.99 * e * e * arrives, e);  // only after the third blow slow enough
    EXPECT_EQ(comes_back.kinds(), "impact impact impact latch");
    EXPECT_NEAR(comes_back.events.at(3).time, first * (1 + 2 * e + 2 * e * e), 1e-7);
    EXPECT_NEAR(comes_back.coordinate.back()[0], at, digits);
    EXPECT_EQ(flown(at, 1e-3, 0).kinds(), "impact latch");  // what rests there is slow enough
  }
}

// Two stops so near that the second ends what the first began.
TEST_P(Law, StopsNearEachOtherEndAllBounces) {
  for (const double upper : {0.301, 0.302, 0.31}) {
    SCOPED_TRACE(upper);
    JointLaw law;
    law.preload = 0.5;
    law.lower_stop = StopLaw{.at = 0.3, .restitution = 0.5};
    law.upper_stop = StopLaw{.at = upper, .restitution = 0.5};
    const LawFlight f =
        fly(one_joint(JointKind::hinge, J, spring(0), law), one_start(0.3, 0.1), GetParam(), law_options(1e-9, 4, 0.1));
    EXPECT_EQ(f.events.back().kind, EventKind::rest);
    EXPECT_NEAR(f.coordinate.back()[0], upper, digits);
  }
}

// A quarter of a swing to the edge, the gap at the same rate, and so on: T = 2 pi / omega + 4 b / (omega A).
TEST_P(Law, PeriodOfASwingWithBacklash) {
  JointLaw law;
  law.backlash = 0.1;
  const double A = 0.6, period = 2 * pi / omega + 4 * 0.1 / (omega * A);
  const LawFlight f = fly(one_joint(JointKind::hinge, J, spring(), law), one_start(0.1 + A, 0), GetParam(),
                          law_options(1e-11, 3 * period, period));
  EXPECT_EQ(f.kinds(),
            "disengage engage disengage engage disengage engage disengage engage disengage engage disengage "
            "engage");
  for (const auto& x : f.coordinate) EXPECT_NEAR(x[0], 0.1 + A, digits);
  for (size_t i = 0; i < f.events.size(); ++i) {
    const double half = std::floor(static_cast<double>(i) / 2);
    EXPECT_NEAR(f.events[i].time, pi / (2 * omega) + half * period / 2 + (i % 2 ? 0.2 / (omega * A) : 0), digits);
  }
  expect_balanced(f);
}

// A pad only pushes: it lets go where stiffness and damper cancel, and the rotor flies on at that rate.
TEST_P(Law, PadsAtBothEndsPushAndDoNotPull) {
  JointLaw law;
  constexpr double K = 200, C = 4;
  law.lower_stop = StopLaw{.at = -0.3, .stiffness = K, .damping = C};
  law.upper_stop = StopLaw{.at = 0.2, .stiffness = K, .damping = C};
  const LawFlight f =
      fly(one_joint(JointKind::hinge, J, spring(0), law), one_start(0, 1), GetParam(), law_options(1e-11, 3, 0.05));
  const double decay = C / (2 * J), w = std::sqrt(K / J - decay * decay);
  const auto depth = [&](double t) { return std::exp(-decay * t) * std::sin(w * t) / w; };
  const auto rate = [&](double t) { return std::exp(-decay * t) * (std::cos(w * t) - decay / w * std::sin(w * t)); };
  double a = 0.5 * pi / w, b = pi / w;
  for (int i = 0; i < 60; ++i) (K * depth((a + b) / 2) + C * rate((a + b) / 2) > 0 ? a : b) = (a + b) / 2;
  const double e = -rate(a), stay = a + depth(a) / e;  // what is left of the rate; until it is off the pad
  double t = 0.2, v = 1;
  for (size_t i = 0; i < f.events.size(); ++i) {
    EXPECT_EQ(event_name(f.events[i]), i % 2 ? "release" : "contact");
    EXPECT_NEAR(f.events[i].time, t, digits);
    EXPECT_NEAR(std::abs(f.events[i].rate), v, digits);
    if (i % 2 == 0)
      t += stay, v *= e;
    else
      t += 0.5 / v;
  }
  EXPECT_GT(f.events.size(), 5U);
  expect_balanced(f);
  EXPECT_NEAR(f.ledger.back().laws[static_cast<size_t>(LawLoss::stop)] + f.ledger.back().stops, J / 2 * (1 - v * v),
              1e-8);
}

TEST_P(Law, PreloadShiftsTheSwing) {
  JointLaw law;
  law.preload = 0.7;
  const LawFlight f =
      fly(one_joint(JointKind::slider, J, spring(), law), one_start(0, 0), GetParam(), law_options(1e-11, 5, 0.1));
  for (size_t i = 0; i < f.time.size(); ++i)
    EXPECT_NEAR(f.coordinate[i][0], 0.7 / k * (1 - std::cos(omega * f.time[i])), digits);
  expect_balanced(f);
}

// By the energy integral: kinetic energy is what the table gave.
TEST_P(Law, SpringByATableGivesItsArea) {
  JointLaw law;
  law.spring = {{-0.5, 0.1, 0.4, 1}, {3, 0.5, 0.4, -2}};
  const LawFlight f =
      fly(one_joint(JointKind::hinge, J, spring(0), law), one_start(-0.3, 0), GetParam(), law_options(1e-11, 6, 0.05));
  const auto torque = [&](double x) {
    size_t i = 0;
    while (i + 2 < law.spring.at.size() && x > law.spring.at[i + 1]) ++i;
    const double s = (x - law.spring.at[i]) / (law.spring.at[i + 1] - law.spring.at[i]);
    return law.spring.load[i] + s * (law.spring.load[i + 1] - law.spring.load[i]);
  };
  const auto area = [&](double to) {  // trapezes between the kinks
    double sum = 0, from = -0.3;
    for (const double kink : {0.1, 0.4, to}) {
      const double next = std::min(kink, to);
      if (next > from || to < from) sum += (next - from) * (torque(next) + torque(from)) / 2, from = next;
    }
    return sum;
  };
  double fastest = 0;
  for (size_t i = 0; i < f.time.size(); ++i) {
    EXPECT_NEAR(J / 2 * f.rate[i][0] * f.rate[i][0], area(f.coordinate[i][0]), digits) << f.time[i];
    fastest = std::max(fastest, std::abs(f.rate[i][0]));
  }
  EXPECT_GT(fastest, 0.5);
  EXPECT_EQ(f.of_kind("kink").size(), 4U);
  for (const StopEvent& e : f.events) {
    const bool first = std::abs(std::abs(e.rate) - std::sqrt(2 * area(0.1) / J)) < digits;
    EXPECT_TRUE(first || std::abs(std::abs(e.rate) - std::sqrt(2 * area(0.4) / J)) < digits) << e.time;
  }
  expect_balanced(f);
}

// Two exponential decays, one after the other.
TEST_P(Law, DamperByATableChangesItsRateOfDecay) {
  JointLaw law;
  law.damper = {{-1, 0, 0.5, 1}, {1, 0, -0.5, -2}};  // 1 N m s/rad, 3 beyond 0.5 rad/s
  const LawFlight f =
      fly(one_joint(JointKind::hinge, J, spring(0), law), one_start(0, 2), GetParam(), law_options(1e-11, 6, 0.1));
  const double rest = 1.0 / 3, change = J / 3 * std::log((2 - rest) / (0.5 - rest));
  for (size_t i = 0; i < f.time.size(); ++i) {
    const double t = f.time[i];
    EXPECT_NEAR(f.rate[i][0], t < change ? rest + (2 - rest) * std::exp(-3 * t / J) : 0.5 * std::exp(-(t - change) / J),
                digits);
  }
  EXPECT_EQ(f.kinds(), "kink");
  EXPECT_NEAR(f.events.at(0).time, change, digits);
  EXPECT_NEAR(f.ledger.back().dampers, J / 2 * (4 - f.rate.back()[0] * f.rate.back()[0]), digits);
  expect_balanced(f);
}

// --- more than one freedom: both formulations fly the same ---

/// A hub that flies with two flexible panels in line; the outer hinge has the law.
Multibody two_panel_wing(const JointLaw& law, const HingeMechanism& mechanism) {
  Multibody scene;
  scene.bodies.push_back(rigid_body("hub", 20, {0, 0, 0}, Eigen::Vector3d(2, 2.5, 3).asDiagonal()));
  scene.joints.push_back(testing::joint("flight", JointKind::free, testing::place(-1), testing::place(0)));
  for (int i = 0; i < 2; ++i) {
    scene.bodies.push_back(eq14::reduced_body({1.2, 0.4, 30.0}, 2, eq14::Planes::xy, i == 0 ? "inner" : "outer"));
    apply_damping(scene.bodies.back(), {.name = "rayleigh", .alpha = 0, .beta = 1e-3});
    scene.joints.push_back(testing::joint(i == 0 ? "root" : "fold", JointKind::hinge,
                                          i == 0 ? testing::place(0, {0.3, 0, 0}) : testing::at_marker(1, "tip"),
                                          testing::place(i + 1)));
  }
  scene.joints[1].mechanism = {6, 0, 0.5, 0, 0};
  scene.joints[2].mechanism = mechanism, scene.joints[2].law = law;
  return scene;
}

struct LawCase {
  std::string name;
  JointLaw law;
  HingeMechanism mechanism;
  std::string must_have;  // an event
};

std::vector<LawCase> law_cases() {
  const HingeMechanism swing = {2, 0.3, 0.02, 0, 0};
  JointLaw friction, rigid, latch, backlash, pads, tables, all;
  friction.friction = FrictionLaw{0.15, 0.2};
  rigid.lower_stop = StopLaw{.at = -0.2, .restitution = 0.5}, rigid.upper_stop = StopLaw{.at = 0.5, .restitution = 0.3};
  latch.latch = LatchLaw{.at = 0.35, .rate = 3};
  backlash.backlash = 0.05, backlash.preload = 0.02;
  pads.lower_stop = StopLaw{.at = -0.1, .stiffness = 150, .damping = 0.3};
  pads.upper_stop = StopLaw{.at = 0.5, .stiffness = 150, .damping = 0.3};
  tables.spring = {{-1, 0, 0.4, 1}, {2, 0.3, 0, -2}}, tables.damper = {{-1, 0, 0.5, 1}, {0.1, 0, -0.05, -0.3}};
  all = friction, all.upper_stop = rigid.upper_stop, all.lower_stop = pads.lower_stop, all.backlash = 0.03;
  return {{"friction", friction, swing, "stick"}, {"rigid", rigid, swing, "impact"},
          {"latch", latch, swing, "latch"},       {"backlash", backlash, swing, "engage"},
          {"pads", pads, swing, "contact"},       {"tables", tables, {0, 0, 0, 0, 0}, "kink"},
          {"all", all, swing, "contact"}};
}

TreeState wing_start(double fold) {
  TreeState s;
  s.joints.resize(3);
  s.joints[0].omega = {0.02, -0.01, 0.05};
  s.joints[1].coordinate = {0.1}, s.joints[1].rate = {0};
  s.joints[2].coordinate = {fold}, s.joints[2].rate = {0};
  s.q = s.q_dot = {Eigen::VectorXd::Zero(0), Eigen::VectorXd::Zero(2), Eigen::VectorXd::Zero(2)};
  return s;
}

void expect_same(const LawFlight& a, const LawFlight& b, double tolerance) {
  EXPECT_EQ(a.kinds(), b.kinds());
  for (size_t i = 0; i < std::min(a.events.size(), b.events.size()); ++i) {
    EXPECT_EQ(a.events[i].joint, b.events[i].joint);
    EXPECT_NEAR(a.events[i].time, b.events[i].time, tolerance) << event_name(a.events[i]);
  }
  ASSERT_EQ(a.time.size(), b.time.size());
  for (size_t i = 0; i < a.time.size(); ++i) {
    for (size_t j = 1; j < a.coordinate[i].size(); ++j)
      EXPECT_NEAR(a.coordinate[i][j], b.coordinate[i][j], tolerance) << a.time[i];
    EXPECT_LT((a.q[i] - b.q[i]).norm(), tolerance) << a.time[i];
  }
  for (size_t k = 0; k < law_losses.size(); ++k)
    EXPECT_NEAR(a.ledger.back().laws[k], b.ledger.back().laws[k], tolerance) << law_losses[k];
  EXPECT_NEAR(a.ledger.back().dampers, b.ledger.back().dampers, tolerance);
  EXPECT_NEAR(a.ledger.back().elsewhere, b.ledger.back().elsewhere, tolerance);
}

TEST(Laws, FlexibleWingsAreTheSameInBothFormulationsAndByEveryMethod) {
  for (const LawCase& c : law_cases()) {
    SCOPED_TRACE(c.name);
    const Multibody scene = two_panel_wing(c.law, c.mechanism);
    const IntegratorOptions o = law_options(1e-9, 1.5, 0.05);
    const LawFlight one = fly(scene, wing_start(-0.15), "bdf", o);
    EXPECT_NE(one.kinds().find(c.must_have), std::string::npos) << one.kinds();
    EXPECT_LT(one.energy_balance, 1e-7);
    for (const char* method : {"adams", "erk", "dirk", "ida"}) {
      SCOPED_TRACE(method);
      const LawFlight other = fly(scene, wing_start(-0.15), method, o);
      EXPECT_LT(other.energy_balance, 1e-7);
      expect_same(one, other, 1e-6);
    }
  }
}

TEST(Laws, GoWithWheelsAndPrescribedJoints) {
  for (const LawCase& c : law_cases()) {
    SCOPED_TRACE(c.name);
    Multibody scene = two_panel_wing(c.law, c.mechanism);
    ReactionWheel wheel;
    wheel.inertia = 0.05, wheel.spin = 30, wheel.torque = [](double t) { return 0.1 * std::sin(3 * t); };
    scene.wheels.push_back(wheel);
    const IntegratorOptions o = law_options(1e-9, 1, 0.05);
    TreeState start = wing_start(-0.15);
    start.spin = {30};
    expect_same(fly(scene, start, "bdf", o), fly(scene, start, "ida", o), 1e-6);
    scene.joints[1].prescribed = {testing::swing(0.2)};
    scene.joints[1].mechanism = {0, 0, 0, 0, 0};
    start.joints[1].coordinate = {0.2 * std::sin(0.4)}, start.joints[1].rate = {0.26 * std::cos(0.4)};
    const LawFlight a = fly(scene, start, "bdf", o), b = fly(scene, start, "ida", o);
    EXPECT_LT(a.energy_balance, 1e-7);
    EXPECT_LT(b.energy_balance, 1e-7);
    expect_same(a, b, 1e-6);
  }
}

TEST(Laws, GoOnWhereAnotherFlightEnded) {
  for (const LawCase& c : law_cases()) {
    SCOPED_TRACE(c.name);
    const Multibody scene = two_panel_wing(c.law, c.mechanism);
    const LawFlight whole = fly(scene, wing_start(-0.15), "bdf", law_options(1e-10, 1.4, 0.1));
    for (const double half : {0.3, 0.7, 1.1}) {
      const LawFlight first = fly(scene, wing_start(-0.15), "bdf", law_options(1e-10, half, 0.1));
      IntegratorOptions o = law_options(1e-10, 1.4, 0.1);
      o.start = half, o.stops = first.stops, o.method = "bdf";
      const Tree tree(scene);
      const TreeTrajectory second = integrate(tree, first.end, o);
      EXPECT_EQ(first.events.size() + second.events.size(), whole.events.size());
      EXPECT_LT((tree.unpack(second.y.back()).q[2] - whole.q.back().tail(2)).norm(), 1e-7);
      EXPECT_NEAR(tree.unpack(second.y.back()).joints[2].coordinate[0], whole.coordinate.back()[2], 1e-7);
      for (size_t k = 0; k < law_losses.size(); ++k)
        EXPECT_NEAR(second.balance.back().ledger.laws[k], whole.ledger.back().laws[k], 1e-7);
    }
  }
}

// A blow from rest to rest: momenta of the whole are kept, friction is no match for it.
TEST(Laws, BlowsGoThroughEverythingThatHangsTogether) {
  JointLaw rigid, sticky;
  rigid.upper_stop = StopLaw{.at = 0.2, .restitution = 0.4};
  sticky.friction = FrictionLaw{0.05, 0.5};
  Multibody scene = two_panel_wing(rigid, {0, 0, 0, 0, 0});
  scene.joints[1].mechanism = {0, 0, 0, 0, 0}, scene.joints[1].law = sticky;
  TreeState start = wing_start(0);
  start.joints[0].omega.setZero();
  start.joints[2].rate = {1.0};
  for (const char* method : {"bdf", "ida"}) {
    SCOPED_TRACE(method);
    const LawFlight f = fly(scene, start, method, law_options(1e-10, 0.5, 0.01));
    EXPECT_NE(f.kinds().find("impact"), std::string::npos);
    EXPECT_NE(f.kinds().find("slip"), std::string::npos) << f.kinds();
    EXPECT_LT(f.energy_balance, 1e-8);
  }
}

}  // namespace
}  // namespace flexboom
