#include "fem/formats/abaqus/read.hpp"

#include "abaqus_testing.hpp"
#include "fem/base/files.hpp"
#include "fem/mesh/mesh_sets.hpp"

#include <fmt/format.h>

namespace flexboom::testing {
namespace {

using Eigen::Vector3d;

TEST(Abaqus, CubeHasItsMassMaterialAndSets) {
  const MeshFile file = read(cube);
  EXPECT_EQ(file.mesh.nodes.cols(), 8);
  ASSERT_EQ(file.mesh.elements.size(), 1U);
  EXPECT_EQ(type_of(file.mesh.elements[0]).name, "hex8");
  EXPECT_NEAR(total_mass(file.mesh), 8000, 1e-9);
  EXPECT_EQ(file.mesh.solid_properties[0].name, "Steel");
  EXPECT_EQ(file.mesh.solid_properties[0].material.E, 210e9);
  EXPECT_EQ(node_set(file.mesh, "Nall").size(), 8U);
  EXPECT_EQ(file.mesh.element_sets.at("EALL"), std::vector<int>{0});
  EXPECT_EQ(file.modes, std::nullopt);
}

TEST(Abaqus, LineEndsOfWindowsAreNoPartOfNames) {
  std::string text = cube;
  for (size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2) text.insert(at, 1, '\r');
  EXPECT_EQ(read(text).mesh.element_sets.count("EALL"), 1U);
}

struct Kind {
  std::string deck, row;
};

class AbaqusKind : public ::testing::TestWithParam<Kind> {};

// Nodes at their reference places, at most 16 numbers per line, the first with a comma at its end.
TEST_P(AbaqusKind, ElementHasItsVolumeAndFaces) {
  const ElementType& row = row_named(GetParam().row);
  const Eigen::Matrix3Xd nodes = reference_nodes(row, row.orders().front());
  std::string text = "*NODE\n", element = "7";
  for (int i = 0; i < nodes.cols(); ++i) {
    text += fmt::format("{}, {}, {}, {}\n", i + 10, nodes(0, i), nodes(1, i), nodes(2, i));
    element += fmt::format(",{}{}", i == 14 ? "\n" : "", i + 10);
  }
  text += "*ELEMENT, TYPE=" + GetParam().deck + ", ELSET=E\n" + element + "\n" + steel +
          "*SOLID SECTION, ELSET=E, MATERIAL=Steel\n";
  const int faces = row.shape == Shape::hexahedron ? 6 : row.shape == Shape::wedge ? 5 : 4;
  for (int f = 1; f <= faces; ++f) text += fmt::format("*SURFACE, NAME=F{}\n7, S{}\n", f, f);
  const Mesh mesh = read(text).mesh;
  ASSERT_EQ(mesh.elements.size(), 1U);
  EXPECT_EQ(type_of(mesh.elements[0]).name, row.name);
  EXPECT_EQ(mesh.element_labels[0], 7);
  mesh.validate();
  const double exact = row.shape == Shape::hexahedron ? 8 : row.shape == Shape::wedge ? 1 : 1.0 / 6;
  EXPECT_NEAR(volume(mesh), exact, 1e-12);

  // The nodes of each face are all nodes of a plane that bounds the element, and no two faces are one.
  std::vector<std::vector<int>> seen;
  for (int f = 1; f <= faces; ++f) {
    const std::vector<int>& face = node_set(mesh, fmt::format("F{}", f));
    seen.push_back(face);
    const Vector3d a = mesh.nodes.col(face[0]);
    Vector3d normal = Vector3d::Zero();
    for (size_t i = 1; i < face.size(); ++i) {
      for (size_t k = 1; k < i; ++k) {
        const Vector3d n = (mesh.nodes.col(face[i]) - a).cross(mesh.nodes.col(face[k]) - a);
        if (n.norm() > normal.norm()) normal = n;
      }
    }
    const Eigen::VectorXd height = normal.normalized().transpose() * (mesh.nodes.colwise() - a);
    EXPECT_TRUE(height.minCoeff() > -1e-12 || height.maxCoeff() < 1e-12) << f;
    EXPECT_EQ((height.array().abs() < 1e-12).count(), std::ssize(face)) << f;
  }
  std::ranges::sort(seen);
  EXPECT_EQ(std::ranges::adjacent_find(seen), seen.end());
}

INSTANTIATE_TEST_SUITE_P(All, AbaqusKind,
                         ::testing::Values(Kind{"C3D4", "tet4"}, Kind{"C3D10", "tet10"}, Kind{"C3D8", "hex8"},
                                           Kind{"C3D8I", "hex8"}, Kind{"C3D8R", "hex8-reduced"}, Kind{"C3D20", "hex20"},
                                           Kind{"C3D20R", "hex20-reduced"}, Kind{"C3D6", "wedge6"},
                                           Kind{"C3D15", "wedge15"}),
                         [](const auto& kind) { return kind.param.deck; });

TEST(Abaqus, SetsAreGeneratedJoinedAndExtended) {
  const Mesh mesh = read(cube +
                         "*NSET, NSET=Odd, GENERATE\n1, 99, 2\n*NSET, NSET=Some\nodd, 2\n*NSET, NSET=SOME\n4\n"
                         "*NSET, NSET=OfElements, ELSET=Eall\n*ELSET, ELSET=Copy\nEall\n")
                        .mesh;
  EXPECT_EQ(node_set(mesh, "Odd"), (std::vector<int>{0, 2, 4, 6}));
  EXPECT_EQ(node_set(mesh, "Some"), (std::vector<int>{0, 1, 2, 3, 4, 6}));
  EXPECT_EQ(node_set(mesh, "OfElements").size(), 8U);
  EXPECT_EQ(mesh.element_sets.at("Copy"), std::vector<int>{0});
}

TEST(Abaqus, SupportsByRangeNameAndNewStep) {
  const std::string before = cube + "*BOUNDARY\n1, 1, 3\n2, XSYMM\n3, PINNED\n4, 2\n5, 3, , 0.1\n6, 11, 11, 20\n";
  const MeshFile file = read(before);
  EXPECT_EQ(held(file.mesh, 1), "123");
  EXPECT_EQ(held(file.mesh, 2), "1");  // a solid has no rotations
  EXPECT_EQ(held(file.mesh, 3), "123");
  EXPECT_EQ(held(file.mesh, 4), "2");
  EXPECT_EQ(held(file.mesh, 5), "3");
  EXPECT_EQ(held(file.mesh, 6), "");
  EXPECT_TRUE(has_note(file, "held at zero"));
  const Mesh changed =
      read(before + "*STEP\n*FREQUENCY\n3\n*BOUNDARY, OP=NEW\n7, 1\n*BOUNDARY, OP=NEW\n8, 2\n*END STEP\n").mesh;
  EXPECT_EQ(changed.supports.size(), 2U);
  EXPECT_EQ(held(changed, 7), "1");
}

TEST(Abaqus, FirstFrequencyStepCounts) {
  const MeshFile file =
      read(cube +
           "*STEP\n*STATIC\n*CLOAD\n7, 1, 10.\n*END STEP\n*STEP\n*FREQUENCY, STORAGE=YES\n12, 1., 1e4\n"
           "*NODE FILE\nU\n*END STEP\n*STEP\n*MODAL DYNAMIC\n0.1, 1\n*END STEP\n");
  EXPECT_EQ(file.modes, 12);
  EXPECT_TRUE(has_note(file, "*STATIC steps are not computed"));
  EXPECT_TRUE(has_note(file, "limits of frequency"));
  EXPECT_TRUE(has_note(file, "what follows the first *FREQUENCY step"));
}

TEST(Abaqus, PreloadOnlyCountsWhereItStiffens) {
  const auto deck = [](const std::string& load, const std::string& modes) {
    return cube + "*STEP" + load + "\n*STATIC\n*END STEP\n*STEP" + modes + "\n*FREQUENCY\n5\n*END STEP\n";
  };
  EXPECT_EQ(read(deck("", "")).modes, 5);
  for (const auto& [load, modes] : {std::pair("", ", PERTURBATION"), std::pair(", NLGEOM", "")})
    EXPECT_NE(input_error([&, load = load, modes = modes] {
                read(deck(load, modes));
              }).find("starts from the loads of this step"),
              std::string::npos);
}

TEST(Abaqus, NumbersThatCalculixCutsOffCountInFull) {
  std::string text = cube;
  text.replace(text.find("5, 0, 0, 1\n"), 11, "5, -3.62454980326159e-05, 0, 1\n");
  const MeshFile file = read(text);
  EXPECT_EQ(file.mesh.nodes(0, 4), -3.62454980326159e-05);
  EXPECT_TRUE(has_note(file, "CalculiX reads 20 characters"));
}

// What mesh generators write: groups of lines and surfaces as elements, nodes of nothing, no material.
TEST(Abaqus, GroupsOfLowerDimensionBecomeNodeSets) {
  const MeshFile file = read(cube_nodes +
                             "*NODE\n99, 5, 5, 5\n*ELEMENT, TYPE=CPS4, ELSET=Bottom\n2, 1, 2, 3, 4\n"
                             "*ELEMENT, TYPE=T3D2, ELSET=Edge\n3, 1, 2\n");
  EXPECT_EQ(file.mesh.elements.size(), 1U);
  EXPECT_EQ(file.mesh.nodes.cols(), 8);
  EXPECT_EQ(node_set(file.mesh, "Bottom").size(), 4U);
  EXPECT_EQ(node_set(file.mesh, "Edge").size(), 2U);
  EXPECT_EQ(file.mesh.solid_properties[0].material.E, 0);
  EXPECT_TRUE(has_note(file, "give it one"));
}

TEST(Abaqus, BeamSectionsAndTheirDirections) {
  const Mesh mesh = read(mast("SECTION=RECT\n0.1, 0.4\n0, 1, 0\n")).mesh;
  ASSERT_EQ(mesh.elements.size(), 2U);  // B32: two pieces
  EXPECT_EQ(mesh.elements[1].nodes, (std::vector<int>{1, 2}));
  EXPECT_EQ(mesh.element_labels, (std::vector<long>{5, 5}));
  const BeamProperty& beam = mesh.beam_properties[0];
  EXPECT_EQ(beam.y_axis, Vector3d::UnitY());
  // Thickness 0.1 along direction 1 = y of the section: bending along it is the soft one.
  const Section s = section_of(beam.start, 0.3, {});
  EXPECT_NEAR(s.Iz, 0.4 * 0.001 / 12, 1e-12);
  EXPECT_NEAR(s.Iy, 0.1 * 0.064 / 12, 1e-12);
  EXPECT_NEAR(total_mass(mesh), 8000 * 0.04 * 2, 1e-9);

  const auto area = [](const std::string& section) {
    return section_of(read(mast(section)).mesh.beam_properties[0].start, 0.3, {}).A;
  };
  EXPECT_NEAR(area("SECTION=CIRC\n0.2, 0.2\n1, 0, 0\n"), pi * 0.01, 1e-14);  // CalculiX: diameters
  EXPECT_NEAR(area("SECTION=PIPE\n0.2, 0.05\n1, 0, 0\n"), pi * (0.04 - 0.0225), 1e-14);
  EXPECT_NEAR(area("SECTION=BOX\n0.4, 0.2, .01, .01, .01, .01\n1, 0, 0\n"), 0.08 - 0.38 * 0.18, 1e-14);
}

// A planar model: *BOUNDARY on every node.
TEST(Abaqus, PlanarBeamsHaveNoTorsionInside) {
  const std::string text =
      mast("SECTION=RECT\n0.1, 0.4\n0, 1, 0\n") + "*NSET, NSET=All\n1, 2, 3\n*BOUNDARY\nAll, 1\nAll, 5, 6\n1, 1, 6\n";
  const Mesh mesh = read(text).mesh;
  EXPECT_EQ(unknowns(mesh, assemble(mesh).dofs, {}).count, 6 + 2 * (4 + 9));
}

TEST(Abaqus, GeneralBeamSection) {
  std::string text = mast("");
  text.resize(text.find("*BEAM SECTION"));
  const Mesh mesh = read(text +
                         "*BEAM GENERAL SECTION, ELSET=Mast, DENSITY=1000\n0.01, 1e-5, 0, 3e-5, 2e-5\n1, 0, 0\n"
                         "2.6e9, 1e9\n")
                        .mesh;
  const BeamProperty& beam = mesh.beam_properties[0];
  EXPECT_NEAR(beam.material.nu, 0.3, 1e-12);
  EXPECT_EQ(section_of(beam.start, 0.3, {}).Iy, 1e-5);  // I11: about direction 1 = y
  EXPECT_EQ(section_of(beam.start, 0.3, {}).Iz, 3e-5);
  EXPECT_NEAR(total_mass(mesh), 20, 1e-10);
}

TEST(Abaqus, MassOnRigidBodyAndSupportsOfItsRotations) {
  const Mesh mesh =
      read(cube +
           "*NODE\n20, 0.5, 0.5, 3\n21, 0.5, 0.5, 3\n*ELEMENT, TYPE=MASS, ELSET=Lump\n9, 20\n*MASS, ELSET=Lump\n"
           "12.5\n*NSET, NSET=Top\n5, 6, 7, 8\n*RIGID BODY, NSET=Top, REF NODE=20, ROT NODE=21\n"
           "*BOUNDARY\n20, 1, 2\n21, 3\n")
          .mesh;
  ASSERT_EQ(mesh.rigid_connections.size(), 1U);
  EXPECT_EQ(mesh.rigid_connections[0].nodes.size(), 4U);
  EXPECT_EQ(held(mesh, 20), "126");  // rotation about z
  EXPECT_EQ(mesh.nodes.cols(), 9);   // the rotation node is gone
  EXPECT_NEAR(total_mass(mesh), 8012.5, 1e-9);
  EXPECT_LT(rigid_residual(mesh), 1e-12);
}

// Two blocks, 1 x 1 and 2 x 2 elements in their faces: nodes of the fine one follow the coarse face.
std::string blocks(double gap) {
  std::string text = cube + "*NODE\n";
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 3; ++i)
        text += fmt::format("{}, {}, {}, {}\n", 100 + i + 3 * j + 9 * k, 0.5 * i, 0.5 * j, 1 + gap + k);
    }
  }
  text += "*ELEMENT, TYPE=C3D8, ELSET=Fine\n";
  for (int e = 0; e < 4; ++e) {
    const int n = 100 + e % 2 + 3 * (e / 2);
    text += fmt::format("{}, {}, {}, {}, {}, {}, {}, {}, {}\n", 10 + e, n, n + 1, n + 4, n + 3, n + 9, n + 10, n + 13,
                        n + 12);
  }
  return text +
         "*SOLID SECTION, ELSET=Fine, MATERIAL=Steel\n*SURFACE, NAME=Master\nEall, S2\n"
         "*SURFACE, NAME=Slave\nFine, S1\n";
}

