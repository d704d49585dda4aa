#include "fem/formats/nastran/read.hpp"

#include "deck_testing.hpp"
#include "fem/base/files.hpp"

#include <fmt/format.h>

namespace flexboom::testing {
namespace {

using Eigen::Vector3d;

MeshFile read(const std::string& text) { return read_nastran(text, "deck.bdf"); }

const std::string tet = R"(CTETRA         1       7       1       2       4       5
PSOLID         7       3
MAT1           3  2.1+11              .3   6000.
)";
const std::string small = R"($ a comment
GRID           1              0.      0.      0.
GRID           2             1.0      0.      0.
GRID           4              0.   1.0+0      0. $ another
GRID           5              0.      0.   1.D+0
)" + tet;

TEST(Nastran, FixedLargeAndFreeFieldsSayTheSame) {
  const std::string large =
      "GRID*                  1                              0.              0.\n*                     0.\n"
      "GRID*                  2                              1.              0.*A\n*A                    0.\n"
      "grid*                  4                              0.            .1+1\n*                    0.0\n"
      "GRID*                  5                              0.              0.\n*                  1.-0\n" +
      tet;
  const std::string free =
      "GRID,1,,0.,0.,0.\nGRID, 2, , 1., 0., 0.\nGRID*,4,,0.,1.\n*,0.\nGRID,5,,0.,0.,10.-1\n"
      "CTETRA,1,7,1,2,4,\n+,5\nPSOLID,7,3\nMAT1,3,2.1+11,,.3,6000.\n";
  std::string broken_lines = free;
  broken_lines.replace(broken_lines.find("2,4,\n+,5"), 8, "2,4,5");
  std::string tabs = small;
  tabs.replace(tabs.find("GRID           2             1.0"), 32, "GRID\t2\t\t1.0");
  const Mesh expected = read(small).mesh;
  EXPECT_NEAR(total_mass(expected), 1000, 1e-9);
  for (const std::string& text : {large, broken_lines, tabs}) {
    const Mesh mesh = read(text).mesh;
    EXPECT_EQ(mesh.nodes, expected.nodes);
    EXPECT_EQ(mesh.elements[0].nodes, expected.elements[0].nodes);
    EXPECT_EQ(mesh.solid_properties[0].material.E, 2.1e11);
    EXPECT_EQ(mesh.solid_properties[0].material.rho, 6000);
  }
}

// Three bars in a plane, along (1, 1, 0) and with their y axis in the plane or normal to it.
std::string frame(const std::string& direction, const std::string& systems, const std::string& supports) {
  std::string text = systems;
  for (int i = 0; i < 4; ++i) text += fmt::format("GRID,{},,{}.,{}.,0.\n", i + 1, i, i);
  for (int i = 0; i < 3; ++i) text += fmt::format("CBAR,{},1,{},{},{}\n", i + 1, i + 1, i + 2, direction);
  return text + "PBAR,1,1,1.-4,1.-8,2.-8,3.-8\n,0.,0.,0.,0.,0.,0.,0.,0.\n,.85,.85\nMAT1,1,7.+10,,.3,2700.\n" + supports;
}

TEST(Nastran, FieldsThatAreHeldEverywhereAreHeldInsideElements) {
  const auto free_of = [](const std::string& text) {
    const Mesh mesh = read(text).mesh;
    return unknowns(mesh, assemble(mesh).dofs, {}).count;
  };
  constexpr int bubbles = 4, bending = 9;  // of order 4
  const std::string root = "SPC1,1,126,1\n", plane = "SPC1,1,345,1,THRU,4\n";
  for (const std::string direction : {"0.,0.,1.", "-1.,1.,0."}) {
    for (const std::string& text : {frame(direction, "GRDSET,,,,,,,345\n", root), frame(direction, "", root + plane)})
      EXPECT_EQ(free_of(text), 9 + 3 * (bubbles + bending)) << direction;
    // Torsion alone, about an axis that is none of the mesh, is not held by components of the mesh.
    EXPECT_EQ(free_of(frame(direction, "", "SPC1,1,123456,1\nSPC1,1,4,2,THRU,4\n")), 15 + 3 * 2 * (bubbles + bending));
    EXPECT_EQ(free_of(frame(direction, "", "SPC1,1,45,1,THRU,4\n")), 16 + 3 * (bubbles + 2 * bending));
    EXPECT_EQ(free_of(frame(direction, "", root)), 21 + 3 * 2 * (bubbles + bending));
  }
  // All nodes held: what is left are vibrations between supports.
  EXPECT_EQ(free_of(frame("0.,0.,1.", "", "SPC1,1,123456,1,THRU,4\n")), 3 * 2 * (bubbles + bending));
}

