#include "reduction/invariants/uniform_beam.hpp"

#include "reduction/basis/hinge_basis.hpp"
#include "reduction/invariants/certificate.hpp"
#include "reduction/invariants/eq14.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tests/reduction/booms.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <string>

namespace flexboom {
namespace {

using Eigen::Vector3d;
using test::boom4;

constexpr double L = 0.302, rho_A = 2840 * 7.853981633974483e-5, EI = 67e9 * 4.908738521234052e-10;

TEST(BendingMode, OfALineMassIsEq14) {
  const eq14::Boom boom{L, rho_A, EI};
  for (int k = 1; k <= 30; ++k) {
    const double exact = eq14::omega(boom, k);
    const auto mode = bending_mode({L, rho_A, EI}, exact * (1 + 1e-3));
    ASSERT_TRUE(mode.has_value()) << k;
    // The phase mu L turns by 94 rad at k = 30; Ct and Cr0 per tip deflection of |phi(1)| = 2.
    EXPECT_NEAR(mode->omega / exact, 1, 1e-13) << k;
    const double tip = eq14::phi(k, 1);
    EXPECT_NEAR(mode->Ct / (rho_A * L * eq14::integral_phi(k) / tip), 1, 1e-11) << k;
    EXPECT_NEAR(mode->Cr0 / (rho_A * L * L * eq14::integral_x_phi(k) / tip), 1, 1e-11) << k;
  }
  EXPECT_FALSE(bending_mode({L, rho_A, EI}, 1.5 * eq14::omega(boom, 3)).has_value());
}

TEST(BendingMode, AboveTheCutoffThereIsNone) {
  const double rho_I = 2840 * 4.908738521234052e-10, compliance = 1 / (0.9 * 25e9 * 7.853981633974483e-5);
  const double cutoff = 1 / std::sqrt(compliance * rho_I);
  EXPECT_FALSE(bending_mode({L, rho_A, EI, rho_I, compliance}, 1.1 * cutoff).has_value());
}

struct Checked {
  test::Boom boom;
  ModalBasis basis;
  ReducedBody body;
  std::vector<BodyCheck> checks;
};

Checked checked(Mesh mesh, int modes) {
  Assembly assembly = assemble(mesh);
  Checked c{{std::move(mesh), std::move(assembly)}, {}, {}, {}};
  const Clamp clamp(node_set(c.boom.mesh, "root"));
  c.basis = clamped_modes(c.boom.mesh, c.boom.assembly, clamp, {.num_modes = modes, .sigma = {}, .backend = "dense"});
  c.body = reduce(c.boom.mesh, c.boom.assembly, c.basis, "boom");
  c.checks = check_uniform_beam(c.body, c.boom.mesh, c.boom.assembly.dofs, clamp, c.basis);
  return c;
}

/// A mesh turned and moved.
Mesh moved(Mesh mesh) {
  const Eigen::Matrix3d A = Eigen::AngleAxisd(0.7, Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  mesh.nodes = (A * mesh.nodes).colwise() + Vector3d(0.1, -0.07, 0.05);
  for (BeamProperty& p : mesh.beam_properties) p.y_axis = A * p.y_axis;
  return mesh;
}

TEST(UniformBeam, OfEveryTheoryAgreesWithItsClosedForm) {
  for (const bool rectangle : {false, true}) {
    for (const auto& [theory, rotary] : {std::pair{BeamTheory::euler_bernoulli, false},
                                         {BeamTheory::euler_bernoulli, true},
                                         {BeamTheory::timoshenko, true},
                                         {BeamTheory::timoshenko, false}}) {
      BeamGeometry g = boom4(theory, rotary, 8, 8);
      if (rectangle) g.segments[0].start = g.segments[0].end = Rectangle{0.01, 0.014};
      // 20 modes: bending up to the eighth in each plane, torsion, tension.
      const Checked c = checked(rotary ? moved(make_mesh(g)) : make_mesh(g), 20);
      ASSERT_EQ(c.checks.size(), 4U);
      EXPECT_LT(c.checks[0].relative_error, 1e-10) << c.checks[0].value << " " << c.checks[0].reference;
      EXPECT_LT(c.checks[1].relative_error, 1e-9);  // shapes err by more than their frequencies
      EXPECT_LT(c.checks[2].relative_error, 1e-9);
      EXPECT_EQ(c.checks[3].value, 0);
    }
  }
}

// Torsion does not feel what lies on the axis; bending and tension do.
TEST(UniformBeam, MassOnTheAxisIsPartOfTheClosedForm) {
  for (const bool rotary : {false, true}) {
    const Mesh bare = make_mesh(boom4(BeamTheory::timoshenko, rotary, 8, 8));
    Mesh mesh = bare;
    const double rho_A = mesh.beam_properties[0].material.rho * section_of(mesh.beam_properties[0].start, 0.33, {}).A;
    for (BeamProperty& p : mesh.beam_properties) p.line_mass = 3 * rho_A;
    const Checked c = checked(mesh, 20), of_bare = checked(bare, 20);
    for (size_t i = 0; i < 3; ++i) EXPECT_LT(c.checks[i].relative_error, 1e-9) << c.checks[i].name;
    const auto first = [](const Checked& of, ModeKind kind) {
      return of.basis.omega[std::ranges::find(of.basis.kind, kind) - of.basis.kind.begin()];
    };
    EXPECT_NEAR(first(c, ModeKind::bending_y) / first(of_bare, ModeKind::bending_y), 0.5, 1e-3);
    if (rotary) EXPECT_NEAR(first(c, ModeKind::torsion), first(of_bare, ModeKind::torsion), 1e-9 * c.basis.omega[19]);
  }
}

TEST(UniformBeam, ErrorIsThatOfTheMesh) {
  const Checked coarse = checked(make_mesh(boom4(BeamTheory::timoshenko, true, 2, 2)), 6);
  EXPECT_GT(coarse.checks[0].relative_error, 1e-6);
  EXPECT_LT(coarse.checks[0].relative_error, 1e-2);
}

TEST(UniformBeam, EveryWrongQuantityIsNoticed) {
  const Checked c = checked(moved(make_mesh(boom4(BeamTheory::timoshenko, true, 6, 8))), 8);
  const Clamp clamp(node_set(c.boom.mesh, "root"));
  const auto failed = [&](ReducedBody body) {
    std::string names;
    for (const BodyCheck& check : check_uniform_beam(body, c.boom.mesh, c.boom.assembly.dofs, clamp, c.basis))
      names += check.passed ? "" : check.name.substr(check.name.rfind(": ") + 2, 9) + " ";
    return names;
  };
  EXPECT_EQ(failed(c.body), "");
  ReducedBody body = c.body;
  body.coordinates[2].frequency_hz *= 1.002;
  EXPECT_EQ(failed(body), "frequency ");
  body = c.body;
  body.Ct.col(0) *= -1;
  EXPECT_EQ(failed(body), "Ct ");
  body = c.body;
  body.Cr0.col(1) *= -1;
  EXPECT_EQ(failed(body), "Cr0 ");
  body = c.body;
  body.coordinates[2].frequency_hz *= 1.05;
  EXPECT_EQ(failed(body), "modes bel ");
}

TEST(UniformBeam, OtherModelsAreSaidToBeNotApplicable) {
  const auto reason = [](const BeamGeometry& g) {
    const Checked c = checked(make_mesh(g), 2);
    EXPECT_EQ(c.checks.size(), 1U);
    EXPECT_TRUE(c.checks[0].passed);
    return c.checks[0].name;
  };
  BeamGeometry g = boom4(BeamTheory::timoshenko, true);
  g.segments[0].end = RoundBar{0.008};
  EXPECT_NE(reason(g).find("not applicable, not uniform"), std::string::npos);
  g = boom4(BeamTheory::timoshenko, true);
  g.attachments.push_back({"probe", 0.302, 0.05, Eigen::Matrix3d::Zero(), Vector3d::Zero()});
  EXPECT_NE(reason(g).find("bodies"), std::string::npos);
  g = boom4(BeamTheory::timoshenko, true);
  Mesh bent = make_mesh(g);
  bent.nodes(1, bent.nodes.cols() - 1) += 0.01;
  EXPECT_NE(checked(bent, 2).checks[0].name.find("not straight"), std::string::npos);
  const test::Boom boom = test::make_boom(g);
  const Clamp clamp(node_set(boom.mesh, "root"));
  const ModalBasis hinged =
      hinge_adapted_modes(boom.mesh, boom.assembly, clamp, {.axis = Vector3d::UnitZ(), .stiffness = {0.1}}, 2, {});
  const ReducedBody body = reduce(boom.mesh, boom.assembly, hinged, "hinged");
  EXPECT_NE(check_uniform_beam(body, boom.mesh, boom.assembly.dofs, clamp, hinged)[0].name.find("no modes"),
            std::string::npos);
  Mesh held = make_mesh(g);
  held.node_sets["root"] = {1};
  EXPECT_NE(checked(held, 2).checks[0].name.find("not applicable"), std::string::npos);
}

TEST(UniformBeam, CertificateHasNothingTwice) {
  const Checked c = checked(make_mesh(boom4(BeamTheory::timoshenko, true)), 6);
  std::vector<std::string> names;
  for (const BodyCheck& check :
       certificate(c.body, c.boom.mesh, c.boom.assembly, node_set(c.boom.mesh, "root"), c.basis)) {
    EXPECT_TRUE(check.passed) << check.name;
    names.push_back(check.name);
  }
  std::ranges::sort(names);
  EXPECT_EQ(std::ranges::adjacent_find(names), names.end());
  EXPECT_EQ(std::ranges::count_if(names, [](const std::string& n) { return n.find("tr J2") == 0; }), 1);
  EXPECT_EQ(std::ranges::count_if(names, [](const std::string& n) { return n.find("closed form") == 0; }), 4);
}

}  // namespace
}  // namespace flexboom