TEST(Abaqus, TieCarriesEveryLinearMotion) {
  const MeshFile file = read(blocks(0.01) + "*TIE, NAME=Glue\nSlave, Master\n");
  EXPECT_EQ(file.mesh.equations.size(), 27U);  // 9 nodes
  EXPECT_TRUE(has_note(file, "9 slave nodes were moved"));
  EXPECT_EQ(part_count(file.mesh), 1);
  EXPECT_LT(rigid_residual(file.mesh), 1e-12);
  const Assembly a = assemble(file.mesh);
  Eigen::VectorXd u(a.dofs.count);  // u = (x + 2 y, 3 z, x - z): strains and turns
  for (int node = 0; node < file.mesh.nodes.cols(); ++node) {
    const Vector3d x = file.mesh.nodes.col(node);
    u.segment<3>(a.dofs.of_node(node, 0)) << x(0) + 2 * x(1), 3 * x(2), x(0) - x(2);
  }
  EXPECT_LT(residual(file.mesh, a.dofs, u), 1e-12);
  const Mesh kept = read(blocks(0.01) + "*TIE, NAME=Glue, ADJUST=NO\nSlave, Master\n").mesh;
  EXPECT_NEAR(kept.nodes(2, node_labelled(kept, 104)), 1.01, 1e-15);
}