TEST(Nastran, ZeroCoefficientsOfMpcsAreSaid) {
  const std::string first = input_error([] { read(small + "MPC,1,1,1,0.,2,1,1.\n"); });
  EXPECT_NE(first.find("the first coefficient must not be zero"), std::string::npos) << first;
  EXPECT_TRUE(has_note(read(small + "MPC,1,1,1,1.,2,1,0.\n"), "coefficient zero"));
}

TEST(Nastran, ADeckThatIsCutOffIsSaid) {
  const std::string whole = "SOL 103\nCEND\nBEGIN BULK\n" + small;
  EXPECT_TRUE(has_note(read(whole), "no ENDDATA"));
  EXPECT_FALSE(has_note(read(whole + "ENDDATA\n"), "no ENDDATA"));
  EXPECT_FALSE(has_note(read(small), "no ENDDATA")) << "bulk data alone, as in a file that is included";
}

TEST(Nastran, MassesThatCannotBeAreNamed) {
  const std::string message = input_error([] { read(small + "CONM2,9,1,,2.,,,,\n,1.,,1.,,,9.\n"); });
  EXPECT_TRUE(message.starts_with("deck.bdf:")) << message;
  EXPECT_NE(message.find("CONM2: inertia breaks the triangle inequality"), std::string::npos) << message;
}

TEST(Nastran, CaseControlSelectsSupportsAndModes) {
  const std::string sets =
      "SPC1,2,123,1,THRU,4\nSPC,3,5,13,0.,4,2,0.1\nSPCADD,9,2,3\nEIGRL,1,,,6\nEIGRL,5,0.1,,8\nENDDATA\nJUNK\n";
  const auto deck = [&](const std::string& selection) {
    return "NASTRAN x\nSOL 103\nCEND\nTITLE = modes\nSUBCASE 1\n" + selection + "BEGIN BULK\n" + small + sets;
  };
  const MeshFile two = read(deck("  SPC = 2\n METHOD(STRUCTURE)=5\n"));
  EXPECT_EQ(two.modes, 8);
  EXPECT_TRUE(has_note(two, "limits of frequency"));
  EXPECT_EQ(held(two.mesh, 1) + held(two.mesh, 2) + held(two.mesh, 4) + held(two.mesh, 5), "123123123");
  EXPECT_EQ(node_set(two.mesh, "SPC_2").size(), 3U);
  const Mesh sum = read(deck("SPC=9\nMETHOD=1\n")).mesh;
  EXPECT_EQ(held(sum, 5), "13");
  EXPECT_EQ(sum.supports.size(), 4U);
  const MeshFile only = read(small + "SPC1,4,1,2\nEIGR,1,LAN,,,,7\n");
  EXPECT_EQ(held(only.mesh, 2), "1");
  EXPECT_EQ(only.modes, 7);
  EXPECT_TRUE(has_note(only, "the only set, 4, is used"));
  // Nastran leaves out what a case control does not select.
  for (const char* unselected : {"SPC1,2,123,1\n", "MPC,2,1,1,1.,2,1,1.\n"}) {
    const std::string message =
        input_error([&] { read("SOL 103\nCEND\nMETHOD=1\nBEGIN BULK\n" + small + unselected); });
    EXPECT_NE(message.find("sets 2, and without that Nastran leaves them out"), std::string::npos) << message;
  }
}

