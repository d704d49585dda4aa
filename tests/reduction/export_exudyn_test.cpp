#include "reduction/exports/exudyn.hpp"

#include "fem/base/files.hpp"
#include "reduction/exports/exudyn_dictionary.hpp"
#include "tests/reduction/skew_body.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <random>
#include <span>

namespace flexboom::test {
namespace {

/// What an integral of two shapes, or of a shape and a length, can be.
double first_scale(const ReducedBody& b) { return std::sqrt(b.J0.trace() * b.Me.diagonal().maxCoeff()); }

TEST(Exudyn, EverythingComesBackFromTheFileAlone) {
  const Folder folder;
  const ReducedBody body = clamped_sample().body;
  write_exudyn(body, {}, folder.path / "boom.hdf5");
  const ReducedBody back = read_exudyn(folder.path / "boom.hdf5");
  // Numbers are stored to the last bit; a first moment and an inertia are scaled and summed once.
  const double eps = std::numeric_limits<double>::epsilon();
  EXPECT_EQ(back.m, body.m);
  EXPECT_LT(error(back.mc0, body.mc0), 2 * eps);
  EXPECT_EQ(back.J0, body.J0);
  EXPECT_EQ(back.Ct, body.Ct);
  EXPECT_EQ(back.Cr0, body.Cr0);
  EXPECT_EQ(back.Me, body.Me);
  EXPECT_EQ(back.Ke, body.Ke);
  EXPECT_EQ(back.De, body.De);
  for (size_t k = 0; k < body.J1.size(); ++k) {
    EXPECT_EQ(back.Cr1[k], body.Cr1[k]) << k;
    EXPECT_LT((back.J1[k] - body.J1[k]).norm(), 4 * eps * first_scale(body)) << k;
    for (size_t l = 0; l < body.J1.size(); ++l) {
      EXPECT_LT((back.J2[k][l] - body.J2[k][l]).norm(), 4 * eps * body.Me.diagonal().maxCoeff()) << k << " " << l;
    }
  }
  EXPECT_LT(error(frequencies(back.Ke, back.Me), frequencies(body.Ke, body.Me)), 1e-14);
  EXPECT_EQ(back.display.points, body.display.points);
  EXPECT_EQ(back.display.S, body.display.S);
  EXPECT_EQ(back.display.triangles, body.display.triangles);
}

TEST(Exudyn, MarkersMoveAndTurnAsTheirSixNodes) {
  const Folder folder;
  const ReducedBody body = clamped_sample().body;
  write_exudyn(body, {}, folder.path / "boom.hdf5");
  const ReadBack back = exudyn_read_back({}, folder.path / "boom.hdf5");
  ASSERT_EQ(back.markers.size(), body.markers.size());
  for (size_t i = 0; i < body.markers.size(); ++i) {
    const Marker& a = back.markers[i];
    const Marker& b = body.markers[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_LT((a.position - b.position).norm(), 1e-15);
    if (b.name == "root") continue;  // does not move
    EXPECT_LT(error(a.S, b.S), 1e-14);
    EXPECT_LT(error(a.S_theta, b.S_theta), 1e-12);  // differences over an arm of a hundredth of the body
    // Static self-test: what unit forces at the marker do there.
    EXPECT_LT(error(tip_compliance(a.S, back.Ke), tip_compliance(b.S, body.Ke)), 1e-12) << b.name;
  }
}

/// One row for Python: attitude p, omega, q, q_dot, and by the definition, point by point, the mass matrix of
/// (R, omega, q) and the right-hand side without loads: M = sum dm L^T L with L = A [A^T, -tilde(u), S],
/// Q = -sum dm L^T A (omega x (omega x u) + 2 omega x S q_dot) - (0, 0, Ke q + De q_dot).
void add_state(std::ostream& out, const Sample& s, std::mt19937& generator) {
  const auto random = [&] { return static_cast<double>(generator()) / 4294967296.0 - 0.5; };
  const Index n = s.body.n();
  const Eigen::Quaterniond p = Eigen::Quaterniond(random(), random(), random(), random()).normalized();
  const Vector3d omega(random(), random(), random());
  VectorXd q(n), q_dot(n);
  for (Index k = 0; k < n; ++k) {
    const double size = std::sqrt(s.body.J0.trace() / s.body.Me(k, k));  // the deflection is as large as the body
    q(k) = size * random();
    q_dot(k) = size * random();
  }
  const Matrix3d A = p.toRotationMatrix();
  MatrixXd M = MatrixXd::Zero(6 + n, 6 + n);
  VectorXd Q = VectorXd::Zero(6 + n);
  for_each_mass_point(s.boom.mesh, s.boom.assembly.dofs,
                      [&](double dm, const Vector3d& u0, const auto& N, std::span<const int> dofs) {
                        const Matrix3Xd S = N * s.basis.Phi(dofs, Eigen::all);
                        const Vector3d u = u0 + S * q;
                        MatrixXd L(3, 6 + n);
                        L << Matrix3d::Identity(), -A * tilde(u), A * S;
                        M += dm * L.transpose() * L;
                        Q -= dm * L.transpose() * A * (omega.cross(omega.cross(u)) + 2 * omega.cross(S * q_dot));
                      });
  Q.tail(n) -= s.body.Ke * q + s.body.De * q_dot;
  out.precision(17);
  out << p.w() << " " << p.vec().transpose() << " " << omega.transpose() << " " << q.transpose() << " "
      << q_dot.transpose() << " " << M.reshaped().transpose() << " " << Q.transpose() << "\n";
}

TEST(Exudyn, LoaderRebuildsTheEquationsOfMotion) {
  const Folder folder;
  const Sample s = clamped_sample();
  write_exudyn(s.body, {}, folder.path / "boom.hdf5");
  std::ofstream states(folder.path / "states.txt");
  std::mt19937 generator(2020);
  for (int i = 0; i < 5; ++i) add_state(states, s, generator);
  states.close();
  EXPECT_EQ(run_python("export_exudyn.py", folder.path), 0);
}

TEST(Exudyn, BodyWithoutTrianglesOrMarkersIsWritten) {
  const Folder folder;
  Sample s = clamped_sample(2);
  s.body.display.triangles.clear();
  s.body.markers.clear();
  write_exudyn(s.body, {}, folder.path / "boom.hdf5");
  const ReducedBody back = read_exudyn(folder.path / "boom.hdf5");
  EXPECT_TRUE(back.display.triangles.empty());
  EXPECT_TRUE(back.markers.empty());
  EXPECT_EQ(back.display.points, s.body.display.points);
  std::ofstream states(folder.path / "states.txt");
  std::mt19937 generator(7);
  add_state(states, s, generator);
  add_state(states, s, generator);
  states.close();
  EXPECT_EQ(run_python("export_exudyn.py", folder.path), 0);
}

TEST(Exudyn, FilesOfExudynItselfAreRead) {
  const Folder folder;
  const std::filesystem::path path = folder.path / "boom.hdf5";
  const ReducedBody body = clamped_sample(2).body;
  write_exudyn(body, {}, path);
  ExudynDictionary file = read_exudyn_dictionary(path);
  for (const char* ours : {"name", "units", "program", "dampingMatrixReduced", "markerNames", "markerNodes"}) {
    file.erase(ours);
  }
  file["trigList"] = VectorXd(0);  // np.array([])
  write_exudyn_dictionary(path, file);
  const ReducedBody back = read_exudyn(path);
  EXPECT_EQ(back.name, "exudyn");
  EXPECT_EQ(back.Ke, body.Ke);
  EXPECT_TRUE(back.De.isZero(0));
  EXPECT_TRUE(back.markers.empty());
  EXPECT_TRUE(back.display.triangles.empty());
  file["trigList"] = VectorXd(VectorXd::Zero(3));
  write_exudyn_dictionary(path, file);
  EXPECT_NE(message([&] { read_exudyn(path); }).find("trigList\" is of another kind"), std::string::npos);
}

TEST(Exudyn, EqualBodiesMakeEqualFiles) {
  const Folder folder;
  const ReducedBody body = clamped_sample(2).body;
  write_exudyn(body, {}, folder.path / "a.hdf5");
  ::sleep(1);  // times of objects would have another second
  write_exudyn(body, {}, folder.path / "b.hdf5");
  EXPECT_EQ(file_bytes(folder.path / "a.hdf5"), file_bytes(folder.path / "b.hdf5"));
}

TEST(Exudyn, WhatCannotBeWrittenIsRefused) {
  const Folder folder;
  const auto fault = [&](const std::string& name, const std::function<void(ReducedBody&)>& change) {
    ReducedBody body = clamped_sample(2).body;
    change(body);
    return message([&] { write_exudyn(body, {}, folder.path / name); });
  };
  EXPECT_NE(fault("boom.h5", [](ReducedBody&) {}).find("*.hdf5"), std::string::npos);
  EXPECT_NE(fault("boom.hdf5", [](ReducedBody& b) { b.frame = "free"; }).find("rigid motions"), std::string::npos);
  EXPECT_NE(fault("boom.hdf5", [](ReducedBody& b) { b = rigid_body("hub", 1, b.mc0 * 0, Matrix3d::Identity()); })
                .find("ObjectRigidBody"),
            std::string::npos);
  EXPECT_NE(fault("boom.hdf5",
                  [](ReducedBody& b) {
                    b.display = {};
                    b.markers.clear();
                  })
                .find("neither points nor markers"),
            std::string::npos);
  EXPECT_NE(fault("no/boom.hdf5", [](ReducedBody&) {}).find("cannot write"), std::string::npos);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path));
}

TEST(Exudyn, WhatIsLostIsSaid) {
  ReducedBody body = clamped_sample(2).body;
  EXPECT_TRUE(says(exudyn_cannot_hold(body), "dampingMatrixReduced"));
  EXPECT_FALSE(says(exudyn_cannot_hold(body), "Geometric stiffness"));
  EXPECT_TRUE(says(exudyn_cannot_hold(body), "stop"));
  EXPECT_TRUE(says(exudyn_cannot_hold(body), "Gravity"));
  body.De.setZero();
  body.Ct *= 1e-15;  // mean axes
  body.Kg.spin.assign(6, MatrixXd::Identity(2, 2));
  EXPECT_FALSE(says(exudyn_cannot_hold(body), "Damping"));
  EXPECT_FALSE(says(exudyn_cannot_hold(body), "Gravity"));
  EXPECT_TRUE(says(exudyn_cannot_hold(body), "Geometric stiffness"));
}

TEST(Exudyn, BadFilesAreRefused) {
  const Folder folder;
  const std::filesystem::path path = folder.path / "boom.hdf5";
  EXPECT_NE(message([&] { read_exudyn(path); }).find("No such file"), std::string::npos);
  std::ofstream(path) << "not HDF5";
  EXPECT_NE(message([&] { read_exudyn(path); }).find("not an HDF5 file"), std::string::npos);
  write_exudyn(clamped_sample(2).body, {}, path);
  const ExudynDictionary good = read_exudyn_dictionary(path);
  const auto fault = [&](const std::function<void(ExudynDictionary&)>& change) {
    ExudynDictionary file = good;
    change(file);
    write_exudyn_dictionary(path, file);
    return message([&] { read_exudyn(path); });
  };
  EXPECT_EQ(fault([](ExudynDictionary&) {}), "");
  EXPECT_EQ(fault([](ExudynDictionary& d) { d.erase("mPsiTildePsi"); }), path.string() + ": no entry \"mPsiTildePsi\"");
  EXPECT_EQ(fault([](ExudynDictionary& d) { d["totalMass"] = "heavy"; }),
            path.string() + ": entry \"totalMass\" is of another kind");
  EXPECT_EQ(
      fault([](ExudynDictionary& d) { d["modeBasis"] = MatrixXd(MatrixXd::Zero(3, 2)); }).find("modeBasis\" is 3 x 2"),
      path.string().size() + 9);
  EXPECT_NE(fault([](ExudynDictionary& d) { d["fileVersion"] = 2L; }).find("version 2 is unknown"), std::string::npos);
  EXPECT_NE(
      fault([](ExudynDictionary& d) { std::get<IntegerMatrix>(d["markerNodes"])(0, 0) = 100000; }).find("markerNodes"),
      std::string::npos);
  EXPECT_NE(fault([](ExudynDictionary& d) { std::get<IntegerMatrix>(d["trigList"])(0, 0) = -1; }).find("trigList"),
            std::string::npos);
  const std::string bytes = file_bytes(path);
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes.substr(0, bytes.size() / 2);
  EXPECT_NE(message([&] { read_exudyn(path); }), "");
}

}  // namespace
}  // namespace flexboom::test
