// Cases where integrators and contact logic break, each with the outcome that must be seen.

#include "dynamics/numerics/rotation.hpp"
#include "dynamics/simulation/tree_integrator.hpp"

#include "fem/base/check.hpp"
#include "hub_testing.hpp"

#include <gtest/gtest.h>

namespace flexboom {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::Hub;
using testing::HubState;

using std::numbers::pi;

class Hard : public ::testing::TestWithParam<std::string> {
 protected:
  IntegratorOptions options(double tolerance, double duration) const {
    IntegratorOptions o;
    o.method = GetParam();
    o.tolerance = tolerance;
    o.duration = duration;
    return o;
  }
};
INSTANTIATE_TEST_SUITE_P(Methods, Hard, ::testing::Values("exponential", "bdf", "dirk"),
                         [](const auto& p) { return p.param; });

/// A rigid boom about its hinge, J Delta'' + c Delta' + k Delta = 0 with a stop at Delta = 0.
struct Pendulum {
  double J = 4.772175595249452e-4, c = 0.01, k = 0.2228169203286535, stop = 10;

  Hub system() const {
    ReducedBody body = rigid_body("boom", 0.01645, Vector3d(0.01645 * 0.1475, 0, 0), Vector3d(5e-8, J, J).asDiagonal());
    Hinge hinge;
    hinge.mechanism = {k, pi / 2, c, stop, pi / 2};
    return Hub({}, {{body, hinge}});
  }

