#include "reduction/basis/craig_bampton.hpp"

#include "fem/base/check.hpp"
#include "fem/booms/solid_boom.hpp"
#include "reduction/invariants/certificate.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tests/reduction/booms.hpp"
#include "tests/reduction/compliance.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <cmath>
#include <numbers>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::boom4;
using test::make_boom;

CraigBamptonOptions with(int modes, const std::string& reference = "", bool orthonormal = false) {
  CraigBamptonOptions options;
  options.modes.num_modes = modes;
  options.reference = reference;
  options.orthonormal = orthonormal;
  return options;
}

/// A boom of SPORT with interfaces at both ends.
struct TwoEnds {
  test::Boom boom;
  std::vector<InterfaceNode> ends;

  explicit TwoEnds(const BeamGeometry& geometry) {
    boom.mesh = make_mesh(geometry);
    ends = place_interfaces(boom.mesh, {{"root", "root"}, {"tip", "tip"}});
    boom.assembly = assemble(boom.mesh);
  }
  ModalBasis basis(const CraigBamptonOptions& options) const {
    return craig_bampton(boom.mesh, boom.assembly, ends, options);
  }
  ReducedBody body(const CraigBamptonOptions& options) const {
    return reduce(boom.mesh, boom.assembly, basis(options), "boom");
  }
};

TwoEnds sip() { return TwoEnds(boom4(BeamTheory::timoshenko, true, 4, 6)); }

VectorXd frequencies_hz(const ReducedBody& body) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(body.Me, body.Ke);
  return solver.eigenvalues().reverse().cwiseInverse().cwiseSqrt() / (2 * std::numbers::pi);
}

TEST(CraigBampton, CoordinatesAreInterfaceFreedomsThenNormalModes) {
  const TwoEnds t = sip();
  const ReducedBody body = t.body(with(4));
  EXPECT_EQ(body.frame, "free");
  ASSERT_EQ(body.n(), 16);
  ASSERT_EQ(body.interfaces.size(), 2U);
  EXPECT_EQ(body.interfaces[1].first_coordinate, 6);
  EXPECT_EQ(body.coordinates[7].kind, "interface");
  EXPECT_EQ(body.coordinates[7].interface, "tip");
  EXPECT_EQ(body.coordinates[7].direction, "uy");
  EXPECT_EQ(body.coordinates[7].frequency_hz, 0);
  EXPECT_EQ(body.coordinates[12].kind, "bending_y");
  // A unit of an interface coordinate is the unit motion of its marker; the others and the normal modes leave it.
  for (int i = 0; i < 2; ++i) {
    const Marker& m = marker(body, body.interfaces[static_cast<size_t>(i)].name);
    MatrixXd motion(6, body.n());
    motion << m.S, m.S_theta;
    MatrixXd expected = MatrixXd::Zero(6, body.n());
    expected.middleCols(6 * i, 6).setIdentity();
    EXPECT_EQ((motion - expected).norm(), 0);  // exact: they are set, not solved for
  }
}

TEST(CraigBampton, AChoiceKeepsTheInterfacesThatAreWhole) {
  const ModalBasis basis = sip().basis(with(4));
  const ModalBasis some = selected(basis, {0, 1, 2, 3, 4, 6, 7, 8, 9, 10, 11, 14});
  EXPECT_EQ(some.interfaces[0].first_coordinate, -1);
  EXPECT_EQ(some.interfaces[1].first_coordinate, 5);
  EXPECT_EQ(some.coordinates[11].kind, basis.coordinates[14].kind);
  EXPECT_EQ(selected(basis, {7, 6, 8, 9, 10, 11}).interfaces[1].first_coordinate, -1);
}

