#include "fem/formats/gmsh/gmsh.hpp"

#include "fem/base/files.hpp"
#include "fem/formats/common/node_orders.hpp"
#include "mesh_file_testing.hpp"

#include <cstring>

namespace flexboom::testing {
namespace {

constexpr double sector_volume = pi / 12 * (0.2 * 0.2 - 0.1 * 0.1) * 0.05;

struct Sector {
  std::string file, row;
  int order, elements, nodes, root;
  double accuracy;  // of the volume: edges that follow the arc by polynomials of the order
};

class GmshSector : public ::testing::TestWithParam<Sector> {};

TEST_P(GmshSector, HasTheElementsSetsAndVolume) {
  const Sector& sector = GetParam();
  const MeshFile file = read_mesh(test_mesh(sector.file + ".msh"));
  Mesh mesh = file.mesh;
  ASSERT_EQ(std::ssize(mesh.elements), sector.elements);
  EXPECT_EQ(mesh.nodes.cols(), sector.nodes);
  for (const Element& element : mesh.elements) {
    EXPECT_EQ(type_of(element).name, sector.row);
    EXPECT_EQ(element.order, sector.order);
  }
  EXPECT_NEAR(volume(mesh) / sector_volume, 1, sector.accuracy);
  ASSERT_EQ(mesh.solid_properties.size(), 1U);
  EXPECT_EQ(mesh.solid_properties[0].name, "ring");
  EXPECT_EQ(mesh.solid_properties[0].material.E, 0);
  EXPECT_EQ(std::ssize(mesh.element_sets.at("ring")), sector.elements);
  EXPECT_EQ(node_set(mesh, "corner").size(), 1U);
  EXPECT_EQ(std::ssize(node_set(mesh, "root")), sector.root);
  for (const int node : node_set(mesh, "root")) EXPECT_NEAR(mesh.nodes(1, node), 0, 1e-12);
  EXPECT_EQ(std::ssize(node_set(mesh, "inner edge")), std::max(sector.order, 1) + 1);
  mesh.solid_properties[0].material = aluminium;
  mesh.validate();  // no element is inside out
}

// The radial error of an arc of angle a by polynomials of degree p falls like (a/2)^(p+1); the figures were measured,
// and each order is better than the one before.
INSTANTIATE_TEST_SUITE_P(
    Files, GmshSector,
    ::testing::Values(
        Sector{"hex_1_v41", "hex8", 1, 2, 12, 6, 5e-2}, Sector{"hex_1_parametric_v41", "hex8", 1, 2, 12, 6, 5e-2},
        Sector{"hex_1_no_groups_v41", "hex8", 1, 2, 12, 6, 5e-2}, Sector{"hex_2_v41", "hex20", 2, 2, 32, 13, 2e-4},
        Sector{"hex_2_v22", "hex20", 2, 2, 32, 13, 2e-4}, Sector{"hex_2_v41_binary", "hex20", 2, 2, 32, 13, 2e-4},
        Sector{"hex_2_full_v41", "hex27", 2, 2, 45, 15, 2e-4}, Sector{"hex_3_v22", "hex", 3, 2, 112, 28, 3e-5},
        Sector{"hex_3_v41_binary", "hex", 3, 2, 112, 28, 3e-5}, Sector{"hex_4_v41_binary", "hex", 4, 2, 225, 45, 2e-7},
        Sector{"hex_5_v41_binary", "hex", 5, 2, 396, 66, 2e-8},
        Sector{"hex_8_v41_binary", "hex", 8, 2, 1377, 153, 1e-12}, Sector{"wedge_1_v41", "wedge6", 1, 4, 12, 6, 5e-2},
        Sector{"wedge_2_v41", "wedge15", 2, 4, 36, 15, 2e-4}, Sector{"wedge_2_v22", "wedge15", 2, 4, 36, 15, 2e-4},
        Sector{"wedge_2_v41_binary", "wedge15", 2, 4, 36, 15, 2e-4}, Sector{"tet_1_v41", "tet4", 1, 12, 12, 6, 5e-2},
        Sector{"tet_1_v22_binary", "tet4", 1, 12, 12, 6, 5e-2}, Sector{"tet_2_v41", "tet10", 2, 12, 45, 15, 2e-4},
        Sector{"tet_2_v22", "tet10", 2, 12, 45, 15, 2e-4}, Sector{"tet_2_v41_binary", "tet10", 2, 12, 45, 15, 2e-4}),
    [](const auto& test) { return test.param.file; });

// Gmsh puts the nodes of an order at the same places of the arcs, whatever the format.
TEST(Gmsh, FormatsAgree) {
  for (const char* shape : {"hex_2", "wedge_2", "tet_2"}) {
    const Mesh text = read_mesh(test_mesh(std::string(shape) + "_v41.msh")).mesh;
    expect_same(read_mesh(test_mesh(std::string(shape) + "_v22.msh")).mesh, text, 1e-14);  // 16 digits of text
    expect_same(read_mesh(test_mesh(std::string(shape) + "_v41_binary.msh")).mesh, text, 1e-14);
  }
}

// The middle of a straight edge is where its quadratic node must be: root edges of the sector are straight.
TEST(Gmsh, MiddleNodesLieOnTheirEdges) {
  for (const char* file : {"hex_2_v41", "hex_2_full_v41", "wedge_2_v41", "tet_2_v41"}) {
    const Mesh mesh = read_mesh(test_mesh(std::string(file) + ".msh")).mesh;
    for (const Element& element : mesh.elements) {
      const ElementType& row = type_of(element);
      const Eigen::Matrix3Xd reference = reference_nodes(row, 2);
      const Eigen::Matrix3Xd nodes = mesh.nodes(Eigen::all, element.nodes);
      const auto corners = row.shape == Shape::hexahedron ? 8 : row.shape == Shape::wedge ? 6 : 4;
      for (Eigen::Index m = corners; m < reference.cols(); ++m) {
        for (Eigen::Index a = 0; a < corners; ++a) {
          for (Eigen::Index b = 0; b < a; ++b) {
            if ((reference.col(a) + reference.col(b) - 2 * reference.col(m)).norm() > 1e-12) continue;
            // The arc rises 7e-3 above its chord, diagonals bend by up to 9e-3; the next middle is 25e-3 away.
            EXPECT_LT((nodes.col(a) + nodes.col(b) - 2 * nodes.col(m)).norm() / 2, 1e-2) << file << " node " << m;
          }
        }
      }
    }
  }
}

// The same bytes with every number turned round.
TEST(Gmsh, ReadsTheOtherByteOrder) {
  std::string text = "$MeshFormat\n2.2 1 8\n";
  const auto put = [&text](auto value) {
    char bytes[sizeof(value)];
    std::memcpy(bytes, &value, sizeof(value));
    std::reverse(std::begin(bytes), std::end(bytes));
    text.append(bytes, sizeof(value));
  };
  put(1);
  text += "\n$EndMeshFormat\n$Nodes\n4\n";
  const Eigen::Matrix3Xd nodes{{0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 2.5}};
  for (int i = 0; i < 4; ++i) {
    put(10 + i);
    for (int k = 0; k < 3; ++k) put(nodes(k, i));
  }
  text += "\n$EndNodes\n$Elements\n1\n";
  for (const int value : {4, 1, 2, 77, 5, 1, 10, 11, 12, 13}) put(value);
  text += "\n$EndElements\n";
  const Mesh mesh = read_gmsh(text, "turned.msh").mesh;
  EXPECT_EQ(mesh.nodes, nodes);
  EXPECT_EQ(mesh.node_labels, (std::vector<long>{10, 11, 12, 13}));
  EXPECT_EQ(mesh.element_labels, std::vector<long>{77});
  EXPECT_TRUE(mesh.element_sets.contains("5"));  // a group without a name
}

// Version 2.2 lists an element once per group; it must not be there twice.
TEST(Gmsh, ElementOfTwoGroupsIsOneElement) {
  const std::string text =
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n3 1 \"a\"\n3 2 \"b\"\n$EndPhysicalNames\n"
      "$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n9 5 5 5\n$EndNodes\n"
      "$Elements\n3\n1 15 2 3 1 9\n2 4 2 1 1 1 2 3 4\n3 4 2 2 1 1 2 3 4\n$EndElements\n";
  const MeshFile file = read_gmsh(text, "two.msh");
  EXPECT_EQ(file.mesh.elements.size(), 1U);
  EXPECT_EQ(file.mesh.element_sets, (std::map<std::string, std::vector<int>>{{"a", {0}}, {"b", {0}}}));
  EXPECT_EQ(file.mesh.solid_properties.size(), 1U);
  EXPECT_EQ(file.mesh.nodes.cols(), 4);
  EXPECT_EQ(file.notes, (std::vector<std::string>{"node set \"3\" has no node of an element and was left out",
                                                  "1 node of no element was left out"}));
}

TEST(Gmsh, WithoutGroupsEntitiesAreSets) {
  const std::string text =
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
      "$Elements\n2\n1 2 2 0 6 1 2 3\n2 4 2 0 1 1 2 3 4\n$EndElements\n";
  const Mesh mesh = read_gmsh(text, "plain.msh").mesh;
  EXPECT_EQ(mesh.node_sets, (std::map<std::string, std::vector<int>>{{"surface_6", {0, 1, 2}}}));
  EXPECT_TRUE(mesh.element_sets.contains("volume_1"));
}

// What a .msh file holds comes back for every row: shape, order and sets.
TEST(Gmsh, RoundTripOfEveryRow) {
  const Folder folder;
  for (const ElementType& row : element_types()) {
    if (row.shape == Shape::line) continue;
    for (const int order : row.orders()) {
      SCOPED_TRACE(std::string(row.name) + " of order " + std::to_string(order));
      if (row.name.ends_with("-reduced")) continue;
      Mesh mesh = two_elements(row, order);
      mesh.node_sets = {{"root", {0, 1}}, {"tip", {1}}};
      write_mesh(folder.path / "m.msh", mesh);
      const Mesh read = read_mesh(folder.path / "m.msh").mesh;
      EXPECT_NEAR(volume(read) / volume(mesh), 1, 1e-12);  // round-off of positions moved there and back
      mesh.solid_properties.resize(read.solid_properties.size());
      EXPECT_EQ(read.solid_properties[0].name, "steel part");
      EXPECT_EQ(read.solid_properties[1].name, "other <part>");
      mesh.element_sets["steel part"] = {0};
      mesh.element_sets["other <part>"] = {1};
      if (row.name != "hex" || order > 2) expect_same(read, mesh, 1e-14);
    }
  }
}

TEST(Gmsh, BeamsAreLines) {
  const Folder folder;
  Mesh mesh = two_elements(element_types()[0], 4);
  mesh.node_sets = {{"root", {0}}};
  write_mesh(folder.path / "beam.msh", mesh);
  EXPECT_NE(file_bytes(folder.path / "beam.msh").find("1 1 1 1\n"), std::string::npos);
  EXPECT_NE(
      input_error([&] { read_mesh(folder.path / "beam.msh"); }).find("no volume elements (line elements at most)"),
      std::string::npos);
}

TEST(Gmsh, WhatItCannotHoldIsAnInputError) {
  const Folder folder;
  const auto fault = [&folder](const auto& spoil) {
    Mesh mesh = two_elements(row_named("tet4"), 1);
    mesh.node_labels = {10, 11, 12, 13, 14, 15, 16, 17};
    spoil(mesh);
    const std::string text = input_error([&] { write_mesh(folder.path / "x.msh", mesh); });
    return text.substr(text.find("x.msh: ") + 7);
  };
  const std::string end = " (node 12); write .vtu or .inp", deck = " (node 12); write .inp";
  EXPECT_EQ(fault([](Mesh& m) { m.bodies.push_back({2, 1.0}); }), "a .msh file cannot hold a body" + end);
  EXPECT_EQ(fault([](Mesh& m) { m.supports.push_back({2}); }), "a .msh file cannot hold a support" + end);
  EXPECT_EQ(fault([](Mesh& m) {
              m.rigid_connections.push_back({2, {3}});
            }),
            "a .msh file cannot hold a rigid connection" + deck);
  EXPECT_EQ(fault([](Mesh& m) {
              m.distributing_connections.push_back({2, {3}, {1.0}});
            }),
            "a .msh file cannot hold a distributing connection (node 12); no format does");
  EXPECT_EQ(fault([](Mesh& m) {
              m.equations.push_back({{{2, 0, 1.0}}});
            }),
            "a .msh file cannot hold an equation" + deck);
  EXPECT_NE(input_error([&] {
              write_mesh(folder.path / "x.msh", two_elements(row_named("hex20-reduced"), 2));
            }).find("cannot say that hex20-reduced element 0 has reduced integration; write .vtu or .inp"),
            std::string::npos);
  EXPECT_EQ(fault([](Mesh&) {}), "set \"a & \"b\" <c>\": a name in a .msh file cannot have quotes or line ends");
  EXPECT_EQ(fault([](Mesh& m) { m.elements.clear(); }), "the mesh has no elements");
}

}  // namespace
}  // namespace flexboom::testing
