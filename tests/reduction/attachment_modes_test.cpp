#include "reduction/basis/attachment_modes.hpp"

#include "fem/base/check.hpp"
#include "fem/booms/solid_boom.hpp"
#include "reduction/basis/mean_axis.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tests/reduction/booms.hpp"
#include "tests/reduction/compliance.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include <cmath>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::boom4;
using test::make_boom;

EigenOptions first(int modes) { return {.num_modes = modes, .sigma = {}, .backend = "arpack"}; }

const std::vector<AttachmentLoad> tip_loads = {{"tip", "Fy"}, {"tip", "Mz"}, {"tip", "Mx"}};

MatrixXd motion(const ReducedBody& body, const std::string& name) {
  const Marker& m = marker(body, name);
  MatrixXd S(6, body.n());
  S << m.S, m.S_theta;
  return S;
}

TEST(AttachmentModes, StaticResponseToTheirLoadsIsExact) {
  const test::Boom boom = make_boom(boom4(BeamTheory::euler_bernoulli, true));
  const Clamp root = node_set(boom.mesh, "root");
  const ModalBasis modes = clamped_modes(boom.mesh, boom.assembly, root, first(4));
  const ModalBasis basis = with_attachment_modes(modes, boom.mesh, boom.assembly, root, tip_loads);
  const ReducedBody body = reduce(boom.mesh, boom.assembly, basis, "boom");
  ASSERT_EQ(body.n(), 7);
  const MatrixXd S = motion(body, "tip");
  const MatrixXd compliance = S * body.Ke.ldlt().solve(S.transpose());
  const double L = 0.302, EI = 67e9 * 4.908738521234052e-10, GJ = 67e9 / 2.66 * 2 * 4.908738521234052e-10;
  // Closed forms of the bar; the static solve keeps 1e-16 times the condition of K, 1e6.
  EXPECT_NEAR(compliance(1, 1) / (L * L * L / (3 * EI)), 1, 1e-10);
  EXPECT_NEAR(compliance(1, 5) / (L * L / (2 * EI)), 1, 1e-10);
  EXPECT_NEAR(compliance(5, 5) / (L / EI), 1, 1e-10);
  EXPECT_NEAR(compliance(3, 3) / (L / GJ), 1, 1e-10);
  // Without them the modes alone are too stiff.
  const ReducedBody plain = reduce(boom.mesh, boom.assembly, modes, "boom");
  const MatrixXd S_plain = motion(plain, "tip");
  EXPECT_LT((S_plain * plain.Ke.ldlt().solve(S_plain.transpose()))(5, 5) / (L / EI), 0.98);
}

TEST(AttachmentModes, AreOrthogonalToAllOthersAndHaveTheMassOfTheBody) {
  const test::Boom boom = make_boom(boom4(BeamTheory::timoshenko, true));
  const Clamp root = node_set(boom.mesh, "root");
  const ModalBasis basis = with_attachment_modes(clamped_modes(boom.mesh, boom.assembly, root, first(4)), boom.mesh,
                                                 boom.assembly, root, tip_loads);
  const ReducedBody body = reduce(boom.mesh, boom.assembly, basis, "boom");
  for (Index i = 4; i < 7; ++i) {
    EXPECT_NEAR(body.Me(i, i) / body.m, 1, 1e-12);
    for (Index j = 0; j < i; ++j) EXPECT_LT(std::abs(body.Me(i, j)), 1e-12 * body.m) << i << " " << j;
    // To modes also in K: the static shape less its part in them. What modes leave: 1e-11 of omega^2.
    for (Index j = 0; j < 4; ++j)
      EXPECT_LT(std::abs(body.Ke(i, j)), 1e-9 * std::sqrt(body.Ke(i, i) * body.Ke(j, j))) << i << " " << j;
  }
  const Coordinate& c = body.coordinates[4];
  EXPECT_EQ(c.kind, "attachment");
  EXPECT_EQ(c.interface, "tip");
  EXPECT_EQ(c.direction, "Fy");
  EXPECT_GT(c.frequency_hz, body.coordinates[3].frequency_hz);  // what is left is above the modes kept
  EXPECT_GT(marker(body, "tip").S(1, 4), 0);                    // along its load
  for (const BodyCheck& check : check_invariants(body, boom.mesh, boom.assembly, basis))
    EXPECT_TRUE(check.passed) << check.name << " " << check.relative_error;
}

