#include "reduction/invariants/lumped_invariants.hpp"

#include "fem/base/check.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tests/fem/solid_testing.hpp"
#include "tests/reduction/booms.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace flexboom {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double round_off = 1e-13;  // relative, of sums over some hundred points

/// A box 0.3 x 0.2 x 0.1 m with a corner at the origin, `cells` elements along each edge.
Mesh box(const std::string& element, int order, int cells) {
  return testing::box(element_types()[static_cast<size_t>(element_type(element))], order, {cells, cells, cells},
                      testing::stretch(0.3, 0.2, 0.1));
}

ReducedBody lumped(const Mesh& mesh) {
  const Assembly assembly = assemble(mesh);
  return lumped_invariants(mesh, assembly, rigid_motions(mesh, assembly.dofs));
}

TEST(LumpedInvariants, MassesOfABrickOf20NodesAreThoseOfTheRule) {
  const VectorXd masses = nodal_masses(box("hex20", 2, 1));
  const double mass = masses.sum();
  EXPECT_NEAR(mass, testing::aluminium.rho * 0.006, round_off * mass);
  // The integrals of N_i^2 over the brick by rational arithmetic: 7/248 of the mass at corners, 2/31 on edges.
  for (const double m : masses) {
    const double share = m < mass / 25 ? 7.0 / 248 : 2.0 / 31;
    EXPECT_NEAR(m, share * mass, round_off * mass);
  }
}

TEST(LumpedInvariants, InertiaOfBricksOf8NodesIsTheTrapezoidalRule) {
  for (const int k : {1, 2, 4}) {
    const ReducedBody body = lumped(box("hex8", 1, k));
    // int y^2 + z^2 over [0, b] x [0, c]; the rule with k intervals adds b^2 / (6 k^2).
    const double exact = (0.2 * 0.2 + 0.1 * 0.1) / 3;
    EXPECT_NEAR(body.J0(0, 0) / body.m, exact + (0.2 * 0.2 + 0.1 * 0.1) / (6 * k * k), round_off);
    EXPECT_LT((body.mc0 / body.m - Vector3d(0.15, 0.1, 0.05)).norm(), round_off);
  }
}

TEST(LumpedInvariants, RigidMotionsGiveTheRigidBodyOfTheMasses) {
  Mesh mesh = box("hex20", 2, 2);
  mesh.bodies.push_back({.node = 3, .mass = 0.7});
  const ReducedBody body = lumped(mesh);
  const double size = body.J0.norm();
  EXPECT_NEAR(body.m, total_mass(mesh, assemble(mesh)), round_off * body.m);
  EXPECT_LT((body.Ct.leftCols<3>() - body.m * Eigen::Matrix3d::Identity()).norm(), round_off * body.m);
  EXPECT_LT((body.Me.topLeftCorner<3, 3>() - body.m * Eigen::Matrix3d::Identity()).norm(), round_off * body.m);
  EXPECT_LT((body.Cr0.rightCols<3>() - body.J0).norm(), round_off * size);
  EXPECT_LT((body.Me.bottomRightCorner<3, 3>() - body.J0).norm(), round_off * size);
}

TEST(LumpedInvariants, AreConsistentOnesInTheLimit) {
  const auto error = [](int cells) {
    const Mesh mesh = box("hex8", 1, cells);
    const Assembly assembly = assemble(mesh);
    MatrixXd Phi(assembly.dofs.count, 1);  // u = (y, z, x)
    for (int i = 0; i < mesh.nodes.cols(); ++i)
      Phi.middleRows(assembly.dofs.of_node(i, 0), 3) = mesh.nodes.col(i)(std::array{1, 2, 0});
    ModalBasis basis;
    basis.Phi = Phi;
    basis.omega = VectorXd::Zero(1);
    basis.kind = {ModeKind::other};
    const ReducedBody exact = reduce(mesh, assembly, basis, "box");
    const ReducedBody sums = lumped_invariants(mesh, assembly, Phi);
    return (sums.J1[0] - exact.J1[0]).norm() + (sums.J2[0][0] - exact.J2[0][0]).norm() + (sums.Cr0 - exact.Cr0).norm();
  };
  EXPECT_NEAR(error(2) / error(4), 4, 1e-9);  // all integrands are quadratic: the error is that of the rule alone
}

TEST(LumpedInvariants, RotationsOfBeamsHaveNoInertia) {
  const test::Boom boom = test::make_boom(test::boom4(BeamTheory::timoshenko, true));
  const ReducedBody body = lumped_invariants(boom.mesh, boom.assembly, rigid_motions(boom.mesh, boom.assembly.dofs));
  EXPECT_NEAR(body.m, total_mass(boom.mesh, boom.assembly), round_off * body.m);
  EXPECT_NEAR(body.J0(0, 0), 0, round_off * body.J0(1, 1));
  EXPECT_GT(body.J0(1, 1), body.m * 0.302 * 0.302 / 3);
}

TEST(LumpedInvariants, RefuseShapesOfAnotherMesh) {
  const Mesh mesh = box("hex8", 1, 1);
  EXPECT_THROW(lumped_invariants(mesh, assemble(mesh), MatrixXd::Zero(25, 2)), InputError);
}

}  // namespace
}  // namespace flexboom
