#include "fem/formats/mesh_formats.hpp"

#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "fem/base/text_reader.hpp"
#include "fem/formats/abaqus/write.hpp"
#include "mesh_file_testing.hpp"

#include <sys/resource.h>
#include <sys/stat.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <tuple>

namespace flexboom::testing {
namespace {

const std::filesystem::path broken = std::filesystem::path(FLEXBOOM_TEST_DATA) / "fem" / "broken_meshes";

// Lines "file: message" or "file:line:column: message".
TEST(MeshFile, BrokenFilesAreReportedAsExpected) {
  std::ifstream expected(broken / "expected.txt");
  int count = 0;
  for (std::string line; std::getline(expected, line);) {
    if (line.starts_with('#')) continue;
    const std::string name = line.substr(0, line.find(':'));
    const std::string message = input_error([&] { read_mesh(broken / name); });
    EXPECT_TRUE(message.starts_with(broken.string() + "/" + line)) << message << "\nexpected: " << line;
    ++count;
  }
  const auto files = std::distance(std::filesystem::directory_iterator(broken), {});
  EXPECT_EQ(count, files - 1);  // all but the table itself
}

TEST(MeshFile, UnknownExtensionListsWhatThereIs) {
  EXPECT_EQ(input_error([] { read_mesh("boom.stl"); })
                .find("boom.stl: mesh files of extension \".stl\" are not read; "
                      "there are .msh, "),
            0U);
  EXPECT_EQ(input_error([] { write_mesh("boom.step", {}); }),
            "boom.step: mesh files of extension \".step\" are not written; there are .msh, .inp, .vtu");
  EXPECT_EQ(input_error([] { read_mesh("/nowhere/boom.MSH"); }),
            "cannot read /nowhere/boom.MSH: No such file or directory");
  EXPECT_EQ(input_error([] { read_mesh("boom"); }).find("boom: mesh files of extension \"\" are not read"), 0U);
}

TEST(MeshFile, ExtensionsDifferAndRowsAreComplete) {
  std::vector<std::string_view> extensions;
  for (const MeshFormat& format : mesh_formats()) {
    EXPECT_TRUE(format.read != nullptr || format.write != nullptr) << format.name;
    extensions.insert(extensions.end(), format.extensions.begin(), format.extensions.end());
  }
  std::ranges::sort(extensions);
  EXPECT_EQ(std::ranges::adjacent_find(extensions), extensions.end());
}

// Cut anywhere, a file is an error or still a mesh; it is never anything else.
TEST(MeshFile, CutFilesAreErrors) {
  const Folder folder;
  for (const char* name : {"wedge_2_v22.msh", "hex_2_v41.msh", "tet_2_v41_binary.msh", "tet_1_v22_binary.msh"}) {
    const std::string text = file_bytes(test_mesh(name));
    for (size_t size = 0; size + 20 < text.size(); size += 37) {
      write_file(folder.path / "cut.msh", std::string_view(text).substr(0, size));
      EXPECT_EQ(input_error([&] { read_mesh(folder.path / "cut.msh"); }).find((folder.path / "cut.msh").string()), 0U)
          << name << " cut at " << size;
    }
  }
}

long peak_memory_kb() {
  struct rusage usage {};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

// Whatever a small file announces: the error comes before the memory is taken.
TEST(MeshFile, HugeNumbersInSmallMshFilesTakeLittleTimeAndMemory) {
  const Folder folder;
  const std::filesystem::path file = folder.path / "huge.msh";
  const long before = peak_memory_kb();
  const auto start = std::chrono::steady_clock::now();
  int errors = 0;
  const auto try_to_read = [&](const std::string& text) {
    write_file(file, text);
    try {
      read_mesh(file);
    } catch (const InputError&) {
      ++errors;  // anything else fails the test
    }
  };
  for (const char* name : {"wedge_2_v22.msh", "hex_2_v41.msh"}) {
    const std::string text = file_bytes(test_mesh(name));
    for (size_t begin = 0, end = 0; begin < text.size(); begin = end + 1) {
      end = std::min(text.find_first_of(" \n", begin), text.size());
      const std::string_view token = std::string_view(text).substr(begin, end - begin);
      if (token.empty() || token.find_first_not_of("0123456789") != std::string_view::npos) continue;
      for (const char* huge : {"2147483647", "9223372036854775807"})
        try_to_read(std::string(text).replace(begin, token.size(), huge));
    }
  }
  const std::string binary = file_bytes(test_mesh("tet_1_v22_binary.msh"));
  for (size_t at = 0; at + 4 <= binary.size(); ++at)
    try_to_read(std::string(binary).replace(at, 4, "\xFF\xFF\xFF\x7F"));
  EXPECT_GT(errors, 500);
  EXPECT_LT(peak_memory_kb() - before, 512 << 10);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::minutes(2));
}

TEST(MeshFile, GeometryIsMeshedByGmsh) {
  const Folder folder;
  const std::filesystem::path path = folder.path / "a box.geo";
  write_file(path,
             "SetFactory(\"OpenCASCADE\");\nBox(1) = {0, 0, 0, 1, 2, 3};\nPhysical Volume(\"box\") = {1};\n"
             "Physical Surface(\"root\") = {1};\nMesh.MeshSizeMin = 1;\nMesh.ElementOrder = 2;\n");
  if (std::system("gmsh -version > /dev/null 2>&1") != 0) GTEST_SKIP() << "gmsh is not installed";
  const MeshFile file = read_mesh(path);
  EXPECT_NEAR(volume(file.mesh), 6, 1e-9);
  EXPECT_EQ(type_of(file.mesh.elements[0]).name, "tet10");
  EXPECT_TRUE(file.mesh.node_sets.contains("root"));
  ASSERT_EQ(file.notes.size(), 1U);
  write_file(path, "Box(1 = {0};\n");
  const std::string message = input_error([&] { read_mesh(path); });
  EXPECT_EQ(message.find(path.string() + ": gmsh made no mesh (exit code "), 0U) << message;
}

TEST(MeshFile, MissingGmshIsAnInputError) {
  const Folder folder;
  write_file(folder.path / "x.geo", "Point(1) = {0, 0, 0};\n");
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", folder.path.c_str(), 1);
  const std::string message = input_error([&] { read_mesh(folder.path / "x.geo"); });
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_EQ(message,
            (folder.path / "x.geo").string() + ": to mesh a geometry, the program gmsh must be in PATH (Debian: gmsh)");
}

Mesh clamped(std::string_view row, int order) {
  Mesh mesh = two_elements(row_named(row), order);
  mesh.node_sets = {{"root", {0, 1}}, {"7", {2}}};
  for (BeamProperty& property : mesh.beam_properties) {
    property.rotary_inertia = true;
    property.end = property.start;
    property.shear = {};
  }
  return mesh;
}

std::string deck_of(const Mesh& mesh, std::optional<int> modes = {}) {
  const Folder folder;
  write_abaqus(folder.path / "m.inp", mesh, modes);
  return file_bytes(folder.path / "m.inp");
}

TEST(WriteAbaqus, HasElementsSetsMaterialsAndStep) {
  Mesh mesh = clamped("hex20", 2);
  mesh.supports = {{0, {true, true, false, false, true, false}}};
  mesh.equations = {{{{1, 0, 1.0}, {2, 2, -1.0 / 3}}}};
  mesh.bodies = {{3, 2.5}};
  const std::string text = deck_of(mesh, 12);
  const auto has = [&text](const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  };
  has("*ELEMENT, TYPE=C3D20, ELSET=SOLID_1\n1, 1, 2, 3, 4, 5, 6, 7,\n8, 9, 10, 11, 12, 13, 14, 15,\n16, 17, 18, 19, "
      "20\n");
  has("*ELEMENT, TYPE=MASS, ELSET=MASS_1\n3, 4\n*MASS, ELSET=MASS_1\n2.500000000000e+00\n");
  has("*NSET, NSET=S_7\n3\n");  // a set named by digits would be a node
  has("*ELSET, ELSET=both\n1, 2\n");
  has("*MATERIAL, NAME=steel_part\n*ELASTIC\n2.100000000000e+11, 3.000000000000e-01\n*DENSITY\n7.850000000000e+03\n"
      "*SOLID SECTION, ELSET=SOLID_1, MATERIAL=steel_part\n");
  has("*EQUATION\n2\n2, 1, 1.000000000000e+00\n3, 3, -3.333333333333e-01\n");
  has("*BOUNDARY\n1, 1, 1\n1, 2, 2\n*STEP\n*FREQUENCY\n12\n*END STEP\n");  // no rotation of a solid node
  EXPECT_EQ(deck_of(mesh).find("*STEP"), std::string::npos);
}

// CalculiX reads the first 20 characters of a number and 132 of a line.
TEST(WriteAbaqus, NumbersAndLinesAreShort) {
  Mesh mesh = clamped("tet10", 2);
  mesh.nodes(0, 0) = -1.2345678901234567e-300;
  mesh.node_labels.clear();
  for (long i = 0; i < mesh.nodes.cols(); ++i) mesh.node_labels.push_back(1234567890123L + i);
  std::istringstream text(deck_of(mesh));
  for (std::string line; std::getline(text, line);) {
    EXPECT_LE(line.size(), 132U);
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) {
      if (!line.starts_with('*') && line.find("flexboom") == std::string::npos) {
        EXPECT_LE(trimmed(cell).size(), 20U) << line;
      }
    }
  }
}

// The corners of the first order run round in a deck, while ours run along the axes.
TEST(WriteAbaqus, FirstOrderHexahedraHaveDeckOrder) {
  EXPECT_NE(deck_of(clamped("hex", 1)).find("TYPE=C3D8I, ELSET=SOLID_1\n1, 1, 2, 4, 3, 5, 6, 8,\n7\n"),
            std::string::npos);
}

TEST(WriteAbaqus, RotationOfARigidBodyHasItsOwnNode) {
  Mesh mesh = clamped("hex8", 1);
  mesh.rigid_connections = {{8, {0, 1, 2}}};
  mesh.supports = {{8, all_components}};
  const std::string text = deck_of(mesh);
  EXPECT_NE(text.find("*NSET, NSET=RIGID_1\n1, 2, 3\n*RIGID BODY, NSET=RIGID_1, REF NODE=9, ROT NODE=17\n"),
            std::string::npos);
  EXPECT_NE(text.find("*BOUNDARY\n9, 1, 1\n9, 2, 2\n9, 3, 3\n17, 1, 1\n17, 2, 2\n17, 3, 3\n"), std::string::npos);
}

TEST(WriteAbaqus, BeamsHaveSectionsOfCalculix) {
  const std::string text = deck_of(clamped("beam-timoshenko", 4));
  EXPECT_NE(text.find("*ELEMENT, TYPE=B31, ELSET=BEAM_1\n1, 1, 2\n"), std::string::npos);
  EXPECT_NE(text.find("ELSET=BEAM_1, MATERIAL=BEAM_MATERIAL_1, SECTION=CIRC\n1.000000000000e-02, 1.000000000000e-02\n"
                      "0.000000000000e+00, 0.000000000000e+00, 1.000000000000e+00\n"),
            std::string::npos);
  EXPECT_NE(text.find("SECTION=BOX\n1.000000000000e-01, 2.000000000000e-01, 1.000000000000e-02, 1.000000000000e-02, "),
            std::string::npos);
}

TEST(WriteAbaqus, WhatADeckCannotHoldIsAnInputError) {
  const auto fault = [](Mesh mesh, const auto& spoil) {
    spoil(mesh);
    const std::string text = input_error([&] { deck_of(mesh); });
    return text.substr(std::min(text.size(), text.find("m.inp: ") + 7));
  };
  const auto nothing = [](Mesh&) {};
  const Mesh tet = clamped("tet4", 1), beam = clamped("beam-timoshenko", 4);
  EXPECT_EQ(fault(clamped("hex", 2), nothing), "hex element 0 of order 2 has no type in CalculiX; write .vtu or .msh");
  EXPECT_EQ(fault(clamped("hex27", 2), nothing),
            "hex27 element 0 of order 2 has no type in CalculiX; write .vtu or .msh");
  EXPECT_EQ(fault(clamped("beam-euler-bernoulli", 1), nothing),
            "beam-euler-bernoulli element 0 of order 1 has no type in CalculiX; write .vtu or .msh");
  EXPECT_EQ(fault(beam, [](Mesh& m) { m.beam_properties[0].end = RoundBar{0.3}; }),
            "beam property 0 is tapered, which no deck holds");
  EXPECT_EQ(fault(beam, [](Mesh& m) { m.beam_properties[1].start = m.beam_properties[1].end = GeneralSection{}; }),
            "beam property 1 has a general section, which CalculiX does not have");
  EXPECT_EQ(fault(beam, [](Mesh& m) { m.beam_properties[0].rotary_inertia = false; }),
            "beam property 0 is without rotary inertia, which B31 always has");
  EXPECT_EQ(fault(tet,
                  [](Mesh& m) {
                    m.bodies.push_back({1, 1.0, Eigen::Matrix3d::Identity()});
                  }),
            "the body at node 1 has inertia or an offset; a deck holds point masses only (write .vtu)");
  EXPECT_EQ(fault(tet,
                  [](Mesh& m) {
                    m.distributing_connections.push_back({1, {2}, {1.0}});
                  }),
            "a deck of ours cannot hold a distributing connection; no format does");
  EXPECT_EQ(fault(tet,
                  [](Mesh& m) {
                    m.rigid_connections.push_back({1, {2}, {true, false, true}});
                  }),
            "the rigid connection of node 1 leaves displacements free, which *RIGID BODY cannot");
  const auto pinned = [](Mesh& m) { m.rigid_connections.push_back({1, {2}, {true, true, true, true, true, false}}); };
  Mesh solid = tet;
  pinned(solid);
  EXPECT_NO_THROW(deck_of(solid)) << "nodes of solids have no rotations";
  EXPECT_EQ(fault(beam, pinned),
            "the rigid connection of node 1 leaves rotations of beams free, which *RIGID BODY cannot");
  EXPECT_EQ(
      fault(clamped("hex", 2), pinned),
      "hex element 0 of order 2 has no type in CalculiX; take elements that have one (hex20, tet10): other formats "
      "hold no connections");
  EXPECT_EQ(fault(beam,
                  [](Mesh& m) {
                    m.beam_properties[0].shear = {"value", 0.5};
                  }),
            "beam property 0 has a shear coefficient of its own, which no deck holds");
  EXPECT_EQ(fault(tet, [](Mesh& m) { m.solid_properties[0].material = {}; }),
            "material steel_part is missing; give E, nu and rho (--material E,nu,rho)");
  EXPECT_EQ(fault(tet, [](Mesh& m) { m.node_sets["ROOT"] = {3}; }),
            "two sets would be called ROOT in a deck, which has one case");
}

// Editors of Windows begin a file with the byte order mark of UTF-8.
TEST(MeshFile, AByteOrderMarkIsPassedOver) {
  const Folder folder;
  const MeshFile original = read_mesh(test_mesh("hex_2_v41.msh"));
  Mesh mesh = original.mesh;
  for (SolidProperty& property : mesh.solid_properties) property.material = {70e9, 0.3, 2700};
  write_mesh(folder.path / "plain.vtu", mesh);
  write_file(folder.path / "plain.inp", "*NODE\n1\n2, 1\n3, 0, 1\n4, 0, 0, 1\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n");
  write_file(folder.path / "plain.bdf",
             "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\nCTETRA,1,1,1,2,3,4\n"
             "PSOLID,1,1\nMAT1,1,7.+10,,.3,2700.\n");
  std::filesystem::copy(test_mesh("hex_2_v41.msh"), folder.path / "plain.msh");
  std::filesystem::copy(test_mesh("hex_2_v41_binary.msh"), folder.path / "plain.MSH");
  for (const std::string extension : {".inp", ".bdf", ".msh", ".MSH", ".vtu"}) {
    const std::filesystem::path plain = folder.path / ("plain" + extension),
                                marked = folder.path / ("marked" + extension);
    write_file(marked, "\xEF\xBB\xBF" + file_bytes(plain));
    EXPECT_EQ(read_mesh(marked).mesh.nodes, read_mesh(plain).mesh.nodes) << extension;
  }
}

// A pipe without a writer would be waited for, a device never ends.
TEST(MeshFile, OnlyFilesAreRead) {
  const Folder folder;
  for (const std::string extension : {".inp", ".bdf", ".msh", ".vtu", ".geo", ".step"}) {
    const std::filesystem::path pipe = folder.path / ("pipe" + extension), zero = folder.path / ("zero" + extension);
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    std::filesystem::create_symlink("/dev/zero", zero);
    for (const std::filesystem::path& path : {pipe, zero})
      EXPECT_EQ(input_error([&] { read_mesh(path); }),
                "cannot read " + path.string() + ": it is a device, pipe or socket, not a file");
  }
}

// Whatever a file says of its materials, or leaves out, does not matter then.
TEST(MeshFile, AGivenMaterialTakesThePlaceOfTheFiles) {
  const Folder folder;
  const std::string grids =
      "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\nCTETRA,1,1,1,2,3,4\nPSOLID,1,1\n";
  const std::string nodes = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT,TYPE=C3D4,ELSET=E\n1,1,2,3,4\n";
  const std::string section = "*SOLID SECTION,ELSET=E,MATERIAL=M\n";
  const std::vector<std::pair<std::string, std::string>> files = {
      {"incomplete.bdf", grids + "MAT1,1,7.+10,,,2700.\n"},
      {"wrong.bdf", grids + "MAT1,1,-7.+10,,.3,-1.\n"},
      {"anisotropic.bdf", grids + "MAT9,1,1.,2.,3.\n"},
      {"none.bdf", grids},
      {"complete.bdf", grids + "MAT1,1,1.,,.1,1.\n"},
      {"incomplete.inp", nodes + "*MATERIAL,NAME=M\n*DENSITY\n2700\n" + section},
      {"weightless.inp", nodes + "*MATERIAL,NAME=M\n*ELASTIC\n7e10,.3\n" + section},
      {"anisotropic.inp", nodes + "*MATERIAL,NAME=M\n*ELASTIC,TYPE=ORTHO\n1,2,3,4,5,6,7,8\n9\n" + section},
      {"warm.inp", nodes + "*MATERIAL,NAME=M\n*ELASTIC\n7e10,.3,0\n6e10,.3,100\n*DENSITY\n2700\n" + section},
      {"undefined.inp", nodes + section},
      {"none.inp", nodes},
      {"without_section.inp", nodes + "*MATERIAL,NAME=M\n*ELASTIC\n7e10,.3\n"}};
  ReadOptions options;
  options.material = Material{67e9, 0.33, 2840};
  for (const auto& [name, text] : files) {
    write_file(folder.path / name, text);
    const MeshFile file = read_mesh(folder.path / name, options);
    ASSERT_EQ(file.mesh.solid_properties.size(), 1u) << name;
    const Material& m = file.mesh.solid_properties[0].material;
    EXPECT_EQ(std::tie(m.E, m.nu, m.rho), std::tie(options.material->E, options.material->nu, options.material->rho))
        << name;
    for (const std::string& note : file.notes) EXPECT_EQ(note.find("material"), std::string::npos) << name << note;
    EXPECT_NO_THROW(file.mesh.validate()) << name;
  }
}

TEST(MeshFile, ADialectIsOfDecks) {
  ReadOptions options;
  options.dialect = Dialect::abaqus;
  EXPECT_NE(input_error([&] { read_mesh("any.msh", options); }).find("is of decks"), std::string::npos);
}

}  // namespace
}  // namespace flexboom::testing