TEST(Abaqus, TieToleranceIsHeeded) {
  EXPECT_NE(input_error([] { read(blocks(0.1) + "*TIE, NAME=G\nSlave, Master\n"); }).find("slave node"),
            std::string::npos);
  EXPECT_EQ(read(blocks(0.1) + "*TIE, NAME=G, POSITION TOLERANCE=0.2\nSlave, Master\n").mesh.equations.size(), 27U);
}

// Quadratic faces: a slave node anywhere on a curved face of C3D20 must be found and held without gap.
TEST(Abaqus, TieFollowsCurvedFaces) {
  const ElementType& row = row_named("hex20");
  Eigen::Matrix3Xd nodes = reference_nodes(row, 2);
  nodes.row(2) += 0.1 * nodes.row(0).cwiseProduct(nodes.row(0)) - 0.05 * nodes.row(1).cwiseProduct(nodes.row(1));
  std::string text = "*NODE\n", element = "1";
  for (int i = 0; i < 20; ++i) {
    text += fmt::format("{}, {}, {}, {}\n", i + 1, nodes(0, i), nodes(1, i), nodes(2, i));
    element += fmt::format(", {}", i + 1);
  }
  const double x = 0.3, y = -0.6;  // x and y are linear in the element
  text += fmt::format("51, {}, {}, {}\n52, 2, 0, 3\n53, 0, 2, 3\n54, 0, 0, 4\n", x, y, 1 + 0.1 * x * x - 0.05 * y * y);
  const Mesh mesh = read(text + "*ELEMENT, TYPE=C3D20, ELSET=E\n" + element +
                         "\n*ELEMENT, TYPE=C3D4, ELSET=E\n2, 51, 52, 53, 54\n" + steel +
                         "*SOLID SECTION, ELSET=E, MATERIAL=Steel\n*SURFACE, NAME=M\n1, S2\n"
                         "*SURFACE, NAME=S, TYPE=NODE\n51\n*TIE, NAME=T, POSITION TOLERANCE=1e-9\nS, M\n")
                        .mesh;
  EXPECT_EQ(mesh.equations.size(), 3U);
  EXPECT_LT(rigid_residual(mesh), 1e-12);
}