TEST(CraigBampton, FreeBodyHasSixMotionsWithoutEnergy) {
  const ReducedBody body = sip().body(with(4));
  // Rigid motion of both interfaces: exactly in the span, no strain.
  MatrixXd rigid = MatrixXd::Zero(body.n(), 6);
  for (const Interface& i : body.interfaces) {
    const Eigen::Vector3d r = marker(body, i.name).position;
    rigid.block<3, 3>(i.first_coordinate, 0).setIdentity();
    rigid.block<3, 3>(i.first_coordinate + 3, 3).setIdentity();
    for (int k = 0; k < 3; ++k) rigid.block<3, 1>(i.first_coordinate, 3 + k) = Eigen::Vector3d::Unit(k).cross(r);
  }
  // Round-off of static shapes: 1e-16 times the condition of K_ii, about 1e5, in the shape; what it stores in K.
  EXPECT_LT((body.Ke * rigid).norm(), 1e-10 * body.Ke.norm());
  const VectorXd values = Eigen::SelfAdjointEigenSolver<MatrixXd>(body.Ke).eigenvalues();
  EXPECT_LT(values.head(6).cwiseAbs().maxCoeff(), 1e-10 * values(15));
  EXPECT_GT(values(6), 1e-9 * values(15));
  // And the rigid mass is that of the body.
  const MatrixXd M_r = rigid.transpose() * body.Me * rigid;
  EXPECT_NEAR(M_r(0, 0) / body.m, 1, 1e-12);
  EXPECT_LT((M_r.bottomRightCorner<3, 3>() - body.J0).norm(), 1e-12 * body.J0.norm());
}

// A boom that drifts or turns as a whole is not braked against anything.
TEST(CraigBampton, RayleighDampingOfAFreeBodyLeavesItsRigidMotionsAlone) {
  ReducedBody body = sip().body(with(4));
  apply_damping(body, {"rayleigh", 0, 0.3, 2e-5});
  MatrixXd L(6, body.n());
  L << body.Ct, body.Cr0;
  const MatrixXd rigid = body.Me.llt().solve(L.transpose());                   // their coordinates
  EXPECT_LT((body.De * rigid).norm(), 1e-9 * (0.3 * body.Me * rigid).norm());  // round-off of Ke times 2e-5
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> modes(body.Ke, body.Me);
  const VectorXd phi = modes.eigenvectors().col(6);
  const double lambda = modes.eigenvalues()(6);
  EXPECT_NEAR(phi.dot(body.De * phi) / (0.3 + 2e-5 * lambda), 1, 1e-8);  // elastic motions as ever
}

// What round-off leaves of the stiffness of rigid coordinates has no size that it could be held against.
TEST(CraigBampton, ModesOfAFreeBodyPassTheirChecks) {
  const TwoEnds t = sip();
  for (const int modes : {2, 8}) {
    const ModalBasis basis = t.basis(with(modes, "", true));
    const ReducedBody body = reduce(t.boom.mesh, t.boom.assembly, basis, "boom");
    for (int k = 0; k < body.n(); ++k)
      EXPECT_EQ(body.coordinates[static_cast<size_t>(k)].frequency_hz > 0, k >= 6) << k;
    for (const BodyCheck& check : certificate(body, t.boom.mesh, t.boom.assembly, {}, basis, {}, 1))
      EXPECT_TRUE(check.passed) << check.name << ": " << check.value;
  }
}

TEST(CraigBampton, SupportsHoldAllRigidMotionsOrNone) {
  TwoEnds held = sip();
  held.boom.mesh.supports.push_back({3, {true, true, true, false, false, false}});
  EXPECT_THROW(held.basis(with(4)), InputError);
  EXPECT_NO_THROW(held.basis(with(4, "root")));
}

