#include "fem/base/files.hpp"
#include "fem/base/text_reader.hpp"
#include "fem/formats/vtk/vtk.hpp"
#include "mesh_file_testing.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <cstdint>
#include <cstdlib>

namespace flexboom::testing {
namespace {

Mesh with_everything(const ElementType& row, int order) {
  Mesh mesh = two_elements(row, order);
  mesh.supports = {{0, {true, false, true, false, false, true}}};
  NodalBody body{1, 2.5, Eigen::Vector3d(3, 4, 5).asDiagonal(), {0.1, 0.2, 1.0 / 3}};
  body.inertia(0, 1) = body.inertia(1, 0) = 0.25;
  mesh.bodies = {body};
  if (row.shape == Shape::line) mesh.beam_properties[1].line_mass = 0.25;
  for (Eigen::Index i = 0; i < mesh.nodes.cols(); ++i) mesh.node_labels.push_back(100 + 3 * i);
  mesh.element_labels = {7, 123456789012};
  return mesh;
}

void expect_same_beams(const Mesh& mesh, const Mesh& expected) {
  ASSERT_EQ(mesh.beam_properties.size(), expected.beam_properties.size());
  for (size_t i = 0; i < mesh.beam_properties.size(); ++i) {
    const BeamProperty &a = mesh.beam_properties[i], &b = expected.beam_properties[i];
    EXPECT_EQ(a.theory, b.theory);
    EXPECT_EQ(a.material.E, b.material.E);
    EXPECT_EQ(a.shear.name, b.shear.name);
    EXPECT_EQ(a.shear.value, b.shear.value);
    EXPECT_EQ(a.rotary_inertia, b.rotary_inertia);
    EXPECT_EQ(a.y_axis, b.y_axis);
    EXPECT_EQ(a.line_mass, b.line_mass);
    for (const auto& [x, y] : {std::pair{a.start, b.start}, {a.end, b.end}}) {
      ASSERT_EQ(x.index(), y.index());
      const Section s = section_of(x, 0.3, {}), t = section_of(y, 0.3, {});
      EXPECT_EQ(s.A, t.A);
      EXPECT_EQ(s.Iy, t.Iy);
      EXPECT_EQ(s.Iz, t.Iz);
    }
  }
}

TEST(Vtu, RoundTripOfEveryRowAndOrder) {
  const Folder folder;
  for (const ElementType& row : element_types()) {
    for (const int order : row.orders()) {
      SCOPED_TRACE(std::string(row.name) + " of order " + std::to_string(order));
      const Mesh mesh = with_everything(row, order);
      write_mesh(folder.path / "m.vtu", mesh);
      const MeshFile file = read_mesh(folder.path / "m.vtu");
      const Mesh& read = file.mesh;
      EXPECT_TRUE(file.notes.empty());
      expect_same(read, mesh, row.name == "hex" && order > 2 ? 1e-13 : 0);  // only there are nodes moved and back
      EXPECT_EQ(read.node_labels, mesh.node_labels);
      EXPECT_EQ(read.element_labels, mesh.element_labels);
      ASSERT_EQ(read.solid_properties.size(), mesh.solid_properties.size());
      for (size_t i = 0; i < mesh.solid_properties.size(); ++i) {
        EXPECT_EQ(read.solid_properties[i].name, mesh.solid_properties[i].name);
        EXPECT_EQ(read.solid_properties[i].material.E, mesh.solid_properties[i].material.E);
        EXPECT_EQ(read.solid_properties[i].material.nu, mesh.solid_properties[i].material.nu);
        EXPECT_EQ(read.solid_properties[i].material.rho, mesh.solid_properties[i].material.rho);
      }
      expect_same_beams(read, mesh);
      ASSERT_EQ(read.supports.size(), 1U);
      EXPECT_EQ(read.supports[0].components, mesh.supports[0].components);
      ASSERT_EQ(read.bodies.size(), 1U);
      EXPECT_EQ(read.bodies[0].node, 1);
      EXPECT_EQ(read.bodies[0].mass, 2.5);
      EXPECT_EQ(read.bodies[0].inertia, mesh.bodies[0].inertia);
      EXPECT_EQ(read.bodies[0].offset, mesh.bodies[0].offset);
    }
  }
}

// Mass, first moment and inertia about the node of all bodies on it, before and after.
TEST(Vtu, BodiesOnOneNodeBecomeOne) {
  const Folder folder;
  Mesh mesh = two_elements(element_types()[0], 4);
  mesh.bodies = {{1, 2, Eigen::Vector3d(3, 4, 5).asDiagonal(), {1, 0, 0}},
                 {1, 6, Eigen::Vector3d(1, 2, 2).asDiagonal(), {0, -1, 0.5}}};
  write_mesh(folder.path / "m.vtu", mesh);
  const Mesh read = read_mesh(folder.path / "m.vtu").mesh;
  ASSERT_EQ(read.bodies.size(), 1U);
  const auto about_node = [](const std::vector<NodalBody>& bodies) {
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
    for (const NodalBody& b : bodies)
      inertia +=
          b.inertia + b.mass * (b.offset.squaredNorm() * Eigen::Matrix3d::Identity() - b.offset * b.offset.transpose());
    return inertia;
  };
  EXPECT_EQ(read.bodies[0].mass, 8);
  EXPECT_LT((read.bodies[0].offset - Eigen::Vector3d(2, -6, 3) / 8).norm(), 1e-15);
  EXPECT_LT((about_node(read.bodies) - about_node(mesh.bodies)).norm(), 1e-13 * about_node(mesh.bodies).norm());
}

// The field of a polynomial of the order takes its values at the points that the file has, not at the nodes.
TEST(Vtu, PointValuesBelongToThePoints) {
  const ElementType& hex = row_named("hex");
  for (const int order : hex.orders()) {
    const Mesh mesh = two_elements(hex, order);
    const Eigen::Matrix3Xd points = vtk_grid(mesh).points;
    const Eigen::MatrixXd values = vtk_point_values(mesh, mesh.nodes.topRows(2));
    EXPECT_LT((values - points.topRows(2)).cwiseAbs().maxCoeff(), 1e-13);
    // Equally spaced: the second node of an edge is 1 / order of the way, seen in the reference element.
    Mesh straight = mesh;
    straight.nodes.leftCols(mesh.nodes.cols() / 2) = reference_nodes(hex, order);
    EXPECT_NEAR(vtk_grid(straight).points(0, 1), -1 + 2.0 / order, 1e-14);
  }
}

// One file of every row and order, of more than 10 000 points, and with cells of three shapes, opened by meshio and by
// VTK, which measures their volumes.
TEST(Vtu, MeshioAndVtkOpenEveryCell) {
  const Folder folder;
  for (const ElementType& row : element_types()) {
    for (const int order : row.orders()) {
      if (row.shape == Shape::line && order > 1) continue;  // the same line
      const std::string name = std::string(row.name) + "_" + std::to_string(order);
      Mesh mesh = two_elements(row, order);
      write_mesh(folder.path / (name + ".vtu"), mesh);
      const double size = row.shape == Shape::line ? 4 : volume(mesh, 6);
      write_file(folder.path / (name + ".txt"), std::to_string(mesh.nodes.cols()) + " " + fmt::format("{:.17g}", size));
    }
  }
  VtkGrid grid = vtk_grid(two_elements(row_named("hex20"), 2));
  const Eigen::Index few = grid.points.cols();
  grid.points.conservativeResize(3, 10001);
  for (Eigen::Index i = few; i < 10001; ++i) grid.points.col(i).setConstant(static_cast<double>(i) / 3);
  grid.point_data = {{"third", grid.points.topRows(2)}};
  grid.point_groups = {{"set:last", {10000}}};
  grid.cells.push_back({10, {0, 1, 2, 4}});  // a row of another length
  write_vtu(folder.path / "large.vtu", grid);
  const std::string command =
      std::string(FLEXBOOM_PYTHON) + " " + FLEXBOOM_TEST_DATA + "/fem/vtu_open.py " + folder.path.string();
  EXPECT_EQ(std::system(command.c_str()), 0);
}

// Every way that VTK and meshio write the mesh of a file of ours comes back.
TEST(Vtu, ReadsWhatMeshioAndVtkWrite) {
  const Folder folder;
  for (const auto& [name, order] : {std::pair{"hex8", 1}, {"tet10", 2}, {"hex", 3}}) {
    Mesh mesh = two_elements(row_named(name), order);
    mesh.node_sets = {{"root", {0, 1}}};  // meshio does not escape names
    mesh.solid_properties[1].name = "other";
    write_mesh(folder.path / "in.vtu", mesh);
    const std::string command = std::string(FLEXBOOM_PYTHON) + " " + FLEXBOOM_TEST_DATA + "/fem/vtu_rewrite.py " +
                                (folder.path / "in.vtu").string() + " " + folder.path.string();
    ASSERT_EQ(std::system(command.c_str()), 0);
    int count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path)) {
      if (!entry.path().filename().string().starts_with("out_")) continue;
      SCOPED_TRACE(std::string(name) + " " + entry.path().filename().string());
      expect_same(read_mesh(entry.path()).mesh, mesh, 1e-11);  // the digits of meshio's ASCII
      ++count;
    }
    EXPECT_EQ(count, 17);
  }
}

