#include "reduction/invariants/prestressed.hpp"

#include "fem/base/check.hpp"
#include "reduction/basis/modal_basis.hpp"
#include "reduction/invariants/geometric_stiffness.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tests/reduction/csv.hpp"
#include "tests/reduction/geometric_stiffness_testing.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace flexboom::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

Model line_mass(double diameter, double L, const Material& material) {
  BeamGeometry boom = uniform_boom(RoundBar{diameter}, L, BeamTheory::euler_bernoulli, 6, 8);
  boom.segments[0].material = material;
  boom.rotary_inertia = false;
  return clamped(make_mesh(boom));
}

ReducedBody stiffened(const Model& model, const ModalBasis& basis) {
  ReducedBody body = reduce(model.mesh, model.assembly, basis, "boom");
  body.Kg = geometric_stiffness(model.mesh, model.assembly, model.clamp, basis.Phi);
  return body;
}

ModalBasis held(const Model& model, int count) {
  EigenOptions options;
  options.num_modes = count;
  return clamped_modes(model.mesh, model.assembly, model.clamp, options);
}

PrestressedBasis prestressed(const Model& model, const SteadyMotion& motion, int modes) {
  return prestressed_modes(
      model.mesh, model.assembly, model.clamp, motion, [&](int count) { return held(model, count); }, 200, modes);
}

/// A root that is held, at a distance from the axis of spin.
TEST(Prestressed, RotatingCantileversHaveTheFrequenciesOfTheTable) {
  constexpr double L = 0.302, diameter = 0.01;
  const Model model = line_mass(diameter, L, aluminium);
  const double EI = aluminium.E * pi * std::pow(diameter, 4) / 64, m = aluminium.rho * pi * diameter * diameter / 4;
  const double unit = std::sqrt(EI / m) / (L * L);
  const ReducedBody body = stiffened(model, held(model, 50));  // 25 of each plane leave 5e-6
  const test::Table table = test::read_csv("rotating_cantilever.csv");
  const std::vector<double>&eta = table.at("eta"), &ratio = table.at("hub_ratio_R_over_L");
  ASSERT_GE(eta.size(), 10u);
  for (size_t row = 0; row < eta.size(); ++row) {
    const double spin = eta[row] * unit, radius = ratio[row] * L;
    const SteadyMotion motion{{0, 0, spin}, {-spin * spin * radius, 0, 0}, {}};
    const VectorXd omega = prestressed_shapes(body, motion, 14).lambda.cwiseSqrt() / unit;
    for (const char* plane : {"flap", "leadlag"})
      for (int k = 1; k <= 5; ++k) {
        const double exact = table.at(fmt::format("{}_{}", plane, k))[row];
        EXPECT_LT((omega.array() / exact - 1).abs().minCoeff(), 1e-5) << plane << k << ", row " << row;
      }
  }
}

/// A string that turns about its end has the shapes P_k, k = 3, 5, ..., and omega^2 = k (k + 1) / 2 Omega^2 out of the
/// plane, less Omega^2 in it (Legendre's equation). Its first ones, k = 1, are rotations without a shape. A stiffness
/// epsilon = EI / (m Omega^2 L^4) adds epsilon int P''^2 / int P^2: 525 and 12705 epsilon.
TEST(Prestressed, AStringThatTurnsFreelyHasTheShapesOfLegendre) {
  constexpr double L = 20, Omega = 0.5, diameter = 1e-3;
  const Material material{7e7, 0.3, 4000};
  const double epsilon = material.E * diameter * diameter / 16 / (material.rho * Omega * Omega * std::pow(L, 4));
  const Model model = line_mass(diameter, L, material);
  const SteadyMotion motion{{0, 0, Omega}, Vector3d::Zero(), {Vector3d::UnitY(), Vector3d::UnitZ()}};
  const ReducedBody body = stiffened(model, held(model, 60));
  const VectorXd lambda = prestressed_shapes(body, motion, 4).lambda / (Omega * Omega);
  const double third = 6 + 525 * epsilon, fifth = 15 + 12705 * epsilon;
  EXPECT_NEAR(lambda[0], third - 1, 2e-4);
  EXPECT_NEAR(lambda[1], third, 2e-4);
  EXPECT_NEAR(lambda[2], fifth - 1, 2e-3);
  EXPECT_NEAR(lambda[3], fifth, 2e-3);
  // Held, its first ones are near rotations beyond a thin layer at the root.
  const VectorXd clamped = prestressed_shapes(body, {motion.spin, motion.acceleration, {}}, 2).lambda / (Omega * Omega);
  EXPECT_NEAR(clamped[1], 1, 0.05);
}

