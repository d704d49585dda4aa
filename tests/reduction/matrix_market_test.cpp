#include "reduction/exports/matrix_market.hpp"

#include "reduction/exports/reduced_matrix_market.hpp"
#include "tests/reduction/skew_body.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <vector>

namespace flexboom::test {
namespace {

TEST(MatrixMarket, ReducedBodyComesBackToTheLastBit) {
  const Folder folder;
  const ReducedBody body = clamped_sample().body;
  write_reduced_matrices(body, {}, folder.path);
  const ReducedBody back = read_reduced_matrices(folder.path);
  EXPECT_EQ(back.gram, body.gram);
  EXPECT_EQ(back.m, body.m);
  EXPECT_EQ(back.J0, body.J0);
  EXPECT_EQ(back.Ct, body.Ct);
  EXPECT_EQ(back.Cr0, body.Cr0);
  EXPECT_EQ(back.Cr1, body.Cr1);
  EXPECT_EQ(back.J1, body.J1);
  EXPECT_EQ(back.J2, body.J2);
  EXPECT_EQ(back.Me, body.Me);
  EXPECT_EQ(back.Ke, body.Ke);
  EXPECT_EQ(back.De, body.De);
  ReducedBody rigid = rigid_body("hub", 1, Vector3d::Zero(), Matrix3d::Identity());
  rigid.gram.resize(0, 0);
  EXPECT_NE(message([&] { write_reduced_matrices(rigid, {}, folder.path); }).find("no gram"), std::string::npos);
  EXPECT_TRUE(says(reduced_matrices_cannot_hold(body), "Markers"));
}

TEST(MatrixMarket, FaultsAreFoundWithTheirPlace) {
  const Folder folder;
  const std::filesystem::path path = folder.path / "A.mtx";
  const auto fault = [&](const std::string& text) {
    std::ofstream(path, std::ios::trunc) << text;
    return message([&] { read_mtx_array(path); });
  };
  const std::string banner = "%%MatrixMarket matrix array real general\n% a comment\n\n";
  EXPECT_EQ(fault(banner + "2 1\n1.5\n-3e-7\n"), "");
  EXPECT_EQ(read_mtx_array(path), Eigen::MatrixXd(Eigen::Vector2d(1.5, -3e-7)));
  EXPECT_NE(fault("").find("A.mtx:1:1: not a Matrix Market file"), std::string::npos);
  EXPECT_NE(fault("%%MatrixMarket matrix coordinate real general\n1 1 0\n").find("not a Matrix Market"),
            std::string::npos);
  EXPECT_NE(fault(banner + "2 1\n1\nnan\n").find("A.mtx:6:1"), std::string::npos);
  EXPECT_NE(fault(banner + "1 1\n1\n2\n").find("A.mtx:6:1: more numbers"), std::string::npos);
  EXPECT_NE(fault(banner + "2 2\n1\n"), "");
  EXPECT_NE(fault(banner + "50 50\n1\n").find("more than the file holds"), std::string::npos);
}

}  // namespace
}  // namespace flexboom::test
