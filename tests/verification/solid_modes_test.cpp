#include "apps/bench/modes.hpp"
#include "apps/model/mesh_tuning.hpp"
#include "apps/model/prepared_body.hpp"
#include "fem/booms/solid_boom.hpp"
#include "reduction/basis/modal_basis.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

// Frequencies of solids against three-dimensional elasticity.
namespace flexboom {
namespace {

using std::numbers::pi;
const Material aluminium{67e9, 0.33, 2840};

BeamGeometry bar(const SectionShape& section, double length, const Material& material) {
  BeamGeometry boom;
  boom.segments = {{section, section, length, material, 0}};
  return boom;
}

BeamGeometry boom4() { return bar(RoundBar{0.01}, 0.302, aluminium); }

/// Uniform mesh without grading.
SolidOptions uniform(int order, int sectors, int rings, int along) {
  SolidOptions options;
  options.order = order;
  options.grading.sectors = sectors;
  options.grading.rings = rings;
  options.grading.long_elements = along;
  options.grading.end_layers = 0;
  options.grading.corner_levels = 0;
  return options;
}

ModalBasis modes_of(const Mesh& mesh, const Clamp& clamp, int count) {
  EigenOptions options;
  options.num_modes = count;
  options.backend = "auto";
  return clamped_modes(mesh, assemble(mesh), clamp, options);
}

std::vector<double> hz_of(const ModalBasis& basis) {
  std::vector<double> hz;
  for (const double omega : basis.omega) hz.push_back(omega / (2 * pi));
  return hz;
}

// The shear of torsion is infinite along the inner edges of a rectangular tube. Cuts toward them take the error
// from 1.3 % to 0.1 %. Reference: order 5 with two cuts; order 6 with one is 1.2e-4 away.
TEST(SlowEdges, CutsTowardInnerEdgesMakeTorsionRight) {
  const BeamGeometry tube = bar(RectangularTube{0.03, 0.02, 0.0015}, 0.4, aluminium);
  const auto torsion = [&](int levels) {
    SolidOptions options;
    options.order = 3;
    options.grading.edge_levels = levels;
    const Mesh mesh = make_solid_mesh(tube, options);
    const ModalBasis basis = modes_of(mesh, node_set(mesh, "root"), 6);
    const auto found = std::ranges::find(basis.kind, ModeKind::torsion);
    return basis.omega[found - basis.kind.begin()] / (2 * pi);
  };
  constexpr double reference = 1542.715;
  EXPECT_GT(torsion(0) / reference - 1, 1e-2);
  EXPECT_GT(torsion(1) / reference - 1, 0);
  EXPECT_LT(torsion(1) / reference - 1, 1.2e-3);
}

// One sector per quarter of a stub cannot bend to three lobes, whatever its order: the mesh is cut where its
// frequencies ask for it. Reference: order 6 with two sectors; order 5 is 2.5e-5 away, and with three sectors 5e-6
// more.
TEST(SlowEdges, AMeshIsRefinedWhereItsFrequenciesAskForIt) {
  BodyScene body;
  body.name = "stub";
  body.structure = "solid";
  body.geometry = bar(Tube{0.02, 0.002}, 0.05, aluminium);
  body.solid.accuracy = 1e-3;
  Model model;
  model.mesh = mesh_of(body);
  model.clamped = "root";
  model.clamp = node_set(model.mesh, "root");
  model.body = body;
  EigenOptions options;
  options.num_modes = 5;
  options.backend = "auto";
  const Model start = with_order(model, least_order_of_tuning);
  const std::optional<Model> better =
      tuned(start, modes_of(start.mesh, start.clamp, options.num_modes).omega, 0, 1e-2, options, 1);
  ASSERT_TRUE(better);
  EXPECT_EQ(better->body->solid.grading.sectors, 2);
  EXPECT_EQ(better->body->solid.grading.rings, 2);
  const std::vector<double> hz = hz_of(modes_of(better->mesh, better->clamp, options.num_modes));
  const std::vector<double> reference = {5827.183, 5827.183, 14890.436, 15553.834, 15553.834};
  for (size_t k = 0; k < reference.size(); ++k) EXPECT_NEAR(hz[k] / reference[k], 1, 1e-3) << k;
  EXPECT_GT(hz_of(modes_of(model.mesh, model.clamp, options.num_modes))[4] / reference[4], 1.02);
}

double worst_of_boom4(double accuracy) {
  SolidOptions options;
  options.accuracy = accuracy;
  const Mesh mesh = make_solid_mesh(boom4(), options);
  const std::vector<double> hz = hz_of(modes_of(mesh, node_set(mesh, "root"), 10));
  const std::vector<double> reference = boom4_reference_hz();
  double worst = 0;
  for (size_t k = 0; k < 10; ++k) worst = std::max(worst, std::abs(hz[k] / reference[k] - 1));
  return worst;
}

TEST(ClampedBoom4, IsWithinTheAccuracyAskedFor) {
  EXPECT_LT(worst_of_boom4(1e-3), 1e-3);
  EXPECT_LT(worst_of_boom4(1e-4), 1e-4);
  EXPECT_LT(worst_of_boom4(1e-5), 1e-5);
}

TEST(SlowClampedBoom4, IsWithinOnePartInAMillion) { EXPECT_LT(worst_of_boom4(1e-6), 1e-6); }

struct Exact {
  std::string family;
  double hz;
};

/// Rows of the exact cylinder with diaphragm ends (Pochhammer-Chree, 13 digits).
std::vector<Exact> diaphragm_rows(const std::string& bar_name) {
  std::ifstream in(std::string(FLEXBOOM_TEST_DATA) + "/reference/cylinder_diaphragm_ends_exact_3d_hz.csv");
  std::vector<Exact> rows;
  for (std::string line; std::getline(in, line);) {
    std::vector<std::string> cells;
    std::istringstream cells_in(line);
    for (std::string cell; std::getline(cells_in, cell, ',');) cells.push_back(cell);
    if (!cells.empty() && cells[0] == bar_name) rows.push_back({cells[3], std::stod(cells.back())});
  }
  EXPECT_FALSE(rows.empty());
  return rows;
}

// Both end faces may not move in their plane and are free to move along the bar: one rigid motion is left.
TEST(SlowDiaphragmEnds, RoundBarHasTheExactFrequencies) {
  Mesh mesh = make_solid_mesh(bar(RoundBar{0.01}, 0.03, aluminium), uniform(8, 1, 1, 2));
  for (const char* face : {"root", "tip"}) {
    for (const int node : node_set(mesh, face)) {
      mesh.supports.push_back({node, {false, true, true, false, false, false}});
    }
  }
  const ModalBasis basis = modes_of(mesh, {}, 16);
  EXPECT_EQ(basis.rigid_freedoms, 1);
  const std::vector<double> hz = hz_of(basis);
  for (const Exact& row : diaphragm_rows("stub_L30_R5")) {
    if (row.hz > 1e5) continue;  // the third half-wave wants a third element
    const auto nearest = std::ranges::min_element(hz, {}, [&](double f) { return std::abs(f - row.hz); });
    EXPECT_NEAR(*nearest / row.hz, 1, 1e-10) << row.family << ' ' << row.hz;
  }
}

// Torsion of a clamped round bar is exact in elementary terms, (2 k - 1) sqrt(G / rho) / (4 L): no singularity at the
// rim.
TEST(SlowClampedRoundBar, HasTheExactTorsion) {
  const double length = 0.03;
  const Mesh mesh = make_solid_mesh(bar(RoundBar{0.01}, length, aluminium), uniform(8, 1, 1, 2));
  const ModalBasis basis = modes_of(mesh, node_set(mesh, "root"), 12);
  int found = 0;
  for (int i = 0; i < 12; ++i) {
    if (basis.kind[static_cast<size_t>(i)] != ModeKind::torsion) continue;
    const double exact = (2 * ++found - 1) * std::sqrt(aluminium.shear_modulus() / aluminium.rho) / (4 * length);
    EXPECT_NEAR(basis.omega(i) / (2 * pi) / exact, 1, 1e-9);
  }
  EXPECT_GE(found, 2);
}

// Layers of 5 micrometres split an exact pair by 7e-6 in the assembled stiffness; the strain energies of the elements
// restore it.
TEST(ClampedRoundBar, PairsStayEqualOnAStronglyGradedMesh) {
  SolidOptions options = uniform(4, 1, 1, 12);
  options.grading.end_layers = 6;
  options.grading.first_layer = 1e-3;  // 5 micrometres, more or less: widths of the outer ring
  options.grading.growth = 5;
  const Mesh mesh = make_solid_mesh(boom4(), options);
  const ModalBasis basis = modes_of(mesh, node_set(mesh, "root"), 6);
  for (const int i : {0, 2, 4}) EXPECT_NEAR(basis.omega(i) / basis.omega(i + 1), 1, 1e-9) << i;
}

/// Frequencies of a square plate of side a in the limit of no thickness, in units of sqrt(D / (rho t)) / a^2, by
/// Richardson from two thicknesses: elements that are wide against the thickness see no edge layer, so the difference
/// to the thin-plate theory goes like t^2.
std::vector<double> thin_plate_factors(const SolidOptions& options, bool cantilever, int first, int count) {
  const double side = 10, nu = 0.3;
  const Material steel{200e9, nu, 8000};
  std::array<std::vector<double>, 2> factor;
  for (const int level : {0, 1}) {
    const double thickness = side * (level == 0 ? 8e-3 : 4e-3);
    Mesh mesh = make_solid_mesh(bar(Rectangle{side, side}, side, steel), options);
    mesh.nodes.row(2) *= thickness / side;
    if (cantilever) {  // the edge may not turn or deflect; it is free to become thinner
      for (const int node : node_set(mesh, "root")) {
        const bool middle = std::abs(mesh.nodes(2, node)) < 1e-9 * thickness;
        mesh.supports.push_back({node, {true, true, middle, false, false, false}});
      }
    }
    const ModalBasis basis = modes_of(mesh, {}, first + count);
    const double D = steel.E * std::pow(thickness, 3) / (12 * (1 - nu * nu));
    const double unit = std::sqrt(D / (steel.rho * thickness)) / (side * side);
    for (int k = first; k < first + count; ++k) factor[static_cast<size_t>(level)].push_back(basis.omega(k) / unit);
  }
  std::vector<double> limit;
  for (size_t k = 0; k < factor[0].size(); ++k) limit.push_back((4 * factor[1][k] - factor[0][k]) / 3);
  return limit;
}

// NAFEMS FV12 and FV16; Kirchhoff factors recomputed to 2e-5 and better. The published targets are up to 1 % off.
TEST(Nafems, Fv12FreePlate) {
  const std::vector<double> exact = {13.468197, 19.596137, 24.270201, 34.800892, 34.800892, 61.093234};
  const std::vector<double> got = thin_plate_factors(uniform(6, 2, 1, 2), false, 6, 6);
  for (size_t k = 0; k < exact.size(); ++k) EXPECT_NEAR(got[k] / exact[k], 1, 1e-4) << k;
}

TEST(SlowNafems, Fv16CantileverPlate) {
  const std::vector<double> exact = {3.4710134, 8.5063308, 21.284178, 27.198756, 30.954781, 54.184686};
  SolidOptions options = uniform(8, 2, 1, 2);  // layers toward the clamp, whose corners are singular
  options.grading.end_layers = 2;
  options.grading.first_layer = 0.05;
  options.grading.growth = 4;
  const std::vector<double> got = thin_plate_factors(options, true, 0, 6);
  for (size_t k = 0; k < exact.size(); ++k) EXPECT_NEAR(got[k] / exact[k], 1, 1e-4) << k;
}

}  // namespace
}  // namespace flexboom
