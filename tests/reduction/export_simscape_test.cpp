#include "reduction/exports/simscape.hpp"

#include "tests/reduction/skew_body.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include <cmath>
#include <fstream>
#include <numbers>
#include <utility>

namespace flexboom::test {
namespace {

TEST(Simscape, MassPropertiesComeBackFromTheFileAlone) {
  const Folder folder;
  const ReducedBody body = free_sample().body;
  write_simscape(body, {}, folder.path / "boom.mat");
  const ReadBack back = simscape_read_back({}, folder.path / "boom.mat");
  // Constraint modes carry rigid motions to the error of a solve with K_ii; reached: 1e-12.
  const double tolerance = 1e-11;
  EXPECT_NEAR(back.m / body.m, 1, tolerance);
  EXPECT_LT(error(back.mc0, body.mc0), tolerance);
  EXPECT_LT(error(back.J0, body.J0), tolerance);
  EXPECT_LT(error(back.Ct, body.Ct), tolerance);
  EXPECT_LT(error(back.Cr0, body.Cr0), tolerance);
  EXPECT_EQ(back.Me, body.Me);
  EXPECT_EQ(back.Ke, body.Ke);
  EXPECT_EQ(read_simscape(folder.path / "boom.mat").C, body.De);
  ASSERT_EQ(back.markers.size(), 2U);
  for (const Marker& m : back.markers) {
    EXPECT_EQ(m.position, marker(body, m.name).position);
    EXPECT_LT((m.S - marker(body, m.name).S).norm(), 1e-12);
    EXPECT_LT((m.S_theta - marker(body, m.name).S_theta).norm(), 1e-12);
  }
}

TEST(Simscape, StiffnessLacksTheSixRigidMotions) {
  const Sample s = free_sample();
  const SimscapeRank rank = rank_of_stiffness(simscape_model(s.body));
  EXPECT_EQ(rank.deficiency, 6);
  EXPECT_LT(rank.rigid_residual, 1e-10);
  EXPECT_LT(rank.largest_zero_hz, 1e-3 * rank.first_elastic_hz);
  // First elastic frequency of the free full model; four fixed-interface modes hold it to a few 1e-4.
  const VectorXd full = frequencies(dense(s.boom.assembly.K), dense(s.boom.assembly.M));
  EXPECT_NEAR(rank.first_elastic_hz / (std::sqrt(full(6)) / (2 * std::numbers::pi)), 1, 1e-3);
}

TEST(Simscape, TipForceGivesTheTipDisplacementOfTheFullModel) {
  const Folder folder;
  const Sample s = free_sample();
  write_simscape(s.body, {}, folder.path / "boom.mat");
  const MatrixXd tip = read_simscape(folder.path / "boom.mat").K.block<6, 6>(6, 6);  // root held, no load on the modes
  const MatrixXd full = dense(s.boom.assembly.K);
  const std::vector<int> root = freedoms_of(s.boom, {"root"});
  std::vector<int> rest;
  for (int k = 0; k < full.rows(); ++k) {
    if (std::ranges::find(root, k) == root.end()) rest.push_back(k);
  }
  MatrixXd load = MatrixXd::Zero(full.rows(), 6);
  load(freedoms_of(s.boom, {"tip"}), Eigen::all).setIdentity();
  const MatrixXd u = full(rest, rest).ldlt().solve(load(rest, Eigen::all));
  // Constraint modes are exact for forces on interfaces; 1e-9: condition of K.
  EXPECT_LT(error(tip.inverse(), load(rest, Eigen::all).transpose() * u), 1e-9);
}

TEST(Simscape, CoordinatesTakeTheOrderOfTheBlock) {
  const ReducedBody body = free_sample(2).body;
  const std::vector<int> order = {12, 6, 7, 8, 9, 10, 11, 13, 0, 1, 2, 3, 4, 5};  // modes among the interfaces
  ReducedBody mixed = body;
  mixed.Me = body.Me(order, order);
  mixed.Ke = body.Ke(order, order);
  mixed.De = body.De(order, order);
  mixed.interfaces[0].first_coordinate = 8;
  mixed.interfaces[1].first_coordinate = 1;
  for (Marker& m : mixed.markers) {
    m.S = m.S(Eigen::all, order).eval();
    m.S_theta = m.S_theta(Eigen::all, order).eval();
  }
  const SimscapeModel a = simscape_model(body);
  const SimscapeModel b = simscape_model(mixed);
  EXPECT_EQ(a.K, b.K);
  EXPECT_EQ(a.M, b.M);
  EXPECT_EQ(a.C, b.C);
  EXPECT_EQ(a.P, b.P);
}

TEST(Simscape, ScipyOpensTheFile) {
  const Folder folder;
  const ReducedBody body = free_sample().body;
  write_simscape(body, {}, folder.path / "boom.mat");
  std::ofstream expected(folder.path / "expected.txt");
  expected.precision(17);
  expected << body.m << " " << body.mc0.transpose() << " " << body.J0.reshaped().transpose() << " "
           << marker(body, "root").position.transpose() << " " << marker(body, "tip").position.transpose() << " "
           << body.Ke.reshaped().transpose() << " " << body.Me.reshaped().transpose() << " "
           << body.De.reshaped().transpose() << "\n";
  expected.close();
  EXPECT_EQ(run_python("export_simscape.py", folder.path), 0);
}

TEST(Simscape, OtherBodiesAreRefusedAndToldHow) {
  const Folder folder;
  const auto fault = [&](const std::function<void(ReducedBody&)>& change) {
    ReducedBody body = free_sample(2).body;
    change(body);
    return message([&] { write_simscape(body, {}, folder.path / "boom.mat"); });
  };
  const std::string how = "make a Craig-Bampton body of frame \"free\"";
  const std::vector<std::pair<std::string, std::function<void(ReducedBody&)>>> faults = {
      {"its frame is \"clamped\"", [](ReducedBody& b) { b.frame = "clamped"; }},
      {"no interfaces", [](ReducedBody& b) { b.interfaces.clear(); }},
      {"does not keep all six", [](ReducedBody& b) { b.interfaces[1].components[4] = false; }},
      {"no coordinates of its own", [](ReducedBody& b) { b.interfaces[1].first_coordinate = -1; }},
      {"are not its motions",
       [](ReducedBody& b) {
         for (Marker& m : b.markers) m.S *= 2;
       }},
      {"rank deficiency 5", [](ReducedBody& b) { b.Ke(0, 0) *= 2; }},
      {"rank deficiency 7",
       [](ReducedBody& b) {
         b.Ke.row(12).setZero();
         b.Ke.col(12).setZero();
       }},
      {"strains it",
       [](ReducedBody& b) {
         for (Marker& m : b.markers) m.position *= 1.01;
       }},
  };
  EXPECT_EQ(fault([](ReducedBody&) {}), "");
  for (const auto& [words, change] : faults) {
    EXPECT_NE(fault(change).find(words), std::string::npos) << words << ": " << fault(change);
    EXPECT_NE(fault(change).find(how), std::string::npos) << words;
  }
  ReducedBody body = free_sample(2).body;
  EXPECT_NE(message([&] { write_simscape(body, {}, folder.path / "no" / "boom.mat"); }).find("cannot write"),
            std::string::npos);
  EXPECT_TRUE(says(simscape_cannot_hold(body), "rank deficiency 6"));
  EXPECT_NE(message([&] { read_simscape(folder.path / "none.mat"); }).find("no such MAT file"), std::string::npos);
}

}  // namespace
}  // namespace flexboom::test
