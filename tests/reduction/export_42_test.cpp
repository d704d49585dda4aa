#include "fem/base/files.hpp"
#include "reduction/exports/nasa42.hpp"
#include "tests/reduction/export_testing.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <memory>

namespace flexboom {
namespace {

using Eigen::Index;
using test::bent;
using test::message;

/// The flex file as 42 reads it: fscanf of values, of the rest of the line and of line ends.
class Scanner {
 public:
  explicit Scanner(const std::filesystem::path& path) : file_(std::fopen(path.c_str(), "r"), &std::fclose) {}

  /// Text that must fit a buffer of 80.
  void text() {
    char junk[1000];
    char end[8];
    EXPECT_GE(std::fscanf(file_.get(), "%999[^\n] %7[\n]", junk, end), 1);
    EXPECT_LT(std::string(junk).size(), 80U) << junk;
  }
  long integer() {
    long value = -1;
    EXPECT_EQ(std::fscanf(file_.get(), "%ld", &value), 1);
    return value;
  }
  double real() {
    double value = 0;
    EXPECT_EQ(std::fscanf(file_.get(), "%lf", &value), 1);
    return value;
  }
  void comment() {
    EXPECT_EQ(std::fscanf(file_.get(), " "), 0);
    text();
    EXPECT_EQ(std::fscanf(file_.get(), " "), 0);
  }
  void heading() { comment(); }
  template <class Entry>
  void entries(size_t indices, const Entry& entry) {
    heading();
    const long count = integer();
    comment();
    for (long i = 0; i < count; ++i) {
      std::vector<long> index(indices);
      for (long& x : index) x = integer();
      entry(index, real());
      comment();
    }
  }

 private:
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
};

TEST(Export42, FlexFileIsReadAsTheProgramDoes) {
  const auto folder = test::test_folder() / "bent";
  const ReducedBody& body = bent();
  export_body(body, "42", {{{"joints", "1=tip, 3 = middle"}}}, folder);
  Scanner s(folder / "Flex_bent.txt");
  s.heading();
  s.heading();
  EXPECT_EQ(s.integer(), body.n());
  s.comment();
  s.heading();
  for (Index k = 0; k < body.n(); ++k) {
    EXPECT_EQ(s.real(), 0);
    EXPECT_EQ(s.real(), 0);
    s.comment();
  }
  s.heading();
  s.entries(3, [&](const auto& i, double v) { EXPECT_EQ(v, body.markers[i[1] == 1 ? 2 : 0].S(i[2], i[0])); });
  s.entries(3, [&](const auto& i, double v) { EXPECT_EQ(v, body.markers[i[1] == 1 ? 2 : 0].S_theta(i[2], i[0])); });
  s.heading();
  s.entries(3, [&](const auto& i, double v) { EXPECT_EQ(v, body.markers[static_cast<size_t>(i[1])].S(i[2], i[0])); });
  s.entries(
      3, [&](const auto& i, double v) { EXPECT_EQ(v, body.markers[static_cast<size_t>(i[1])].S_theta(i[2], i[0])); });
  s.entries(2, [&](const auto& i, double v) { EXPECT_EQ(v, body.Me(i[0], i[1])); });
  s.entries(2, [&](const auto& i, double v) { EXPECT_EQ(v, body.Ke(i[0], i[1])); });
  s.entries(2, [&](const auto& i, double v) { EXPECT_EQ(v, body.De(i[0], i[1])); });
  for (const Eigen::Matrix3Xd& integral : {body.Ct, body.Cr0}) {
    s.heading();
    for (Index k = 0; k < body.n(); ++k) {
      for (Index i = 0; i < 3; ++i) EXPECT_EQ(s.real(), integral(i, k));
      s.comment();
    }
  }
  s.entries(3, [&](const auto& i, double v) { EXPECT_EQ(v, body.gram(4 + 3 * i[2] + i[0], 1 + i[1])); });
  s.entries(4, [&](const auto& i, double v) { EXPECT_EQ(v, body.gram(4 + 3 * i[2] + i[0], 4 + 3 * i[3] + i[1])); });
}

TEST(Export42, NodesJointAndBlockAreHeld) {
  const auto folder = test::test_folder() / "bent";
  const ExportOptions options = {
      {{"joints", "1=tip"}, {"spring", "0.5"}, {"damper", "0.01"}, {"stop_stiffness", "40"}, {"stop_angle", "0.1"}}};
  export_body(bent(), "42", options, folder);
  const File42 file = read_42(folder);
  EXPECT_EQ(file.nodes[2].label, "tip");
  EXPECT_EQ(file.nodes[2].position, bent().markers[2].position);
  EXPECT_EQ(file.joints[0].PSI, bent().markers[2].S);
  EXPECT_EQ(file.joint.rotation_spring, Eigen::Vector3d(0.5, 0, 0));
  EXPECT_EQ(file.joint.rotation_damper, Eigen::Vector3d(0.01, 0, 0));
  EXPECT_EQ(file.inertia, bent().J0);
  EXPECT_FALSE(file.about_centre);
  // The block has products of inertia, int x y dm and so on; 42 turns their signs.
  std::FILE* block = std::fopen((folder / "Block_bent.txt").c_str(), "r");
  char line[200];
  for (int i = 0; i < 8; ++i) ASSERT_NE(std::fgets(line, sizeof line, block), nullptr);
  double xy = 0;
  double xz = 0;
  double yz = 0;
  EXPECT_EQ(std::fscanf(block, "%lf %lf %lf", &xy, &xz, &yz), 3);
  std::fclose(block);
  EXPECT_EQ(xy, bent().gram(1, 2));
  EXPECT_EQ(xz, bent().gram(1, 3));
  EXPECT_EQ(yz, bent().gram(2, 3));
  const std::string joint = file_bytes(folder / "Joint_bent.txt");
  EXPECT_NE(joint.find("! 42 has linear springs only"), std::string::npos);
  EXPECT_NE(joint.find("stop = 0.1"), std::string::npos);
  EXPECT_NE(message([&] { file_42(bent(), {{{"joints", "1:tip"}}}); }).find("INDEX=MARKER"), std::string::npos);
  EXPECT_NE(message([&] { file_42(bent(), {{{"joints", "1=top"}}}); }).find("it has \"middle\""), std::string::npos);
}

TEST(Export42, MeanAxisBodiesAreReferredToTheirCentre) {
  ReducedBody body = bent();
  body.frame = "mean-axis";
  const File42 file = file_42(body, {});
  EXPECT_TRUE(file.about_centre);
  const Eigen::Vector3d r = file.centre;
  const Eigen::Matrix3d about_origin =
      file.inertia + file.mass * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
  EXPECT_LT((about_origin - body.J0).norm(), 1e-15);
}

}  // namespace
}  // namespace flexboom
