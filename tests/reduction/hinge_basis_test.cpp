#include "reduction/basis/hinge_basis.hpp"

#include "fem/base/check.hpp"
#include "fem/booms/solid_boom.hpp"
#include "reduction/basis/basis.hpp"
#include "reduction/invariants/certificate.hpp"
#include "reduction/invariants/eq14.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tests/reduction/booms.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// One row of hinge_sprung_boom_hz.csv.
struct Sprung {
  int boom = 0;
  std::string regime;
  double k = 0;
  int mode = 0;
  double hz = 0;
};

std::vector<Sprung> reference() {
  std::ifstream in(std::string(FLEXBOOM_TEST_DATA) + "/reference/hinge_sprung_boom_hz.csv");
  std::vector<Sprung> rows;
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream cells(line);
    std::vector<std::string> cell(7);
    for (std::string& c : cell) std::getline(cells, c, ',');
    rows.push_back({std::stoi(cell[0]), cell[1], std::stod(cell[2]), std::stoi(cell[4]), std::stod(cell[6])});
  }
  return rows;
}

double stiffness_of(int boom, const std::string& regime) {
  for (const Sprung& row : reference()) {
    if (row.boom == boom && row.regime.starts_with(regime)) return row.k;
  }
  throw InputError("no row");
}
double hz_of(int boom, const std::string& regime, int mode) {
  for (const Sprung& row : reference()) {
    if (row.boom == boom && row.regime.starts_with(regime) && row.mode == mode) return row.hz;
  }
  throw InputError("no row");
}
constexpr const char* free_side = "k1 (";
constexpr const char* closed = "k1+P3";

/// Booms of SPORT (sport.toml) in the theory of the table: line mass, Euler-Bernoulli. Booms 2 and 3 are alike.
BeamGeometry line_boom(int boom) {
  const double length = boom == 4 ? 0.302 : boom == 5 ? 0.146 : 0.295, d = boom == 4 ? 0.01 : 0.005;
  BeamGeometry g = test::boom4(BeamTheory::euler_bernoulli, false, 4, 8);
  g.segments[0].start = g.segments[0].end = RoundBar{d};
  g.segments[0].length = length;
  return g;
}
int table_boom(int boom) { return boom == 3 ? 2 : boom; }

/// Frequencies of the body on a hinge about `axis` through its origin with spring k, hub fixed: coordinates (angle, q).
VectorXd sprung_hz(const ReducedBody& body, const Eigen::Vector3d& axis, double k) {
  const Index n = body.n();
  MatrixXd M(n + 1, n + 1), K = MatrixXd::Zero(n + 1, n + 1);
  const Eigen::RowVectorXd coupling = axis.transpose() * body.Cr0;
  M << axis.dot(body.J0 * axis), coupling, coupling.transpose(), body.Me;
  K(0, 0) = k;
  K.bottomRightCorner(n, n) = body.Ke;
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(M, K);
  return solver.eigenvalues().reverse().cwiseInverse().cwiseSqrt() / (2 * std::numbers::pi);
}

ModalBasis adapted(const test::Boom& boom, const Eigen::Vector3d& axis, std::vector<double> stiffness, int modes = 1) {
  return hinge_adapted_modes(boom.mesh, boom.assembly, node_set(boom.mesh, "root"),
                             {Eigen::Vector3d::Zero(), axis, std::move(stiffness)}, modes);
}

TEST(HingeAdapted, TwoCoordinatesReachBothRegimesOfEveryBoom) {
  for (const int b : {2, 3, 4, 5}) {
    const test::Boom boom = test::make_boom(line_boom(b));
    const double k_free = stiffness_of(table_boom(b), free_side), k_closed = stiffness_of(table_boom(b), closed);
    for (const Eigen::Vector3d& axis : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, -1, 0)}) {
      const ModalBasis basis = adapted(boom, axis, {k_free, k_closed});
      ASSERT_EQ(basis.Phi.cols(), 2);
      const ReducedBody body = reduce(boom.mesh, boom.assembly, basis, "boom");
      EXPECT_NEAR(sprung_hz(body, axis, k_free)(0) / hz_of(table_boom(b), free_side, 1), 1, 1e-10) << b;
      EXPECT_NEAR(sprung_hz(body, axis, k_closed)(0) / hz_of(table_boom(b), closed, 1), 1, 1e-10) << b;
    }
  }
}