/// The shapes and the rotations of the root hold the modes that they were taken from: the few have the frequencies of
/// the many.
TEST(Prestressed, ShapesAndRotationsHoldTheModes) {
  const Model model = beam(strip, 1.5, BeamTheory::timoshenko, 4, 6);
  for (const SteadyMotion& motion :
       {SteadyMotion{{0.5, 20, 30}, {-400, 30, 5}, {}}, SteadyMotion{{0, 10, 15}, {-100, 0, 0}, {Vector3d::UnitZ()}},
        SteadyMotion{{0, 0, 30}, {-400, 0, 0}, {Vector3d::UnitY(), Vector3d(0, 0.2, 1)}},
        SteadyMotion{{0, 0, 0}, {0, 0, 9.81}, {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()}}}) {
    const PrestressedBasis made = prestressed(model, motion, 8);
    const ReducedBody body = stiffened(model, made.basis);
    EXPECT_LT((body.Ke - MatrixXd(body.Ke.diagonal().asDiagonal())).norm(), 1e-9 * body.Ke.norm());
    const VectorXd few = prestressed_shapes(body, motion, 8).lambda,
                   many = prestressed_shapes(made.clamped, motion, 8).lambda;
    // Of modes that rotations keep apart those behind the eighth shape are not held, so the last two may differ.
    // Round-off is that of the largest of the many, beside 100 (rad/s)^2 where one is zero.
    EXPECT_LT(((few - many).array() / (many.array().abs() + 100)).head(6).abs().maxCoeff(), 1e-7)
        << few.transpose() << "\n"
        << many.transpose();
    const MatrixXd parts = clamped_parts(made, model.assembly, made.basis.Phi);
    EXPECT_LT((made.clamped_Phi * parts - made.basis.Phi).norm(), 1e-10 * made.basis.Phi.norm());
  }
}

/// Many elements have the modes of few: as many clamped modes are combined as that takes.
TEST(Prestressed, OfManyUnknownsAreThoseOfFew) {
  const SteadyMotion motion{{0, 0, 0.5}, Vector3d::Zero(), {Vector3d::UnitY(), Vector3d::UnitZ()}};
  const auto lambda = [&](int elements) {
    BeamGeometry wire = uniform_boom(RoundBar{1e-3}, 20, BeamTheory::euler_bernoulli, elements, 4);
    const Model model = clamped(make_mesh(wire));
    const int most = unknowns(model.mesh, model.assembly.dofs, model.clamp).count;
    const PrestressedBasis made = prestressed_modes(
        model.mesh, model.assembly, model.clamp, motion, [&](int count) { return held(model, count); }, most, 3);
    return VectorXd(prestressed_shapes(stiffened(model, made.basis), motion, 3).lambda);
  };
  const VectorXd few = lambda(12), many = lambda(70);
  EXPECT_LT((many.array() / few.array() - 1).abs().maxCoeff(), 1e-4) << few.transpose() << "\n" << many.transpose();
}

TEST(Prestressed, WithoutMotionAreTheModesOfTheBodyAtRest) {
  const Model model = beam(strip, 1.5, BeamTheory::timoshenko, 4, 6);
  const PrestressedBasis made = prestressed(model, {}, 5);
  EXPECT_LT((made.basis.omega.array() / held(model, 5).omega.array() - 1).abs().maxCoeff(), 1e-9);
}

TEST(Prestressed, WhatCanNotServeIsAnError) {
  const Model model = beam(strip, 1.5, BeamTheory::timoshenko, 1, 2);
  const ModalBasis basis = held(model, 4);
  const SteadyMotion still;
  const ReducedBody body = stiffened(model, basis), soft = reduce(model.mesh, model.assembly, basis, "soft");
  EXPECT_NO_THROW(prestressed_shapes(body, still, 4));
  EXPECT_THROW(prestressed_shapes(body, still, 5), InputError);
  EXPECT_THROW(prestressed_shapes(soft, still, 2), InputError);
  EXPECT_THROW(prestressed_shapes(body, {Vector3d::Zero(), Vector3d::Zero(), {Vector3d::Zero()}}, 2), InputError);
  EXPECT_THROW(prestressed_shapes(body, {Vector3d::Constant(std::nan("")), Vector3d::Zero(), {}}, 2), InputError);
}

}  // namespace
}  // namespace flexboom::testing
