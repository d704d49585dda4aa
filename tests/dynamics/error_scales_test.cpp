#include "dynamics/methods/error_scales.hpp"

#include "sport_testing.hpp"

#include <gtest/gtest.h>

namespace flexboom {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

/// SPORT at rest, its booms where their springs are, with a wheel of 0.1 J at 5000 rad/s.
Tree sport_with_a_wheel() {
  Multibody scene = hub_with_booms(testing::sport_hub(), testing::sport_booms(2), {});
  scene.wheels.push_back({"wheel", 0, Vector3d::UnitZ(), 8e-9, 0, {}});
  return Tree(std::move(scene));
}

/// All booms by an angle beyond their stops [rad], the wheel spinning [rad/s].
VectorXd turned_by(const Tree& tree, double angle, double spin) {
  VectorXd y = tree.pack(tree.at_rest());
  for (const int stop : tree.stops()) y[tree.layout().joints[static_cast<size_t>(stop)].scalar] = angle;
  y[tree.layout().spin] = spin;
  return y;
}

// A boom that its spring presses into the stop does not move: its rate is not that of a swing through the stop as deep.
TEST(ErrorScales, WhatIsPressedIntoItsStopAtRestHasNoRate) {
  const Tree tree = sport_with_a_wheel();
  constexpr double depth = 1e-4;  // [rad], far above all floors
  ErrorScales scales(tree, turned_by(tree, 0, 0), 1e-6);
  scales.observe(turned_by(tree, depth, 0));
  for (const int stop : tree.stops()) {
    const auto joint = static_cast<size_t>(stop);
    const int gap = tree.layout().joints[joint].scalar;
    const ReducedBody& boom = tree.scene().bodies[static_cast<size_t>(tree.scene().joints[joint].b.body)];
    const double swing = std::sqrt(tree.scene().joints[joint].mechanism.stiffness / boom.J0.diagonal().maxCoeff());
    EXPECT_EQ(scales.error().scale[gap], depth);
    EXPECT_NEAR(scales.error().scale[tree.layout().rate(gap)], depth * swing, 1e-12 * depth * swing);
  }
}

TEST(ErrorScales, WheelsThatSpinAtTheStartLoosenNothing) {
  const Tree tree = sport_with_a_wheel();
  const VectorXd still = turned_by(tree, -1e-3, 0), spins = turned_by(tree, -1e-3, 5000);
  const ErrorScales at_rest(tree, still, 1e-6), with_spin(tree, spins, 1e-6);
  EXPECT_NEAR(tree.balance(0, spins).kinetic, 0.1, 1e-12);
  EXPECT_EQ(tree.balance(0, spins).shaking(), tree.balance(0, still).shaking());
  const int spin = tree.layout().spin;
  for (int i = 0; i < tree.layout().size; ++i)
    EXPECT_EQ(with_spin.error().scale[i], i == spin ? 5000 : at_rest.error().scale[i]) << i;
}

}  // namespace
}  // namespace flexboom