TEST(HingeAdapted, OneCoordinateIsExactForItsOwnSpring) {
  const Eigen::Vector3d axis(0, 0, 1);
  for (const int b : {2, 4, 5}) {
    const test::Boom boom = test::make_boom(line_boom(b));
    for (const char* regime : {free_side, closed}) {
      const double k = stiffness_of(b, regime);
      const ReducedBody body = reduce(boom.mesh, boom.assembly, adapted(boom, axis, {k}), "boom");
      EXPECT_NEAR(sprung_hz(body, axis, k)(0) / hz_of(b, regime, 1), 1, 1e-11) << b << regime;
    }
  }
}

TEST(HingeAdapted, MoreModesPerRegimeAreExactToo) {
  const test::Boom boom = test::make_boom(line_boom(2));
  const Eigen::Vector3d axis(0, 0, 1);
  const ReducedBody body = reduce(
      boom.mesh, boom.assembly, adapted(boom, axis, {stiffness_of(2, free_side), stiffness_of(2, closed)}, 3), "boom");
  ASSERT_EQ(body.n(), 6);
  for (int mode = 1; mode <= 3; ++mode) {
    for (const char* regime : {free_side, closed}) {
      // Six nearly parallel shapes: some digits go into telling them apart.
      EXPECT_NEAR(sprung_hz(body, axis, stiffness_of(2, regime))(mode - 1) / hz_of(2, regime, mode), 1, 1e-8)
          << regime << mode;
    }
  }
}

/// Sections of every kind, as beams, and two of them as solids.
std::vector<Mesh> every_section() {
  const std::vector<SectionShape> sections = {RoundBar{0.01}, Tube{0.01, 0.0005}, Rectangle{0.02, 0.01},
                                              Rectangle{0.01, 0.01}, RectangularTube{0.02, 0.01, 0.001}};
  std::vector<Mesh> meshes;
  for (const SectionShape& section : sections) {
    BeamGeometry g = test::boom4(BeamTheory::timoshenko, true, 3, 5);
    g.segments[0].start = g.segments[0].end = section;
    meshes.push_back(make_mesh(g));
    if (!std::holds_alternative<RoundBar>(section) && !std::holds_alternative<Rectangle>(section)) continue;
    SolidOptions options;
    options.order = 2;
    options.grading = {.sectors = 1, .rings = 1, .long_elements = 5, .end_layers = 0, .corner_levels = 0};
    meshes.push_back(make_solid_mesh(g, options));
  }
  return meshes;
}

