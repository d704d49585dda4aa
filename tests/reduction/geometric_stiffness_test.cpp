#include "reduction/geometric_stiffness.hpp"

#include "fem/check.hpp"
#include "fem/solid_boom.hpp"
#include "reduction/inertia_invariants.hpp"
#include "reduction/modal_basis.hpp"
#include "tests/fem/solid_testing.hpp"
#include "tests/reduction/csv.hpp"

#include <gtest/gtest.h>

namespace flexboom::testing {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Entry (k, l), k >= l, of a packed lower triangle of n columns.
Index pair_of(Index k, Index l, Index n) { return l * n - l * (l - 1) / 2 + (k - l); }

MatrixXd unpacked(const VectorXd& pairs, Index n) {
  MatrixXd A(n, n);
  for (Index l = 0; l < n; ++l) {
    for (Index k = l; k < n; ++k) A(k, l) = A(l, k) = pairs(pair_of(k, l, n));
  }
  return A;
}

// ---- every row of the table ----

std::vector<Row> all_rows() {
  std::vector<Row> rows;
  for (size_t i = 0; i < element_types().size(); ++i) {
    for (const int order : element_types()[i].orders()) rows.push_back({i, order});
  }
  return rows;
}

class PrestressWork : public ::testing::TestWithParam<Row> {
 protected:
  const ElementType& type() const { return element_types()[GetParam().type]; }
  int order() const { return GetParam().order; }
  Mesh body(const Map3& map) const {
    if (is_solid(type())) return one_solid(type(), order(), map);
    return one_element(type(), order(), 0.3 * Vector3d(1, -2, 2) / 3, {0.4, 0.1, 0.9}, Rectangle{0.02, 0.03},
                       Rectangle{0.02, 0.03});
  }
  Index freedoms(const Mesh& mesh) const {
    return type().node_freedoms * mesh.nodes.cols() + type().internal_freedoms(mesh, mesh.elements[0]);
  }
  MatrixXd some_vectors(const Mesh& mesh, Index count) const {
    std::srand(7);
    return MatrixXd::Random(freedoms(mesh), count);
  }
  /// Vector of the linear displacement A X; rotations of beams follow the skew part.
  VectorXd linear(const Mesh& mesh, const Matrix3d& A) const {
    VectorXd q = VectorXd::Zero(freedoms(mesh));
    for (Index node = 0; node < mesh.nodes.cols(); ++node) {
      q.segment<3>(type().node_freedoms * node) = A * mesh.nodes.col(node);
      if (type().node_freedoms == 3) continue;
      q.segment<3>(6 * node + 3) = Vector3d(A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1)) / 2;
    }
    return q;
  }
  MatrixXd work(const Mesh& mesh, const MatrixXd& q0, const MatrixXd& q) const {
    return type().prestress_work(mesh, mesh.elements[0], q0, q);
  }
};

// Pairs in another order are other rows: what says k, l must say l, k.
TEST_P(PrestressWork, IsSymmetricInTheShapesAndLinearInTheLoads) {
  const Mesh mesh = body(distort);
  const MatrixXd q = some_vectors(mesh, 4), q0 = some_vectors(mesh, 6).rightCols(2);
  MatrixXd load(q0.rows(), 3);
  load << q0, 2 * q0.col(0) - 3 * q0.col(1);
  const MatrixXd W = work(mesh, load, q), reversed = work(mesh, load, q.rowwise().reverse());
  const double scale = W.cwiseAbs().maxCoeff();
  ASSERT_EQ(W.rows(), 10);
  for (Index c = 0; c < 3; ++c) {
    const MatrixXd A = unpacked(W.col(c), 4), B = unpacked(reversed.col(c), 4).reverse();
    EXPECT_LT((A - B).cwiseAbs().maxCoeff(), 1e-13 * scale);
  }
  EXPECT_LT((W.col(2) - 2 * W.col(0) + 3 * W.col(1)).cwiseAbs().maxCoeff(), 1e-12 * scale);
}