TEST(CraigBampton, StaticTipResponseIsThatOfTheFullModel) {
  const TwoEnds t = sip();
  for (const bool orthonormal : {false, true}) {
    const ReducedBody body = t.body(with(3, "root", orthonormal));
    EXPECT_EQ(body.frame, "clamped");
    const Marker& tip = marker(body, "tip");
    MatrixXd S(6, body.n());
    S << tip.S, tip.S_theta;
    const MatrixXd compliance = S * body.Ke.ldlt().solve(S.transpose());
    const Unknowns left = unknowns(t.boom.mesh, t.boom.assembly.dofs, node_set(t.boom.mesh, "root"));
    MatrixXd f = MatrixXd::Zero(t.boom.assembly.dofs.count, 6);
    const int first = t.boom.assembly.dofs.of_node(node_set(t.boom.mesh, "tip").front(), 0);
    f.middleRows<6>(first).setIdentity();
    const MatrixXd full = test::compliance(t.boom.mesh, t.boom.assembly, left, f);
    // Entries of one bending plane, extension and torsion have their own scales.
    for (Index i = 0; i < 6; ++i) {
      for (Index j = 0; j < 6; ++j)
        EXPECT_NEAR(compliance(i, j), full(i, j), 1e-10 * std::sqrt(full(i, i) * full(j, j))) << i << " " << j;
    }
    // Closed form of the slender bar: L / EA, L / G J.
    EXPECT_NEAR(full(0, 0) / (0.302 / (67e9 * 7.853981633974483e-5)), 1, 1e-9);
    EXPECT_NEAR(full(3, 3) / (0.302 / (67e9 / 2.66 * 2 * 4.908738521234052e-10)), 1, 1e-9);
  }
}

TEST(CraigBampton, FrequenciesConvergeFromAboveWithTheNumberOfModes) {
  const TwoEnds t(boom4(BeamTheory::timoshenko, true, 6, 6));
  const ModalBasis exact = clamped_modes(t.boom.mesh, t.boom.assembly, node_set(t.boom.mesh, "root"),
                                         {.num_modes = 10, .sigma = {}, .backend = "arpack"});
  const VectorXd reference = exact.omega / (2 * std::numbers::pi);
  VectorXd last = VectorXd::Constant(10, 1e300);
  for (const int modes : {6, 8, 12, 16, 24, 40}) {
    const VectorXd f = frequencies_hz(t.body(with(modes, "root"))).head(10);
    for (Index i = 0; i < 10; ++i) {
      EXPECT_LE(f(i), last(i) * (1 + 1e-12)) << modes << " " << i;       // a larger space: Rayleigh-Ritz
      EXPECT_GE(f(i), reference(i) * (1 - 1e-11)) << modes << " " << i;  // digits of the full solve
    }
    last = f;
  }
  EXPECT_LT((last.cwiseQuotient(reference).array() - 1).maxCoeff(), 1e-3);
}

TEST(CraigBampton, ManyModesReachTheFullModel) {
  const TwoEnds t(boom4(BeamTheory::timoshenko, true, 2, 4));
  const int all = unknowns(t.boom.mesh, t.boom.assembly.dofs, node_set(t.boom.mesh, "root")).count;
  const ModalBasis exact = clamped_modes(t.boom.mesh, t.boom.assembly, node_set(t.boom.mesh, "root"),
                                         {.num_modes = 6, .sigma = {}, .backend = "dense"});
  CraigBamptonOptions options = with(all - 6, "root");
  options.modes.backend = "dense";
  const VectorXd f = frequencies_hz(t.body(options));
  ASSERT_EQ(f.size(), all);
  for (Index i = 0; i < 6; ++i) EXPECT_NEAR(f(i) * 2 * std::numbers::pi / exact.omega(i), 1, 1e-9) << i;
}