TEST(Abaqus, EquationsPairSetsAndTurnWithTransforms) {
  const Mesh mesh = read(cube + "*NSET, NSET=A\n1, 2\n*NSET, NSET=B\n5, 6\n*EQUATION\n2\nA, 1, 1., B, 1, -1.\n").mesh;
  ASSERT_EQ(mesh.equations.size(), 2U);
  EXPECT_EQ(mesh.equations[1].terms[0].node, 1);
  EXPECT_EQ(mesh.equations[1].terms[1].node, 5);
  EXPECT_EQ(read(cube + "*NSET, NSET=A\n2, 1\n*NSET, NSET=B\n5, 6\n*EQUATION\n2\nA, 1, 1., B, 1, -1.\n")
                .mesh.equations[0]
                .terms[0]
                .node,
            0);  // sets are ascending, as they are in Abaqus

  // Node 3 slides on the plane whose normal is (1, 1, 0); node 4 is held entirely, which no axes change.
  const std::string turned = cube + "*TRANSFORM, NSET=T\n1, 1, 0, -1, 1, 0\n*NSET, NSET=T\n3, 4\n";
  const Mesh slides = read(turned + "*BOUNDARY\n3, 1\n4, 1, 3\n").mesh;
  ASSERT_EQ(slides.equations.size(), 1U);
  ASSERT_EQ(slides.equations[0].terms.size(), 2U);
  for (const auto& term : slides.equations[0].terms) EXPECT_NEAR(term.coefficient, std::sqrt(0.5), 1e-15);
  EXPECT_EQ(held(slides, 4), "123");
  EXPECT_EQ(held(read(turned + "*BOUNDARY\n3, 3\n").mesh, 3), "3");
}