TEST(HingeAdapted, EverySectionSeveralSpringsAndCounts) {
  const Eigen::Vector3d axis(0, 0, 1);
  int mesh_number = 0;
  for (const Mesh& mesh : every_section()) {
    const Assembly assembly = assemble(mesh);
    for (const std::vector<double>& k :
         std::vector<std::vector<double>>{{5}, {5, 2000}, {0, 5, 2000}, {5, 5.0001}, {7, 7}}) {
      for (const int count : {1, 2, 3, 5}) {
        const bool coarse = !mesh.solid_properties.empty();  // too few elements along the bar for ten good modes
        if (coarse && count > 3) continue;
        const auto where = [&] {
          return fmt::format("mesh {}, k {}, count {}", mesh_number, fmt::join(k, " "), count);
        };
        const ModalBasis basis =
            hinge_adapted_modes(mesh, assembly, node_set(mesh, "root"), {Eigen::Vector3d::Zero(), axis, k}, count);
        const auto asked = static_cast<Index>(k.size()) * count;
        EXPECT_TRUE(basis.Phi.cols() == asked || (basis.Phi.cols() < asked && !basis.summary.note.empty())) << where();
        const ReducedBody body = reduce(mesh, assembly, basis, "boom");
        for (const BodyCheck& c : body_checks(body)) EXPECT_TRUE(c.passed) << where() << " " << c.name << c.value;
        // More shapes leave the sprung frequencies of the first regime where they are.
        const ReducedBody alone = reduce(
            mesh, assembly,
            hinge_adapted_modes(mesh, assembly, node_set(mesh, "root"), {Eigen::Vector3d::Zero(), axis, {k[0]}}, count),
            "boom");
        const double spring = std::max(k[0], 1e-6);
        const VectorXd all = sprung_hz(body, axis, spring), own = sprung_hz(alone, axis, spring);
        for (int mode = 0; mode < count; ++mode)
          EXPECT_NEAR(all(mode) / own(mode), 1, 1e-6) << where() << " mode " << mode;
      }
    }
    ++mesh_number;
  }
}

TEST(HingeAdapted, AFreeHingeHasItsPinnedModes) {
  const test::Boom boom = test::make_boom(line_boom(4));
  const Eigen::Vector3d axis(0, 0, 1);
  const ReducedBody body = reduce(boom.mesh, boom.assembly, adapted(boom, axis, {0}, 2), "boom");
  const VectorXd hz =
      sprung_hz(body, axis, 1e-9);  // hardly a spring: the rotation has a frequency that can be inverted
  EXPECT_NEAR(hz(1) / hz_of(4, "k=0", 1), 1, 1e-9);
  EXPECT_NEAR(hz(2) / hz_of(4, "k=0", 2), 1, 1e-9);
}

TEST(HingeAdapted, ShapesAreClampedAtTheRoot) {
  const test::Boom boom = test::make_boom(line_boom(5));
  const ModalBasis basis = adapted(boom, {0, 0, 1}, {stiffness_of(5, free_side), stiffness_of(5, closed)});
  const ReducedBody body = reduce(boom.mesh, boom.assembly, basis, "boom");
  EXPECT_EQ(marker(body, "root").S.norm() + marker(body, "root").S_theta.norm(), 0);
  EXPECT_EQ(body.frame, "clamped");
  EXPECT_EQ(body.interfaces.front().name, "root");
  EXPECT_EQ(body.coordinates[0].kind, "bending_y");
  EXPECT_NEAR(marker(body, "tip").S(1, 0), 2, 1e-12);
  EXPECT_LT(std::abs(body.Me(0, 1)), 1e-10 * body.m);
  for (const BodyCheck& c : check_invariants(body, boom.mesh, boom.assembly, basis))
    EXPECT_TRUE(c.passed) << c.name << " " << c.relative_error;
}

TEST(HingeAdapted, ThePointMayLieAnywhereOnTheAxis) {
  const test::Boom boom = test::make_boom(line_boom(5));
  const std::vector<double> k = {stiffness_of(5, free_side), stiffness_of(5, closed)};
  const ModalBasis here = adapted(boom, {0, 0, 1}, k);
  const Eigen::Vector3d d(0.3, -0.2, 0.1);
  Mesh mesh = boom.mesh;
  mesh.nodes.colwise() += d;
  const ModalBasis there = hinge_adapted_modes(mesh, boom.assembly, node_set(mesh, "root"),
                                               {d + Eigen::Vector3d(0, 0, 0.7), {0, 0, 3}, k}, 1);
  // M h is what is left of terms of size |d| / L.
  EXPECT_LT((here.omega - there.omega).norm(), 1e-9 * here.omega.norm());
  EXPECT_LT((here.Phi - there.Phi).cwiseAbs().maxCoeff(), 1e-7 * here.Phi.cwiseAbs().maxCoeff());
}

