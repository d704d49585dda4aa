#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "fem/booms/solid_boom.hpp"
#include "fem/formats/mesh_formats.hpp"
#include "reduction/basis/mean_axis.hpp"
#include "reduction/invariants/geometric_stiffness.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tests/fem/solid_testing.hpp"
#include "tests/reduction/booms.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <numbers>
#include <string>
#include <utility>

namespace flexboom {
namespace {

Mesh deck(const std::string& name) {
  return read_mesh(std::filesystem::path(FLEXBOOM_TEST_DATA) / "fem" / "decks" / name).mesh;
}

struct Modes {
  Eigen::VectorXd hz;
  long rigid = 0;  // so called
  ModalBasis basis;
};

Modes modes(const Mesh& mesh, const Clamp& clamp, int count) {
  const Assembly assembly = assemble(mesh);
  ModalBasis basis = clamped_modes(mesh, assembly, clamp, {.num_modes = count, .sigma = {}, .backend = "auto"});
  return {basis.omega / (2 * std::numbers::pi), std::ranges::count(basis.kind, ModeKind::rigid), basis};
}

const Clamp nothing({}, false);

TEST(RigidModes, SupportsInCylindricalAxesHoldAndAreLeftOutOfAFreeBody) {
  const Mesh mesh = deck("tube_on_cylindrical_supports.inp");
  const Modes held = modes(mesh, {}, 6), free = modes(mesh, nothing, 8);
  EXPECT_EQ(held.rigid, 0);
  EXPECT_EQ(held.basis.rigid_freedoms, 0);
  EXPECT_EQ(held.basis.frame, "clamped");
  EXPECT_GT(held.hz(0), 1);
  EXPECT_EQ(free.rigid, 6);
  EXPECT_EQ(free.basis.rigid_freedoms, 6);
  EXPECT_LT(free.hz(5), 1e-3);
  EXPECT_NEAR(free.hz(6), 35.29, 0.005);
  EXPECT_NEAR(free.hz(7), 40.01, 0.005);
}

TEST(RigidModes, InclinedRollersHold) {
  const Mesh mesh = deck("bar_on_inclined_rollers.inp");
  const Modes held = modes(mesh, {}, 6), free = modes(mesh, nothing, 7);
  EXPECT_EQ(held.rigid, 0);
  EXPECT_EQ(held.basis.frame, "clamped");
  EXPECT_EQ(free.rigid, 6);
  const Assembly assembly = assemble(mesh);
  EXPECT_EQ(reduce(mesh, assembly, held.basis, "bar").frame, "clamped");
  const GeometricStiffness Kg = geometric_stiffness(mesh, assembly, {}, held.basis.Phi, {});
  EXPECT_EQ(Kg.spin.size(), 6U);
  EXPECT_EQ(mean_axis_modes(mesh, assembly, {.num_modes = 3, .sigma = {}}).rigid_freedoms, 0);
}

// The measure of rigidity knows neither size nor slenderness nor the kind of element.
TEST(RigidModes, NoneOfASlenderClampedBody) {
  // Its lowest energies are a small part of the terms that they come from.
  BeamGeometry boom;
  boom.segments.push_back({Tube{0.01, 0.001}, Tube{0.01, 0.001}, 4, {67e9, 0.33, 2840}});
  SolidOptions options;
  options.order = 4;
  options.grading.sectors = options.grading.rings = 1, options.grading.long_elements = 8;
  const Mesh mesh = make_solid_mesh(boom, options);
  const Modes held = modes(mesh, mesh.node_sets.at("root"), 6);
  EXPECT_EQ(held.rigid, 0);
  EXPECT_EQ(held.basis.summary.note, "");
  EXPECT_EQ(held.basis.summary.sigma, 0);
  const double A = std::numbers::pi / 4 * (1e-4 - 0.64e-4), I = std::numbers::pi / 64 * (1e-8 - 0.4096e-8);
  const double omega = std::pow(1.8751040687 / 4, 2) * std::sqrt(67e9 * I / (2840 * A));
  EXPECT_NEAR(2 * std::numbers::pi * held.hz(0) / omega, 1, 2e-3);  // Euler and Bernoulli, and a coarse mesh
}

TEST(RigidModes, SixOfAnyFreeBody) {
  for (const double size : {1e-4, 1.0, 1e4}) {
    for (const double slenderness : {3e-5, 1e-2, 0.2}) {
      BeamGeometry g = test::boom4(BeamTheory::timoshenko, true, 4, 4);
      g.segments[0].length = size;
      g.segments[0].start = g.segments[0].end = RoundBar{slenderness * size};
      const Mesh mesh = make_mesh(g);
      EXPECT_EQ(modes(mesh, nothing, 12).rigid, 6) << size << " " << slenderness;
      EXPECT_EQ(modes(mesh, node_set(mesh, "root"), 6).rigid, 0) << size << " " << slenderness;
      if (slenderness < 1e-3) continue;
      SolidOptions options;
      options.order = 2;
      options.grading = {.sectors = 1, .rings = 1, .long_elements = 6, .end_layers = 0, .corner_levels = 0};
      const Mesh solid = make_solid_mesh(g, options);
      EXPECT_EQ(modes(solid, nothing, 12).rigid, 6) << size << " " << slenderness;
      EXPECT_EQ(modes(solid, node_set(solid, "root"), 6).rigid, 0) << size << " " << slenderness;
    }
  }
}

TEST(RigidModes, SixOfEveryLoneSolidElement) {
  for (const ElementType& type : element_types()) {
    if (!testing::is_solid(type)) continue;
    const Mesh mesh = testing::one_solid(type, type.orders().front(), [](const Eigen::Vector3d& x) { return x; });
    for (const char* backend : {"auto", "arpack", "block", "spectra", "dense"}) {
      for (const int count : {6, 7, 10}) {
        if (count > 3 * mesh.nodes.cols()) continue;
        const ModalBasis basis =
            clamped_modes(mesh, assemble(mesh), nothing, {.num_modes = count, .sigma = {}, .backend = backend});
        EXPECT_EQ(std::ranges::count(basis.kind, ModeKind::rigid), 6) << type.name << " " << backend << " " << count;
      }
    }
  }
}

TEST(RigidModes, EveryPartOfABodyInPieces) {
  Mesh mesh = make_mesh(test::boom4(BeamTheory::timoshenko, true, 2, 4));
  const auto nodes = static_cast<int>(mesh.nodes.cols());
  Mesh both = mesh;
  both.nodes.resize(3, 2 * nodes);
  both.nodes << mesh.nodes, mesh.nodes.colwise() + Eigen::Vector3d(0, 1, 0);
  for (Element element : mesh.elements) {
    for (int& node : element.nodes) node += nodes;
    both.elements.push_back(element);
  }
  const Modes free = modes(both, nothing, 14);
  EXPECT_EQ(free.rigid, 12);
  EXPECT_EQ(free.basis.rigid_freedoms, 12);
  // One part held, the other joined by a ball: three motions without strain.
  both.supports = {{0, all_components}};
  for (int k = 0; k < 3; ++k) both.equations.push_back({{{nodes, k, 1}, {nodes - 1, k, -1}}});
  EXPECT_EQ(modes(both, {}, 6).rigid, 3);
}

TEST(RigidModes, AReferenceNodeWithOneEquationPerNodeOfAFace) {
  const Mesh mesh = deck("bar_tied_to_reference_node.inp");
  const Modes held = modes(mesh, {}, 10);
  EXPECT_EQ(held.rigid, 0);
  const Assembly assembly = assemble(mesh);
  EXPECT_EQ(geometric_stiffness(mesh, assembly, {}, held.basis.Phi, {}).spin.size(), 6U);
  // The same by equations among the nodes of the face.
  Mesh plain = mesh;
  plain.node_sets.clear();
  const int leader = plain.equations.front().terms.front().node;
  plain.nodes.conservativeResize(3, plain.nodes.cols() - 1);
  plain.equations.erase(plain.equations.begin());
  for (LinearEquation& equation : plain.equations) equation.terms.back().node = leader;
  const Modes same = modes(plain, {}, 10);
  EXPECT_LT((held.hz - same.hz).norm(), 1e-9 * same.hz.norm());
}

TEST(RigidModes, AMeshWithoutMassSaysSo) {
  Mesh mesh = deck("bar_on_inclined_rollers.inp");
  for (SolidProperty& property : mesh.solid_properties) property.material.rho = 0;
  const Assembly assembly = assemble(mesh);
  try {
    clamped_modes(mesh, assembly, {}, {.num_modes = 3, .sigma = {}});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("nothing has mass"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("\"M\""), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("--material E,nu,rho"), std::string::npos) << error.what();
  }
}

/// A deck as a file of that extension.
Mesh deck_of(const std::string& extension, const std::string& text) {
  const std::filesystem::path file =
      std::filesystem::path(::testing::TempDir()) / ("deck." + std::to_string(::getpid()) + extension);
  write_file(file, text);
  const Mesh mesh = read_mesh(file).mesh;
  std::filesystem::remove(file);
  return mesh;
}

const char* const nodes_of_four = "*NODE\n1\n2, 1\n3, 0, 1\n4, 0, 0, 1\n";
const char* const weightless = "*MATERIAL, NAME=M\n*ELASTIC\n7e10, 0.3\n";

TEST(RigidModes, ADeckWithoutDensitySaysSo) {
  for (const auto& [extension, text] :
       {std::pair{".inp", std::string(nodes_of_four) + "*ELEMENT, TYPE=C3D4, ELSET=E\n1, 1, 2, 3, 4\n" + weightless +
                              "*SOLID SECTION, ELSET=E, MATERIAL=M\n"},
        std::pair{".inp", std::string("*NODE\n1\n2, 1\n3, 2\n*ELEMENT, TYPE=B31, ELSET=E\n1, 1, 2\n2, 2, 3\n") +
                              weightless + "*BEAM SECTION, ELSET=E, MATERIAL=M, SECTION=RECT\n0.1, 0.1\n0, 1, 0\n"},
        std::pair{".bdf", std::string("GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\n"
                                      "CTETRA,1,1,1,2,3,4\nPSOLID,1,1\nMAT1,1,7.+10,,.3\n")}}) {
    const Mesh mesh = deck_of(extension, text);
    for (const Clamp& clamp : {Clamp(), Clamp({0})}) try {
        clamped_modes(mesh, assemble(mesh), clamp, {.num_modes = 3, .sigma = {}});
        ADD_FAILURE() << text;
      } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("nothing has mass"), std::string::npos) << error.what() << text;
      }
  }
}

