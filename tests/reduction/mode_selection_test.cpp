#include "reduction/basis/mode_selection.hpp"

#include "fem/base/check.hpp"
#include "reduction/invariants/eq14.hpp"
#include "reduction/invariants/geometric_stiffness.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tests/reduction/booms.hpp"
#include "tests/reduction/csv.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double L = 0.302, rho_A = 2840 * 7.853981633974483e-5, EI = 67e9 * 4.908738521234052e-10;

ReducedBody line_boom(int n, eq14::Planes planes = eq14::Planes::xy) {
  return eq14::reduced_body({L, rho_A, EI}, n, planes, "boom");
}

TEST(ModeSelection, EffectiveMassesAreThoseOfTheTable) {
  const test::Table t = test::read_csv("effective_modal_mass.csv");
  const ReducedBody body = line_boom(20);
  const MatrixXd effective = effective_masses(body);
  for (Index k = 0; k < 20; ++k) {
    const auto row = static_cast<size_t>(k);
    EXPECT_NEAR(effective(1, k) / body.m / t.at("eff_mass_translation/m")[row], 1, 1e-11) << k;
    EXPECT_NEAR(effective(5, k) / body.J0(2, 2) / t.at("eff_inertia_about_root/(mL^2/3)")[row], 1, 1e-11) << k;
  }
  EXPECT_EQ(effective.row(0).norm() + effective.row(2).norm() + effective.row(4).norm(), 0);
}

TEST(ModeSelection, ABodyOfChosenCoordinatesIsThatOfTheChosenShapes) {
  const test::Boom boom = test::make_boom(test::boom4(BeamTheory::timoshenko, true));
  const Clamp clamp(node_set(boom.mesh, "root"));
  const ModalBasis basis = clamped_modes(boom.mesh, boom.assembly, clamp, {.num_modes = 6, .sigma = {}});
  ReducedBody all = reduce(boom.mesh, boom.assembly, basis, "boom");
  all.Kg = geometric_stiffness(boom.mesh, boom.assembly, clamp, basis.Phi, {.markers = {"tip"}});
  apply_damping(all, {"rayleigh", 0, 0.3, 2e-5});
  const std::vector<int> list = {4, 0, 3};
  const ModalBasis chosen = selected(basis, list);
  ReducedBody direct = reduce(boom.mesh, boom.assembly, chosen, "boom");
  direct.Kg = geometric_stiffness(boom.mesh, boom.assembly, clamp, chosen.Phi, {.markers = {"tip"}});
  apply_damping(direct, {"rayleigh", 0, 0.3, 2e-5});
  const ReducedBody body = selected(all, list);
  body.validate();
  // The same sums over the same points, in blocks of another size; some are zero by symmetry.
  const auto near = [mass = all.m](const MatrixXd& A, const MatrixXd& B) {
    EXPECT_LE((A - B).norm(), 1e-13 * (B.norm() + mass));
  };
  near(body.gram, direct.gram), near(body.Ke, direct.Ke), near(body.De, direct.De), near(body.Me, direct.Me);
  near(body.Ct, direct.Ct), near(body.Cr0, direct.Cr0), near(body.Cr1[1], direct.Cr1[1]);
  near(body.J1[2], direct.J1[2]), near(body.J2[0][2], direct.J2[0][2]), near(body.Kg.spin[5], direct.Kg.spin[5]);
  near(body.Kg.markers[0].force[0], direct.Kg.markers[0].force[0]);
  near(marker(body, "tip").S_theta, marker(direct, "tip").S_theta), near(body.display.S[3], direct.display.S[3]);
  EXPECT_EQ(body.coordinates[0].frequency_hz, basis.coordinates[4].frequency_hz);
  EXPECT_THROW(selected(all, {6}), InputError);
}

