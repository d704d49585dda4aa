#include "dynamics/methods/error_scales.hpp"
#include "dynamics/methods/ode.hpp"
#include "dynamics/relative/split.hpp"
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

class EveryMethod : public ::testing::TestWithParam<std::string> {};

std::vector<std::string> method_names() {
  std::vector<std::string> names;
  for (const IntegratorMethod& m : integrator_methods()) names.emplace_back(m.name);
  return names;
}
INSTANTIATE_TEST_SUITE_P(Table, EveryMethod, ::testing::ValuesIn(method_names()),
                         [](const auto& p) { return p.param; });

/// Boom 2 of SPORT on a hub that does not move: rigid with the inertia of a solid bar, or with eq. 14 modes.
Hub boom_2(int modes, double zeta = 0) {
  ReducedBody body;
  if (modes == 0) {
    const double m = 0.01645016453235955, J = 0.0004772175595249452;  // boom_properties.json
    body = rigid_body("boom", m, Vector3d(m * 0.295 / 2, 0, 0), Vector3d(5.140676416362361e-8, J, J).asDiagonal());
  } else {
    body = eq14::reduced_body(testing::round_boom(0.295, 0.005), modes, eq14::Planes::xy, "boom");
    if (zeta > 0) apply_damping(body, {"modal", zeta});
  }
  Hinge hinge;
  hinge.mechanism = testing::sport_mechanism(0.35);
  return Hub({}, {{body, hinge}});
}

/// Equations that have no answer, `left` times, after a time.
struct Unfit {
  double after = 0;
  int left = 0;

  void look(double t) {
    if (t > after && left-- > 0) throw UnfitState("no answer here");
  }
};

class UnfitOde final : public Ode {
 public:
  UnfitOde(std::unique_ptr<Ode> ode, Unfit& unfit) : ode_(std::move(ode)), unfit_(unfit) {}
  std::unique_ptr<Ode> another() const override { return ode_->another(); }
  int size() const override { return ode_->size(); }
  int stops() const override { return ode_->stops(); }
  void derivative(double t, const double* y, std::span<const char> contact, double* y_dot) override {
    unfit_.look(t);
    ode_->derivative(t, y, contact, y_dot);
  }
  void jacobian(double t, const double* y, std::span<const char> contact) override { ode_->jacobian(t, y, contact); }
  void factorise(double gamma) override { ode_->factorise(gamma); }
  void solve(const double* b, double* x) override { ode_->solve(b, x); }
  double gap(const double* y, int stop) const override { return ode_->gap(y, stop); }
  double gap_rate(const double* y, int stop) const override { return ode_->gap_rate(y, stop); }

 private:
  std::unique_ptr<Ode> ode_;
  Unfit& unfit_;
};

class UnfitSplit final : public SplitProblem {
 public:
  UnfitSplit(std::unique_ptr<SplitProblem> problem, Unfit& unfit) : problem_(std::move(problem)), unfit_(unfit) {}
  const SplitLayout& layout() const override { return problem_->layout(); }
  void derivative(double t, const double* y, std::span<const char> contact, double* y_dot) override {
    unfit_.look(t);
    problem_->derivative(t, y, contact, y_dot);
  }
  Vector3d outside_acceleration(size_t root) override { return problem_->outside_acceleration(root); }
  Eigen::MatrixXd linear(double t, const double* y, std::span<const char> contact) override {
    return problem_->linear(t, y, contact);
  }
  FloatingBodies floating(size_t root, double t, const double* y) override { return problem_->floating(root, t, y); }
  MassCentre mass_centre(size_t root, double t, const double* y) override { return problem_->mass_centre(root, t, y); }

 private:
  std::unique_ptr<SplitProblem> problem_;
  Unfit& unfit_;
};

