#include "reduction/invariants/inertia_invariants.hpp"

#include "fem/base/check.hpp"
#include "reduction/invariants/certificate.hpp"
#include "reduction/invariants/eq14.hpp"
#include "tests/reduction/booms.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <functional>

namespace flexboom {
namespace {

using test::boom4;
using test::make_boom;

const std::vector<ModeKind> bending = {ModeKind::bending_y, ModeKind::bending_z};

struct Reduced {
  test::Boom boom;
  ModalBasis basis;
  ReducedBody body;
};

Reduced reduced(const BeamGeometry& geometry, int modes) {
  test::Boom boom = make_boom(geometry);
  ModalBasis basis = clamped_modes(boom.mesh, boom.assembly, node_set(boom.mesh, "root"),
                                   {.num_modes = modes, .sigma = {}, .backend = "arpack"});
  ReducedBody body = reduce(boom.mesh, boom.assembly, basis, "boom");
  return {std::move(boom), std::move(basis), std::move(body)};
}

/// A boom with everything: taper, two materials, a lumped mass and a tip body whose mass centre is off the axis.
BeamGeometry full_boom() {
  BeamGeometry g = boom4(BeamTheory::timoshenko, true, 3, 6);
  g.segments.push_back({RoundBar{0.01}, RoundBar{0.006}, 0.2, Material{110e9, 0.3, 4400}, 3});
  g.attachments.push_back({"lump", 0.302, 0.02, Eigen::Matrix3d::Zero(), Eigen::Vector3d::Zero()});
  Eigen::Matrix3d inertia;
  inertia << 3e-5, 2e-6, 0, 2e-6, 4e-5, -3e-6, 0, -3e-6, 5e-5;
  g.attachments.push_back({"probe", 0.502, 0.05, inertia, {0.02, 0.01, -0.005}});
  return g;
}

double error_of(const std::vector<BodyCheck>& checks, const std::string& name) {
  for (const BodyCheck& c : checks) {
    if (c.name == name) return c.relative_error;
  }
  ADD_FAILURE() << "no check " << name;
  return 0;
}

TEST(Reduce, LineMassBoomHasEveryInvariantOfEq14) {
  constexpr int n = 5;
  const test::Boom boom = make_boom(boom4(BeamTheory::euler_bernoulli, false, 10, 8));
  const ModalBasis basis =
      clamped_modes_of_kind(boom.mesh, boom.assembly, node_set(boom.mesh, "root"), 2 * n, bending, {});
  const ReducedBody fe = reduce(boom.mesh, boom.assembly, basis, "fe");
  const ReducedBody exact = eq14::reduced_body({0.302, 2840 * 7.853981633974483e-5, 67e9 * 4.908738521234052e-10}, n,
                                               eq14::Planes::xy_and_xz, "exact");
  const auto of = [](Eigen::Index i) { return i / 2 + (i % 2) * n; };  // FE: y, z in turn; eq. 14: all y, then all z
  const double m = exact.m;
  const double tolerance = 1e-10 * m;  // asked for; reached: 1e-12
  EXPECT_NEAR(fe.m, m, 1e-14 * m);
  EXPECT_LT((fe.mc0 - exact.mc0).norm(), 1e-14 * m);
  EXPECT_LT((fe.J0 - exact.J0).norm(), 1e-14 * m);
  for (Eigen::Index i = 0; i < 2 * n; ++i) {
    const auto a = static_cast<size_t>(i);
    const auto b = static_cast<size_t>(of(i));
    EXPECT_LT((fe.Ct.col(i) - exact.Ct.col(of(i))).norm(), tolerance) << i;
    EXPECT_LT((fe.Cr0.col(i) - exact.Cr0.col(of(i))).norm(), tolerance) << i;
    EXPECT_LT((fe.J1[a] - exact.J1[b]).norm(), tolerance) << i;
    EXPECT_NEAR(fe.Ke(i, i) / exact.Ke(of(i), of(i)), 1, 1e-10) << i;
    for (Eigen::Index j = 0; j < 2 * n; ++j) {
      EXPECT_NEAR(fe.Me(i, j), exact.Me(of(i), of(j)), tolerance) << i << " " << j;
      EXPECT_LT((fe.Cr1[a].col(j) - exact.Cr1[b].col(of(j))).norm(), tolerance) << i << " " << j;
      EXPECT_LT((fe.J2[a][static_cast<size_t>(j)] - exact.J2[b][static_cast<size_t>(of(j))]).norm(), tolerance)
          << i << " " << j;
    }
  }
  const Marker& tip = marker(fe, "tip");
  EXPECT_LT((tip.S.col(0) - marker(exact, "tip").S.col(0)).norm(), 1e-10);
  EXPECT_LT((tip.S_theta.col(0) - marker(exact, "tip").S_theta.col(0)).norm(), 1e-8);
  EXPECT_LT((tip.S_theta.col(1) - marker(exact, "tip").S_theta.col(n)).norm(), 1e-8);
}

TEST(Reduce, EveryInvariantAgreesWithIndependentRoutes) {
  for (const BeamGeometry& g : {boom4(BeamTheory::euler_bernoulli, false), boom4(BeamTheory::euler_bernoulli, true),
                                boom4(BeamTheory::timoshenko, true), full_boom()}) {
    const Reduced r = reduced(g, 8);
    for (const BodyCheck& c : check_invariants(r.body, r.boom.mesh, r.boom.assembly, r.basis)) {
      EXPECT_TRUE(c.passed) << c.name << " " << c.value << " against " << c.reference << ", " << c.relative_error;
    }
  }
}

// Where elements are a thousand times deeper than long, M is rotary inertia, and the mass is what is left of it.
TEST(Reduce, InvariantsOfStubsAgreeToWhatRoundOffLeaves) {
  for (const double length : {0.02, 0.005, 0.001})
    for (const SectionShape& shape : {SectionShape(RoundBar{0.1}), SectionShape(Rectangle{0.02, 0.5})}) {
      BeamGeometry g = boom4(BeamTheory::timoshenko, true, 8, 4);
      g.segments[0].start = g.segments[0].end = shape;
      g.segments[0].length = length;
      const Reduced r = reduced(g, 2);
      for (const BodyCheck& c : check_invariants(r.body, r.boom.mesh, r.boom.assembly, r.basis)) {
        EXPECT_TRUE(c.passed) << c.name << " " << c.value << " against " << c.reference << ", " << c.relative_error;
        EXPECT_LT(c.relative_error, 1e-8) << c.name;
      }
    }
}

TEST(Reduce, RigidPartIsTheClosedFormOfACylinder) {
  const ReducedBody body = reduced(boom4(BeamTheory::timoshenko, true), 2).body;
  // boom_properties.json
  EXPECT_NEAR(body.m / 0.06736202967827235, 1, 1e-14);
  EXPECT_NEAR(body.mc0.x() / (0.06736202967827235 * 0.151), 1, 1e-14);
  EXPECT_NEAR(body.J0(1, 1) / 0.00204831653094454, 1, 1e-14);
  EXPECT_NEAR(body.J0(2, 2) / 0.00204831653094454, 1, 1e-14);
  EXPECT_NEAR(body.J0(0, 0) / 8.420253709784043e-7, 1, 1e-13);
}

TEST(Reduce, TipBodyAddsByTheParallelAxisTheorem) {
  BeamGeometry g = full_boom();
  const ReducedBody with = reduced(g, 2).body;
  const RigidAttachment probe = g.attachments.back();
  g.attachments.pop_back();
  const ReducedBody without = reduced(g, 2).body;
  const Eigen::Vector3d r = Eigen::Vector3d(probe.position, 0, 0) + probe.offset;
  const Eigen::Matrix3d J =
      probe.inertia + probe.mass * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
  EXPECT_NEAR(with.m - without.m, probe.mass, 1e-15);
  EXPECT_LT((with.mc0 - without.mc0 - probe.mass * r).norm(), 1e-15);
  EXPECT_LT((with.J0 - without.J0 - J).norm(), 1e-15);
}

/// A mesh turned as a whole by A.
Mesh rotated(Mesh mesh, const Eigen::Matrix3d& A) {
  mesh.nodes = A * mesh.nodes;
  for (BeamProperty& p : mesh.beam_properties) p.y_axis = A * p.y_axis;
  for (NodalBody& b : mesh.bodies) {
    b.inertia = A * b.inertia * A.transpose();
    b.offset = A * b.offset;
  }
  return mesh;
}

TEST(Reduce, TurningTheBodyTurnsItsInvariants) {
  const Reduced r = reduced(full_boom(), 4);
  const Eigen::Matrix3d A = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  const Mesh mesh = rotated(r.boom.mesh, A);
  const Assembly assembly = assemble(mesh);
  // The same shapes, turned: vectors at the nodes turn, amplitudes inside the elements are in element axes.
  ModalBasis basis = r.basis;
  for (int node = 0; node < mesh.nodes.cols(); ++node) {
    for (const int half : {0, 3}) {
      auto rows = basis.Phi.middleRows<3>(assembly.dofs.of_node(node, half));
      rows = (A * rows).eval();
    }
  }
  const ReducedBody turned = reduce(mesh, assembly, basis, "turned");
  const double m = r.body.m;  // lengths and shapes are of the order of 1
  EXPECT_LT((turned.mc0 - A * r.body.mc0).norm(), 1e-14 * m);
  EXPECT_LT((turned.J0 - A * r.body.J0 * A.transpose()).norm(), 1e-14 * m);
  EXPECT_LT((turned.Ct - A * r.body.Ct).norm(), 1e-13 * m);
  EXPECT_LT((turned.Cr0 - A * r.body.Cr0).norm(), 1e-13 * m);
  EXPECT_LT((turned.Me - r.body.Me).norm(), 1e-13 * r.body.Me.norm());
  EXPECT_LT((turned.Ke - r.body.Ke).norm(), 1e-12 * r.body.Ke.norm());
  for (size_t k = 0; k < 4; ++k) {
    EXPECT_LT((turned.Cr1[k] - A * r.body.Cr1[k]).norm(), 1e-13 * r.body.Me.norm());
    EXPECT_LT((turned.J1[k] - A * r.body.J1[k] * A.transpose()).norm(), 1e-13 * m);
    EXPECT_LT((turned.J2[k][3] - A * r.body.J2[k][3] * A.transpose()).norm(), 1e-13 * r.body.Me.norm());
  }
}

TEST(Reduce, ShiftingTheFrameShiftsItsInvariants) {
  const Reduced r = reduced(full_boom(), 4);
  const Eigen::Vector3d d(0.3, -0.2, 0.5);  // old origin seen from the new one
  Mesh mesh = r.boom.mesh;
  mesh.nodes.colwise() += d;
  const ReducedBody shifted = reduce(mesh, r.boom.assembly, r.basis, "shifted");
  const ReducedBody& b = r.body;
  const auto tilde = [](const Eigen::Vector3d& a) {
    return (Eigen::Matrix3d() << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0).finished();
  };
  const Eigen::Matrix3d D = tilde(d);
  const double m = b.m;
  EXPECT_LT((shifted.mc0 - b.mc0 - m * d).norm(), 1e-14 * m);
  const Eigen::Matrix3d J0 = b.J0 - D * tilde(b.mc0) - tilde(b.mc0) * D - m * D * D;
  EXPECT_LT((shifted.J0 - J0).norm(), 1e-14 * m);
  EXPECT_LT((shifted.Ct - b.Ct).norm(), 1e-14 * m);
  EXPECT_LT((shifted.Cr0 - b.Cr0 - D * b.Ct).norm(), 1e-13 * m);
  EXPECT_LT((shifted.Me - b.Me).norm(), 1e-14 * b.Me.norm());
  for (size_t k = 0; k < 4; ++k) {
    const Eigen::Matrix3d C = tilde(b.Ct.col(static_cast<Eigen::Index>(k)));
    EXPECT_LT((shifted.J1[k] - b.J1[k] + D * C + C * D).norm(), 1e-13 * m);
    EXPECT_LT((shifted.Cr1[k] - b.Cr1[k]).norm() + (shifted.J2[k][1] - b.J2[k][1]).norm(), 1e-13 * b.Me.norm());
  }
}

TEST(CheckInvariants, EveryWrongInvariantIsNoticed) {
  const Reduced r = reduced(full_boom(), 4);
  const std::vector<std::tuple<std::string, std::string, std::function<void(ReducedBody&)>>> mutations = {
      {"m scaled", "m = t^T M t", [](ReducedBody& b) { b.m *= 1 + 1e-10; }},
      {"mc0 sign", "mc0 = t^T M r", [](ReducedBody& b) { b.mc0 *= -1; }},
      {"J0 about the mass centre", "J0 = r^T M r", [](ReducedBody& b) { b.J0 -= b.mc0 * b.mc0.transpose() / b.m; }},
      {"Ct of one mode dropped", "Ct = t^T M Phi", [](ReducedBody& b) { b.Ct.col(2).setZero(); }},
      {"Cr0 sign", "Cr0 = r^T M Phi", [](ReducedBody& b) { b.Cr0 *= -1; }},
      {"Me diagonal only", "Me = Phi^T M Phi", [](ReducedBody& b) { b.Me(0, 1) += 1e-9 * b.m; }},
      {"Cr1 dropped", "Cr1, finer quadrature", [](ReducedBody& b) { b.Cr1[1].setZero(); }},
      {"Cr1 dropped, seen at q", "Cr(q) of the deformed body", [](ReducedBody& b) { b.Cr1[1].setZero(); }},
      {"Cr1 not antisymmetric", "Cr1[k] e_l + Cr1[l] e_k", [](ReducedBody& b) { b.Cr1[1] *= -1; }},
      {"J1 halved", "J1, finer quadrature", [](ReducedBody& b) { b.J1[0] /= 2; }},
      {"J1 halved, seen at q", "J(q) of the deformed body", [](ReducedBody& b) { b.J1[0] /= 2; }},
      {"J2 transposed sum", "J2, finer quadrature", [](ReducedBody& b) { b.J2[0][1] *= 2; }},
      {"J2 trace", "tr J2 - 2 Me", [](ReducedBody& b) { b.J2[0][0](0, 0) *= 1.001; }},
      {"J2 seen at q", "J(q) of the deformed body", [](ReducedBody& b) { b.J2[2][2].setZero(); }},
      {"Ct seen at q", "mc(q) of the deformed body", [](ReducedBody& b) { b.Ct.col(0) *= 1.001; }},
      {"Ke wrong", "Ke = omega^2 Me", [](ReducedBody& b) { b.Ke(3, 3) *= 1 + 1e-9; }},
  };
  for (const auto& [what, name, damage] : mutations) {
    ReducedBody body = r.body;
    damage(body);
    std::vector<BodyCheck> checks = check_invariants(body, r.boom.mesh, r.boom.assembly, r.basis);
    const std::vector<BodyCheck> of_body = body_checks(body);
    checks.insert(checks.end(), of_body.begin(), of_body.end());
    EXPECT_GT(error_of(checks, name), 1e-11) << what;
  }
}

TEST(CheckInvariants, OneWrongEntryAmongManyIsNoticed) {
  // More coordinates than are checked one by one.
  const Reduced r = reduced(full_boom(), 14);
  const auto worst = [&](const ReducedBody& body, const std::string& name) {
    return error_of(check_invariants(body, r.boom.mesh, r.boom.assembly, r.basis), name);
  };
  for (const BodyCheck& c : check_invariants(r.body, r.boom.mesh, r.boom.assembly, r.basis))
    EXPECT_TRUE(c.passed) << c.name << " " << c.relative_error;
  ReducedBody body = r.body;
  body.Cr1[11](2, 8) += 1e-9 * std::sqrt(body.Me(11, 11) * body.Me(8, 8));
  EXPECT_GT(worst(body, "Cr1, finer quadrature"), 1e-11);
  EXPECT_GT(worst(body, "Cr(q) of the deformed body"), 1e-11);
  body = r.body;
  body.J1[13](0, 1) += 1e-9 * std::sqrt(body.J0(1, 1) * body.Me(13, 13));
  EXPECT_GT(worst(body, "J1, finer quadrature"), 1e-11);
  body = r.body;
  body.J2[3][12](1, 1) += 1e-9 * std::sqrt(body.Me(3, 3) * body.Me(12, 12));
  EXPECT_GT(worst(body, "J2, finer quadrature"), 1e-11);
  EXPECT_GT(worst(body, "J(q) of the deformed body"), 1e-11);
}

TEST(Reduce, StiffnessIsDiagonalAndGivesTheFrequencies) {
  const Reduced r = reduced(full_boom(), 6);
  for (Eigen::Index i = 0; i < 6; ++i) {
    EXPECT_NEAR(r.body.Ke(i, i) / r.body.Me(i, i) / std::pow(r.basis.omega(i), 2), 1, 1e-13);
    for (Eigen::Index j = 0; j < i; ++j) {
      // Orthogonality in K follows from that in M by the solver's residual times omega^2 of the higher mode.
      EXPECT_LT(std::abs(r.body.Ke(i, j)), 1e-9 * r.body.Ke(i, i)) << i << " " << j;
    }
  }
}

TEST(Reduce, BodySaysWhatItIs) {
  const Reduced r = reduced(boom4(BeamTheory::timoshenko, true), 3);
  EXPECT_EQ(r.body.structure, "beam");
  EXPECT_EQ(r.body.frame, "clamped");
  EXPECT_EQ(r.body.full_freedoms, r.basis.unknowns);
  EXPECT_EQ(r.body.coordinates[0].kind, "bending_y");
  EXPECT_NEAR(r.body.coordinates[0].frequency_hz, 74.455927735, 1e-8);
  EXPECT_EQ(marker(r.body, "root").S.norm(), 0);
  EXPECT_NEAR(marker(r.body, "tip").S(1, 0), 2, 1e-12);
  EXPECT_EQ(r.body.De.norm(), 0);
  ASSERT_FALSE(r.body.display.lines.empty());
  const int last = r.body.display.lines.back().back();
  EXPECT_LT((r.body.display.points.col(last) - Eigen::Vector3d(0.302, 0, 0)).norm(), 1e-15);
  EXPECT_LT((r.body.display.S[static_cast<size_t>(last)] - marker(r.body, "tip").S).norm(), 1e-12);
}

TEST(Reduce, ABasisOfAnotherMeshIsRefused) {
  const Reduced r = reduced(boom4(BeamTheory::timoshenko, true), 2);
  const test::Boom other = make_boom(boom4(BeamTheory::timoshenko, true, 5));
  EXPECT_THROW(reduce(other.mesh, other.assembly, r.basis, "b"), InputError);
}

}  // namespace
}  // namespace flexboom
