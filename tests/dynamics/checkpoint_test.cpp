// What is told of a flight on its way, and where it fails; and motions that die out before they reach a stop.

#include "dynamics/model/time_function.hpp"
#include "dynamics/simulation/formulations.hpp"
#include "dynamics/simulation/tree_integrator.hpp"
#include "fem/base/check.hpp"
#include "hub_testing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace flexboom {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::Hub;

using std::numbers::pi;

/// One hinge's motion, whatever flew it.
struct Motion {
  std::vector<double> time, gap;
  std::vector<bool> contacts;
  std::vector<double> contact_times;
};
struct SeenMotion : Motion {
  size_t outputs = 0;
  VectorXd end;  // where it is
  std::vector<StopHistory> stops;
};

using Look = std::function<void(const SeenMotion&)>;
using Engine = Motion (*)(const Hub&, const VectorXd& y0, IntegratorOptions, const Look&);

template <class Events>
void add_events(const Events& events, Motion& m) {
  for (const auto& e : events) m.contacts.push_back(e.contact), m.contact_times.push_back(e.time);
}

Motion by_tree(const Hub& system, const VectorXd& y0, IntegratorOptions o, const Look& look) {
  const auto seen = [&](const TreeTrajectory& r) {
    SeenMotion m;
    m.time = r.time;
    for (const VectorXd& y : r.y) m.gap.push_back(system.gap(y.data(), 0));
    add_events(r.events, m);
    m.end = r.y.back(), m.stops = r.summary.stops;
    return m;
  };
  Checkpoint<TreeTrajectory> told;
  if (look)
    told = [&](const TreeTrajectory& r, size_t outputs) {
      SeenMotion m = seen(r);
      m.outputs = outputs;
      look(m);
    };
  return seen(integrate(system.tree(), y0, o, told));
}

template <const char* method>
Motion by_method(const Hub& system, const VectorXd& y0, IntegratorOptions o, const Look& look) {
  o.method = method;
  return by_tree(system, y0, o, look);
}

Motion by_multipliers(const Hub& system, const VectorXd& y0, IntegratorOptions o, const Look& look) {
  const Tree& tree = system.tree();
  const Multipliers multipliers(tree.scene());
  const double threshold = system.appendages()[0].hinge.mechanism.threshold;
  const auto seen = [&](const MultibodyTrajectory& r) {
    SeenMotion m;
    m.time = r.time;
    for (const MultibodyState& s : r.states) m.gap.push_back(s.coordinate[0] - threshold);
    add_events(r.events, m);
    m.end = tree.pack(tree_state(multipliers, r.states.back()));
    m.stops = r.summary.stops;
    return m;
  };
  Checkpoint<MultibodyTrajectory> told;
  if (look)
    told = [&](const MultibodyTrajectory& r, size_t outputs) {
      SeenMotion m = seen(r);
      m.outputs = outputs;
      look(m);
    };
  MultipliersOptions of_flight{o};
  of_flight.angles = {y0[0] + threshold};
  return seen(integrate_multipliers(multipliers, body_states(tree, o.start, y0), of_flight, told));
}

constexpr char exponential[] = "exponential", bdf[] = "bdf", adams[] = "adams", dirk[] = "dirk", erk[] = "erk";

struct Row {
  const char* name;
  Engine fly;
};
class EveryEngine : public ::testing::TestWithParam<Row> {};
INSTANTIATE_TEST_SUITE_P(Table, EveryEngine,
                         ::testing::Values(Row{"exponential", by_method<exponential>}, Row{"bdf", by_method<bdf>},
                                           Row{"adams", by_method<adams>}, Row{"dirk", by_method<dirk>},
                                           Row{"erk", by_method<erk>}, Row{"multipliers", by_multipliers}),
                         [](const auto& row) { return std::string(row.param.name); });