TEST(Abaqus, PairsOfSetsGoByTheNumbersOfNodes) {
  // Nodes that stand in another order than their numbers.
  std::string text = cube;
  const std::string in_order = "1, 0, 0, 0\n 2, 1., 0, 0.\n";
  text.replace(text.find(in_order), in_order.size(), "2, 1., 0, 0.\n 1, 0, 0, 0\n");
  const Mesh mesh = read(text + "*NSET, NSET=A\n1, 2\n*NSET, NSET=B\n5, 6\n*EQUATION\n2\nA, 1, 1., B, 1, -1.\n").mesh;
  ASSERT_EQ(mesh.equations.size(), 2U);
  EXPECT_EQ(mesh.node_label(mesh.equations[0].terms[0].node), 1);
  EXPECT_EQ(mesh.node_label(mesh.equations[0].terms[1].node), 5);

  const auto paired = [](const std::string& members, const std::string& use) {
    return input_error([&] {
      read(cube + "*NSET, NSET=A, UNSORTED\n" + members + "\n*NSET, NSET=B\n5, 6\n" + use + "\n", Dialect::abaqus);
    });
  };
  for (const std::string use : {"*EQUATION\n2\nA, 1, 1., B, 1, -1.", "*MPC\nPIN, A, B", "*MPC\nPIN, B, A"}) {
    EXPECT_TRUE(says(paired("2, 1", use), "UNSORTED")) << use;
    EXPECT_EQ(paired("1, 2", use), "nothing was thrown") << use;
  }
  EXPECT_EQ(paired("2, 1", "*BOUNDARY\nA, 1, 3"), "nothing was thrown");
}

TEST(Abaqus, CylindricalTransformIsRadialAtEachNode) {
  const Mesh mesh = read(cube + "*TRANSFORM, NSET=Nall, TYPE=C\n0.5, 0.5, 0, 0.5, 0.5, 1\n*BOUNDARY\nNall, 2\n").mesh;
  ASSERT_EQ(mesh.equations.size(), 8U);
  for (const LinearEquation& equation : mesh.equations) {  // tangential: normal to the radius
    double radial = 0;
    for (const auto& term : equation.terms) radial += term.coefficient * (mesh.nodes(term.component, term.node) - 0.5);
    EXPECT_NEAR(radial, 0, 1e-15);
  }
}

TEST(Abaqus, MpcsJoinNodes) {
  const std::string two = cube +
                          "*NODE\n20, 0, 0, 2\n21, 0, 0, 3\n*ELEMENT, TYPE=B31, ELSET=Mast\n9, 20, 21\n"
                          "*BEAM SECTION, ELSET=Mast, MATERIAL=Steel, SECTION=RECT\n0.1, 0.1\n1, 0, 0\n";
  const Mesh beam = read(two + "*MPC\nBEAM, 5, 20\nBEAM, Nall, 20\n", Dialect::abaqus).mesh;
  EXPECT_EQ(beam.rigid_connections.size(), 2U);
  EXPECT_EQ(beam.rigid_connections[1].nodes.size(), 8U);
  EXPECT_LT(rigid_residual(beam), 1e-12);
  EXPECT_EQ(read(two + "*MPC\nTIE, 5, 20\n").mesh.equations.size(), 3U);  // node 5 has no rotations
  const Mesh link = read(two + "*MPC\nLINK, 7, 20\n").mesh;
  EXPECT_EQ(link.equations.size(), 1U);
  EXPECT_LT(rigid_residual(link), 1e-12);
}

