// Speed of trees: SPORT beside System in one run, chains of flexible links by their length, bodies by their modes.

#include "dynamics/multibody_of.hpp"
#include "dynamics/tree_integrator.hpp"

#include "reduction/eq14.hpp"
#include "tests/bench_hub.hpp"

#include <benchmark/benchmark.h>

#include <cmath>

namespace {

using namespace flexboom;
using Eigen::Vector3d;
using Eigen::VectorXd;

void SportBySystem(benchmark::State& state) {
  const HubInFlight f = sport(static_cast<int>(state.range(0)));
  const VectorXd y = moving_state(f);
  VectorXd y_dot(y.size());
  const std::vector<char> contact(4, 0);
  const auto work = f.system.workspace();
  for (auto _ : state) f.system.derivative(y.data(), contact, *work, y_dot.data());
}
BENCHMARK(SportBySystem)->Arg(2)->Arg(8);

void SportByTree(benchmark::State& state) {
  const HubInFlight f = sport(static_cast<int>(state.range(0)));
  const Tree tree(multibody_of(f.system));
  const VectorXd of_system = moving_state(f);
  VectorXd y = VectorXd::Zero(tree.layout().size), y_dot(y.size()), expected(of_system.size());
  const Eigen::Index n = of_system.size() - 2;  // all but the energies
  y.head(n) = of_system.head(n);
  const std::vector<char> contact(5, 0);
  const auto work = tree.workspace();
  for (auto _ : state) tree.derivative(0, y.data(), contact, *work, y_dot.data());
  f.system.derivative(of_system.data(), std::vector<char>(4, 0), *f.system.workspace(), expected.data());
  state.counters["difference_from_system"] = (y_dot.head(n) - expected.head(n)).norm() / expected.norm();
}
BENCHMARK(SportByTree)->Arg(2)->Arg(8);

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

void JacobianOfSport(benchmark::State& state) {
  const HubInFlight f = sport(2);
  const Tree tree(multibody_of(f.system));
  VectorXd y = VectorXd::Zero(tree.layout().size);
  const VectorXd of_system = moving_state(f);
  y.head(of_system.size() - 2) = of_system.head(of_system.size() - 2);
  Eigen::MatrixXd J;
  const auto work = tree.workspace();
  const std::vector<char> contact(5, 0);
  for (auto _ : state) tree.jacobian(0, y.data(), contact, *work, J);
}
BENCHMARK(JacobianOfSport);

}  // namespace