/// A boom of SPORT on a hub that does not move.
Hub boom(HingeMechanism mechanism, int modes) {
  const double m = 0.01645016453235955, J = 0.0004772175595249452;
  ReducedBody body =
      modes == 0
          ? rigid_body("boom", m, Vector3d(m * 0.295 / 2, 0, 0), Vector3d(5.140676416362361e-8, J, J).asDiagonal())
          : eq14::reduced_body(testing::round_boom(0.295, 0.005), modes, eq14::Planes::xy, "boom");
  if (modes > 0) apply_damping(body, {"modal", 0.05});
  Hinge hinge;
  hinge.mechanism = mechanism;
  return Hub({}, {{std::move(body), hinge}});
}

Hub bouncing_boom() { return boom(testing::sport_mechanism(0.35), 0); }

IntegratorOptions short_flight() {
  IntegratorOptions o;
  o.tolerance = 1e-7;
  o.duration = 0.5;
  o.output_step = 0.01;
  return o;
}

VectorXd start_of(const Hub& system) { return system.pack(system.at_rest({pi / 2 - pi / 60})); }

TEST_P(EveryEngine, ACheckpointAtEveryStepChangesNothing) {
  const Hub system = bouncing_boom();
  IntegratorOptions o = short_flight();
  const Motion alone = GetParam().fly(system, start_of(system), o, {});
  o.checkpoint_every = 0;
  std::vector<SeenMotion> seen;
  const Motion watched = GetParam().fly(system, start_of(system), o, [&](const SeenMotion& m) { seen.push_back(m); });
  EXPECT_EQ(watched.time, alone.time);
  EXPECT_EQ(watched.gap, alone.gap);
  EXPECT_EQ(watched.contact_times, alone.contact_times);
  ASSERT_GT(seen.size(), 10u);
  EXPECT_EQ(seen.front().time, std::vector<double>{0.0});
  for (const SeenMotion& m : seen) {
    ASSERT_GE(m.outputs, 1u);
    ASSERT_LE(m.outputs, m.time.size());
    ASSERT_LE(m.time.size(), m.outputs + 1);
    for (size_t i = 0; i < m.outputs; ++i) {
      EXPECT_EQ(m.time[i], alone.time[i]);
      EXPECT_EQ(m.gap[i], alone.gap[i]);
    }
    EXPECT_GE(m.time.back(), m.contact_times.empty() ? 0 : m.contact_times.back());
  }
}

// From wherever a flight was seen it goes on to the same end by the same contacts.
TEST_P(EveryEngine, EveryCheckpointIsAStart) {
  const Hub system = bouncing_boom();
  IntegratorOptions o = short_flight();
  o.checkpoint_every = 0;
  std::vector<SeenMotion> seen;
  const Motion whole = GetParam().fly(system, start_of(system), o, [&](const SeenMotion& m) { seen.push_back(m); });
  ASSERT_GE(whole.contacts.size(), 5u);
  double largest = 0;
  for (const double gap : whole.gap) largest = std::max(largest, std::abs(gap));
  for (size_t i = 1; i + 1 < seen.size(); i += seen.size() / 12 + 1) {
    const SeenMotion& from = seen[i];
    if (from.time.back() >= o.duration) break;
    IntegratorOptions rest = short_flight();
    rest.start = from.time.back();
    rest.stops = from.stops;
    const Motion later = GetParam().fly(system, from.end, rest, {});
    ASSERT_EQ(from.contacts.size() + later.contacts.size(), whole.contacts.size()) << rest.start;
    for (size_t k = 0; k < later.contacts.size(); ++k) {
      EXPECT_EQ(later.contacts[k], whole.contacts[from.contacts.size() + k]);
      EXPECT_NEAR(later.contact_times[k], whole.contact_times[from.contacts.size() + k], 1e-5) << rest.start;
    }
    EXPECT_NEAR(later.gap.back(), whole.gap.back(), 1e-5 * largest) << rest.start;
  }
}

