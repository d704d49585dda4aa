// Speed of trees: chains of flexible links by their length, bodies by their modes, stars by their booms.

#include "dynamics/model/hub_with_booms.hpp"
#include "dynamics/simulation/tree_integrator.hpp"

#include "reduction/invariants/eq14.hpp"
#include "tests/bench_hub.hpp"

#include <benchmark/benchmark.h>

#include <cmath>
#include <functional>
#include <numbers>

namespace {

using namespace flexboom;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Flexible links of some modes, each hinged to the tip of the one before, random deflections.
Tree chain(int links, int modes) {
  Multibody scene;
  for (int i = 0; i < links; ++i) {
    scene.bodies.push_back(eq14::reduced_body({1.0, 0.5, 2000.0}, modes, eq14::Planes::xy, "link"));
    Joint joint;
    joint.name = "hinge";
    joint.a.body = i - 1;
    if (i > 0) joint.a.marker = "tip";
    joint.b.body = i;
    scene.joints.push_back(joint);
  }
  return Tree(std::move(scene));
}

VectorXd bent(const Tree& tree) {
  VectorXd y = tree.pack(tree.at_rest());
  const TreeLayout& l = tree.layout();
  for (int i = 0; i < l.p; ++i) y[i] = 0.01 * std::sin(i + 1.0), y[l.rate(i)] = 0.1 * std::cos(3.0 * i);
  return y;
}

void run(benchmark::State& state, const Tree& tree) {
  const VectorXd y = bent(tree);
  VectorXd y_dot(y.size());
  const std::vector<char> contact(tree.scene().joints.size(), 0);
  const auto work = tree.workspace();
  for (auto _ : state) tree.derivative(0, y.data(), contact, *work, y_dot.data());
  state.SetComplexityN(state.range(0));
}

void ChainByLinks(benchmark::State& state) { run(state, chain(static_cast<int>(state.range(0)), 2)); }
BENCHMARK(ChainByLinks)->RangeMultiplier(2)->Range(1, 64)->Complexity();

void ChainByModes(benchmark::State& state) { run(state, chain(4, static_cast<int>(state.range(0)))); }
BENCHMARK(ChainByModes)->RangeMultiplier(2)->Range(2, 64)->Complexity();

/// Booms of so many modes on a free hub.
Tree star(int booms, const std::function<int(int boom)>& modes) {
  std::vector<Appendage> appendages;
  for (int i = 0; i < booms; ++i) {
    const ReducedBody boom = eq14::reduced_body({1.0, 0.5, 2000.0}, modes(i), eq14::Planes::xy, "boom");
    const double angle = 2 * std::numbers::pi * i / booms;
    const Vector3d out(std::cos(angle), std::sin(angle), 0);
    appendages.push_back(
        {boom, {.point = out, .stowed = Vector3d::UnitZ(), .outward = out, .mechanism = {0.1, 1.5, 0.01, 10, 1.6}}});
  }
  return Tree(hub_with_booms(rigid_body("hub", 100, Vector3d::Zero(), 50 * Eigen::Matrix3d::Identity()), appendages));
}

/// Equal booms are computed side by side.
void StarOfEqualBooms(benchmark::State& state) {
  run(state, star(static_cast<int>(state.range(0)), [](int) { return 8; }));
}
BENCHMARK(StarOfEqualBooms)->RangeMultiplier(4)->Range(1, 64)->Complexity();

/// No two have equally many modes; eight in the mean.
void StarOfUnequalBooms(benchmark::State& state) {
  const auto booms = static_cast<int>(state.range(0));
  run(state,
      star(booms, [booms](int i) { return booms == 1 ? 8 : static_cast<int>(std::lround(16.0 * i / (booms - 1))); }));
}
BENCHMARK(StarOfUnequalBooms)->Arg(4)->Arg(16);

void JacobianOfSport(benchmark::State& state) {
  const SceneInFlight f = sport(2);
  const VectorXd y = moving_state(f);
  Eigen::MatrixXd J;
  const auto work = f.tree.workspace();
  const std::vector<char> contact = all_open(f);
  for (auto _ : state) f.tree.jacobian(0, y.data(), contact, *work, J);
}
BENCHMARK(JacobianOfSport);

}  // namespace
