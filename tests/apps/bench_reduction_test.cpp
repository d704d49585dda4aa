#include "apps/bench/reduction.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace flexboom {
namespace {

/// The smallest mesh of every family.
const ReductionBenches& smallest() {
  static const ReductionBenches bench = bench_reduction(1e-6, 1, [](const ReductionBench&) {});
  return bench;
}

TEST(SlowBenchReduction, WhatModesLackIsThatOfTheSlenderBeam) {
  // Clamped modes of a line mass, alpha_1 = 1.8751: mode k holds 4 sigma^2 / alpha^2 of the mass and 12 / alpha^4 of
  // the tip compliance. Shear and rotary inertia change the boom by some (d / L)^2 = 1e-3, of what is left by a few
  // 1e-2.
  constexpr double alpha = 1.8751040687, sigma = 0.7340955138;
  for (const ReductionBench& r : smallest().rows) {
    if (r.modes != 2) continue;
    EXPECT_NEAR(r.mass_missing, 1 - 4 * sigma * sigma / (alpha * alpha), 4e-3) << r.family;
    EXPECT_NEAR(r.compliance_error, 1 - 12 / std::pow(alpha, 4), 1e-3) << r.family;
    // Rigid rotation and one clamped mode, of unit modal mass: omega^2 = omega_1^2 / (1 - 3 (2 / alpha^2)^2), against
    // the pinned beam's 3.9266^4.
    const double one = std::pow(alpha, 4) / (1 - 12 / std::pow(alpha, 4));
    EXPECT_NEAR(r.hinge_error, std::sqrt(one / std::pow(3.9266023120, 4)) - 1, 1e-2) << r.family;
  }
}

TEST(SlowBenchReduction, MoreModesLackLess) {
  double compliance = 1, mass = 1, hinge = 1;
  for (const ReductionBench& r : smallest().rows) {
    if (r.modes == 2) compliance = mass = hinge = 1;
    EXPECT_LT(r.compliance_error, compliance);
    EXPECT_LT(r.mass_missing, mass);
    EXPECT_LT(r.hinge_error, hinge);
    compliance = r.compliance_error, mass = r.mass_missing, hinge = r.hinge_error;
  }
}

TEST(SlowBenchReduction, ConsistentInvariantsAreNearerThanLumpedOnes) {
  for (const InvariantsBench& r : smallest().invariants) {
    const double consistent = std::ranges::max(r.consistent), lumped = std::ranges::max(r.lumped);
    EXPECT_LT(consistent, r.family == "hex20" ? 2e-2 : 2e-4) << r.family;  // hex20: the section of one ring
    EXPECT_GT(lumped, 5 * consistent) << r.family;
  }
  EXPECT_EQ(smallest().invariants.size(), 4U);
}

}  // namespace
}  // namespace flexboom