TEST_P(PrestressWork, OfARigidTranslationIsZero) {
  const Mesh mesh = body(distort);
  MatrixXd q = some_vectors(mesh, 5);
  for (Index k = 0; k < 3; ++k) {
    VectorXd u = VectorXd::Zero(q.rows());
    for (Index node = 0; node < mesh.nodes.cols(); ++node) u(type().node_freedoms * node + k) = 1;
    q.col(k) = u;
  }
  const MatrixXd W = work(mesh, some_vectors(mesh, 1), q), A = unpacked(W.col(0), 5);
  EXPECT_LT(A.leftCols(3).cwiseAbs().maxCoeff(), 1e-11 * A.cwiseAbs().maxCoeff());  // slopes are eps / h
  EXPECT_GT(A.bottomRightCorner(2, 2).cwiseAbs().minCoeff(), 0);
}

TEST_P(PrestressWork, OfATurnedElementIsTheSame) {
  const Matrix3d R = Eigen::AngleAxisd(1.1, Vector3d(1, 2, -0.5).normalized()).toRotationMatrix();
  const Mesh mesh = body(distort);
  Mesh turned = mesh;
  turned.nodes = R * mesh.nodes;
  for (BeamProperty& property : turned.beam_properties) property.y_axis = R * property.y_axis;
  const MatrixXd q = some_vectors(mesh, 4);
  MatrixXd turned_q = q;
  for (Index i = 0; i < type().node_freedoms * mesh.nodes.cols(); i += 3) {
    turned_q.middleRows<3>(i) = R * q.middleRows<3>(i);
  }
  const MatrixXd W = work(mesh, q, q);
  EXPECT_LT((work(turned, turned_q, turned_q) - W).cwiseAbs().maxCoeff(), 1e-11 * W.cwiseAbs().maxCoeff());
}

// Constant stress and constant slopes: volume sigma : A_k^T A_l of solids; of a beam whose stress is a tension N,
// N h (slope across the axis)^2.
TEST_P(PrestressWork, OfAUniformPrestressIsExact) {
  const Mesh mesh = body([](const Vector3d& x) {  // a parallelepiped, on which every rule is exact
    return Vector3d(0.7 + 0.11 * x(0) + 0.02 * x(1), -0.3 + 0.09 * x(1) - 0.01 * x(2), 1.1 + 0.13 * x(2) + 0.01 * x(0));
  });
  std::srand(11);
  const Matrix3d A0 = Matrix3d::Random();
  const std::array<Matrix3d, 2> A = {Matrix3d::Random(), Matrix3d::Random()};
  const double E = aluminium.E, nu = aluminium.nu;
  if (is_solid(type())) {
    double volume = 0;
    type().mass_points(mesh, mesh.elements[0], 0,
                       [&](double dm, const Vector3d&, const auto&) { volume += dm / aluminium.rho; });
    const Matrix3d strain = (A0 + A0.transpose()) / 2;
    const Matrix3d stress = E / (1 + nu) * (strain + nu / (1 - 2 * nu) * strain.trace() * Matrix3d::Identity());
    MatrixXd q(freedoms(mesh), 2);
    q << linear(mesh, A[0]), linear(mesh, A[1]);
    const MatrixXd W = unpacked(work(mesh, linear(mesh, A0), q).col(0), 2);
    for (Index k = 0; k < 2; ++k) {
      for (Index l = 0; l < 2; ++l) {
        const double exact = volume * (stress * A[size_t(k)].transpose() * A[size_t(l)]).trace();
        EXPECT_NEAR(W(k, l), exact, 1e-12 * volume * stress.norm() * A[0].norm() * A[1].norm());
      }
    }
    return;
  }
  const Vector3d axis = mesh.nodes.col(1) - mesh.nodes.col(0), t = axis.normalized();
  MatrixXd q(freedoms(mesh), 3);  // rigid rotations
  for (int k = 0; k < 3; ++k) {
    Matrix3d spin;
    for (int j = 0; j < 3; ++j) spin.col(j) = Vector3d::Unit(k).cross(Vector3d::Unit(j));
    q.col(k) = linear(mesh, spin);
  }
  const MatrixXd W = unpacked(work(mesh, linear(mesh, 1e-3 * t * t.transpose()), q).col(0), 3);
  const double N = E * 0.02 * 0.03 * 1e-3;
  const Matrix3d exact = N * axis.norm() * (Matrix3d::Identity() - t * t.transpose());
  EXPECT_LT((W - exact).cwiseAbs().maxCoeff(), 1e-11 * N * axis.norm());
}

