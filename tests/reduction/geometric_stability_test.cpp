#include "fem/booms/solid_boom.hpp"
#include "reduction/basis/modal_basis.hpp"
#include "reduction/invariants/geometric_stiffness.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tests/reduction/csv.hpp"
#include "tests/reduction/geometric_stiffness_testing.hpp"

#include <gtest/gtest.h>

namespace flexboom::testing {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// ---- buckling: K + P Kg is singular at the critical load ----

/// The smallest positive load P with K + P Kg singular, over all unknowns of the mesh.
double critical_load(const Model& model, const std::function<MatrixXd(const MarkerStiffness&)>& which) {
  const std::vector<int> free = unknowns(model.mesh, model.assembly.dofs, model.clamp).free_dofs();
  MatrixXd Phi = MatrixXd::Zero(model.assembly.dofs.count, std::ssize(free));
  for (size_t i = 0; i < free.size(); ++i) Phi(free[i], static_cast<Index>(i)) = 1;
  const GeometricStiffness Kg = geometric_stiffness(model.mesh, model.assembly, model.clamp, Phi, {.markers = {"tip"}});
  const MatrixXd K = full(model.assembly.K, free), B = -which(Kg.markers[0]);
  const VectorXd scale = K.diagonal().cwiseSqrt().cwiseInverse();
  // -Kg x = (1 / P) K x: the largest 1 / P.
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(scale.asDiagonal() * B * scale.asDiagonal(),
                                                                  scale.asDiagonal() * K * scale.asDiagonal());
  return 1 / solver.eigenvalues().maxCoeff();
}

MatrixXd push(const MarkerStiffness& tip) { return -tip.force[0]; }

TEST(Buckling, OfAnEulerBernoulliColumnIsEulers) {
  const double exact = pi * pi * EIz / (4 * length * length);
  double last = 1;
  for (const int order : {1, 2, 3, 5, 8}) {
    const double error = critical_load(beam(strip, length, BeamTheory::euler_bernoulli, 2, order), push) / exact - 1;
    EXPECT_GT(error, -1e-10) << order;  // a Ritz value: from above
    EXPECT_LT(error, std::max(last / 4, 1e-10)) << order;
    last = error;
  }
  EXPECT_LT(last, 1e-10);  // eps cond(K) of 2 elements of order 8
}

// N v'^2 is Engesser's column: the shear force is that part of P which the slope of the axis makes transverse.
TEST(Buckling, OfATimoshenkoColumnIsEngessers) {
  constexpr double L = 0.1;
  const Section section = section_of(strip, aluminium.nu, {});
  const double euler = pi * pi * EIz / (4 * L * L), kGA = section.kappa_y * aluminium.shear_modulus() * section.A;
  const double P = critical_load(beam(strip, L, BeamTheory::timoshenko, 2, 8), push);
  EXPECT_NEAR(P / (euler / (1 + euler / kGA)), 1, 1e-10);
  EXPECT_GT(euler / kGA, 5e-3);  // what the test would see
}

// Cantilever with a dead force at the tip, along the stiff direction: 4.0126 sqrt(EI GJ) / L^2 (Timoshenko, Gere,
// Theory of Elastic Stability, 6.3; twice the first zero of J_-1/4).
TEST(Buckling, OfAStripUnderALateralForceIsPrandtls) {
  const double exact = 4.0125993435788985 * std::sqrt(EIz * GJ) / (length * length);
  for (const Index axis : {2, 1}) {  // the strip as it is, and turned by a right angle
    const Rectangle section = axis == 2 ? strip : Rectangle{strip.width, strip.height};
    const auto lateral = [axis](const MarkerStiffness& tip) { return tip.force[size_t(axis)]; };
    const double P = critical_load(beam(section, length, BeamTheory::euler_bernoulli, 2, 8), lateral);
    EXPECT_NEAR(P / exact, 1, 1e-9) << axis;
    // Shear deformation is of order (h / L)^2 = 1e-3 of it.
    const double sheared = critical_load(beam(section, length, BeamTheory::timoshenko, 2, 8), lateral);
    EXPECT_NEAR(sheared / exact, 1, 1e-3) << axis;
  }
}

// A torque that does work on the rotation vector is semitangential: pi sqrt(EI GJ) / L in bending, pi EI / L in
// torsion (Ziegler, Principles of Structural Stability, 1968, ch. 4).
TEST(Buckling, UnderASemitangentialTorqueIsZieglers) {
  const double EI = aluminium.E * pi * std::pow(0.01, 4) / 64;
  const auto bend = [](const MarkerStiffness& tip) { return tip.torque[1]; };
  const auto twist = [](const MarkerStiffness& tip) { return tip.torque[0]; };
  for (const BeamTheory theory : {BeamTheory::euler_bernoulli, BeamTheory::timoshenko}) {
    const double M = critical_load(beam(strip, length, theory, 2, 8), bend);
    EXPECT_NEAR(M / (pi * std::sqrt(EIz * GJ) / length), 1, 1e-9);
    const double T = critical_load(beam(RoundBar{0.01}, length, theory, 2, 8), twist);
    EXPECT_NEAR(T / (pi * EI / length), 1, 1e-9);
  }
}

// Solids, h / L = 1/25: Green's strain of the section adds P I / A theta'^2, hence P / EA beside Engesser's P / kGA.
// The elements are too stiff: loads from above. "hex20-reduced" has motions that only its share of 1e-5 holds, and
// these buckle first; smooth shapes do not contain them.
TEST(Buckling, OfASolidColumnIsEulersToTheErrorOfTheElement) {
  struct Case {
    const char* name;
    int order, cells;
    double tolerance;  // discretisation, reached: half to nearly all of it
  };
  for (const Case& c : {Case{"hex", 3, 2, 5e-4},
                        {"hex20", 1, 6, 5e-3},
                        {"hex27", 1, 6, 5e-3},
                        {"tet10", 1, 6, 5e-3},
                        {"wedge15", 1, 6, 2e-3},
                        {"hex8", 1, 12, 5e-3},
                        {"hex8-reduced", 1, 12, 5e-3}}) {
    Mesh mesh =
        box(element_types()[size_t(element_type(c.name))], c.order, {c.cells, 1, 1}, stretch(1, 0.05, 0.04), soft);
    for (int node = 0; node < mesh.nodes.cols(); ++node) {
      if (mesh.nodes(0, node) < 1e-9) mesh.node_sets["root"].push_back(node);
      if (mesh.nodes(0, node) > 1 - 1e-9) mesh.node_sets["tip"].push_back(node);
    }
    const double EA = soft.E * 0.05 * 0.04, EI = EA * 0.04 * 0.04 / 12, euler = pi * pi * EI / 4;
    const double exact = euler / (1 + euler / EA + euler / (EA / 2 * 5 / 6));
    const double ratio = critical_load(clamped(mesh), push) / exact;
    EXPECT_NEAR(ratio, 1, c.tolerance) << c.name;
  }
}

// ---- rotating cantilevers ----

struct Rotor {
  Model model;
  ModalBasis basis;
  ReducedBody body;
};

Rotor rotor(Mesh mesh, int count, const std::vector<ModeKind>& kinds, const GeometricOptions& options = {}) {
  Model model = clamped(std::move(mesh));
  ModalBasis basis = clamped_modes_of_kind(model.mesh, model.assembly, model.clamp, count, kinds, {});
  ReducedBody body = reduce(model.mesh, model.assembly, basis, "rotor");
  body.Kg = geometric_stiffness(model.mesh, model.assembly, model.clamp, basis.Phi, options);
  return {std::move(model), std::move(basis), std::move(body)};
}

BeamGeometry line_boom(int elements, int order) {
  BeamGeometry g = uniform_boom(RoundBar{0.01}, 0.302, BeamTheory::euler_bernoulli, elements, order);
  g.rotary_inertia = false;
  return g;
}

/// Frequencies [rad/s] of a body that spins about z: stiffness Ke + Kg less Omega^2 int rho S^T (I - z z^T) S, which is
/// z . J2 z. The Coriolis term int rho S_k . (z x S_l) of shapes that are all of one bending plane is zero, as that of
/// an inextensible beam without rotary inertia is.
VectorXd spinning_frequencies(const ReducedBody& body, double spin) {
  MatrixXd K = body.Ke + motion_stiffness(body, {0, 0, spin});
  for (Index k = 0; k < body.n(); ++k) {
    for (Index l = 0; l < body.n(); ++l) K(k, l) -= spin * spin * body.J2[size_t(k)][size_t(l)](2, 2);
  }
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(K, body.Me);
  return solver.eigenvalues().cwiseSqrt();
}

TEST(RotatingCantilever, OfBeamsHasTheFrequenciesOfTheTable) {
  const test::Table table = test::read_csv("rotating_cantilever.csv");
  const double unit = std::sqrt(67e9 * pi * 1e-8 / 64 / (2840 * pi * 1e-4 / 4)) / (0.302 * 0.302);
  const std::vector<std::pair<ModeKind, std::string>> planes = {{ModeKind::bending_z, "flap_"},
                                                                {ModeKind::bending_y, "leadlag_"}};
  for (const auto& [kind, column] : planes) {
    const ReducedBody body = rotor(make_mesh(line_boom(12, 8)), 40, {kind}).body;
    for (size_t row = 0; row < table.at("eta").size(); ++row) {
      const VectorXd omega = spinning_frequencies(body, table.at("eta")[row] * unit) / unit;
      for (int mode = 0; mode < 5; ++mode) {
        const double exact = table.at(column + std::to_string(mode + 1))[row];
        EXPECT_NEAR(omega(mode) / exact, 1, 1e-6) << column << mode + 1 << " eta " << table.at("eta")[row];  // 40 modes
      }
    }
  }
}

// All matrices of the line mass against integrals in closed form: tension m w^2 L (1 - x^2) / 2 of the spin about y
// and z, -m a (1 - x) of an acceleration along x.
TEST(RotatingCantilever, OfBeamsHasTheIntegralsOfEq14) {
  const Rotor r = rotor(make_mesh(line_boom(8, 8)), 10, {ModeKind::bending_y}, {.markers = {"tip"}});
  const test::Table table = test::read_csv("eq14_shape_integrals.csv");
  const double m = r.body.m, L = 0.302;
  for (size_t row = 0; row < table.at("k").size(); ++row) {
    const auto k = Index(table.at("k")[row]) - 1, l = Index(table.at("j")[row]) - 1;
    if (k >= 10 || l >= 10) continue;
    const double sign = (k + l) % 2 ? -1 : 1;  // phi_k(L) = 2 (-1)^(k + 1), ours +2
    const double spin = sign * m * table.at("int_half(1-x^2)_dphik_dphij")[row];
    const double acceleration = -sign * m / L * table.at("int_(1-x)_dphik_dphij")[row];
    const double force = sign / L * table.at("int_dphik_dphij")[row];
    const double scale = m * 30;  // of the diagonal
    EXPECT_NEAR(r.body.Kg.spin[2](k, l), spin, 1e-9 * scale) << k << l;
    EXPECT_NEAR(r.body.Kg.spin[1](k, l), spin, 1e-9 * scale) << k << l;
    EXPECT_NEAR(r.body.Kg.acceleration[0](k, l), acceleration, 1e-9 * scale / L) << k << l;
    EXPECT_NEAR(r.body.Kg.markers[0].force[0](k, l), force, 1e-9 * scale / L / m) << k << l;
  }
  EXPECT_LT(r.body.Kg.spin[0].norm(), 1e-9 * m);
}

/// A square solid boom of nu = 0, depth over length h.
ReducedBody solid_rotor(double h, ModeKind kind) {
  BeamGeometry g;
  g.segments.push_back({Rectangle{h, h}, Rectangle{h, h}, 1.0, soft, 0});
  return rotor(make_solid_mesh(g, coarse("hex", 3)), 10, {kind}).body;
}

// What is left is what Euler-Bernoulli leaves out, shear and rotary inertia: of order h^2.
TEST(RotatingCantilever, OfSolidsApproachesTheTableWithSlenderness) {
  const test::Table table = test::read_csv("rotating_cantilever.csv");
  for (const auto& [kind, column] : {std::pair(ModeKind::bending_z, "flap_1"), {ModeKind::bending_y, "leadlag_1"}}) {
    std::array<std::vector<double>, 3> errors;
    for (const double h : {0.1, 0.05, 0.025}) {
      const double unit = std::sqrt(soft.E * h * h / 12 / soft.rho);
      const ReducedBody body = solid_rotor(h, kind);
      for (size_t i = 0; i < 3; ++i) {
        const size_t row = 3 * i;
        const double omega = spinning_frequencies(body, table.at("eta")[row] * unit)(0) / unit;
        errors[i].push_back(std::abs(omega / table.at(column)[row] - 1));
      }
    }
    for (const std::vector<double>& e : errors) {
      EXPECT_LT(e[2], 1e-3);
      EXPECT_NEAR(e[0] / e[1], 4, 0.4);
      EXPECT_NEAR(e[1] / e[2], 4, 0.4);
    }
  }
}

// A hub radius R is an acceleration -w^2 R of the origin: the same prestress as that of a mesh moved by R.
TEST(RotatingCantilever, OnAHubIsThatOfAMovedMesh) {
  const double R = 0.4;
  const BeamGeometry g = uniform_boom(strip, 0.5, BeamTheory::timoshenko, 3, 4);
  for (const bool solid : {false, true}) {
    const Model model = clamped(solid ? make_solid_mesh(g, coarse("hex20")) : make_mesh(g));
    Model moved = model;
    moved.mesh.nodes.row(0).array() += R;
    const MatrixXd Phi = clamped_modes(model.mesh, model.assembly, model.clamp, {.num_modes = 6, .sigma = {}}).Phi;
    const GeometricStiffness A = geometric_stiffness(model.mesh, model.assembly, model.clamp, Phi);
    const GeometricStiffness B = geometric_stiffness(moved.mesh, moved.assembly, moved.clamp, Phi);
    // -w x (w x R x) = R x for w along y or z, -R y (-R z) per w_x w_y (w_z w_x); -alpha_z x R is -R y.
    const double tolerance = 1e-8 * B.angular_acceleration[2].cwiseAbs().maxCoeff();  // eps cond(K), 1e8
    const auto expect_equal = [tolerance](const MatrixXd& X, const MatrixXd& Y) {
      EXPECT_LT((X - Y).cwiseAbs().maxCoeff(), tolerance);
    };
    expect_equal(B.spin[0], A.spin[0]);
    expect_equal(B.spin[1], A.spin[1] - R * A.acceleration[0]);
    expect_equal(B.spin[2], A.spin[2] - R * A.acceleration[0]);
    expect_equal(B.spin[3], A.spin[3] + R * A.acceleration[1]);
    expect_equal(B.spin[4], A.spin[4]);
    expect_equal(B.spin[5], A.spin[5] + R * A.acceleration[2]);
    expect_equal(B.angular_acceleration[0], A.angular_acceleration[0]);
    expect_equal(B.angular_acceleration[1], A.angular_acceleration[1] - R * A.acceleration[2]);
    expect_equal(B.angular_acceleration[2], A.angular_acceleration[2] + R * A.acceleration[1]);
  }
}

}  // namespace
}  // namespace flexboom::testing