TEST(Abaqus, CouplingsBecomeRigidAndDistributing) {
  const std::string top = cube +
                          "*NODE\n20, 0.5, 0.5, 3\n*SURFACE, NAME=Top\nEall, S2\n"
                          "*COUPLING, REF NODE=20, SURFACE=Top, CONSTRAINT NAME=C\n";
  const Mesh kinematic = read(top + "*KINEMATIC\n1, 2\n").mesh;
  ASSERT_EQ(kinematic.rigid_connections.size(), 1U);
  EXPECT_EQ(kinematic.rigid_connections[0].components, (Components{true, true, false, false, false, false}));
  const Mesh distributing = read(top + "*DISTRIBUTING\n1, 6\n").mesh;
  ASSERT_EQ(distributing.distributing_connections.size(), 1U);
  double sum = 0;
  for (const double w : distributing.distributing_connections[0].weights) sum += w;
  EXPECT_NEAR(sum, 1, 1e-15);  // the area
  EXPECT_LT(rigid_residual(distributing), 1e-12);
  const Mesh elements = read(cube +
                                 "*NODE\n20, 0.5, 0.5, 3\n*ELEMENT, TYPE=DCOUP3D, ELSET=D\n9, 20\n"
                                 "*DISTRIBUTING COUPLING, ELSET=D\n5, 2.\n6, 1.\n7, 1.\n",
                             Dialect::abaqus)
                            .mesh;
  EXPECT_EQ(elements.distributing_connections[0].weights, (std::vector<double>{2, 1, 1}));
}

TEST(Abaqus, ElementsThatAreNotThoseOfThePrograms) {
  for (const std::string kind : {"C3D8", "C3D8R", "C3D8I"}) {
    std::string text = cube;
    text.replace(text.find("c3d8i"), 5, kind);
    EXPECT_TRUE(has_note(read(text), kind + " is")) << kind;
  }
  const std::string solid = "\n" + steel + "*SOLID SECTION, ELSET=E, MATERIAL=Steel\n";
  const std::string nodes = "*NODE\n1\n2, 1\n3, 0, 1\n4, 0, 0, 1\n5, 1, 0, 1\n6, 0, 1, 1\n*ELEMENT, ELSET=E, TYPE=";
  EXPECT_TRUE(has_note(read(nodes + "C3D4\n1, 1, 2, 3, 4" + solid), "C3D4 has the mass"));
  EXPECT_TRUE(has_note(read(nodes + "C3D6\n1, 1, 2, 3, 4, 5, 6" + solid), "C3D6 is held"));
}

TEST(Abaqus, FourthFieldOfFrequencyIsSaid) {
  EXPECT_TRUE(has_note(read(cube + "*STEP\n*FREQUENCY\n5, , , 1e-3\n*END STEP\n"), "fourth field"));
  EXPECT_FALSE(has_note(read(cube + "*STEP\n*FREQUENCY\n5\n*END STEP\n"), "fourth field"));
}

// E and nu between rows by the initial temperature, and of the last row beyond it.
TEST(Abaqus, MaterialsAreTakenAtTheInitialTemperature) {
  std::string text = cube;
  text.replace(text.find("210e9, 0.3\n"), 11, "200e9, 0.3, 300\n100e9, 0.4, 400\n");
  text.replace(text.find("8000\n"), 5, "8000, 0\n7000, 1000\n");
  const auto material = [&](const std::string& start) { return read(text + start).mesh.solid_properties[0].material; };
  const auto at = [](const std::string& t) { return "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nNall, " + t + "\n"; };
  EXPECT_NEAR(material(at("325")).E, 175e9, 1);
  EXPECT_NEAR(material(at("325")).nu, 0.325, 1e-12);
  EXPECT_NEAR(material(at("325")).rho, 7675, 1e-9);
  EXPECT_EQ(material(at("1e4")).E, 100e9);
  EXPECT_EQ(material("").E, 200e9);  // at zero, as both programs do
  EXPECT_TRUE(has_note(read(text + at("325")), "depends on temperature"));
  EXPECT_FALSE(has_note(read(text + at("325")), "no effect"));
  EXPECT_TRUE(says(input_error([&] { material(at("325") + "*INITIAL CONDITIONS, TYPE=TEMPERATURE\n1, 330\n"); }),
                   "start between 325 and 330"));
  const std::string step = "*STEP\n*STATIC\n*TEMPERATURE\nNall, 400\n*END STEP\n*STEP\n*FREQUENCY\n5\n*END STEP\n";
  EXPECT_TRUE(says(input_error([&] { material(at("300") + step); }), "--dialect"));
  EXPECT_EQ(read(text + at("300") + step, Dialect::calculix).mesh.solid_properties[0].material.E, 200e9);
  EXPECT_TRUE(says(input_error([&] { read(text + at("300") + step, Dialect::abaqus); }), "give it that"));
  EXPECT_EQ(read(cube + at("300") + step).mesh.solid_properties[0].material.E, 210e9);  // nothing depends on it
}

TEST(Abaqus, ZeroCoefficientsOfEquationsAreSaid) {
  const auto equation = [](const std::string& terms) { return cube + "*EQUATION\n2\n" + terms + "\n"; };
  const std::string first = input_error([&] { read(equation("1, 1, 0., 2, 1, 1.")); });
  EXPECT_TRUE(says(first, "deck.inp:23:7: the first coefficient of an equation must not be zero")) << first;
  EXPECT_TRUE(says(input_error([&] { read(equation("1, 1, 0., 2, 1, 0.")); }), "must not be zero"));
  const MeshFile second = read(equation("1, 1, 1., 2, 1, 0."));
  EXPECT_TRUE(has_note(second, "deck.inp:23: a term of the equation has the coefficient zero"));
  EXPECT_EQ(second.mesh.equations[0].terms.size(), 1U);
}