INSTANTIATE_TEST_SUITE_P(Rows, PrestressWork, ::testing::ValuesIn(all_rows()), name_of_row);

// ---- buckling: K + P Kg is singular at the critical load ----

struct Model {
  Mesh mesh;
  Assembly assembly;
  Clamp clamp;
};

Model clamped(Mesh mesh) {
  Assembly assembly = assemble(mesh);
  Clamp clamp(node_set(mesh, "root"));
  return {std::move(mesh), std::move(assembly), std::move(clamp)};
}

/// Few elements of even length, no refinement.
SolidOptions coarse(const std::string& element, int order = 0) {
  SolidOptions options;
  options.element = element;
  options.order = order;
  options.grading = {.sectors = 1, .rings = 1, .long_elements = 8, .end_layers = 0, .corner_levels = 0};
  return options;
}

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

// A strip that bends easily along y.
constexpr double length = 1.2;
const Rectangle strip{0.01, 0.04};
const double EIz = aluminium.E * 0.04 * std::pow(0.01, 3) / 12;
const double GJ = aluminium.shear_modulus() * section_of(strip, aluminium.nu, {}).J;

Model beam(const SectionShape& section, double L, BeamTheory theory, int elements, int order) {
  return clamped(make_mesh(uniform_boom(section, L, theory, elements, order)));
}

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

const Material soft{1e9, 0, 1000};  // nu = 0: the clamp does not stiffen

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

// ---- beams against solids ----

/// Deflections x^2 and x^3 along y and z with sections normal to the axis, and the twist x: in the shapes of beams
/// (Hermite) and of solids of order 3.
MatrixXd five_shapes(const Model& model) {
  MatrixXd Phi = MatrixXd::Zero(model.assembly.dofs.count, 5);
  for (int node = 0; node < model.mesh.nodes.cols(); ++node) {
    const double x = model.mesh.nodes(0, node);
    const Vector3d arm(0, model.mesh.nodes(1, node), model.mesh.nodes(2, node));
    Eigen::Matrix<double, 3, 5> axis, theta;
    axis << 0, 0, 0, 0, 0, x * x, x * x * x, 0, 0, 0, 0, 0, x * x, x * x * x, 0;
    theta << 0, 0, 0, 0, x, 0, 0, -2 * x, -3 * x * x, 0, 2 * x, 3 * x * x, 0, 0, 0;
    const int first = model.assembly.dofs.of_node(node, 0);
    for (Index k = 0; k < 5; ++k) {
      Phi.block<3, 1>(first, k) = axis.col(k) + Vector3d(theta.col(k)).cross(arm);
    }
    if (model.assembly.dofs.freedoms_of(node) == 6) Phi.middleRows<3>(first + 3) = theta;
  }
  return Phi;
}

std::vector<MatrixXd> all_matrices(const GeometricStiffness& Kg) {
  std::vector<MatrixXd> all = Kg.spin;
  all.insert(all.end(), Kg.acceleration.begin(), Kg.acceleration.end());
  all.insert(all.end(), Kg.angular_acceleration.begin(), Kg.angular_acceleration.end());
  for (const MarkerStiffness& marker : Kg.markers) {
    all.insert(all.end(), marker.force.begin(), marker.force.end());
    all.insert(all.end(), marker.torque.begin(), marker.torque.end());
  }
  return all;
}

