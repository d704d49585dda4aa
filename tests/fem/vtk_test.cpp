#include "fem/formats/vtk/vtk.hpp"

#include "fem/base/check.hpp"
#include "fem_testing.hpp"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>

namespace flexboom::testing {
namespace {

// A folder of this process alone, removed at the end.
struct Folder {
  std::filesystem::path path = std::filesystem::temp_directory_path() / ("flexboom_vtk_" + std::to_string(::getpid()));
  Folder() { std::filesystem::create_directories(path); }
  ~Folder() { std::filesystem::remove_all(path); }
};

// A chain of four lines with fields whose values vtk_open.py knows.
VtkGrid four_lines() {
  VtkGrid grid;
  grid.points.resize(3, 5);
  for (int i = 0; i < 5; ++i) grid.points.col(i) << i / 3.0, 0.1 * i, -1e-9 * i;
  grid.cells = {{3, {0, 1}}, {3, {1, 2}}, {3, {2, 3}}, {3, {3, 4}}};
  grid.point_data = {{"displacement", 2 * grid.points},
                     {"speed <m/s> & \"more\"", Eigen::RowVectorXd::LinSpaced(5, 0, 4)}};
  grid.cell_data = {{"body", Eigen::RowVector4d(1, 1, 2, 2)}};
  return grid;
}

TEST(Vtk, MeshioAndVtkOpenWhatIsWritten) {
  const Folder folder;
  write_vtu(folder.path / "lines.vtu", four_lines());
  write_pvd(folder.path / "lines.pvd", {{0, "lines.vtu"}, {0.1, "lines.vtu"}});
  const std::string command =
      std::string(FLEXBOOM_PYTHON) + " " + FLEXBOOM_TEST_DATA + "/fem/vtk_open.py " + folder.path.string();
  EXPECT_EQ(std::system(command.c_str()), 0);
}

TEST(Vtk, WritesEveryDigit) {
  const Folder folder;
  const std::filesystem::path path = folder.path / "lines.vtu";
  write_vtu(path, four_lines());
  std::ifstream in(path);
  const std::string text(std::istreambuf_iterator<char>(in), {});
  EXPECT_NE(text.find("0.33333333333333331 0.10000000000000001 -1.0000000000000001e-09"), std::string::npos);
}

TEST(Vtk, BadInputSaysWhatIsWrong) {
  const Folder folder;
  const auto fault = [&](const std::function<void(VtkGrid&)>& spoil) {
    VtkGrid grid = four_lines();
    spoil(grid);
    return input_error([&] { write_vtu(folder.path / "x.vtu", grid); });
  };
  const std::string start = "cannot write " + (folder.path / "x.vtu").string() + ": ";
  EXPECT_EQ(fault([](VtkGrid& g) { g.point_data[0].second.resize(3, 4); }),
            start + "point field \"displacement\" is 3 x 4; it must have 5 columns");
  EXPECT_EQ(fault([](VtkGrid& g) { g.cell_data[0].second.resize(1, 5); }),
            start + "cell field \"body\" is 1 x 5; it must have 4 columns");
  EXPECT_EQ(fault([](VtkGrid& g) { g.point_data[0].second(0) = NAN; }),
            start + "point field \"displacement\" has a value that is not finite");
  EXPECT_EQ(fault([](VtkGrid& g) { g.points(1) = INFINITY; }), start + "points have a coordinate that is not finite");
  EXPECT_EQ(fault([](VtkGrid& g) { g.cells[1].points[0] = 5; }), start + "cell 1: point 5 is missing");
  EXPECT_EQ(fault([](VtkGrid& g) { g.cells[1].points.clear(); }), start + "cell 1 has no points");
  EXPECT_EQ(fault([](VtkGrid& g) { g.point_groups = {{"tip", {5}}}; }), start + "point group \"tip\": 5 is missing");
  EXPECT_EQ(fault([](VtkGrid& g) { g.cell_groups = {{"end", {4}}}; }), start + "cell group \"end\": 4 is missing");
  EXPECT_EQ(fault([](VtkGrid& g) { g.cells[0].type = 0; }), start + "cell 0 has type 0, which VTK does not have");
  EXPECT_FALSE(std::filesystem::exists(folder.path / "x.vtu"));
}

TEST(Vtk, UnwritableFileIsAnInputError) {
  EXPECT_EQ(input_error([] { write_vtu("/nowhere/x.vtu", four_lines()); }),
            "cannot write /nowhere/x.vtu: No such file or directory");
  EXPECT_EQ(input_error([] { write_pvd("/nowhere/x.pvd", {}); }),
            "cannot write /nowhere/x.pvd: No such file or directory");
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  EXPECT_EQ(input_error([] { write_vtu("/dev/full", four_lines()); }),
            "cannot write /dev/full: No space left on device");
}

}  // namespace
}  // namespace flexboom::testing