/// What is linear in the shapes goes with T, what is quadratic with T twice.
TEST(ModeSelection, ABodyOfCombinationsHasTheIntegralsOfItsShapes) {
  const test::Boom boom = test::make_boom(test::boom4(BeamTheory::timoshenko, true));
  const Clamp clamp(node_set(boom.mesh, "root"));
  const ModalBasis basis = clamped_modes(boom.mesh, boom.assembly, clamp, {.num_modes = 6, .sigma = {}});
  ReducedBody all = reduce(boom.mesh, boom.assembly, basis, "boom");
  all.Kg = geometric_stiffness(boom.mesh, boom.assembly, clamp, basis.Phi, {.markers = {"tip"}});
  const MatrixXd T = (MatrixXd(6, 2) << 0.3, -1, 0.7, 0.1, -0.4, 0.2, 0, 0.9, 1.1, -0.6, 0.2, 0.5).finished();
  const ReducedBody body = combined(all, T, {{"a"}, {"b"}});
  body.validate();
  const auto near = [mass = all.m](const MatrixXd& A, const MatrixXd& B) {
    EXPECT_LE((A - B).norm(), 1e-12 * (B.norm() + mass));
  };
  near(body.Ct, all.Ct * T), near(body.Cr0, all.Cr0 * T), near(body.Me, T.transpose() * all.Me * T);
  near(body.Ke, T.transpose() * all.Ke * T), near(body.Kg.spin[2], T.transpose() * all.Kg.spin[2] * T);
  near(marker(body, "tip").S, marker(all, "tip").S * T);
  Eigen::Matrix3d first = Eigen::Matrix3d::Zero(), second = first;
  Eigen::Matrix3Xd coupling = Eigen::Matrix3Xd::Zero(3, 6);
  for (size_t k = 0; k < 6; ++k) {
    const auto row = static_cast<Index>(k);
    first += T(row, 1) * all.J1[k];
    coupling += T(row, 1) * all.Cr1[k];
    for (size_t l = 0; l < 6; ++l) second += T(row, 0) * T(static_cast<Index>(l), 1) * all.J2[k][l];
  }
  near(body.J1[1], first), near(body.J2[0][1], second), near(body.Cr1[1], coupling * T);
  EXPECT_THROW(combined(all, T, {{"a"}}), InputError);
  EXPECT_THROW(combined(all, T.topRows(5), {{"a"}, {"b"}}), InputError);
}