TEST(Vtu, ForeignGroupsBecomeSets) {
  const std::string text = R"(<VTKFile type="UnstructuredGrid" version="0.1"><UnstructuredGrid>
<Piece NumberOfPoints="6" NumberOfCells="3"><Points>
<DataArray type="Float32" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 0 0 1 1 1 1 9 9 9</DataArray></Points>
<Cells><DataArray type="Int32" Name="connectivity" format="ascii">0 1 2 0 1 2 3 1 2 3 4</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii">3 7 11</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">5 10 10</DataArray></Cells>
<CellData><DataArray type="Int32" Name="gmsh:physical" format="ascii">4 7 8</DataArray>
<DataArray type="Float64" Name="cell_tags" format="ascii">1 1 1</DataArray></CellData>
</Piece></UnstructuredGrid></VTKFile>)";
  const MeshFile file = read_vtu(text, "foreign.vtu");
  EXPECT_EQ(file.mesh.elements.size(), 2U);
  EXPECT_EQ(file.mesh.nodes.cols(), 5);
  EXPECT_EQ(file.mesh.element_sets, (std::map<std::string, std::vector<int>>{{"7", {0}}, {"8", {1}}}));
  EXPECT_EQ(file.mesh.node_sets, (std::map<std::string, std::vector<int>>{{"4", {0, 1, 2}}}));
  ASSERT_EQ(file.mesh.solid_properties.size(), 2U);
  EXPECT_EQ(file.mesh.solid_properties[1].name, "8");
  EXPECT_EQ(file.mesh.elements[1].property, 1);
  EXPECT_EQ(file.notes, std::vector<std::string>{"1 node of no element was left out"});
}