/// A flight of boom 2 to 0.02 s, before its stop.
VectorXd swung(const std::string& name, Unfit& unfit) {
  const Hub system = boom_2(2);
  const Tree& tree = system.tree();
  VectorXd y = system.pack(system.at_rest({0.8}));
  ErrorScales scales(tree, y, 1e-9);
  const Laws laws(tree.scene().joints, {});
  const auto method = std::ranges::find(integrator_methods(), name, &IntegratorMethod::name);
  const std::unique_ptr<Stepper> stepper =
      method->make_split != nullptr
          ? method->make_split(std::make_unique<UnfitSplit>(split(tree), unfit), scales.error())
          : method->make(std::make_unique<UnfitOde>(ode_of(tree, laws), unfit), scales.error());
  const std::vector<char> contact(tree.stops().size(), 0);
  const std::vector<double> levels(contact.size(), no_level);
  std::vector<int> crossed(contact.size());
  double t = 0;
  for (stepper->restart(t, y, contact, levels); t < 0.02;) stepper->step(0.02, t, y, crossed);
  return y;
}

// Within a step a method may try a state that the motion never comes to. Explicit stages of ARKODE have no second try.
TEST_P(EveryMethod, TriesAShorterStepWhereATrialHasNoAnswer) {
  Unfit never, twice{.after = 0.01, .left = 2}, always{.after = 0.01, .left = 1 << 30};
  const VectorXd expected = swung(GetParam(), never);
  EXPECT_THROW(swung(GetParam(), always), UnfitState);
  if (GetParam() == "erk") return;
  const VectorXd y = swung(GetParam(), twice);
  EXPECT_LT(twice.left, 0);
  EXPECT_LT((y - expected).norm(), 1e-6 * expected.norm());
}

/// Every contact and release over 10 s keeps its digits, down to motions of 1e-45 rad.
TEST_P(EveryMethod, RigidBoomOnAFixedHubFollowsTheExactPiecewiseSolution) {
  const Hub system = boom_2(0);
  for (const int side : {3, -3}) {
    IntegratorOptions o;
    o.method = GetParam();
    o.tolerance = 1e-10;
    o.settle = 0;
    o.rescale_at_events = true;
    const TreeTrajectory r = integrate(system, system.pack(system.at_rest({pi / 2 + side * pi / 180})), o);
    double error = 0;
    for (const auto& row : testing::read_csv("hinge_angle_boom2.csv")) {
      const double exact = std::stod(row[side > 0 ? 1 : 3]);
      const auto i = static_cast<size_t>(std::llround(std::stod(row[0]) / o.output_step));
      error = std::max(error, std::abs(system.gap(r.y[i].data(), 0) - exact));
    }
    EXPECT_LT(error, 1e-9 * 3 * pi / 180) << side;
    size_t k = 0;
    double worst = 0;
    for (const auto& row : testing::read_csv("hinge_events_boom2.csv")) {
      if (std::stoi(row[2]) != side || std::stod(row[4]) > o.duration) continue;
      ASSERT_LT(k, r.events.size());
      worst = std::max(worst, std::abs(r.events[k].time - std::stod(row[4])));
      EXPECT_EQ(r.events[k].contact, row[6].starts_with("enters"));
      ++k;
    }
    EXPECT_EQ(k, r.events.size());
    EXPECT_LT(worst, 1e-9) << side;
  }
}