  /// Crossings of the stop from Delta = `start` < 0 at rest: half a period of either side each.
  std::vector<double> crossings(int count) const {
    const double d = c / (2 * J), free = std::sqrt(k / J - d * d), closed = std::sqrt((k + stop) / J - d * d);
    std::vector<double> t{(pi - std::atan2(free, d)) / free};
    // From rest at the far side: tan(w t) = -w / d, a quarter of a period without damping.
    while (std::ssize(t) < count) t.push_back(t.back() + pi / (t.size() % 2 ? closed : free));
    return t;
  }
};

TEST_P(Hard, AStopAMillionTimesAsStiff) {
  Pendulum p;
  p.stop *= 1e6;
  const Hub system = p.system();
  IntegratorOptions o = options(1e-9, 1.5);
  o.settle = 1e-9;
  const TreeTrajectory r = integrate(system, system.pack(system.at_rest({pi / 2 - 0.05})), o);
  const std::vector<double> exact = p.crossings(12);
  ASSERT_GE(r.events.size(), exact.size());
  for (size_t i = 0; i < exact.size(); ++i)
    EXPECT_NEAR(r.events[i].time, exact[i],
                GetParam() == "exponential" ? 1e-9
                : GetParam() == "dirk"      ? 1e-8
                                            : 1e-6)
        << i;
}

TEST_P(Hard, TenThousandContactsWithoutDamping) {
  if (GetParam() != "exponential") GTEST_SKIP() << "loses energy; 40 times slower";
  Pendulum p;
  p.c = 0;
  const Hub system = p.system();
  const std::vector<double> exact = p.crossings(10000);
  const TreeTrajectory r =
      integrate(system, system.pack(system.at_rest({pi / 2 - 0.05})), options(1e-9, exact.back() + 1e-3));
  ASSERT_EQ(r.events.size(), exact.size());
  EXPECT_NEAR(r.events.back().time, exact.back(), 1e-7);
  EXPECT_LT(r.summary.energy_balance, 1e-9);
}

// The spring draws the boom to a place 0.1 rad off the stop; it starts beyond that place by a little more or less.
TEST_P(Hard, GrazingContact) {
  Pendulum p;
  p.c = 0;
  const Hub plain = p.system();
  Appendage a = plain.appendages()[0];
  a.hinge.mechanism.rest = pi / 2 - 0.1;
  const Hub system({}, {a});
  const double period = 2 * pi * std::sqrt(p.J / p.k);
  for (const double excess : {1e-6, -1e-6}) {
    const VectorXd y0 = system.pack(system.at_rest({pi / 2 - 0.2 - 0.1 * excess}));
    const TreeTrajectory r = integrate(system, y0, options(1e-9, 3.2 * period));
    EXPECT_EQ(r.events.size(), excess > 0 ? 6U : 0U);
    for (const VectorXd& y : r.y) EXPECT_LT(y[0], 2e-7);
  }
}

Hub boom_on_hub(double hub_mass, int modes) {
  ReducedBody body = eq14::reduced_body(testing::round_boom(0.295, 0.005), modes, eq14::Planes::xy, "boom");
  apply_damping(body, {"modal", 0.05});
  Hinge hinge;
  hinge.mechanism = testing::sport_mechanism(0.35);
  hinge.point = Vector3d(0.05, 0.1, 0);
  return Hub(rigid_body("hub", hub_mass, Vector3d::Zero(), hub_mass / 60 * Matrix3d::Identity()), {{body, hinge}});
}

// On a hub 1e6 times as heavy the boom moves as on one that is held; the difference is their mass ratio.
TEST_P(Hard, ABoomAMillionTimesLighterThanTheHub) {
  const Hub free = boom_on_hub(0.01645e6, 1);
  const Hub held({}, {free.appendages()[0]});
  const std::vector<double> start{pi / 2 - 0.05};
  const TreeTrajectory a = integrate(free, free.pack(free.at_rest(start)), options(1e-8, 1));
  const TreeTrajectory b = integrate(held, held.pack(held.at_rest(start)), options(1e-8, 1));
  for (size_t i = 0; i < a.y.size(); ++i) EXPECT_NEAR(a.y[i][0], b.y[i][0], 2e-6 * 0.05);
  EXPECT_LT(a.summary.energy_balance, 1e-7);
  double turned = 0;
  for (const VectorXd& y : a.y) turned = std::max(turned, y.segment<3>(free.layout().attitude() + 1).norm());
  EXPECT_GT(turned, 0);  // it does turn
}

TEST_P(Hard, FrequenciesAMillionApart) {
  const Hub one = boom_on_hub(8.5, 1);
  Appendage stiff = boom_on_hub(8.5, 2).appendages()[0];
  const double ratio = stiff.body.Ke(1, 1) / stiff.body.Me(1, 1) / (stiff.body.Ke(0, 0) / stiff.body.Me(0, 0));
  stiff.body.Ke(1, 1) *= 1e12 / ratio;  // the second mode is rigid, to the motion of the first
  apply_damping(stiff.body, {"modal", 0.05});
  const Hub two(one.hub(), {stiff});
  const TreeTrajectory ra = integrate(two, two.pack(two.at_rest({pi / 2 - 0.05})), options(1e-7, 0.5));
  const TreeTrajectory rb = integrate(one, one.pack(one.at_rest({pi / 2 - 0.05})), options(1e-7, 0.5));
  for (size_t i = 0; i < ra.y.size(); ++i) EXPECT_NEAR(ra.y[i][0], rb.y[i][0], 1e-5 * 0.05) << ra.time[i];
}

// The hinge row is left with 1e-8 of its inertia, which then depends on q: L must be taken anew along the way.
TEST_P(Hard, TwoHundredModesOnOneBoom) {
  if (GetParam() == "bdf") GTEST_SKIP() << "minutes";
  const auto fly = [&](int modes, double duration) {
    const Hub system = boom_on_hub(8.5, modes);
    IntegratorOptions o = options(1e-6, duration);
    o.output_step = 5e-4;
    return integrate(system, system.pack(system.at_rest({pi / 2 - 0.05})), o);
  };
  const TreeTrajectory few = fly(20, 0.05);
  for (const auto& [modes, duration] : {std::pair{60, 0.05}, {200, 0.001}}) {
    const TreeTrajectory many = fly(modes, duration);
    for (size_t i = 0; i < many.y.size(); ++i) EXPECT_NEAR(few.y[i][0], many.y[i][0], 1e-7 * 0.05) << many.time[i];
    EXPECT_LT(many.summary.energy_balance, 1e-7);
  }
}

TEST_P(Hard, ToleranceOf1e12And1e2) {
  const Hub system = boom_on_hub(8.5, 2);
  const VectorXd y0 = system.pack(system.at_rest({pi / 2 - 0.05}));
  const TreeTrajectory fine = integrate(system, y0, options(1e-12, 1)),
                       coarse = integrate(system, y0, options(1e-2, 1)),
                       middle = integrate(system, y0, options(1e-9, 1));
  for (size_t i = 0; i < fine.y.size(); ++i) {
    EXPECT_NEAR(coarse.y[i][0], fine.y[i][0], 1e-2 * 0.05);
    EXPECT_NEAR(middle.y[i][0], fine.y[i][0], 1e-9 * 0.05);
  }
  EXPECT_LT(fine.summary.energy_balance, 1e-11);
}

TEST_P(Hard, OutputsEveryNanosecond) {
  const Hub system = boom_on_hub(8.5, 2);
  IntegratorOptions o = options(1e-6, 1e-6);
  o.output_step = 1e-9;
  const TreeTrajectory r = integrate(system, system.pack(system.at_rest({pi / 2 - 0.05})), o);
  ASSERT_EQ(r.y.size(), 1001U);
  const double push = 2 * (r.y[1000][0] - r.y[0][0]) / 1e-12;  // constant acceleration
  EXPECT_NEAR(2 * (r.y[500][0] - r.y[0][0]) / 0.25e-12, push, 1e-2 * push);
}

TEST_P(Hard, AMillionSeconds) {
  const Hub system = boom_on_hub(8.5, 2);
  IntegratorOptions o = options(1e-6, 1e6);
  o.output_step = 1e5;
  const TreeTrajectory r = integrate(system, system.pack(system.at_rest({pi / 2 - 0.05})), o);
  EXPECT_EQ(r.time.back(), 1e6);
  EXPECT_LT(std::abs(r.y.back()[0]), 1e-9);  // it has come to rest on its stop
  EXPECT_LT(r.summary.energy_balance, 1e-5);
  // Free from outside: the hub ends where the boom's motion left it.
  EXPECT_LT((r.y.back() - r.y[1]).segment<3>(system.layout().attitude() + 1).norm(), 1e-5);
}

// Two turns a second for days about a principal axis.
TEST_P(Hard, AMillionTurns) {
  if (GetParam() != "exponential") GTEST_SKIP() << "1e8 steps";
  const Hub system(rigid_body("hub", 8.5, Vector3d::Zero(), Vector3d(0.13, 0.1, 0.06).asDiagonal()), {});
  HubState s = system.at_rest({});
  s.omega = Vector3d(4 * pi, 0, 0);
  IntegratorOptions o = options(1e-9, 0.5e6 + 0.125);
  o.output_step = 1e5;
  const TreeTrajectory r = integrate(system, system.pack(s), o);
  const Eigen::Vector4d q = r.y.back().segment<4>(system.layout().attitude());
  EXPECT_NEAR(q.norm(), 1, 1e-14);
  EXPECT_LT((rotation_vector(q) - Vector3d(pi / 2, 0, 0)).norm(), 1e-8);  // 2e6 pi times round-off
}

TEST(HardHub, AHubWithoutInertiaAboutAnAxisIsRefused) {
  EXPECT_THROW(Hub(rigid_body("hub", 8.5, Vector3d::Zero(), Vector3d(0, 0.1, 0.1).asDiagonal()), {}), InputError);
}

}  // namespace
}  // namespace flexboom