TEST(CraigBampton, OrthonormalCoordinatesAreTheModesOfTheReducedBody) {
  const TwoEnds t = sip();
  const ReducedBody plain = t.body(with(8, "root"));
  const ModalBasis basis = t.basis(with(8, "root", true));
  const ReducedBody body = reduce(t.boom.mesh, t.boom.assembly, basis, "boom");
  const VectorXd f = frequencies_hz(plain);
  for (Index i = 0; i < body.n(); ++i) {
    EXPECT_NEAR(body.coordinates[static_cast<size_t>(i)].frequency_hz / f(i), 1, 1e-10) << i;
    for (Index j = 0; j < i; ++j) {
      EXPECT_LT(std::abs(body.Me(i, j)), 1e-11 * body.m) << i << " " << j;
      EXPECT_LT(std::abs(body.Ke(i, j)), 1e-9 * std::sqrt(body.Ke(i, i) * body.Ke(j, j))) << i << " " << j;
    }
  }
  EXPECT_EQ(body.coordinates[0].kind, "bending_y");
  EXPECT_NEAR(marker(body, "tip").S(1, 0), 2, 1e-10);
  EXPECT_EQ(body.interfaces[0].first_coordinate, -1);
  for (const BodyCheck& c : check_invariants(body, t.boom.mesh, t.boom.assembly, basis))
    EXPECT_TRUE(c.passed) << c.name << " " << c.relative_error;
}

TEST(CraigBampton, InvariantsOfTheFreeBodyAgreeWithIndependentRoutes) {
  const TwoEnds t = sip();
  const ModalBasis basis = t.basis(with(4));
  const ReducedBody body = reduce(t.boom.mesh, t.boom.assembly, basis, "boom");
  for (const BodyCheck& c : check_invariants(body, t.boom.mesh, t.boom.assembly, basis))
    EXPECT_TRUE(c.passed) << c.name << " " << c.relative_error;
}

TEST(CraigBampton, LineMassLeavesOutTheSpinThatNoMassReaches) {
  const TwoEnds t(boom4(BeamTheory::euler_bernoulli, false));
  const ModalBasis basis = t.basis(with(2));
  EXPECT_EQ(basis.Phi.cols(), 12);  // 5 + 5 + 2
  EXPECT_FALSE(basis.interfaces[0].components[3]);
  EXPECT_EQ(basis.interfaces[1].first_coordinate, 5);
  EXPECT_EQ(basis.coordinates[8].direction, "ry");
}

/// What unit forces do at the reference is round-off, whose digits agree with nothing.
TEST(CraigBampton, TheReferenceHasNoFlexibilityToBeChecked) {
  SolidOptions options;
  options.order = 2;
  options.grading = {.sectors = 1, .rings = 1, .long_elements = 6, .end_layers = 0, .corner_levels = 0};
  Mesh mesh = make_solid_mesh(boom4(BeamTheory::timoshenko, true), options);
  const double middle = mesh.nodes.row(0).maxCoeff() / 2;
  for (int i = 0; i < mesh.nodes.cols(); ++i)
    if (std::abs(mesh.nodes(0, i) - middle) < 1e-9) mesh.node_sets["mid"].push_back(i);
  mesh.nodes = (Eigen::Quaterniond(0.3, -0.5, 0.7, 0.2).normalized().toRotationMatrix() * mesh.nodes).eval();
  const auto places =
      place_interfaces(mesh, {{"base", "root", "rigid"}, {"centre", "mid", "distributing"}, {"end", "tip", "rigid"}});
  const Assembly assembly = assemble(mesh);
  const ModalBasis basis = craig_bampton(mesh, assembly, places, with(4, "centre"));
  const ReducedBody body = reduce(mesh, assembly, basis, "boom");
  int forces = 0;
  const Clamp reference(std::vector<int>{places[1].node});
  for (const BodyCheck& c : certificate(body, mesh, assembly, reference, basis, {"root", "mid", "tip"})) {
    EXPECT_TRUE(c.passed) << c.name << " " << c.value << " " << c.reference;
    EXPECT_FALSE(c.name.starts_with("unit force at mid")) << c.value;
    forces += c.name.starts_with("unit force");
  }
  EXPECT_GE(forces, 6);
}

TEST(CraigBampton, UnknownConnectionsAreRefusedOfOneNodeToo) {
  Mesh mesh = make_mesh(boom4(BeamTheory::timoshenko, true));
  EXPECT_THROW(place_interfaces(mesh, {{"end", "tip", "foo"}}), InputError);
}