TEST_P(EveryMethod, FlexibleBoomOnAFixedHubMeetsTheReference) {
  for (const char* zeta : {"0.0", "0.05"}) {
    const Hub system = boom_2(1, std::stod(zeta));
    IntegratorOptions o;
    o.method = GetParam();
    o.tolerance = 1e-10;
    o.duration = 1;
    o.output_step = 0.005;
    o.settle = 0;
    o.rescale_at_events = true;  // the last contacts are 1e-4 of the first
    const TreeTrajectory r = integrate(system, system.pack(system.at_rest({pi / 2 + pi / 60})), o);
    double gap_error = 0, q_error = 0, gap_size = 0, q_size = 0;
    for (const auto& row : testing::read_csv("flexible_boom2_fixed_hub.csv")) {
      if (row[0] != "2" || row[1] != "1" || row[2] != zeta) continue;
      const auto i = static_cast<size_t>(std::llround(std::stod(row[3]) / o.output_step));
      if (i >= r.y.size()) continue;
      const double gap = std::stod(row[4]), q = std::stod(row[6]);
      gap_error = std::max(gap_error, std::abs(r.y[i][0] - gap));
      q_error = std::max(q_error, std::abs(r.y[i][1] - q));
      gap_size = std::max(gap_size, std::abs(gap));
      q_size = std::max(q_size, std::abs(q));
    }
    EXPECT_LT(gap_error, 1e-9 * gap_size) << zeta;
    EXPECT_LT(q_error, 1e-9 * q_size) << zeta;
    size_t k = 0;
    for (const auto& row : testing::read_csv("flexible_boom2_fixed_hub_events.csv")) {
      if (row[0] != "2" || row[1] != "1" || row[2] != zeta) continue;
      ASSERT_LT(k, r.events.size());
      EXPECT_NEAR(r.events[k++].time, std::stod(row[4]), 1e-9);
    }
    EXPECT_EQ(k, 11U) << zeta;
    EXPECT_EQ(r.events.size(), k) << zeta;
  }
}

/// Free, undamped, no stop: Delta = Delta_0 cos(omega t).
// Steps of minutes: nothing about a stop is measured in seconds.
TEST_P(EveryMethod, SlowSwingBesideAStop) {
  Appendage a = boom_2(0).appendages()[0];
  const double rate = 2 * pi / 3600, J = a.body.J0(2, 2);
  a.hinge.mechanism = {J * rate * rate, pi / 2 - 0.1, 0, 10.0, pi / 2};
  const Hub system({}, {a});
  IntegratorOptions o;
  o.method = GetParam();
  o.duration = 7200;
  o.output_step = 100;
  const TreeTrajectory r = integrate(system, system.pack(system.at_rest({pi / 2 - 0.15})), o);
  EXPECT_TRUE(r.events.empty());
  EXPECT_LT(r.summary.steps, 3000);
  double error = 0;
  for (size_t i = 0; i < r.time.size(); ++i)
    error = std::max(error, std::abs(system.gap(r.y[i].data(), 0) + 0.1 + 0.05 * std::cos(rate * r.time[i])));
  EXPECT_LT(error, 1e-6);  // ten times the tolerance
}

TEST_P(EveryMethod, ErrorOfAnOscillatorFollowsTheTolerance) {
  const Hub damped = boom_2(0);
  Appendage a = damped.appendages()[0];
  a.hinge.mechanism.damping = 0;
  a.hinge.mechanism.stop_stiffness = 0;
  const Hub system({}, {a});
  const double omega = std::sqrt(a.hinge.mechanism.stiffness / a.body.J0(2, 2));
  for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10}) {
    IntegratorOptions o;
    o.method = GetParam();
    o.tolerance = tolerance;
    o.duration = 2;  // 7 periods
    const TreeTrajectory r = integrate(system, system.pack(system.at_rest({pi / 2 + 0.05})), o);
    double error = 0;
    for (size_t i = 0; i < r.time.size(); ++i)
      error = std::max(error, std::abs(r.y[i][0] - 0.05 * std::cos(omega * r.time[i])));
    EXPECT_LT(error, 30 * tolerance * 0.05) << tolerance;  // 7 undamped periods add up some thirty local errors
    EXPECT_EQ(r.events.size(), 0U);
  }
}