/// Unit torque about y or z at the tip of a solid: forces along x on arms in the section, whose work on the second
/// order of the rotation, u_x = theta_x (theta . r) / 2, a torque on the rotation vector does not have.
MatrixXd traction_term(const Model& model, const MatrixXd& Phi, int axis) {
  const int tip = model.assembly.dofs.of_node(node_set(model.mesh, "tip")[0], 3);
  const VectorXd x = Phi.row(tip), other = Phi.row(tip + 3 - axis);
  return (axis == 1 ? -0.5 : 0.5) * (x * other.transpose() + other * x.transpose());
}

// Tension, bending, shear and torsion of both, each against the other: what differs is of order (d / L)^2. With a heavy
// body off the axis at the tip, the arms of nodal bodies and rigid connections as well.
TEST(GeometricStiffness, OfBeamsIsThatOfSolids) {
  for (const bool heavy : {false, true}) {
    std::vector<std::vector<double>> errors(18);
    for (const double d : {0.1, 0.05}) {
      BeamGeometry g;
      g.segments.push_back({RoundBar{d}, RoundBar{d}, 1.0, soft, 4});
      if (heavy)
        g.attachments.push_back(
            {"body", 1.0, 2.0 * d * d / 0.01, d * d * Vector3d(2, 3, 4).asDiagonal(), {2 * d, d, -1.5 * d}});
      const Model beams = clamped(make_mesh(g)), solids = clamped(make_solid_mesh(g, coarse("hex", 3)));
      const MatrixXd Phi = five_shapes(beams);
      const auto exact =
          all_matrices(geometric_stiffness(beams.mesh, beams.assembly, beams.clamp, Phi, {.markers = {"tip"}}));
      const auto found = all_matrices(
          geometric_stiffness(solids.mesh, solids.assembly, solids.clamp, five_shapes(solids), {.markers = {"tip"}}));
      for (size_t i = 0; i < exact.size(); ++i) {
        MatrixXd expected = exact[i];
        if (i >= 16) expected += traction_term(beams, Phi, static_cast<int>(i) - 15);
        const double scale = i == 4 ? exact[1].cwiseAbs().maxCoeff() : expected.cwiseAbs().maxCoeff();  // w_y w_z: zero
        errors[i].push_back((found[i] - expected).cwiseAbs().maxCoeff() / scale);
      }
    }
    for (size_t i = 0; i < errors.size(); ++i) {
      EXPECT_LT(errors[i][1], 2e-3) << i << heavy;
      // 3e-4: the circle of cubic elements has a slightly different area.
      EXPECT_LT(errors[i][1], std::max(errors[i][0] / 3, 3e-4)) << i << heavy;
    }
  }
}

// A line mass on a clamp is statically determinate: both theories have the same resultants, and on shapes without shear
// the same Kg. (Prandtl's load does not see every sign: transposed couplings have the same critical load.)
TEST(GeometricStiffness, OfBothBeamTheoriesIsTheSameWithoutShear) {
  std::array<std::vector<MatrixXd>, 2> Kg;
  for (const BeamTheory theory : {BeamTheory::euler_bernoulli, BeamTheory::timoshenko}) {
    BeamGeometry g = uniform_boom(strip, 1.0, theory, 3, 4);
    g.rotary_inertia = false;
    const Model m = clamped(make_mesh(g));
    Kg[size_t(theory)] =
        all_matrices(geometric_stiffness(m.mesh, m.assembly, m.clamp, five_shapes(m), {.markers = {"tip"}}));
  }
  for (size_t i = 0; i < Kg[0].size(); ++i) {
    const double scale = std::max(Kg[1][i].cwiseAbs().maxCoeff(), 1e-3 * Kg[1][2].cwiseAbs().maxCoeff());
    EXPECT_LT((Kg[0][i] - Kg[1][i]).cwiseAbs().maxCoeff(), 1e-8 * scale) << i;  // eps cond(K)
  }
}

// ---- bodies that nothing holds ----