// Freedoms of it that hold no node of the face have neither stiffness nor mass.
TEST(RigidModes, AReferenceNodeWithoutElementsHasNoModesOfItsOwn) {
  const std::string cube =
      "*NODE\n1\n2, 1\n3, 1, 1\n4, 0, 1\n5, 0, 0, 1\n6, 1, 0, 1\n7, 1, 1, 1\n8, 0, 1, 1\n"
      "*ELEMENT, TYPE=C3D8I, ELSET=E\n1, 1, 2, 3, 4, 5, 6, 7, 8\n*MATERIAL, NAME=M\n*ELASTIC\n7e10, 0.3\n"
      "*DENSITY\n2700\n*SOLID SECTION, ELSET=E, MATERIAL=M\n";
  const std::string coupled = cube +
                              "*NODE\n20, 0.5, 0.5, 3\n*SURFACE, NAME=Top\nE, S2\n"
                              "*COUPLING, REF NODE=20, SURFACE=Top, CONSTRAINT NAME=C\n";
  const Modes plain = modes(deck_of(".inp", cube), {}, 10);
  EXPECT_EQ(plain.rigid, 6);
  for (const char* freedoms : {"1, 1", "1, 3", "1, 6"}) {
    const Modes distributing = modes(deck_of(".inp", fmt::format("{}*DISTRIBUTING\n{}\n", coupled, freedoms)), {}, 10);
    EXPECT_EQ(distributing.rigid, 6) << freedoms;
    EXPECT_LT((distributing.hz - plain.hz).tail(4).norm(), 1e-9 * plain.hz.norm()) << freedoms;
    const Modes kinematic = modes(deck_of(".inp", fmt::format("{}*KINEMATIC\n{}\n", coupled, freedoms)), {}, 10);
    EXPECT_EQ(kinematic.rigid, 6) << freedoms;
    EXPECT_GT(kinematic.hz(6), plain.hz(6) * (1 - 1e-9)) << freedoms;  // a stiff face
  }
}

TEST(RigidModes, MeanAxesNeedABodyThatNoEquationHolds) {
  Mesh mesh = make_mesh(test::boom4(BeamTheory::timoshenko, true, 2, 4));
  mesh.equations = {{{{0, 1, 1}, {2, 1, 1}}}};
  EXPECT_THROW(mean_axis_modes(mesh, assemble(mesh), {.num_modes = 3, .sigma = {}}), InputError);
}

}  // namespace
}  // namespace flexboom