TEST(CraigBampton, ReferenceNodesStandForFacesOfSolids) {
  const BeamGeometry g = boom4(BeamTheory::timoshenko, true);
  SolidOptions options;
  options.order = 2;
  options.grading = {.sectors = 1, .rings = 1, .long_elements = 6, .end_layers = 0, .corner_levels = 0};
  for (const std::string connection : {"rigid", "distributing"}) {
    Mesh mesh = make_solid_mesh(g, options);
    const auto ends = place_interfaces(mesh, {{"base", "root", "rigid"}, {"end", "tip", connection}});
    const Assembly assembly = assemble(mesh);
    const ModalBasis basis = craig_bampton(mesh, assembly, ends, with(4, "base"));
    const ReducedBody body = reduce(mesh, assembly, basis, "boom");
    EXPECT_EQ(body.structure, "solid");
    ASSERT_EQ(body.n(), 10);
    const Marker& end = marker(body, "end");
    EXPECT_LT((end.S.leftCols<3>() - Eigen::Matrix3d::Identity()).norm(), 1e-12) << connection;
    EXPECT_LT(end.S.rightCols<4>().norm(), 1e-9) << connection;
    // The mean motion of the face is that of its reference node, whatever the connection.
    const Marker& face = marker(body, "tip");
    EXPECT_LT((face.S - end.S).norm(), 1e-10) << connection;
    EXPECT_LT((face.S_theta - end.S_theta).norm(), 1e-8) << connection;
    // Static compliance against the full model with the same connection and the same load.
    InterfaceNode loaded = ends[1];
    const Unknowns left =
        unknowns(mesh, assembly.dofs, std::vector<int>{ends[0].node}, kept_freedoms(assembly.dofs, loaded));
    MatrixXd f = MatrixXd::Zero(assembly.dofs.count, 6);
    f.middleRows<6>(assembly.dofs.of_node(loaded.node, 0)).setIdentity();
    const MatrixXd full = test::compliance(mesh, assembly, left, f);
    MatrixXd S(6, body.n());
    S << end.S, end.S_theta;
    const MatrixXd compliance = S * body.Ke.ldlt().solve(S.transpose());
    for (Index i = 0; i < 6; ++i) EXPECT_NEAR(compliance(i, i) / full(i, i), 1, 1e-10) << connection << " " << i;
    // A rigid face is stiffer, and so are six quadratic elements: by 3.5 %.
    EXPECT_NEAR(full(1, 1) / (std::pow(0.302, 3) / (3 * 67e9 * 4.908738521234052e-10)), 0.965, 0.01);
    for (const BodyCheck& c : check_invariants(body, mesh, assembly, basis))
      EXPECT_TRUE(c.passed) << connection << " " << c.name << " " << c.relative_error;
  }
}

TEST(CraigBampton, ImpossibleInterfacesAreRefused) {
  const TwoEnds t = sip();
  const auto refuses = [&t](std::vector<InterfaceNode> interfaces, const CraigBamptonOptions& options,
                            const std::string& text) {
    try {
      craig_bampton(t.boom.mesh, t.boom.assembly, std::move(interfaces), options);
      ADD_FAILURE() << "accepted: " << text;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find(text), std::string::npos) << e.what();
    }
  };
  refuses(t.ends, with(2, "rooot"), "does not exist");
  const int tip = t.ends[1].node;
  refuses({{"pin", tip, {true, true, true, false, false, false}}}, with(2), "can still move");
  refuses({{"a", tip}, {"b", tip}}, with(2), "another interface keeps it too");
  refuses({{"pin", tip, {true, true, true, false, false, false}}, t.ends[0]}, with(2, "pin"), "does not hold the body");
  refuses({{"none", tip, {false, false, false, false, false, false}}}, with(2), "keeps no freedom");
  Mesh mesh = t.boom.mesh;
  EXPECT_THROW(place_interfaces(mesh, {{"a", "rooot"}}), InputError);
  EXPECT_THROW(place_interfaces(mesh, {{"a", "root"}, {"a", "tip"}}), InputError);
}

}  // namespace
}  // namespace flexboom