// The mean stress of a free body is known whatever its elasticity: integral sigma = sum f x^T (the virial). On linear
// shapes, here rigid rotations, Kg needs no more.
TEST(InertiaRelief, OfAFreeBoomHasItsMeanStress) {
  const BeamGeometry g = uniform_boom(Rectangle{0.02, 0.03}, 0.4, BeamTheory::timoshenko, 3, 4);
  for (const bool solid : {false, true}) {
    Model model = clamped(solid ? make_solid_mesh(g, coarse("hex20")) : make_mesh(g));
    model.clamp = Clamp();
    const MatrixXd T = rigid_motions(model.mesh, model.assembly.dofs);
    const GeometricStiffness Kg = geometric_stiffness(model.mesh, model.assembly, model.clamp, T, {.markers = {"tip"}});
    const double m = aluminium.rho * 0.02 * 0.03 * 0.4, Sxx = m * 0.4 * 0.4 / 12, Syy = m * 0.02 * 0.02 / 12;
    const auto expected = [](double xx, double yy) {  // of rotations: tr(sigma) I - sigma
      MatrixXd K = MatrixXd::Zero(6, 6);
      K.diagonal().tail<3>() << yy, xx, xx + yy;
      return K;
    };
    const double tolerance = 1e-9 * Sxx;  // eps cond(K)
    EXPECT_LT((Kg.spin[2] - expected(Sxx, Syy)).cwiseAbs().maxCoeff(), tolerance);
    EXPECT_LT((Kg.markers[0].force[0] - expected(0.2, 0)).cwiseAbs().maxCoeff(), 1e-9 * 0.2);
    for (size_t i = 0; i < 3; ++i) {
      EXPECT_LT(Kg.acceleration[i].cwiseAbs().maxCoeff(), tolerance / 0.4);
      EXPECT_LT(Kg.angular_acceleration[i].cwiseAbs().maxCoeff(), tolerance);
    }
  }
}

// ---- loads ----

// The inertial loads of everything that has mass, by definition at every mass point, and what they do on the second
// order of the rotation of a body on a node.
TEST(GeometricStiffness, OfAnAccelerationIsThatOfItsInertialForces) {
  BeamGeometry g = uniform_boom(Rectangle{0.02, 0.03}, 0.4, BeamTheory::timoshenko, 2, 3);
  g.attachments.push_back({"lump", 0.2, 0.3, Vector3d(2e-3, 3e-3, 4e-3).asDiagonal(), {0.05, 0.02, -0.03}});
  g.rotary_inertia = false;
  for (const bool solid : {false, true}) {
    const Model model = clamped(solid ? make_solid_mesh(g, coarse("hex20")) : make_mesh(g));
    const MatrixXd Phi = clamped_modes(model.mesh, model.assembly, model.clamp, {.num_modes = 6, .sigma = {}}).Phi;
    ReducedBody body = blank_body("boom", 6);
    body.Me.setIdentity();
    body.Kg = geometric_stiffness(model.mesh, model.assembly, model.clamp, Phi);
    const Vector3d omega(1.5, -2, 0.7), a(3, 1, -2), alpha(-4, 5, 2);
    const auto inertial = [&](const Vector3d& u0) {
      return Vector3d(-a - alpha.cross(u0) - omega.cross(omega.cross(u0)));
    };
    VectorXd f = VectorXd::Zero(model.assembly.dofs.count);
    for_each_mass_point(model.mesh, model.assembly.dofs,
                        [&](double dm, const Vector3d& u0, const auto& N, std::span<const int> dofs) {
                          f(dofs) += dm * N.transpose() * inertial(u0);
                        });
    const Unknowns left = unknowns(model.mesh, model.assembly.dofs, model.clamp);
    const MatrixXd K = full(left.reduced(model.assembly.K));
    const MatrixXd T = left.expanded(MatrixXd::Identity(left.count, left.count));
    const VectorXd u0 = T * K.llt().solve(T.transpose() * f);
    MatrixXd expected = MatrixXd::Zero(6, 6);
    for (int e = 0; e < std::ssize(model.mesh.elements); ++e) {
      const Element& element = model.mesh.elements[size_t(e)];
      const std::vector<int> dofs = model.assembly.dofs.of_element(model.mesh, e);
      expected +=
          unpacked(type_of(element).prestress_work(model.mesh, element, u0(dofs), Phi(dofs, Eigen::all)).col(0), 6);
    }
    const NodalBody& lump = model.mesh.bodies.at(0);
    const MatrixXd theta = Phi.middleRows<3>(model.assembly.dofs.of_node(lump.node, 3));
    nodal_body_mass_points(model.mesh, lump, [&](double dm, const Vector3d& x0, const auto&) {
      const Vector3d r = x0 - model.mesh.nodes.col(lump.node), force = dm * inertial(x0);
      for (Index k = 0; k < 6; ++k) {
        for (Index l = 0; l < 6; ++l) {
          const Vector3d x = theta.col(k), y = theta.col(l);
          expected(k, l) -= force.dot(x.cross(y.cross(r)) + y.cross(x.cross(r))) / 2;
        }
      }
    });
    const MatrixXd found = motion_stiffness(body, omega, a, alpha);
    EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-9 * expected.cwiseAbs().maxCoeff());  // eps cond(K)
  }
}