TEST(Abaqus, RequestsForOutputAndStepsAfterModesArePassedOver) {
  for (const std::string request : {"*MATRIX GENERATE, STIFFNESS, MASS", "*MATRIX OUTPUT, STIFFNESS",
                                    "*SUBSTRUCTURE GENERATE", "*ELEMENT MATRIX OUTPUT, ELSET=Eall",
                                    "*FLEXIBLE BODY, TYPE=ADAMS", "*MODAL DYNAMIC", "*INCREMENTATION OUTPUT"}) {
    const MeshFile file = read(cube + "*STEP\n" + request + "\n1, 2\n*END STEP\n*STEP\n*FREQUENCY\n7\n*END STEP\n");
    EXPECT_EQ(file.modes, 7) << request;
    EXPECT_TRUE(has_note(file, "is passed over")) << request;
  }
}

TEST(Abaqus, NamesCompareWithoutCase) {
  const Mesh mesh =
      read(cube + "*NSET, NSET=Tip\n5, 6\n*SURFACE, NAME=TIP\nEall, S2\n*SURFACE, NAME=Side\nEALL, S3\n").mesh;
  EXPECT_EQ(node_set(mesh, "tip"), node_set(mesh, "Tip"));
  EXPECT_EQ(node_set(mesh, "TIP").size(), 2U);  // sets and surfaces are called apart, the set is kept
  EXPECT_EQ(node_set(mesh, "SIDE").size(), 4U);
  EXPECT_EQ(node_set_name(mesh, "nALL"), "Nall");
  EXPECT_EQ(node_set_name(mesh, "none"), "none");
}

// As Abaqus/CAE writes: the nodes in a part, placed by an instance; reference points and sets in the assembly.
TEST(Abaqus, OneInstanceOfOnePart) {
  std::string part = cube;
  part.erase(part.find("*MATERIAL"), steel.size());
  const Mesh mesh =
      read("*PART, NAME=Block\n" + part +
           "*NSET, NSET=Set-1\n1\n*END PART\n*ASSEMBLY, NAME=A\n"
           "*INSTANCE, NAME=Block-1, PART=Block\n10, 0, 0\n10, 0, 0, 10, 0, 1, 90\n*END INSTANCE\n"
           "*NODE\n1, 10, 0, 5\n*NSET, NSET=RP\n1\n*NSET, NSET=Set-1, INSTANCE=Block-1, GENERATE\n5, 8, 1\n"
           "*RIGID BODY, REF NODE=RP, PIN NSET=Set-1\n*END ASSEMBLY\n" +
           steel + "*BOUNDARY\nBlock-1.Set-1, 1, 3\nRP, 6\nBlock-1.2, 2\n")
          .mesh;
  EXPECT_EQ(mesh.nodes.cols(), 9);
  EXPECT_NEAR((mesh.nodes.col(1) - Vector3d(10, 1, 0)).norm(), 0, 1e-14);  // (1, 0, 0) moved and turned
  EXPECT_EQ(node_set(mesh, "Set-1").size(), 4U);
  EXPECT_EQ(node_set(mesh, "Block-1.Set-1"), std::vector<int>{0});
  ASSERT_EQ(mesh.rigid_connections.size(), 1U);
  EXPECT_NEAR(mesh.nodes(2, mesh.rigid_connections[0].reference), 5, 0);
  EXPECT_EQ(mesh.supports.size(), 3U);
  EXPECT_NEAR(total_mass(mesh), 8000, 1e-9);
}

TEST(Abaqus, CurvedBeamsAreSaidToBeTwoStraightHalves) {
  const auto noted = [](const std::string& middle) {
    return has_note(
        read("*NODE\n1, 0, 0, 0\n2, 1, " + middle + ", 0\n3, 2, 0, 0\n*ELEMENT, TYPE=B32, ELSET=E\n1, 1, 2, 3\n" +
             steel + "*BEAM SECTION, ELSET=E, MATERIAL=Steel, SECTION=RECT\n0.1, 0.2\n"),
        "beams with three nodes are curved");
  };
  EXPECT_TRUE(noted("0.1"));
  EXPECT_FALSE(noted("0"));
}

