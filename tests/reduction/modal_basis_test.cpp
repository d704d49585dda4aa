#include "reduction/basis/modal_basis.hpp"
#include "fem/booms/solid_boom.hpp"
#include "reduction/invariants/inertia_invariants.hpp"

#include "fem/base/check.hpp"
#include "reduction/invariants/eq14.hpp"
#include "tests/reduction/booms.hpp"
#include "tests/reduction/csv.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include <cmath>
#include <numbers>

namespace flexboom {
namespace {

using test::boom4;
using test::make_boom;

constexpr double two_pi = 2 * std::numbers::pi;

const std::vector<ModeKind> bending = {ModeKind::bending_y, ModeKind::bending_z};

eq14::Boom line_mass_boom4() {
  return {0.302, 2840 * 7.853981633974483e-5, 67e9 * 4.908738521234052e-10};  // L, rho A, E I: boom_properties.json
}

EigenOptions first(int modes, const std::string& backend = "arpack") {
  return {.num_modes = modes, .sigma = {}, .backend = backend};
}

Eigen::VectorXd tip_motion(const test::Boom& boom, const ModalBasis& basis, Eigen::Index mode) {
  return basis.Phi.col(mode).segment<6>(boom.assembly.dofs.of_node(node_set(boom.mesh, "tip").front(), 0));
}

TEST(ClampedModes, LineMassBoomHasTheFrequenciesOfEq14) {
  const test::Boom boom = make_boom(boom4(BeamTheory::euler_bernoulli, false, 16, 8));
  const ModalBasis basis =
      clamped_modes_of_kind(boom.mesh, boom.assembly, node_set(boom.mesh, "root"), 20, bending, {});
  for (int i = 0; i < 20; ++i) {
    // The mesh is exact to 1e-15 here; the Rayleigh quotient over element strains keeps the digits, point energies to a
    // few eps.
    EXPECT_NEAR(basis.omega(i) / eq14::omega(line_mass_boom4(), i / 2 + 1), 1, 1e-13) << i;
  }
}

// A boom runs from its root to its tip, however short it is.
TEST(ClampedModes, KindsOfASolidThatIsWiderThanLong) {
  BeamGeometry stub;
  const Material aluminium{7e10, 0.3, 2700};
  stub.segments.push_back({RoundBar{0.03}, RoundBar{0.03}, 0.02, aluminium});
  const Mesh mesh = make_solid_mesh(stub, SolidOptions{});
  const Assembly assembly = assemble(mesh);
  EXPECT_EQ(long_axis(mesh), 0);
  const ModalBasis basis = clamped_modes(mesh, assembly, node_set(mesh, "root"), first(4));
  const std::vector<ModeKind> kinds = {ModeKind::bending_y, ModeKind::bending_z, ModeKind::torsion, ModeKind::axial};
  EXPECT_EQ(basis.kind, kinds);
  // A quarter of a wave of shear: exact for a round bar on a clamp.
  EXPECT_NEAR(basis.omega(2) / (std::sqrt(aluminium.shear_modulus() / aluminium.rho) * std::numbers::pi / 0.04), 1,
              1e-3);
  Mesh nameless = mesh;
  nameless.node_sets.clear();
  EXPECT_NE(long_axis(nameless), 0);
}

TEST(ClampedModes, FrequenciesAreThoseOfTheReference) {
  const test::Table t = test::read_csv("boom_beam_frequencies_hz.csv");
  const std::vector<std::pair<std::string, BeamGeometry>> cases = {
      {"bending_Rayleigh", boom4(BeamTheory::euler_bernoulli, true, 8, 8)},
      {"bending_Timo_Cowper_k=0.88864142539", boom4(BeamTheory::timoshenko, true, 8, 8)},
  };
  for (const auto& [column, geometry] : cases) {
    const test::Boom boom = make_boom(geometry);
    const ModalBasis basis = clamped_modes(boom.mesh, boom.assembly, node_set(boom.mesh, "root"), first(16));
    int found = 0;
    for (Eigen::Index i = 0; i < 16; ++i) {
      if (basis.kind[static_cast<size_t>(i)] != ModeKind::bending_y) continue;
      ++found;
      for (size_t row = 0; row < t.at("boom").size(); ++row) {
        if (t.at("boom")[row] != 4 || t.at("mode")[row] != found || found > 6) continue;
        EXPECT_NEAR(basis.omega(i) / two_pi / t.at(column)[row], 1, 1e-11)
            << column << found;  // the coefficient has 11 digits
      }
    }
    EXPECT_GE(found, 6);
  }
}

TEST(ClampedModes, PairsAreAlignedToTheAxesAndPositiveAtTheTip) {
  const test::Boom boom = make_boom(boom4(BeamTheory::timoshenko, true, 6, 8));
  for (const EigenBackend& row : eigen_backends()) {
    const ModalBasis basis =
        clamped_modes(boom.mesh, boom.assembly, node_set(boom.mesh, "root"), first(12, std::string(row.name)));
    ASSERT_EQ(basis.summary.pairs.front(), (std::vector<int>{0, 1}));
    for (Eigen::Index i = 0; i < 12; ++i) {
      const Eigen::VectorXd tip = tip_motion(boom, basis, i);
      const ModeKind kind = basis.kind[static_cast<size_t>(i)];
      const double other_plane = 1e-9;  // what the solver leaves: its residual, 1e-11, times the frequency ratio
      if (kind == ModeKind::torsion) {
        EXPECT_GT(tip(3), 0) << i;
      } else {
        const int component = kind == ModeKind::bending_y ? 1 : kind == ModeKind::bending_z ? 2 : 0;
        EXPECT_LT((tip.head<3>() - 2 * Eigen::Vector3d::Unit(component)).norm(), other_plane) << i;
      }
      EXPECT_NE(kind, ModeKind::other) << i;
    }
    for (const std::vector<int>& pair : basis.summary.pairs) {
      EXPECT_EQ(basis.kind[static_cast<size_t>(pair[0])], ModeKind::bending_y);
      EXPECT_EQ(basis.kind[static_cast<size_t>(pair[1])], ModeKind::bending_z);
    }
  }
}

TEST(ClampedModes, TorsionHasTheMassOfTheBody) {
  const test::Boom boom = make_boom(boom4(BeamTheory::timoshenko, true, 6, 8));
  const ModalBasis basis =
      clamped_modes_of_kind(boom.mesh, boom.assembly, node_set(boom.mesh, "root"), 1, {ModeKind::torsion}, {});
  const Eigen::VectorXd phi = basis.Phi.col(0);
  EXPECT_NEAR(quadratic_form(boom.assembly.M, phi)(0, 0) / 0.06736202967827235, 1,
              1e-12);                                                  // mass: boom_properties.json
  EXPECT_NEAR(basis.omega(0) / two_pi / 2465.303990722897, 1, 1e-12);  // torsion_exact3D: boom_beam_frequencies_hz.csv
}

TEST(ClampedModes, ARectangularBoomNeedsNoAlignment) {
  BeamGeometry g = boom4(BeamTheory::euler_bernoulli, true, 4, 8);
  g.segments[0].start = g.segments[0].end = Rectangle{0.008, 0.012};  // height along y: softer in the xy plane
  const test::Boom boom = make_boom(g);
  const ModalBasis basis = clamped_modes(boom.mesh, boom.assembly, node_set(boom.mesh, "root"), first(4));
  EXPECT_TRUE(basis.summary.pairs.empty());
  EXPECT_EQ(basis.kind[0], ModeKind::bending_y);
  EXPECT_EQ(basis.kind[1], ModeKind::bending_z);
}

TEST(ClampedModes, AskingForHalfAPairGivesTheAlignedHalf) {
  const test::Boom boom = make_boom(boom4(BeamTheory::timoshenko, true, 6, 8));
  const ModalBasis basis = clamped_modes(boom.mesh, boom.assembly, node_set(boom.mesh, "root"), first(3));
  ASSERT_EQ(basis.Phi.cols(), 3);
  EXPECT_EQ(basis.kind[2], ModeKind::bending_y);
  EXPECT_NEAR(tip_motion(boom, basis, 2)(2), 0, 1e-9);
  EXPECT_EQ(basis.summary.pairs.size(), 1U);
}

TEST(ClampedModes, SelectingAKindRenumbersThePairs) {
  const test::Boom boom = make_boom(boom4(BeamTheory::timoshenko, true, 6, 8));
  const ModalBasis basis =
      clamped_modes_of_kind(boom.mesh, boom.assembly, node_set(boom.mesh, "root"), 10, bending, {});
  ASSERT_EQ(basis.summary.pairs.size(), 5U);
  for (int i = 0; i < 5; ++i)
    EXPECT_EQ(basis.summary.pairs[static_cast<size_t>(i)], (std::vector<int>{2 * i, 2 * i + 1}));
}

TEST(ClampedModes, AFreeBoomHasSixRigidModesFirst) {
  const test::Boom boom = make_boom(boom4(BeamTheory::timoshenko, true, 6, 8));
  for (const EigenBackend& row : eigen_backends()) {
    const ModalBasis basis = clamped_modes(boom.mesh, boom.assembly, {}, first(12, std::string(row.name)));
    EXPECT_EQ(basis.rigid_freedoms, 6);
    EXPECT_EQ(basis.kind[5], ModeKind::rigid);
    EXPECT_LT(basis.summary.sigma, 0);
    EXPECT_LT(basis.omega.head(6).maxCoeff(), 1e-6 * basis.omega(6));
    EXPECT_GT(basis.omega(6), 2000);
    // The six are rigid: they lie in the span of the rigid motions.
    const Eigen::MatrixXd T = rigid_motions(boom.mesh, boom.assembly.dofs);
    const Eigen::MatrixXd rigid = basis.Phi.leftCols(6);
    const Eigen::MatrixXd M_T = symmetric_product(boom.assembly.M, T);
    const Eigen::MatrixXd left = rigid - T * (T.transpose() * M_T).ldlt().solve(M_T.transpose() * rigid);
    // The residual of the eigen-solve, 1e-11, against shapes of size 2 and rotations of 2 / L = 7 rad.
    EXPECT_LT(left.cwiseAbs().maxCoeff(), 1e-8);
  }
}

TEST(ClampedModes, HeavyTipIsNotBlownUp) {
  BeamGeometry g = boom4(BeamTheory::timoshenko, true, 6, 8);
  g.attachments.push_back({"payload", 0.302, 50.0, Eigen::Matrix3d::Identity() * 1e-1, Eigen::Vector3d::Zero()});
  const test::Boom boom = make_boom(g);
  const ModalBasis basis = clamped_modes(boom.mesh, boom.assembly, node_set(boom.mesh, "root"), first(10));
  EXPECT_NEAR(tip_motion(boom, basis, 0)(1), 2, 1e-9);  // the first mode carries the payload
  for (int node = 0; node < boom.mesh.nodes.cols(); ++node) {
    // In higher ones the payload stands still and Me = m: deflections of sqrt(payload / boom) = 27 times the shape's 2.
    EXPECT_LT(basis.Phi.middleRows<3>(boom.assembly.dofs.of_node(node, 0)).cwiseAbs().maxCoeff(), 60);
  }
}

TEST(ClampedModes, TooManyModesOrABadClampIsRefused) {
  const test::Boom boom = make_boom(boom4(BeamTheory::euler_bernoulli, true, 1, 3));
  EXPECT_THROW(clamped_modes(boom.mesh, boom.assembly, node_set(boom.mesh, "root"), first(1000)), InputError);
  EXPECT_THROW(clamped_modes(boom.mesh, boom.assembly, std::vector<int>{0, 1, 99}, first(1)), InputError);
  EXPECT_THROW(clamped_modes_of_kind(boom.mesh, boom.assembly, node_set(boom.mesh, "root"), 12, {ModeKind::axial}, {}),
               InputError);
}

// The assembled K of a bar of 100 diameters leaves 1e-6 between its first two frequencies.
TEST(ModalBasis, PairsOfASlenderSolidBarAreAligned) {
  BeamGeometry bar;
  bar.segments.push_back({RoundBar{0.004}, RoundBar{0.004}, 0.4, Material{67e9, 0.33, 2840}, 0});
  const Mesh mesh = make_solid_mesh(bar, {.accuracy = 1e-2});
  const ModalBasis basis = clamped_modes(mesh, assemble(mesh), node_set(mesh, "root"), {.num_modes = 4});
  ASSERT_EQ(basis.summary.pairs.size(), 2U);
  const ReducedBody body = reduce(mesh, assemble(mesh), basis, "bar");
  EXPECT_LT(std::abs(body.Ct(2, 0)), 1e-8 * std::abs(body.Ct(1, 0)));
  EXPECT_LT(std::abs(body.Ct(1, 1)), 1e-8 * std::abs(body.Ct(2, 1)));
}

}  // namespace
}  // namespace flexboom