// Wedges that count their triangles as vtkQuadraticWedge does are turned, not refused.
TEST(Vtu, WedgesOfEitherConventionAreRightSideOut) {
  const Folder folder;
  const Mesh mesh = two_elements(row_named("wedge6"), 1);
  VtkGrid grid = vtk_grid(mesh);
  for (VtkGrid::Cell& cell : grid.cells) {
    std::swap(cell.points[1], cell.points[2]);
    std::swap(cell.points[4], cell.points[5]);
  }
  write_vtu(folder.path / "w.vtu", grid);
  EXPECT_NEAR(volume(read_mesh(folder.path / "w.vtu").mesh), volume(mesh), 1e-12);
}

TEST(Vtu, ConnectionsCannotBeHeld) {
  const Folder folder;
  Mesh mesh = two_elements(row_named("tet4"), 1);
  mesh.rigid_connections.push_back({2, {3}});
  EXPECT_EQ(input_error([&] { write_mesh(folder.path / "x.vtu", mesh); }),
            "cannot write " + (folder.path / "x.vtu").string() +
                ": a .vtu file cannot hold a rigid connection (node 2); write .inp");
}

// Zeros pack to a thousandth: a file of kilobytes could ask for gigabytes.
TEST(Vtu, ZerosThatUnpackBeyondMeasureAreRefused) {
  const std::uint64_t points = 3'200'000, size = points * 3 * sizeof(double);
  const std::string zeros(size, '\0');
  auto packed_size = ::compressBound(size);
  std::string packed(packed_size, '\0');
  ASSERT_EQ(::compress(reinterpret_cast<Bytef*>(packed.data()), &packed_size,
                       reinterpret_cast<const Bytef*>(zeros.data()), size),
            Z_OK);
  packed.resize(packed_size);
  std::string data;
  for (const std::uint64_t number : {std::uint64_t{1}, size, std::uint64_t{0}, std::uint64_t{packed_size}})
    data.append(reinterpret_cast<const char*>(&number), sizeof number);
  const Folder folder;
  write_file(folder.path / "bomb.vtu",
             fmt::format("<VTKFile type=\"UnstructuredGrid\" header_type=\"UInt64\" "
                         "compressor=\"vtkZLibDataCompressor\"><UnstructuredGrid>\n"
                         "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"1\"><Points>\n"
                         "<DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/>"
                         "</Points><Cells>\n"
                         "<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray>\n"
                         "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4</DataArray>\n"
                         "<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10</DataArray>\n"
                         "</Cells></Piece></UnstructuredGrid><AppendedData encoding=\"raw\">_{}",
                         points, data + packed));
  const std::string message = input_error([&] { read_mesh(folder.path / "bomb.vtu"); });
  EXPECT_NE(message.find("unpack to 76800000 bytes, more than 64 times the file"), std::string::npos) << message;
}

}  // namespace
}  // namespace flexboom::testing
