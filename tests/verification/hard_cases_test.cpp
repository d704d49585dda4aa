#include "fem/base/check.hpp"
#include "fem/booms/solid_boom.hpp"
#include "reduction/basis/modal_basis.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

// Cases that broke other programs, each with its outcome; in every one the Sturm count proves that no mode is missed.
namespace flexboom {
namespace {

using std::numbers::pi;
const Material aluminium{67e9, 0.33, 2840};

BeamGeometry bar(const SectionShape& section, double length, const Material& material) {
  BeamGeometry boom;
  boom.segments = {{section, section, length, material, 0}};
  return boom;
}

/// Uniform mesh: `across` elements through the section, `along` along the bar.
SolidOptions plain(const std::string& element, int order, int along, int across = 1) {
  SolidOptions options;
  options.element = element;
  options.order = element == "hex" ? order : 0;
  options.grading.sectors = across;
  options.grading.rings = 1;
  options.grading.long_elements = along;
  options.grading.end_layers = 0;
  options.grading.corner_levels = 0;
  return options;
}

/// Modes with the Sturm count, by ARPACK unless said otherwise.
ModalBasis proven_modes(const Mesh& mesh, const Clamp& clamp, int count, const std::string& backend = "arpack") {
  EigenOptions options;
  options.num_modes = count;
  options.backend = backend;
  options.sturm = SturmPolicy::always;
  const ModalBasis basis = clamped_modes(mesh, assemble(mesh), clamp, options);
  EXPECT_TRUE(basis.summary.sturm_checked);
  EXPECT_GE(basis.summary.sturm_count, count);
  EXPECT_LT(basis.summary.residual_max, 1e-6);
  return basis;
}

double first_hz(const BeamGeometry& boom, const SolidOptions& options) {
  const Mesh mesh = make_solid_mesh(boom, options);
  return proven_modes(mesh, node_set(mesh, "root"), 4).omega(0) / (2 * pi);
}

// Nearly incompressible: elements that lock volumetrically come out several times too stiff.
TEST(HardCase, NearlyIncompressibleBendingDoesNotLock) {
  const BeamGeometry block = bar(Rectangle{0.02, 0.02}, 0.12, Material{1e7, 0.4999, 1100});
  const double converged = first_hz(block, plain("hex", 6, 6));
  EXPECT_NEAR(first_hz(block, plain("hex", 2, 12, 2)) / converged, 1, 0.05);
  EXPECT_NEAR(first_hz(block, plain("hex", 4, 6)) / converged, 1, 0.01);
  EXPECT_NEAR(first_hz(block, plain("hex20", 0, 12, 2)) / converged, 1, 0.05);
  EXPECT_NEAR(first_hz(block, plain("hex20-reduced", 0, 12, 2)) / converged, 1, 0.02);
  EXPECT_NEAR(first_hz(block, plain("hex27", 0, 12, 2)) / converged, 1, 0.05);
  EXPECT_NEAR(first_hz(block, plain("hex8", 0, 24, 4)) / converged, 1, 0.02);
}

TEST(HardCase, ElementsOfAspectOneToAHundredBend) {
  const auto ribbon_hz = [](const SolidOptions& options) {  // elements of 20 mm x 20 mm x 0.2 mm
    Mesh mesh = make_solid_mesh(bar(Rectangle{0.02, 0.02}, 0.2, aluminium), options);
    mesh.nodes.row(2) *= 0.01;
    return proven_modes(mesh, node_set(mesh, "root"), 4).omega(0) / (2 * pi);
  };
  const double converged = ribbon_hz(plain("hex", 6, 10));
  for (const char* element : {"hex8", "hex20", "hex20-reduced", "hex27"}) {
    EXPECT_NEAR(ribbon_hz(plain(element, 0, 10)) / converged, 1, 0.06) << element;
  }
}

TEST(HardCase, BadlyDistortedButValidElementsStayNear) {
  const BeamGeometry block = bar(Rectangle{0.02, 0.02}, 0.12, aluminium);
  const double converged = first_hz(block, plain("hex", 6, 6));
  Mesh mesh = make_solid_mesh(block, plain("hex20", 0, 12, 2));
  for (Eigen::Index i = 0; i < mesh.nodes.cols(); ++i) {  // sheared to and fro along the bar, up to 45 degrees
    auto x = mesh.nodes.col(i);
    x(0) += 0.25 * x(1) * std::sin(2 * pi * x(0) / 0.04) * (x(0) > 1e-9 && x(0) < 0.12 - 1e-9);
  }
  const ModalBasis basis = proven_modes(mesh, node_set(mesh, "root"), 4);
  EXPECT_NEAR(basis.omega(0) / (2 * pi) / converged, 1, 0.01);
}

TEST(HardCase, AnInvertedElementIsNamed) {
  Mesh mesh = make_solid_mesh(bar(Rectangle{0.02, 0.02}, 0.12, aluminium), plain("hex20", 0, 3));
  std::swap(mesh.elements[1].nodes[0], mesh.elements[1].nodes[6]);
  mesh.element_labels = {11, 12, 13};
  try {
    assemble(mesh);
    FAIL() << "nothing was thrown";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("hex20 element 12"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("inverted"), std::string::npos) << error.what();
  }
}

TEST(HardCase, AFreeBodyHasSixRigidModesAndAllElasticOnes) {
  const Mesh mesh = make_solid_mesh(bar(RoundBar{0.01}, 0.1, aluminium), plain("hex", 3, 4));
  for (const char* backend : {"arpack", "block"}) {
    const ModalBasis basis = proven_modes(mesh, {}, 10, backend);
    EXPECT_EQ(basis.rigid_freedoms, 6);
    EXPECT_LT(basis.omega.head(6).maxCoeff(), 1e-5 * basis.omega(6)) << backend;
    EXPECT_NEAR(basis.omega(6) / basis.omega(7), 1, 1e-8) << backend;
  }
}

TEST(HardCase, AHingedBodyHasOneRigidMode) {
  Mesh mesh = make_mesh(bar(RoundBar{0.01}, 0.3, aluminium));
  mesh.supports = {{0, {true, true, true, true, true, false}}};
  const ModalBasis basis = proven_modes(mesh, {}, 5);
  EXPECT_EQ(basis.rigid_freedoms, 1);
  EXPECT_LT(basis.omega(0), 1e-5 * basis.omega(1));
  EXPECT_EQ(basis.kind[0], ModeKind::rigid);
}

TEST(HardCase, AShiftOnAnEigenvalueMovesOff) {
  const Mesh mesh = make_mesh(bar(RoundBar{0.01}, 0.3, aluminium));
  const Assembly assembly = assemble(mesh);
  EigenOptions options;
  options.num_modes = 4;
  options.sturm = SturmPolicy::always;
  const ModalBasis plain_basis = clamped_modes(mesh, assembly, node_set(mesh, "root"), options);
  options.sigma = plain_basis.omega(0) * plain_basis.omega(0);
  const ModalBasis shifted_basis = clamped_modes(mesh, assembly, node_set(mesh, "root"), options);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(shifted_basis.omega(i) / plain_basis.omega(i), 1, 1e-9) << i;
}

/// Equal booms side by side, their roots held by one rigid base.
Mesh brush(int booms, bool rigid_base) {
  BeamGeometry boom = bar(RoundBar{0.01}, 0.3, aluminium);
  boom.order = 2;
  boom.segments[0].elements = 2;
  const Mesh one = make_mesh(boom);
  const auto nodes = static_cast<int>(one.nodes.cols());
  Mesh mesh;
  mesh.beam_properties = one.beam_properties;
  mesh.nodes.resize(3, booms * nodes + 1);
  std::vector<int> roots;
  for (int b = 0; b < booms; ++b) {
    const Eigen::Vector3d place(0, 0.02 * (b % 10), 0.02 * (b / 10));
    mesh.nodes.middleCols(b * nodes, nodes) = one.nodes.colwise() + place;
    for (Element element : one.elements) {
      for (int& node : element.nodes) node += b * nodes;
      mesh.elements.push_back(element);
    }
    roots.push_back(b * nodes);
  }
  const int base = booms * nodes;
  mesh.nodes.col(base) = Eigen::Vector3d(0, 0.09, 0.09);
  if (rigid_base) mesh.rigid_connections = {{base, roots, all_components}};
  mesh.bodies = {{base, 5, 0.1 * Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()}};
  mesh.node_sets["base"] = {base};
  return mesh;
}

TEST(HardCase, AHundredEqualBoomsOnOneBaseAreAllFound) {
  // A single Lanczos vector sees a multiplicity of 200 by round-off alone: this is what blocks are for.
  for (const auto& [booms, backend] : {std::pair{100, "block"}, std::pair{3, "arpack"}}) {
    const Mesh mesh = brush(booms, true);
    const int first = 2 * booms;
    const ModalBasis basis = proven_modes(mesh, node_set(mesh, "base"), first + 2, backend);
    // The booms bend in two planes each at the frequency of one; the next frequency is the second of one boom.
    EXPECT_NEAR(basis.omega(first - 1) / basis.omega(0), 1, 1e-9) << backend;
    EXPECT_GT(basis.omega(first), 6 * basis.omega(0)) << backend;
    ASSERT_FALSE(basis.summary.pairs.empty());
    EXPECT_EQ(std::ssize(basis.summary.pairs[0]), first) << backend;
  }
}

TEST(HardCase, DisconnectedPartsBringSixMoreRigidModesAndAreSaid) {
  Mesh mesh = make_solid_mesh(bar(Rectangle{0.02, 0.02}, 0.1, aluminium), plain("hex", 2, 2));
  const auto nodes = static_cast<int>(mesh.nodes.cols());
  Mesh both = mesh;
  both.nodes.resize(3, 2 * nodes);
  both.nodes << mesh.nodes, mesh.nodes.colwise() + Eigen::Vector3d(0, 0.1, 0);
  for (Element element : mesh.elements) {
    for (int& node : element.nodes) node += nodes;
    both.elements.push_back(element);
  }
  ASSERT_EQ(suspicions(both).size(), 1U);
  EXPECT_NE(suspicions(both)[0].find("2 parts"), std::string::npos);
  const ModalBasis basis = proven_modes(both, node_set(both, "root"), 10);  // the first part is held, the second floats
  EXPECT_LT(basis.omega.head(6).maxCoeff(), 1e-4 * basis.omega(6));
  EXPECT_EQ(basis.summary.rigid_modes, 6);
}

TEST(HardCase, AStiffnessContrastOfAMillion) {
  BeamGeometry boom = bar(Rectangle{0.02, 0.02}, 0.05, aluminium);
  BeamSegment soft = boom.segments[0];
  soft.material.E *= 1e-6;
  soft.length = 0.1;
  boom.segments.push_back(soft);
  const Mesh mesh = make_solid_mesh(boom, plain("hex", 4, 6));
  const ModalBasis basis = proven_modes(mesh, node_set(mesh, "root"), 6);
  // The stiff part is a clamp to the soft one, to 1e-6 and its singular rim.
  const Mesh alone = make_solid_mesh(bar(Rectangle{0.02, 0.02}, 0.1, soft.material), plain("hex", 4, 4));
  const ModalBasis clamped = proven_modes(alone, node_set(alone, "root"), 6);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(basis.omega(i) / clamped.omega(i), 1, 2e-3) << i;
}

TEST(HardCase, APartWithoutDensityIsASpring) {
  BeamGeometry boom = bar(Rectangle{0.02, 0.02}, 0.05, Material{67e9, 0.33, 0});
  boom.segments.push_back({Rectangle{0.02, 0.02}, Rectangle{0.02, 0.02}, 0.1, aluminium, 0});
  const Mesh mesh = make_solid_mesh(boom, plain("hex", 3, 6));
  BeamGeometry light = boom;
  light.segments[0].material.rho = 1e-3;
  const Mesh almost = make_solid_mesh(light, plain("hex", 3, 6));
  for (const char* backend : {"arpack", "block"}) {
    const ModalBasis basis = proven_modes(mesh, node_set(mesh, "root"), 6, backend);
    const ModalBasis limit = proven_modes(almost, node_set(almost, "root"), 6, backend);
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(basis.omega(i) / limit.omega(i), 1, 1e-6) << backend << ' ' << i;
  }
}

TEST(HardCase, DuplicateNodesAreSaid) {
  Mesh mesh = make_solid_mesh(bar(Rectangle{0.02, 0.02}, 0.1, aluminium), plain("hex8", 0, 4));
  // A crack: the third element gets nodes of its own where it meets the second.
  const auto old_nodes = static_cast<int>(mesh.nodes.cols());
  Mesh cracked = mesh;
  std::vector<int> shared;
  for (const int node : mesh.elements[2].nodes) {
    if (std::ranges::find(mesh.elements[1].nodes, node) != mesh.elements[1].nodes.end()) shared.push_back(node);
  }
  ASSERT_EQ(shared.size(), 4U);
  cracked.nodes.conservativeResize(3, old_nodes + 4);
  for (int i = 0; i < 4; ++i) {
    cracked.nodes.col(old_nodes + i) = mesh.nodes.col(shared[static_cast<size_t>(i)]);
    std::ranges::replace(cracked.elements[2].nodes, shared[static_cast<size_t>(i)], old_nodes + i);
  }
  std::string all;
  for (const std::string& s : suspicions(cracked)) all += s + "\n";
  EXPECT_NE(all.find("4 pairs of nodes lie at one place"), std::string::npos) << all;
}

TEST(HardCase, MixedUpUnitsAreSaid) {
  Mesh mesh = make_solid_mesh(bar(Rectangle{20, 20}, 100, aluminium), plain("hex8", 0, 4));
  mesh.solid_properties[0].material = {67000, 0.33, 2.84e-9};  // N, mm, t
  ASSERT_FALSE(suspicions(mesh).empty());
  EXPECT_NE(suspicions(mesh)[0].find("units mixed up"), std::string::npos);
}

}  // namespace
}  // namespace flexboom