TEST_P(EveryEngine, AFailureTellsHowFarItCame) {
  const Hub system = bouncing_boom();
  IntegratorOptions o = short_flight();
  const Motion whole = GetParam().fly(system, start_of(system), o, {});
  o.max_steps = 20;
  SeenMotion last;
  EXPECT_THROW(GetParam().fly(system, start_of(system), o, [&](const SeenMotion& m) { last = m; }), NumericalError);
  EXPECT_GT(last.time.back(), 0);
  EXPECT_LT(last.time.back(), o.duration);
  EXPECT_TRUE(last.end.allFinite());
  for (size_t i = 0; i < last.outputs; ++i) EXPECT_EQ(last.gap[i], whole.gap[i]);
}

/// Overdamped, from a radian: it creeps to its stop and never meets it.
TEST_P(EveryEngine, AMotionThatDiesOutBeforeTheStopMakesNoContact) {
  struct Case {
    double settle, damping, tolerance;
    int modes;
  };
  for (const Case& c : {Case{-1, 0.03, 1e-7, 0}, Case{0, 0.1, 1e-4, 0}, Case{-1, 0.03, 1e-6, 1}}) {
    if (c.modes > 0 && GetParam().name == std::string("erk")) continue;  // a million steps
    HingeMechanism mechanism = testing::sport_mechanism(0.35);
    mechanism.damping = c.damping;
    const Hub system = boom(mechanism, c.modes);
    IntegratorOptions o;
    o.tolerance = c.tolerance, o.settle = c.settle;
    o.duration = 20 * (c.damping / 0.03) * (c.damping / 0.03);  // to e^-100 and beyond
    o.output_step = o.duration / 10;
    const Motion r = GetParam().fly(system, system.pack(system.at_rest({pi / 2 - 1})), o, {});
    EXPECT_EQ(r.contacts.size(), 0u) << "damping " << c.damping << ", modes " << c.modes;
    EXPECT_LT(std::abs(r.gap.back()), c.tolerance);
  }
}

/// A body that a torque turns, whose table ends on the way.
TEST(CheckpointOfATree, OutlivesAFunctionOfTimeThatEnds) {
  Multibody scene;
  scene.bodies = {rigid_body("bar", 1, Vector3d::Zero(), Vector3d(1, 1, 1).asDiagonal())};
  Joint joint;
  joint.name = "pivot", joint.a.body = -1, joint.b.body = 0, joint.mechanism = {0, 0, 0, 0, 0};
  scene.joints = {joint};
  Load load;
  load.name = "motor", load.at.body = 0;
  load.torque[2] = time_table({{0, 0.5}, {1, 1}, "linear", "error"}).function.value;
  scene.loads = {load};
  const Tree tree(scene);
  IntegratorOptions o;
  o.duration = 1, o.output_step = 0.01;
  for (const char* method : {"auto", "adams", "exponential"}) {
    o.method = method;
    int told = 0;
    size_t rows = 0;
    const auto look = [&](const TreeTrajectory& r, size_t) { ++told, rows = r.time.size(); };
    EXPECT_THROW(integrate(tree, tree.pack(tree.at_rest()), o, look), InputError) << method;
    EXPECT_GT(rows, 10U) << method;
    EXPECT_LE(told, 3) << method << ": it is not tried twice";
  }
}

// Then any method has no work; exponential collocation says so.
TEST(Integrate, WhereNothingMoves) {
  Multibody scene;
  scene.bodies = {rigid_body("block", 1, Vector3d::Zero(), Vector3d(1, 1, 1).asDiagonal())};
  Joint joint;
  joint.name = "weld", joint.kind = JointKind::fixed, joint.a.body = -1, joint.b.body = 0;
  joint.mechanism = {0, 0, 0, 0, 0};
  scene.joints = {joint};
  const Tree tree(scene);
  IntegratorOptions o;
  o.duration = 1, o.output_step = 0.1;
  EXPECT_EQ(integrate(tree, tree.pack(tree.at_rest()), o).time.size(), 11U);
  o.method = "exponential";
  EXPECT_THROW(integrate(tree, tree.pack(tree.at_rest()), o), InputError);
}

}  // namespace
}  // namespace flexboom
