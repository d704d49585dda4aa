#include "fem/booms/solid_boom.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tests/reduction/booms.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <string>

// Invariants of solids against a solid that is converged, and against beams.
namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// A stub of round bar, d = 10 mm. nu = 0: the clamped face keeps its shape, so that its rim is not singular.
BeamGeometry stub(double length, double nu) {
  BeamGeometry g = test::boom4(BeamTheory::timoshenko, true, 4, 8);
  g.segments[0].length = length;
  g.segments[0].material.nu = nu;
  return g;
}

struct Solid {
  ReducedBody body;
  int unknowns = 0;
};

/// Orders are even: only then a node lies in the middle of the tip, whose deflection aligns pairs of modes.
Solid solid(double length, double nu, int order, const SolidGrading& grading, int modes = 5) {
  SolidOptions options;
  options.order = order;
  options.grading = grading;
  const Mesh mesh = make_solid_mesh(stub(length, nu), options);
  const Assembly assembly = assemble(mesh, 2);
  const ModalBasis basis =
      clamped_modes(mesh, assembly, node_set(mesh, "root"), {.num_modes = modes, .sigma = {}, .backend = "auto"}, 2);
  return {reduce(mesh, assembly, basis, "solid", 2), basis.unknowns};
}

/// Every invariant as one matrix, its modes scaled to Me_kk = m. (Modes come with the tip's deflection at one node,
/// which converges more slowly than any integral.)
std::map<std::string, MatrixXd> invariants(const ReducedBody& b) {
  const Index n = b.n();
  const Eigen::VectorXd s = (b.Me.diagonal() / b.m).cwiseSqrt().cwiseInverse();
  std::map<std::string, MatrixXd> all;
  all["m"] = MatrixXd::Constant(1, 1, b.m);
  all["mc0"] = b.mc0;
  all["J0"] = b.J0;
  all["Ct"] = b.Ct * s.asDiagonal();
  all["Cr0"] = b.Cr0 * s.asDiagonal();
  all["Me"] = s.asDiagonal() * b.Me * s.asDiagonal();
  all["Ke"] = s.asDiagonal() * b.Ke * s.asDiagonal();
  MatrixXd &Cr1 = all["Cr1"], &J1 = all["J1"], &J2 = all["J2"];
  Cr1.resize(3, n * n), J1.resize(3, 3 * n), J2.resize(3, 3 * n * n);
  for (Index k = 0; k < n; ++k) {
    const auto kk = static_cast<size_t>(k);
    Cr1.middleCols(k * n, n) = s(k) * b.Cr1[kk] * s.asDiagonal();
    J1.middleCols<3>(3 * k) = s(k) * b.J1[kk];
    for (Index l = 0; l < n; ++l) J2.middleCols<3>(3 * (k * n + l)) = s(k) * s(l) * b.J2[kk][static_cast<size_t>(l)];
  }
  return all;
}

/// Largest deviation of each invariant, relative to its largest entry.
std::map<std::string, double> errors(const ReducedBody& body, const ReducedBody& reference) {
  const auto A = invariants(body), B = invariants(reference);
  std::map<std::string, double> result;
  for (const auto& [name, exact] : B)
    result[name] = (A.at(name) - exact).cwiseAbs().maxCoeff() / exact.cwiseAbs().maxCoeff();
  return result;
}

void print(const char* what, const std::map<std::string, double>& errors) {
  std::printf("%s:", what);
  for (const auto& [name, error] : errors) std::printf(" %s %.1e", name.c_str(), error);
  std::printf("\n");
}

SolidGrading graded(int along, int layers, double first, int corners) {
  return {.sectors = 1,
          .rings = 1,
          .long_elements = along,
          .end_layers = layers,
          .first_layer = first,
          .growth = 2,
          .corner_levels = corners,
          .factor = 0.2};
}

// Order 4 with one element per quarter: mass and its centre are exact, what bends is good to 2e-6.
TEST(SolidInvariants, AreThoseOfAConvergedSolid) {
  const auto found =
      errors(solid(0.05, 0, 4, graded(4, 2, 1, 0), 2).body, solid(0.05, 0, 6, graded(4, 2, 1, 1), 2).body);
  print("order 4 against 6", found);
  for (const char* name : {"m", "mc0", "Me"}) EXPECT_LT(found.at(name), 1e-13) << name;
  for (const auto& [name, error] : found) EXPECT_LT(error, 3e-6) << name;
}