TEST(Nastran, PermanentSupportsAndDefaultsOfGrids) {
  std::string text = small;
  text.replace(text.find("GRID           5              0.      0.   1.D+0"), 48, "GRID,5,,0.,0.,1.,,12");
  const Mesh mesh = read("GRDSET,,,,,,,3\n" + text).mesh;
  EXPECT_EQ(held(mesh, 5), "12");
  EXPECT_EQ(held(mesh, 1), "3");
}

struct Kind {
  std::string card, row;
  std::vector<int> order;  // of our nodes in the card
};

class NastranKind : public ::testing::TestWithParam<Kind> {};

// Wrong places of the nodes on edges would bend the element: its volume and the signs of its Jacobian tell.
TEST_P(NastranKind, QuadraticElementHasItsVolume) {
  const ElementType& row = row_named(GetParam().row);
  const Eigen::Matrix3Xd nodes = reference_nodes(row, 2);
  std::string text = "PSOLID,7,3\nMAT1,3,2.1+11,,.3,6000.\n", element = GetParam().card + ",1,7";
  for (int i = 0; i < nodes.cols(); ++i)
    text += fmt::format("GRID,{},,{:.3f},{:.3f},{:.3f}\n", i + 1, nodes(0, i), nodes(1, i), nodes(2, i));
  for (size_t i = 0; i < GetParam().order.size(); ++i)
    element += fmt::format(",{}{}", i % 8 == 6 ? "+\n+," : "", GetParam().order[i]);
  const Mesh mesh = read(text + element + "\n").mesh;
  EXPECT_EQ(type_of(mesh.elements[0]).name, row.name);
  mesh.validate();
  EXPECT_NEAR(volume(mesh), row.shape == Shape::hexahedron ? 8 : row.shape == Shape::wedge ? 1 : 1.0 / 6, 1e-12);
  for (int i = 0; i < nodes.cols(); ++i) {
    const int node = mesh.elements[0].nodes[static_cast<size_t>(i)];
    EXPECT_NEAR((mesh.nodes.col(node) - nodes.col(i)).norm(), 0, 1e-12) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, NastranKind,
    ::testing::Values(Kind{"CTETRA", "tet10", {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}},
                      Kind{"CHEXA", "hex20", {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 17, 18, 19, 20, 13, 14, 15, 16}},
                      Kind{"CPENTA", "wedge15", {1, 2, 3, 4, 5, 6, 7, 8, 9, 13, 14, 15, 10, 11, 12}}),
    [](const auto& kind) { return kind.param.card; });

const std::string mast = "GRID,1,,0.,0.,0.\nGRID,2,,0.,0.,2.\nMAT1,3,2.1+11,,.3,8000.\n";

TEST(Nastran, BarsAndTheirPlanes) {
  const Mesh bar = read(mast + "PBAR,8,3,.01,4.-5,1.-5,2.-5\nCBAR,1,8,1,2,1.,0.,0.\n").mesh;
  ASSERT_EQ(bar.elements.size(), 1U);
  EXPECT_EQ(type_of(bar.elements[0]).name, "beam-euler-bernoulli");  // no K1, K2: rigid in shear
  const BeamProperty& property = bar.beam_properties[0];
  EXPECT_EQ(property.y_axis, Vector3d::UnitX());
  EXPECT_EQ(section_of(property.start, 0.3, {}).Iz, 4e-5);  // I1: bending in the plane of the vector
  EXPECT_EQ(section_of(property.start, 0.3, {}).Iy, 1e-5);
  EXPECT_NEAR(total_mass(bar), 160, 1e-10);
  EXPECT_EQ(bar.element_sets.at("PBEAM_8"), std::vector<int>{0});
  // By a node, with shear factors and nonstructural mass.
  const Mesh node = read(mast + "GRID,3,,0.,5.,0.\nPBAR,8,3,.01,4.-5,1.-5,2.-5,10.,\n,\n,.8,.9\nCBAR,1,8,1,2,3\n").mesh;
  EXPECT_EQ(type_of(node.elements[0]).name, "beam-timoshenko");
  EXPECT_EQ(section_of(node.beam_properties[0].start, 0.3, {}).kappa_y, 0.8);
  EXPECT_EQ(node.beam_properties[0].y_axis, Vector3d::UnitY());
  EXPECT_NEAR(total_mass(node), 160 + 20, 1e-10);
  EXPECT_EQ(node.beam_properties[0].material.rho, 8000);  // it turns with nothing: torsion knows nothing of it
  EXPECT_EQ(node.beam_properties[0].line_mass, 10);
  EXPECT_EQ(node.nodes.cols(), 2);
}

TEST(Nastran, BeamsOfConstantSection) {
  const std::string cbeam = "CBEAM,1,8,1,2,1.,0.,0.\n";
  const std::string pbeam =
      "PBEAM,8,3,.01,4.-5,1.-5,,2.-5,\n,,,,,,,,\n,YES,1.,.01,4.-5,1.-5,,2.-5,\n,,,,,,,,\n,.7,.7\n";
  const Mesh mesh = read(mast + pbeam + cbeam).mesh;
  EXPECT_EQ(section_of(mesh.beam_properties[0].start, 0.3, {}).kappa_z, 0.7);
  std::string taper = pbeam;
  taper.replace(taper.find("1.,.01"), 6, "1.,.02");
  EXPECT_NE(input_error([&] { read(mast + taper + cbeam); }).find("deck.bdf:6:9: PBEAM: sections that change"),
            std::string::npos);
}

TEST(Nastran, SectionsByDimensions) {
  const auto section = [](const std::string& type, const std::string& dimensions) {
    const Mesh mesh = read(mast + "PBARL,8,3,," + type + "\n," + dimensions + "\nCBAR,1,8,1,2,1.,0.,0.\n").mesh;
    return section_of(mesh.beam_properties[0].start, 0.3, {});
  };
  EXPECT_NEAR(section("ROD", ".1").A, pi * 0.01, 1e-14);
  EXPECT_NEAR(section("TUBE", ".1,.08").A, pi * (0.01 - 0.0064), 1e-14);
  EXPECT_NEAR(section("TUBE2", ".1,.02").A, pi * (0.01 - 0.0064), 1e-14);
  EXPECT_NEAR(section("BAR", ".1,.4").Iz, 0.1 * 0.064 / 12, 1e-14);  // DIM2 along the vector
  EXPECT_NEAR(section("BOX", ".2,.4,.01,.01").A, 0.08 - 0.18 * 0.38, 1e-14);
}

TEST(Nastran, MassesWithOffsetAndProducts) {
  const std::string beam = mast + "PBAR,8,3,.01,4.-5,1.-5,2.-5\nCBAR,1,8,1,2,1.,0.,0.\n";
  const MeshFile file = read(beam + "CONM2,9,2,,5.,.1,.2,.3,\n,3.,.1,4.,.2,.3,5.\nPARAM,WTMASS,2.\n");
  ASSERT_EQ(file.mesh.bodies.size(), 1U);
  const NodalBody& body = file.mesh.bodies[0];
  EXPECT_EQ(body.mass, 10);
  EXPECT_EQ(body.offset, Vector3d(.1, .2, .3));
  EXPECT_EQ(body.inertia(0, 1), -0.2);  // I21 enters with a minus
  EXPECT_EQ(body.inertia(2, 0), -0.4);
  EXPECT_EQ(body.inertia(2, 1), -0.6);
  EXPECT_EQ(body.inertia(2, 2), 10);
  EXPECT_NEAR(total_mass(file.mesh), 2 * (160 + 5), 1e-10);
  const Mesh absolute = read(beam + "CONM2,9,2,-1,5.,.1,.2,2.3\n").mesh;
  EXPECT_NEAR((absolute.bodies[0].offset - Vector3d(.1, .2, .3)).norm(), 0, 1e-15);
}

/// A dependent grid has no rotations of its own: what is fixed to it is fixed to the grid that it follows.
TEST(Nastran, MassesOnDependentGridsKeepInertiaAndOffset) {
  const std::string beam = mast + "PBAR,8,3,.01,4.-5,1.-5,2.-5\nCBAR,1,8,1,2,1.,0.,0.\nGRID,20,,3.,4.,5.\n";
  const std::string mass = "CONM2,9,20,,5.,.1,.2,.3,\n,3.,.1,4.,.2,.3,5.\n";
  for (const char* rigid : {"RBE2,40,2,123456,20\n", "RBAR,40,2,20,123456,,,123456\n"}) {
    const MeshFile file = read(beam + rigid + mass);
    ASSERT_EQ(file.mesh.bodies.size(), 1U);
    const NodalBody& body = file.mesh.bodies[0];
    EXPECT_EQ(body.node, node_labelled(file.mesh, 2));
    EXPECT_EQ(body.offset, Vector3d(3.1, 4.2, 5.3) - file.mesh.nodes.col(body.node));
    EXPECT_EQ(body.inertia(1, 1), 4);
    EXPECT_FALSE(has_note(file, "point mass"));
  }
  EXPECT_TRUE(has_note(read(beam + "RBE2,40,2,123,20\n" + mass), "point mass")) << "its rotations follow nothing";
}

TEST(Nastran, RigidElements) {
  const std::string hub = small + "GRID,20,,3.,3.,3.\nCONM2,30,20,,5.\n";
  const Mesh rigid = read(hub + "RBE2,40,20,123,1,2,4,1.2-5\n").mesh;
  ASSERT_EQ(rigid.rigid_connections.size(), 1U);
  EXPECT_EQ(rigid.rigid_connections[0].nodes.size(), 3U);
  EXPECT_EQ(rigid.rigid_connections[0].components, (Components{true, true, true, false, false, false}));
  EXPECT_EQ(node_set(rigid, "RBE2_40").size(), 3U);
  EXPECT_LT(rigid_residual(rigid), 1e-12);
  const Mesh mean = read(hub + "RBE3,40,,20,123456,1.,123,1,2,\n,4,2.,123,5\n").mesh;
  ASSERT_EQ(mean.distributing_connections.size(), 1U);
  EXPECT_EQ(mean.distributing_connections[0].weights, (std::vector<double>{1, 1, 1, 2}));
  EXPECT_LT(rigid_residual(mean), 1e-12);
  const Mesh bar = read(hub + "RBAR,40,20,1,123456,,,123\n").mesh;
  EXPECT_EQ(bar.rigid_connections[0].nodes, std::vector<int>{node_labelled(bar, 1)});
}

TEST(Nastran, EquationsOverSeveralLines) {
  const Mesh mesh = read(small + "MPC,6,1,1,1.,2,1,-.5,\n,,4,1,-.25,5,1,-.25\n").mesh;
  ASSERT_EQ(mesh.equations.size(), 1U);
  ASSERT_EQ(mesh.equations[0].terms.size(), 4U);
  EXPECT_EQ(mesh.equations[0].terms[2].node, node_labelled(mesh, 4));
  EXPECT_EQ(mesh.equations[0].terms[3].coefficient, -0.25);
}

TEST(Nastran, GridsInOtherSystems) {
  std::string text = small;
  text.replace(text.find("GRID           2             1.0      0.      0."), 48, "GRID,2,11,2.,90.,-1.");
  text.replace(text.find("GRID           5              0.      0.   1.D+0"), 48, "GRID,5,12,1.,90.,90.");
  // System 10: moved along x, its z along x; 11: cylinder in it; 12: spherical in the basic one.
  const Mesh mesh = read(
                        "CORD2R,10,0,2.,0.,0.,3.,0.,0.,\n,2.,1.,0.\nCORD2C,11,10,0.,0.,0.,0.,0.,1.,\n,1.,0.,0.\n"
                        "CORD2S,12,,0.,0.,0.,1.,0.,0.,\n,0.,1.,0.\n" +
                        text)
                        .mesh;
  // In 10: axes z = x, x = y, y = z of the basic system; (2, 90 deg, -1) is (0, 2, -1) there.
  EXPECT_NEAR((mesh.nodes.col(node_labelled(mesh, 2)) - Vector3d(1, 0, 2)).norm(), 0, 1e-14);
  // In 12: (r, theta from z, phi from x) = (1, 90, 90) is its y axis, z of the basic system.
  EXPECT_NEAR((mesh.nodes.col(node_labelled(mesh, 5)) - Vector3d(0, 0, 1)).norm(), 0, 1e-14);
  EXPECT_NE(input_error([&] {
              read("CORD2R,10,10,0.,0.,0.,0.,0.,1.,\n,1.,0.,0.\n" + text + "GRID,9,10,0.,0.,0.\n");
            }).find("coordinate system"),
            std::string::npos);
}

TEST(Nastran, MaterialFromAnyTwoModuli) {
  const auto material = [](const std::string& moduli) {
    std::string text = small;
    text.replace(text.find("MAT1 "), std::string::npos, "MAT1,3," + moduli + ",6000.\n");
    return read(text).mesh.solid_properties[0].material;
  };
  EXPECT_NEAR(material("2.6+9,1.+9,").nu, 0.3, 1e-12);
  EXPECT_NEAR(material(",1.+9,.3").E, 2.6e9, 1e-3);
  EXPECT_NEAR(material("2.6+9,,.3").E, 2.6e9, 1e-3);
}

// Fibres along a bar: its G is not E / (2 (1 + nu)) of any isotropic material. NU does not enter the stiffness of bars.
TEST(Nastran, BarsHaveTheirOwnShearModulus) {
  for (const char* moduli : {"120.+9,5.+9,.3", "120.+9,5.+9,"}) {
    std::string text = mast + "CBAR,1,1,1,2,1.,0.,0.\nPBAR,1,3,1.-4,1.-8,2.-8,3.-8\n";
    text.replace(text.find("2.1+11,,.3"), std::string("2.1+11,,.3").size(), moduli);
    const Material material = read(text).mesh.beam_properties[0].material;
    EXPECT_NEAR(material.shear_modulus(), 5e9, 1e-3) << moduli;
    EXPECT_EQ(material.E, 120e9);
  }
  std::string solid = small;
  solid.replace(solid.find("MAT1 "), std::string::npos, "MAT1,3,120.+9,5.+9,,6000.\n");
  EXPECT_NE(input_error([&] { read(solid); }).find("Poisson's ratio of material 3 is 11; of a solid"),
            std::string::npos);
}

TEST(Nastran, NamesOfHyperMeshAndIncludes) {
  const Mesh mesh = read("$HMNAME PROP                   7\"wing box\" 5\n" + small).mesh;
  EXPECT_EQ(mesh.solid_properties[0].name, "wing box");
  EXPECT_EQ(mesh.element_sets.count("wing box"), 1U);
  const std::string path = test_deck("include_main.bdf").string();
  const MeshFile file = read_nastran(file_bytes(path), path);
  EXPECT_EQ(file.mesh.elements.size(), 1U);
  EXPECT_EQ(file.mesh.supports.size(), 3U);
}

TEST(Nastran, IncludesCannotRunAway) {
  const std::string path = test_deck("include_main.bdf").string();  // included once more at every level
  EXPECT_NE(input_error([&] {
              read_nastran("INCLUDE 'include_main.bdf'\nINCLUDE 'include_main.bdf'\n", path);
            }).find("includes itself"),
            std::string::npos);
}

}  // namespace
}  // namespace flexboom::testing