TEST(ModeSelection, ByEffectiveMassTakesTheFewest) {
  // The table's columns "cum": translation 0.613, 0.801, 0.866, 0.899, 0.919; inertia 0.971, 0.9954.
  const ReducedBody body = line_boom(20);
  EXPECT_EQ(modes_by_effective_mass(body, 0.9, {1}), (std::vector<int>{0, 1, 2, 3, 4}));
  EXPECT_EQ(modes_by_effective_mass(body, 0.86, {1}), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(modes_by_effective_mass(body, 0.99, {5}), (std::vector<int>{0, 1}));
  EXPECT_EQ(modes_by_effective_mass(body, 0.99, {}), std::vector<int>{});
  EXPECT_THROW(modes_by_effective_mass(body, 0.99, {1}), InputError);  // 20 modes: 0.9797
  EXPECT_THROW(modes_by_effective_mass(body, 0.5, {0}), InputError);   // no axial modes
  EXPECT_THROW(modes_by_effective_mass(body, 1.5, {1}), InputError);
  EXPECT_THROW(modes_by_effective_mass(body, 0.5, {6}), InputError);
}

TEST(ModeSelection, CompletenessSumsToThePlanesThatBendAndIsInvariant) {
  // Two planes of five rigid motions of a line mass: the modal identities give 4/5 in the limit; axial motion is
  // missing.
  const ReducedBody body = line_boom(40, eq14::Planes::xy_and_xz);
  const VectorXd index = completeness_indices(body);
  const double missing = 0.8 - index.sum();
  EXPECT_GT(missing, 0);
  // What is missing of translation, 1/(pi^2 n) + ... (table: 0.0203 at 20, 0.0081 at 50): half a direction's part each.
  EXPECT_LT(missing, 0.02);
  // In a frame turned and shifted.
  const test::Boom boom = test::make_boom(test::boom4(BeamTheory::timoshenko, true));
  const ModalBasis basis =
      clamped_modes(boom.mesh, boom.assembly, node_set(boom.mesh, "root"), {.num_modes = 6, .sigma = {}});
  Mesh shifted = boom.mesh;
  shifted.nodes.colwise() += Eigen::Vector3d(0.4, -0.2, 0.1);
  const VectorXd here = completeness_indices(reduce(boom.mesh, boom.assembly, basis, "b"));
  const VectorXd there = completeness_indices(reduce(shifted, boom.assembly, basis, "b"));
  EXPECT_LT((here - there).norm(), 1e-12 * here.norm());
  EXPECT_LE(here.sum(), 1);
}

TEST(ModeSelection, ByCompletenessTakesTheFewest) {
  const ReducedBody body = line_boom(10, eq14::Planes::xy_and_xz);
  const VectorXd index = completeness_indices(body);
  EXPECT_EQ(modes_by_completeness(body, 1.5 * index(0)), (std::vector<int>{0, 10}));  // the first of each plane
  EXPECT_THROW(modes_by_completeness(body, 0.9), InputError);
}

TEST(ModeSelection, ByBandAndByList) {
  const ReducedBody body = line_boom(5);
  const double f2 = body.coordinates[1].frequency_hz, f4 = body.coordinates[3].frequency_hz;
  EXPECT_EQ(modes_in_band(body, f2, f4), (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(modes_in_band(body, 0, f2 - 1), (std::vector<int>{0}));
  EXPECT_THROW(modes_in_band(body, 2, 1), InputError);
  EXPECT_EQ(listed_modes(body, {3, 0}), (std::vector<int>{0, 3}));
  EXPECT_THROW(listed_modes(body, {5}), InputError);
  EXPECT_THROW(listed_modes(body, {1, 1}), InputError);
}

TEST(ModeSelection, ObservabilityOfTheTipFallsLikeOmegaCubed) {
  // Every shape has the tip value 2 and Me = m: shares are (omega_1 / omega_k)^3. Slopes grow like alpha.
  const ReducedBody body = line_boom(6);
  const MatrixXd share = observabilities(body, {{"tip", "uy"}, {"tip", "rz"}, {"tip", "uz"}});
  for (Index k = 0; k < 6; ++k) {
    const double ratio = body.coordinates[0].frequency_hz / body.coordinates[static_cast<size_t>(k)].frequency_hz;
    EXPECT_NEAR(share(0, k) / std::pow(ratio, 3), 1, 1e-12) << k;
    const double slope = marker(body, "tip").S_theta(2, k) / marker(body, "tip").S_theta(2, 0);
    EXPECT_NEAR(share(1, k) / (slope * slope * std::pow(ratio, 3)), 1, 1e-12) << k;
  }
  EXPECT_EQ(share.row(2).norm(), 0);  // bending in y is not seen along z
  const double second = share(0, 1);
  EXPECT_EQ(modes_by_observability(body, {{"tip", "uy"}}, second), (std::vector<int>{0, 1}));
  EXPECT_EQ(modes_by_observability(body, {{"tip", "uy"}}, second * 1.001), (std::vector<int>{0}));
  EXPECT_EQ(modes_by_observability(body, {}, 0.1), std::vector<int>{});
  EXPECT_THROW(observabilities(body, {{"tipp", "uy"}}), InputError);
  EXPECT_THROW(modes_by_observability(body, {{"tip", "ux"}}, 0.9), InputError);  // none of them stretches
}

TEST(ModeSelection, SelectedShapesMakeThePartOfTheBody) {
  const test::Boom boom = test::make_boom(test::boom4(BeamTheory::timoshenko, true));
  const ModalBasis basis =
      clamped_modes(boom.mesh, boom.assembly, node_set(boom.mesh, "root"), {.num_modes = 6, .sigma = {}});
  const ReducedBody all = reduce(boom.mesh, boom.assembly, basis, "b");
  const std::vector<int> some = {0, 4, 2};
  const ReducedBody part = reduce(boom.mesh, boom.assembly, selected(basis, some), "b");
  EXPECT_LT((part.Me - all.Me(some, some)).norm(), 1e-15 * all.Me.norm());
  EXPECT_EQ(part.coordinates[1].frequency_hz, all.coordinates[4].frequency_hz);
  EXPECT_THROW(selected(basis, {6}), InputError);
}

}  // namespace
}  // namespace flexboom