/// I = (0.134942, 0.10477, 0.05858) tumbling without torque (Jacobi elliptic functions).
TEST_P(EveryMethod, TorqueFreeTumblingMeetsTheEllipticFunctions) {
  const Hub system(rigid_body("hub", 8.5, Vector3d::Zero(), Vector3d(0.134942, 0.10477, 0.05858).asDiagonal()), {});
  HubState s = system.at_rest({});
  s.omega = Vector3d(0.1, 1, 0.05);
  IntegratorOptions o;
  o.method = GetParam();
  o.tolerance = 1e-10;
  o.duration = 50;
  o.output_step = 1;
  const TreeTrajectory r = integrate(system, system.pack(s), o);
  double rate_error = 0, attitude_error = 0;
  for (const auto& row : testing::read_csv("torque_free_case_b.csv")) {
    const auto i = static_cast<size_t>(std::llround(std::stod(row[1])));
    if (i >= r.time.size()) continue;
    const HubState state = system.unpack(r.y[i]);
    rate_error =
        std::max(rate_error, (state.omega - Vector3d(std::stod(row[2]), std::stod(row[3]), std::stod(row[4]))).norm());
    const Eigen::Vector4d q(std::stod(row[5]), std::stod(row[6]), std::stod(row[7]), std::stod(row[8]));
    attitude_error = std::max(attitude_error, std::min((state.attitude - q).norm(), (state.attitude + q).norm()));
  }
  // Unstable about the middle axis: errors grow between the flips, a hundredfold over 50 s.
  EXPECT_LT(rate_error, 1e-7);
  EXPECT_LT(attitude_error, 1e-7);
  EXPECT_LT(r.summary.energy_balance, 1e-8);
  EXPECT_LT(r.summary.momentum_drift, 1e-8);
}

TEST(Integrator, OutputsStandOnTheGridAndAtTheEnd) {
  const Hub system = boom_2(0);
  IntegratorOptions o;
  o.duration = 0.25;
  o.output_step = 0.1;
  const TreeTrajectory r = integrate(system, system.pack(system.at_rest({1.5})), o);
  EXPECT_EQ(r.time, (std::vector<double>{0.0, 0.1, 0.2, 0.25}));
}

TEST(Integrator, StopsWhenAsked) {
  const Hub system = boom_2(0);
  std::atomic<bool> stop{true};
  IntegratorOptions o;
  o.interrupt = &stop;
  const TreeTrajectory r = integrate(system, system.pack(system.at_rest({1.5})), o);
  EXPECT_TRUE(r.summary.interrupted);
  EXPECT_EQ(r.time, (std::vector<double>{0.0}));
}