TEST(GeometricStiffness, DoesNotDependOnThreadsNorOnWhoFactorises) {
  const Model model = beam(strip, length, BeamTheory::timoshenko, 9, 3);
  const MatrixXd Phi = clamped_modes(model.mesh, model.assembly, model.clamp, {.num_modes = 4, .sigma = {}}).Phi;
  const auto matrices = [&](const GeometricOptions& options) {
    return all_matrices(geometric_stiffness(model.mesh, model.assembly, model.clamp, Phi, options));
  };
  const SparseMatrix K = unknowns(model.mesh, model.assembly.dofs, model.clamp).reduced(model.assembly.K);
  const StaticSolver statics(K, {});
  const std::vector<MatrixXd> one = matrices({}), three = matrices({.markers = {}, .threads = 3}),
                              given = matrices({.markers = {}, .threads = 1, .statics = &statics});
  for (size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i], three[i]);
    EXPECT_LT((one[i] - given[i]).norm(), 1e-9 * (one[i].norm() + one[2].norm()));
  }
}

TEST(GeometricStiffness, SaysWhatIsWrong) {
  Model model = beam(strip, length, BeamTheory::timoshenko, 2, 2);
  const MatrixXd Phi = MatrixXd::Random(model.assembly.dofs.count, 2);
  const auto call = [&](const MatrixXd& shapes, const Clamp& clamp, const GeometricOptions& options) {
    return input_error([&] { geometric_stiffness(model.mesh, model.assembly, clamp, shapes, options); });
  };
  EXPECT_NE(call(Phi.topRows(3), model.clamp, {}).find("shapes have 3 entries"), std::string::npos);
  EXPECT_NE(call(Phi, model.clamp, {.markers = {"tpi"}}).find("tpi"), std::string::npos);
  model.mesh.node_sets["axis"] = {0, 1, 2};
  EXPECT_NE(call(Phi, model.clamp, {.markers = {"axis"}}).find("lie on a line"), std::string::npos);
  model.mesh.supports.push_back({0, {true, true, true, false, false, false}});
  EXPECT_NE(call(Phi, Clamp(), {}).find("leaves 3 of the six rigid motions"), std::string::npos);
  model.assembly.K = SparseMatrix();
  EXPECT_NE(call(Phi, model.clamp, {}).find("was released"), std::string::npos);
}

TEST(GeometricStiffness, OfALoneNodeOfASolidHasNoTorque) {
  Model model = clamped(make_solid_mesh(uniform_boom(strip, 0.2, BeamTheory::timoshenko, 1, 1), coarse("hex8")));
  model.mesh.node_sets["corner"] = {node_set(model.mesh, "tip").front()};
  const MatrixXd Phi = MatrixXd::Random(model.assembly.dofs.count, 2);
  const GeometricStiffness Kg =
      geometric_stiffness(model.mesh, model.assembly, model.clamp, Phi, {.markers = {"corner"}});
  EXPECT_EQ(Kg.markers[0].force.size(), 3U);
  EXPECT_EQ(Kg.markers[0].torque.size(), 0U);
}

}  // namespace
}  // namespace flexboom::testing