TEST(AttachmentModes, OfAFreeBodyBalanceTheirLoadByInertia) {
  const test::Boom boom = make_boom(boom4(BeamTheory::euler_bernoulli, false, 8, 8));
  const Clamp nothing({}, false);
  const std::vector<AttachmentLoad> loads = {{"tip", "Fy"}, {"root", "Mz"}};
  const auto elastic_compliance = [&](const ModalBasis& basis) {
    const ReducedBody body = reduce(boom.mesh, boom.assembly, basis, "boom");
    MatrixXd S(2, body.n());
    S << marker(body, "tip").S.row(1), marker(body, "root").S_theta.row(2);
    return MatrixXd(S * body.Ke.ldlt().solve(S.transpose()));
  };
  const ModalBasis modes = mean_axis_modes(boom.mesh, boom.assembly, first(2));
  const ModalBasis basis = with_attachment_modes(modes, boom.mesh, boom.assembly, nothing, loads);
  EXPECT_EQ(basis.frame, "mean-axis");
  const ReducedBody body = reduce(boom.mesh, boom.assembly, basis, "boom");
  EXPECT_LT(body.Ct.norm(), 1e-12 * body.m * 2);
  EXPECT_LT(body.Cr0.norm(), 1e-12 * body.m * 2);
  // The other route: the sum over very many free-free modes, S_k^2 / Ke_kk, whose tail falls off like k^-3 (torque:
  // k^-1); 60 are about 25 of the plane.
  const MatrixXd few = elastic_compliance(basis);
  const MatrixXd many = elastic_compliance(mean_axis_modes(boom.mesh, boom.assembly, first(60)));
  EXPECT_NEAR(many(0, 0) / few(0, 0), 1, 2e-4);
  EXPECT_NEAR(many(1, 1) / few(1, 1), 1, 6e-2);
  EXPECT_LT(many(0, 0), few(0, 0));
  EXPECT_LT(many(1, 1), few(1, 1));
  // Closed form, free beam with a force at its end and linear inertia load: v(L) elastic = F L^3 / (105 EI).
  EXPECT_NEAR(few(0, 0) / (std::pow(0.302, 3) / (105 * 67e9 * 4.908738521234052e-10)), 1, 1e-9);
}

// Beside many modes little is left of a static shape, and round-off is a larger part of it.
TEST(AttachmentModes, OfAFreeBodyHaveNoRigidPartBesideManyModes) {
  const test::Boom boom = make_boom(boom4(BeamTheory::timoshenko, true, 8, 8));
  std::vector<AttachmentLoad> loads;
  for (const char* end : {"tip", "root"})
    for (const char* along : {"Fx", "Fy", "Fz", "Mx", "My", "Mz"}) loads.push_back({end, along});
  const ModalBasis modes = mean_axis_modes(boom.mesh, boom.assembly, first(40));
  const ModalBasis basis = with_attachment_modes(modes, boom.mesh, boom.assembly, Clamp({}, false), loads);
  const ReducedBody body = reduce(boom.mesh, boom.assembly, basis, "boom");
  ASSERT_GT(body.n(), 48);
  for (const BodyCheck& check : check_invariants(body, boom.mesh, boom.assembly, basis)) {
    EXPECT_TRUE(check.passed) << check.name << " " << check.relative_error;
    if (check.name.starts_with("mean axes")) {
      EXPECT_LT(check.relative_error, 1e-13) << check.name;  // round-off of one projection
    }
  }
}

TEST(AttachmentModes, OnTheFaceOfASolid) {
  SolidOptions options;
  options.order = 2;
  options.grading = {.sectors = 1, .rings = 1, .long_elements = 6, .end_layers = 0, .corner_levels = 0};
  const Mesh mesh = make_solid_mesh(boom4(BeamTheory::timoshenko, true), options);
  const Assembly assembly = assemble(mesh);
  const Clamp root = node_set(mesh, "root");
  const ModalBasis modes = clamped_modes(mesh, assembly, root, first(2));
  const ModalBasis basis = with_attachment_modes(modes, mesh, assembly, root, tip_loads);
  const ReducedBody body = reduce(mesh, assembly, basis, "boom");
  const MatrixXd S = motion(body, "tip");
  const MatrixXd compliance = S * body.Ke.ldlt().solve(S.transpose());
  const MatrixXd full = test::compliance(mesh, assembly, unknowns(mesh, assembly.dofs, root),
                                         unit_loads(modes, mesh, assembly.dofs, tip_loads));
  EXPECT_NEAR(compliance(1, 1) / full(0, 0), 1, 1e-10);
  EXPECT_NEAR(compliance(5, 5) / full(1, 1), 1, 1e-10);
  EXPECT_NEAR(compliance(3, 3) / full(2, 2), 1, 1e-10);
}

TEST(AttachmentModes, LoadsThatAddNothingAreLeftOutAndNamed) {
  const test::Boom boom = make_boom(boom4(BeamTheory::timoshenko, true));
  const Clamp root = node_set(boom.mesh, "root");
  const ModalBasis modes = clamped_modes(boom.mesh, boom.assembly, root, first(2));
  const ModalBasis basis =
      with_attachment_modes(modes, boom.mesh, boom.assembly, root, {{"tip", "Fy"}, {"tip", "Fy"}, {"root", "Fx"}});
  EXPECT_EQ(basis.Phi.cols(), 3);
  EXPECT_NE(basis.summary.note.find("Fx at \"root\""), std::string::npos) << basis.summary.note;
  EXPECT_NE(basis.summary.note.find("Fy at \"tip\""), std::string::npos) << basis.summary.note;
  EXPECT_THROW(with_attachment_modes(modes, boom.mesh, boom.assembly, root, {{"tipp", "Fy"}}), InputError);
  EXPECT_THROW(with_attachment_modes(modes, boom.mesh, boom.assembly, root, {{"tip", "F"}}), InputError);
}

}  // namespace
}  // namespace flexboom