// A step may hold thousands of outputs. Where it is interrupted among them, the flight is where the last of them is:
// what goes on from there misses none, and moves as if nothing had happened.
TEST(Integrator, AnInterruptionWithinAStepLosesNoOutput) {
  const Hub system = boom_2(0);
  for (const char* method : {"exponential", "adams", "dirk"}) {
    SCOPED_TRACE(method);
    std::atomic<bool> stop{false};
    IntegratorOptions o;
    o.method = method;
    o.duration = 0.5;
    o.output_step = 2e-6;
    o.tolerance = 1e-8;
    const TreeTrajectory whole = integrate(system, system.pack(system.at_rest({1.5})), o);
    o.interrupt = &stop;
    o.progress = [&](double t, double) { stop = stop || t > 0.2; };
    const TreeTrajectory cut = integrate(system, system.pack(system.at_rest({1.5})), o);
    ASSERT_TRUE(cut.summary.interrupted);
    ASSERT_GT(cut.time.size(), 100000u);
    ASSERT_LT(cut.time.size(), whole.time.size());
    for (size_t i = 0; i < cut.time.size(); ++i) ASSERT_EQ(cut.time[i], whole.time[i]) << i;
    EXPECT_LT((cut.y.back() - whole.y[cut.y.size() - 1]).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(Integrator, StartsBeyondTheStopAndExactlyOnIt) {
  const Hub system = boom_2(0);
  IntegratorOptions o;
  o.duration = 1;
  EXPECT_FALSE(integrate(system, system.pack(system.at_rest({pi / 2 + 0.1})), o).events.front().contact);
  HubState s = system.at_rest({pi / 2});
  EXPECT_TRUE(integrate(system, system.pack(s), o).events.empty());
  s.rate[0] = 1;
  EXPECT_FALSE(integrate(system, system.pack(s), o).events.front().contact);
  s.rate[0] = -1;
  EXPECT_TRUE(integrate(system, system.pack(s), o).events.front().contact);
}

/// The spring presses the boom against a stop that it starts on, at rest: it must sink in by tau / k and swing there,
/// not through.
TEST(Integrator, StopHoldsABoomThatIsPressedAgainstItFromTheStart) {
  Appendage a = boom_2(0).appendages()[0];
  a.hinge.mechanism.rest = 1.8;
  a.hinge.mechanism.damping = 0;
  const HingeMechanism& m = a.hinge.mechanism;
  const Hub system({}, {a});
  const TreeTrajectory r = integrate(system, system.pack(system.at_rest({pi / 2})), {});
  const double depth = m.stiffness * (m.rest - m.threshold) / (m.stiffness + m.stop_stiffness);
  double deepest = 0;
  for (const VectorXd& y : r.y) deepest = std::max(deepest, y[0]);
  EXPECT_NEAR(deepest, 2 * depth, 0.01 * depth);  // 1 - cos(omega t), on the output grid
  EXPECT_LT(r.summary.energy_balance, 1e-5);
}

/// The hub turns: the boom lifts off or sinks in only after the start, from exact rest on the stop.
TEST(Integrator, StopHoldsABoomOnASpinningHub) {
  Appendage a = boom_2(0).appendages()[0];
  a.hinge.mechanism.stop_stiffness = 1000;
  const Hub system(rigid_body("hub", 8.5, Vector3d::Zero(), 0.1 * Matrix3d::Identity()), {a});
  HubState s = system.at_rest({pi / 2});
  for (const double spin : {1.0, -1.0}) {
    s.omega = Vector3d(0.3, 0.2, spin);
    const TreeTrajectory r = integrate(system, system.pack(s), {});
    EXPECT_LT(r.summary.energy_balance, 1e-6) << spin;
    for (const VectorXd& y : r.y) EXPECT_LT(y[0], 1e-4) << spin;
  }
}

TEST(Integrator, SettledHingesAreReportedAndNoLongerLogged) {
  const Hub system = boom_2(0);
  IntegratorOptions o;
  o.tolerance = 1e-6;
  const TreeTrajectory r = integrate(system, system.pack(system.at_rest({pi / 2 + 0.05})), o);
  EXPECT_LT(r.events.size(), 25U);
  EXPECT_GT(r.summary.stops[0].settled, 0);
  EXPECT_LT(std::abs(r.events.back().rate), 1e-6 * 7);  // the tolerance of the largest
}

TEST(Integrator, NamesTheMethodsThatExist) {
  const Hub system = boom_2(0);
  IntegratorOptions o;
  o.method = "euler";
  try {
    integrate(system, system.pack(system.at_rest({1.5})), o);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("'bdf' 'adams'"), std::string::npos) << e.what();
  }
}

TEST(Integrator, RefusesBadOptions) {
  const Hub system = boom_2(0);
  const VectorXd y0 = system.pack(system.at_rest({1.5}));
  const auto with = [&](auto change) {
    IntegratorOptions o;
    change(o);
    return o;
  };
  EXPECT_THROW(integrate(system, y0, with([](auto& o) { o.tolerance = 0; })), InputError);
  EXPECT_THROW(integrate(system, y0, with([](auto& o) { o.duration = -1; })), InputError);
  EXPECT_THROW(integrate(system, y0, with([](auto& o) { o.output_step = 1e-12; })), InputError);
  EXPECT_THROW(integrate(system, VectorXd::Constant(y0.size(), NAN), {}), InputError);
}

}  // namespace
}  // namespace flexboom