// By 90 degrees about z, so that x of the part is y of the assembly.
TEST(Abaqus, DirectionsOfAPartTurnWithItsInstance) {
  const auto deck = [](const std::string& of_part, const std::string& position, const std::string& after) {
    return read(
               "*PART, NAME=P\n*NODE\n1, 0, 0, 0\n2, 0, 0, 1\n*ELEMENT, TYPE=B31, ELSET=E\n1, 1, 2\n"
               "*BEAM SECTION, ELSET=E, MATERIAL=Steel, SECTION=RECT\n0.1, 0.2\n1, 0, 0\n" +
               of_part + "*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=I, PART=P\n" + position +
               "*END INSTANCE\n*END ASSEMBLY\n" + steel + after)
        .mesh;
  };
  const std::string turned = "5, 0, 0\n5, 0, 0, 5, 0, 1, 90\n", slide = "*NSET, NSET=T\n2\n*TRANSFORM, NSET=T";
  const Mesh section = deck("", turned, "");
  EXPECT_NEAR((section.beam_properties[0].y_axis - Vector3d(0, 1, 0)).norm(), 0, 1e-15);
  // Along (1, 1, 0) of the part, which is (-1, 1, 0).
  const Mesh plane = deck(slide + "\n1, 1, 0, -1, 1, 0\n", turned, "*BOUNDARY\nI.2, 1\n");
  ASSERT_EQ(plane.equations.size(), 1U);
  ASSERT_EQ(plane.equations[0].terms.size(), 2U);
  EXPECT_NEAR(plane.equations[0].terms[0].coefficient * plane.equations[0].terms[1].coefficient, -0.5, 1e-15);
  // The axis runs through (1, 0, z) of the part, which is (5, 1, z): the radius to node 2 is along -y.
  const Mesh radius = deck(slide + ", TYPE=C\n1, 0, 0, 1, 0, 1\n", turned, "*BOUNDARY\nI.2, 1\n");
  EXPECT_EQ(held(radius, 2), "2");
  const std::string equation = "*EQUATION\n2\n1, 1, 1., 2, 2, 1.\n";
  EXPECT_EQ(deck(equation, "5, 0, 0\n", "").equations.size(), 1U);
  EXPECT_NE(input_error([&] { deck(equation, turned, ""); }).find("whose instance is rotated"), std::string::npos);
}

TEST(Abaqus, IncludesAreRelativeToTheIncludingFile) {
  const std::string path = test_deck("include_main.inp").string();
  const MeshFile file = read_abaqus(file_bytes(path), path);
  EXPECT_EQ(file.mesh.elements.size(), 1U);
  EXPECT_EQ(file.modes, 4);
  EXPECT_EQ(node_set(file.mesh, "Nall").size(), 8U);
}

TEST(Abaqus, ExplosionsOfSmallDecksAreStopped) {
  std::string text = cube + "*NSET, NSET=Huge, GENERATE\n1, 900000000000, 1\n";  // only what exists
  EXPECT_EQ(node_set(read(text).mesh, "Huge").size(), 8U);
  for (int i = 0; i < 40; ++i) {  // each twice the one before
    const std::string last = i == 0 ? "Nall" : fmt::format("S{}", i - 1);
    text += fmt::format("*NSET, NSET=S{}\n{}, {}\n", i, last, last);
  }
  EXPECT_NE(input_error([&] { read(text); }).find("grow beyond"), std::string::npos);

  std::string many = cube;  // few members each, all numbers of a wide range gone through
  for (int i = 0; i < 200'000; ++i) many += fmt::format("*NODE\n{}\n", 9 + 1000L * i);
  for (int i = 0; i < 2000; ++i) many += fmt::format("*NSET, NSET=S{}, GENERATE\n1, 900000000000, 1\n", i);
  EXPECT_NE(input_error([&] { read(many); }).find("numbers are generated up to here"), std::string::npos);
  std::string squares = cube_nodes.substr(0, cube_nodes.find("*Element"));  // n nodes in n sets
  squares.replace(squares.find("nset = Nall"), 11, "NSET=Nall");
  for (int i = 9; i < 20'000; ++i) squares += fmt::format("{}\n", i);
  squares += cube.substr(cube.find("*Element"));
  for (int i = 0; i < 20'000; ++i) squares += fmt::format("*NSET, NSET=S{}\nNall\n", i);
  EXPECT_NE(input_error([&] { read(squares); }), "nothing was thrown");
}

// Lines "deck -> message without the folder".
TEST(Decks, BrokenOnesAreReportedAsExpected) {
  const std::filesystem::path folder = std::filesystem::path(FLEXBOOM_TEST_DATA) / "fem" / "broken_decks";
  std::ifstream expected(folder / "expected.txt");
  size_t count = 0;
  for (std::string line; std::getline(expected, line);) {
    const size_t arrow = line.find(" -> ");
    if (line.starts_with('#') || arrow == std::string::npos) continue;
    std::string message = input_error([&] { read_mesh(folder / line.substr(0, arrow)); });
    const std::string prefix = folder.string() + "/";
    for (size_t at = 0; (at = message.find(prefix, at)) != std::string::npos;) message.erase(at, prefix.size());
    EXPECT_EQ(message, line.substr(arrow + 4)) << line.substr(0, arrow);
    ++count;
  }
  size_t decks = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    decks += entry.path().extension() == ".inp" || entry.path().extension() == ".bdf";
  EXPECT_EQ(count, decks);
  EXPECT_GE(count, 70U);
}

}  // namespace
}  // namespace flexboom::testing