TEST(HingeAdapted, ClampedModesConvergeLikeTheSeventhPower) {
  // Closed forms, stop closed.
  const BeamGeometry g = line_boom(2);
  const double A = std::numbers::pi / 4 * 0.005 * 0.005, I = A * 0.005 * 0.005 / 16;
  const auto error = [&](int modes, int mode) {
    const ReducedBody body = eq14::reduced_body({0.295, 2840 * A, 67e9 * I}, modes, eq14::Planes::xy, "boom");
    return sprung_hz(body, {0, 0, 1}, stiffness_of(2, closed))(mode - 1) / hz_of(2, closed, mode) - 1;
  };
  // Mode 3: 3e-6 with 8 modes, 1.4e-9 with 24, far above round-off. Mode k is left out with weight 1 / alpha_k^8, and
  // what is left out sums up to N^-7 (first order: -6.971 between these two).
  EXPECT_NEAR(std::log(error(24, 3) / error(8, 3)) / std::log(3.0), -7, 0.05);
  EXPECT_NEAR(std::log(error(24, 2) / error(8, 2)) / std::log(3.0), -7, 0.05);
  EXPECT_GT(error(6, 1), 5e-10);
  // Two adapted coordinates are worth more than 6 clamped ones.
  const test::Boom boom = test::make_boom(g);
  const ReducedBody two = reduce(boom.mesh, boom.assembly,
                                 adapted(boom, {0, 0, 1}, {stiffness_of(2, free_side), stiffness_of(2, closed)}), "b");
  EXPECT_LT(std::abs(sprung_hz(two, {0, 0, 1}, stiffness_of(2, closed))(0) / hz_of(2, closed, 1) - 1), 1e-10);
}

// A tip mass beside the axis makes every mode bend, twist and turn the root: shapes of the hinge and those beside them
// are told apart, and as many as wanted are found.
TEST(HingeAdapted, AllDirectionsOfABodyWhoseDirectionsAreCoupled) {
  BeamGeometry g = line_boom(2);
  const Eigen::Matrix3d inertia = 1e-6 * Eigen::Matrix3d::Identity();
  g.attachments.push_back(
      {.name = "mass", .position = 0.295, .mass = 0.05, .inertia = inertia, .offset = {0, 0.05, 0.02}});
  Mesh mesh = make_mesh(g);
  for (const int count : {1, 2, 4}) {
    BasisOptions o;
    o.name = "hinge", o.modes = count, o.hinge_stiffness = {0.05, 50};
    const BasisModel model = basis_model(mesh, o, node_set(mesh, "root"));
    const ModalBasis basis = make_basis(mesh, model, o);
    EXPECT_EQ(basis.Phi.cols(), 3 * count) << basis.summary.note;
    const ReducedBody body = reduce(mesh, model.assembly, basis, "boom");
    for (const BodyCheck& c : body_checks(body)) EXPECT_TRUE(c.passed) << count << " " << c.name << c.value;
    const double exact = sprung_hz(
        reduce(mesh, model.assembly, clamped_modes(mesh, model.assembly, model.clamp, {.num_modes = 30}), "boom"),
        {0, 0, 1}, 0.05)(0);
    EXPECT_NEAR(sprung_hz(body, {0, 0, 1}, 0.05)(0) / exact, 1, 1e-7) << count;
  }
}

TEST(HingeAdapted, BadHingesAreRefused) {
  const test::Boom boom = test::make_boom(line_boom(2));
  EXPECT_THROW(adapted(boom, {0, 0, 1}, {}), InputError);
  EXPECT_THROW(adapted(boom, {0, 0, 1}, {-1}), InputError);
  EXPECT_THROW(adapted(boom, {0, 0, 0}, {1}), InputError);
  EXPECT_THROW(adapted(boom, {0, 0, 1}, {1}, 0), InputError);
  EXPECT_THROW(hinge_adapted_modes(boom.mesh, boom.assembly, {}, {{0, 0, 0}, {0, 0, 1}, {1}}, 1), InputError);
}

}  // namespace
}  // namespace flexboom