TEST(SlowSolidInvariants, AreThoseOfAConvergedSolidToEightDigits) {
  const Solid reference = solid(0.05, 0, 8, graded(4, 2, 1, 2), 3), nearly = solid(0.05, 0, 8, graded(4, 2, 1, 1), 3),
              body = solid(0.05, 0, 6, graded(8, 2, 1, 2), 3);
  std::printf("unknowns %d, %d, reference %d\n", body.unknowns, nearly.unknowns, reference.unknowns);
  const auto own = errors(nearly.body, reference.body), found = errors(body.body, reference.body);
  print("reference against one level less at its rim", own);
  print("order 6", found);
  for (const auto& [name, error] : found) EXPECT_LT(error, 1e-8) << name;
  // Each level takes all but a twenty-fifth of it: what is left of the reference is below 1e-9.
  for (const auto& [name, error] : own) EXPECT_LT(error, 1e-8) << name;
}

/// Exponent of the displacements r^lambda where a clamped face meets a free one at right angles: the root in (0, 1) of
/// sin^2(lambda pi / 2) = (4 (1 - nu)^2 - lambda^2) / (3 - 4 nu), M. L. Williams, J. Appl. Mech. 19 (1952) 526.
double rim_exponent(double nu) {
  double low = 0.5, high = 1;
  for (int i = 0; i < 60; ++i) {
    const double x = (low + high) / 2;
    const bool below =
        std::pow(std::sin(x * std::numbers::pi / 2), 2) < (4 * std::pow(1 - nu, 2) - x * x) / (3 - 4 * nu);
    (below ? low : high) = x;
  }
  return low;
}

/// Each level at a singular rim takes the share factor^(2 lambda) of the error away, down to elements of 1e-5 of the
/// diameter: 2e-6 of Ke from the third to the fourth level, 2e-9 from the sixth to the seventh.
TEST(SlowSolidInvariants, ConvergeAtASingularRimAsItsExponentSays) {
  constexpr double nu = 0.33;
  std::map<std::string, double> before;
  ReducedBody last = solid(0.05, nu, 4, graded(4, 2, 1, 3), 2).body;
  for (int level = 4; level <= 7; ++level) {
    const ReducedBody next = solid(0.05, nu, 4, graded(4, 2, 1, level), 2).body;
    const auto change = errors(last, next);
    print("one level more", change);
    for (const char* name : {"Ct", "Cr0", "J1", "J2", "Ke"}) {
      if (!before.empty()) {
        EXPECT_NEAR(before[name] / change.at(name) / std::pow(0.2, -2 * rim_exponent(nu)), 1, 0.05) << name;
      }
    }
    before = change;
    last = next;
  }
  EXPECT_LT(before.at("Ke"), 6e-9);
}

/// nu = 0: beams with shear and rotary inertia differ from solids by the clamp, where shear cannot warp the section.
/// That is so in a layer as long as the section is deep, with shear strain of order d / L: together (d / L)^3.
TEST(SolidInvariants, ApproachThoseOfBeamsWithSlenderness) {
  std::map<std::string, double> last;
  for (const double length : {0.05, 0.1}) {
    const ReducedBody found = solid(length, 0, 6, graded(length < 0.06 ? 3 : 5, 1, 1, 0), 2).body;
    const test::Boom boom = test::make_boom(stub(length, 0));
    const ModalBasis basis =
        clamped_modes(boom.mesh, boom.assembly, node_set(boom.mesh, "root"), {.num_modes = 2, .sigma = {}});
    const auto now = errors(found, reduce(boom.mesh, boom.assembly, basis, "beam"));
    print(("beam, length " + std::to_string(length)).c_str(), now);
    if (!last.empty()) {
      for (const char* name : {"Ct", "Cr0", "J1", "Ke"}) EXPECT_NEAR(last.at(name) / now.at(name), 8, 1.5) << name;
    }
    last = now;
  }
}

/// Stiff in shear and without rotary inertia, beams are eq. 14: see Reduce.LineMassBoomHasEveryInvariantOfEq14. The
/// rotary inertia itself adds (d / L)^2.
TEST(BeamInvariants, ApproachThoseOfALineMassWithSlenderness) {
  std::map<std::string, double> last;
  for (const double length : {0.1, 0.2, 0.4}) {
    const auto body_of = [&](BeamTheory theory, bool rotary) {
      BeamGeometry g = stub(length, 0);
      g.theory = theory;
      g.rotary_inertia = rotary;
      const test::Boom boom = test::make_boom(g);
      const ModalBasis basis = clamped_modes_of_kind(boom.mesh, boom.assembly, node_set(boom.mesh, "root"), 4,
                                                     {ModeKind::bending_y, ModeKind::bending_z}, {});
      return reduce(boom.mesh, boom.assembly, basis, "beam");
    };
    const auto now = errors(body_of(BeamTheory::timoshenko, true), body_of(BeamTheory::euler_bernoulli, false));
    if (!last.empty()) {
      for (const char* name : {"Ct", "Cr0", "J1", "J2", "Ke"})
        EXPECT_NEAR(last.at(name) / now.at(name), 4, 0.8) << name;
    }
    last = now;
  }
}

}  // namespace
}  // namespace flexboom
