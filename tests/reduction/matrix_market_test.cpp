#include "reduction/matrix_market.hpp"

#include "reduction/export_matrix_market.hpp"
#include "reduction/matrix_model.hpp"
#include "tests/reduction/skew_body.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <vector>

namespace flexboom::test {
namespace {

TEST(MatrixMarket, FullModelComesBackToTheLastBit) {
  const Folder folder;
  const Boom boom = skew_boom();
  const MatrixModel model =
      matrix_model(boom.mesh, boom.assembly, unknowns(boom.mesh, boom.assembly.dofs, Clamp({}, false)));
  write_matrix_market(folder.path / "model", model);
  const MatrixModel back = read_matrix_market(folder.path / "model");
  EXPECT_EQ(dense(back.K), dense(model.K));
  EXPECT_EQ(dense(back.M), dense(model.M));
  EXPECT_EQ(back.T, model.T);
  ASSERT_EQ(back.freedoms.size(), model.freedoms.size());
  for (size_t i = 0; i < model.freedoms.size(); ++i) {
    EXPECT_EQ(back.freedoms[i].node, model.freedoms[i].node);
    EXPECT_EQ(back.freedoms[i].element, model.freedoms[i].element);
    EXPECT_EQ(back.freedoms[i].component, model.freedoms[i].component);
    EXPECT_EQ(back.freedoms[i].label, model.freedoms[i].label);
  }
  EXPECT_EQ(run_python("matrix_market.py", folder.path / "model"), 0);
}

TEST(MatrixMarket, MassPropertiesAndFrequenciesComeFromTheFilesAlone) {
  const Folder folder;
  const Sample s = clamped_sample();
  const DofMap& dofs = s.boom.assembly.dofs;
  write_matrix_market(folder.path / "free",
                      matrix_model(s.boom.mesh, s.boom.assembly, unknowns(s.boom.mesh, dofs, Clamp({}, false))));
  const MatrixModel free = read_matrix_market(folder.path / "free");
  const MatrixXd rigid = free.T.transpose() * dense(free.M) * free.T;
  EXPECT_NEAR(rigid(0, 0) / s.body.m, 1, 1e-13);
  EXPECT_LT(error(rigid.topRightCorner<3, 3>(), -tilde(s.body.mc0)), 1e-13);
  EXPECT_LT(error(rigid.bottomRightCorner<3, 3>(), s.body.J0), 1e-13);
  EXPECT_LT((dense(free.K) * free.T).norm(), 1e-13 * dense(free.K).norm());

  // Root held by the map of freedoms: frequencies, Ct, Cr0, and the tip under unit forces.
  const int root = node_set(s.boom.mesh, "root").front();
  const int tip = node_set(s.boom.mesh, "tip").front();
  std::vector<int> kept, tip_rows;
  for (size_t i = 0; i < free.freedoms.size(); ++i) {
    if (free.freedoms[i].node == tip && free.freedoms[i].component < 3)
      tip_rows.push_back(static_cast<int>(kept.size()));
    if (free.freedoms[i].node != root) kept.push_back(static_cast<int>(i));
  }
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(dense(free.K)(kept, kept), dense(free.M)(kept, kept));
  for (Index k = 0; k < s.body.n(); ++k) {
    // Dense eigenvalues err by eps omega_max^2, 1e-6 of the lowest.
    EXPECT_NEAR(solver.eigenvalues()(k) / (s.body.Ke(k, k) / s.body.Me(k, k)), 1, 1e-5);
  }
  const MatrixXd Psi = solver.eigenvectors().leftCols(s.body.n());
  const MatrixXd coupling = free.T.transpose() * dense(free.M)(Eigen::all, kept) * Psi;
  MatrixXd of_body(6, s.body.n());
  of_body << s.body.Ct, s.body.Cr0;
  // Signs and lengths of the shapes are free: C Me^-1 C^T is not.
  EXPECT_LT(error(coupling * coupling.transpose(), of_body * s.body.Me.ldlt().solve(of_body.transpose())), 1e-5);
  MatrixXd load = MatrixXd::Zero(std::ssize(kept), 3);
  load(tip_rows, Eigen::all).setIdentity();
  const MatrixXd exact = load.transpose() * MatrixXd(dense(free.K)(kept, kept)).ldlt().solve(load);
  const MatrixXd modal = tip_compliance(marker(s.body, "tip").S, s.body.Ke);
  // Six modes leave out less than a tenth of the tip's compliance, none of it negative.
  const VectorXd part = frequencies(modal, exact);
  EXPECT_LE(part(2), 1 + 1e-8);
  EXPECT_GT(part(1), 0.9);
}

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

TEST(MatrixMarket, RowsAreTheFreedomsThatTheMapSays) {
  const Boom boom = skew_boom();
  const DofMap& dofs = boom.assembly.dofs;
  const MatrixModel model =
      matrix_model(boom.mesh, boom.assembly, unknowns(boom.mesh, dofs, node_set(boom.mesh, "root")));
  ASSERT_EQ(std::ssize(model.freedoms), dofs.count - 6);
  std::vector<int> freedoms;
  for (const MatrixModel::Freedom& f : model.freedoms) {
    freedoms.push_back(f.node >= 0 ? dofs.of_node(f.node, f.component)
                                   : dofs.element_offset[static_cast<size_t>(f.element)] + f.component);
  }
  EXPECT_EQ(dense(model.K), dense(boom.assembly.K)(freedoms, freedoms));
  EXPECT_EQ(dense(model.M), dense(boom.assembly.M)(freedoms, freedoms));
  EXPECT_EQ(model.T, rigid_motions(boom.mesh, dofs)(freedoms, Eigen::all));
}

TEST(MatrixMarket, ConnectionsAreEliminatedAndKeepTheMass) {
  Boom boom = skew_boom();
  const int tip = node_set(boom.mesh, "tip").front();
  const int lump = boom.mesh.elements[2].nodes.back();
  boom.mesh.rigid_connections = {{tip, {lump}, all_components}};
  const DofMap& dofs = boom.assembly.dofs;
  const MatrixModel model = matrix_model(boom.mesh, boom.assembly, unknowns(boom.mesh, dofs, Clamp({}, false)));
  ASSERT_EQ(std::ssize(model.freedoms), dofs.count - 6);
  for (const MatrixModel::Freedom& f : model.freedoms) EXPECT_NE(f.node, lump);
  const MatrixXd T = rigid_motions(boom.mesh, dofs);
  EXPECT_LT(error(model.T.transpose() * dense(model.M) * model.T, T.transpose() * dense(boom.assembly.M) * T), 1e-13);
  EXPECT_LT((dense(model.K) * model.T).norm(), 1e-13 * dense(model.K).norm());
}

TEST(MatrixMarket, FaultsAreFoundWithTheirPlace) {
  const Folder folder;
  const std::filesystem::path path = folder.path / "A.mtx";
  const auto fault = [&](const std::string& text) {
    std::ofstream(path, std::ios::trunc) << text;
    return message([&] { read_mtx(path); });
  };
  const std::string banner = "%%MatrixMarket matrix coordinate real symmetric\n% a comment\n\n";
  EXPECT_EQ(fault(banner + "2 2 2\n1 1 1.5\n2 1 -3e-7\n"), "");
  const SparseMatrix A = read_mtx(path);
  EXPECT_EQ(A.coeff(0, 0), 1.5);
  EXPECT_EQ(A.coeff(1, 0), -3e-7);
  EXPECT_NE(fault("").find("A.mtx:1:1: not a Matrix Market file"), std::string::npos);
  EXPECT_NE(fault("%%MatrixMarket matrix coordinate complex general\n1 1 0\n").find("not a Matrix Market"),
            std::string::npos);
  EXPECT_NE(fault("%%MatrixMarket matrix array real general\n1 1\n1\n").find("array form"), std::string::npos);
  EXPECT_NE(fault(banner + "2 3 0\n").find("square"), std::string::npos);
  EXPECT_NE(fault(banner + "2 2 1\n1 2 1.0\n").find("A.mtx:5:3"), std::string::npos);  // above the diagonal
  EXPECT_NE(fault(banner + "2 2 1\n3 1 1.0\n").find("A.mtx:5:1"), std::string::npos);
  EXPECT_NE(fault(banner + "2 2 1\n2 1 nan\n").find("A.mtx:5:5"), std::string::npos);
  EXPECT_NE(fault(banner + "2 2 999999999999\n1 1 1\n").find("A.mtx:4:5"), std::string::npos);
  EXPECT_NE(fault(banner + "2 2 1\n1 1 1\n2 2 1\n").find("A.mtx:6:1: more numbers"), std::string::npos);
  EXPECT_NE(fault(banner + "2 2 2\n1 1 1\n2 2\n"), "");
  std::ofstream(path, std::ios::trunc) << "%%MatrixMarket matrix array real general\n99999 99999\n1\n";
  EXPECT_NE(message([&] { read_mtx_array(path); }).find("2:"), std::string::npos);
}

}  // namespace
}  // namespace flexboom::test
