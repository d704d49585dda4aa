#pragma once

#include "reduction/body/tilde.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tests/reduction/booms.hpp"
#include "tests/reduction/messages.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

// Bodies to export, and what the tests of every format ask.
namespace flexboom::test {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// A folder of this process alone, removed at the end.
struct Folder {
  std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("flexboom_export_" + std::to_string(::getpid()));
  Folder() { std::filesystem::create_directories(path); }
  ~Folder() { std::filesystem::remove_all(path); }
};

inline int run_python(const std::string& script, const std::filesystem::path& argument) {
  const std::string command =
      std::string(FLEXBOOM_PYTHON) + " " + FLEXBOOM_TEST_DATA + "/reduction/" + script + " " + argument.string();
  return std::system(command.c_str());
}

inline bool says(const std::vector<std::string>& sentences, const std::string& word) {
  for (const std::string& s : sentences) {
    if (s.find(word) != std::string::npos) return true;
  }
  return false;
}

/// A boom with a taper, a lump and a tip body off its axis, turned and moved: no integral is zero by symmetry.
inline Boom skew_boom() {
  BeamGeometry g = boom4(BeamTheory::timoshenko, true, 3, 4);
  g.segments.push_back({RoundBar{0.01}, RoundBar{0.006}, 0.2, Material{110e9, 0.3, 4400}, 3});
  g.attachments.push_back({"lump", 0.302, 0.02, Matrix3d::Zero(), Vector3d::Zero()});
  Matrix3d inertia;
  inertia << 3e-5, 2e-6, 0, 2e-6, 4e-5, -3e-6, 0, -3e-6, 5e-5;
  g.attachments.push_back({"probe", 0.502, 0.05, inertia, {0.02, 0.01, -0.005}});
  Mesh mesh = make_mesh(g);
  const Matrix3d A = Eigen::AngleAxisd(0.7, Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  mesh.nodes = (A * mesh.nodes).colwise() + Vector3d(0.1, -0.07, 0.05);
  for (BeamProperty& p : mesh.beam_properties) p.y_axis = A * p.y_axis;
  for (NodalBody& b : mesh.bodies) {
    b.inertia = A * b.inertia * A.transpose();
    b.offset = A * b.offset;
  }
  Assembly assembly = assemble(mesh);
  return {std::move(mesh), std::move(assembly)};
}

struct Sample {
  Boom boom;
  ModalBasis basis;
  ReducedBody body;
};

inline Sample clamped_sample(int modes = 6) {
  Sample s{skew_boom(), {}, {}};
  s.basis = clamped_modes(s.boom.mesh, s.boom.assembly, node_set(s.boom.mesh, "root"),
                          {.num_modes = modes, .sigma = {}, .backend = "dense"});
  s.body = reduce(s.boom.mesh, s.boom.assembly, s.basis, "boom");
  apply_damping(s.body, {"rayleigh", 0, 0.3, 2e-5});
  s.body.display.triangles = {{0, 1, 2}, {2, 1, 3}};
  return s;
}

inline MatrixXd dense(const SparseMatrix& A) { return MatrixXd(A).selfadjointView<Eigen::Lower>(); }

/// Freedoms 0..5 of the nodes of the one-node sets, one set after the other.
inline std::vector<int> freedoms_of(const Boom& boom, const std::vector<std::string>& sets) {
  std::vector<int> freedoms;
  for (const std::string& set : sets) {
    for (int c = 0; c < 6; ++c) freedoms.push_back(boom.assembly.dofs.of_node(node_set(boom.mesh, set).front(), c));
  }
  return freedoms;
}

/// Craig-Bampton by dense algebra: Phi = [I 0; -K_ii^-1 K_ib  Phi_i] with interfaces at the root and the tip.
inline Sample free_sample(int modes = 4) {
  Sample s{skew_boom(), {}, {}};
  const MatrixXd K = dense(s.boom.assembly.K);
  const MatrixXd M = dense(s.boom.assembly.M);
  const std::vector<int> b = freedoms_of(s.boom, {"root", "tip"});
  std::vector<int> i;
  for (int k = 0; k < K.rows(); ++k) {
    if (std::ranges::find(b, k) == b.end()) i.push_back(k);
  }
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> inner(K(i, i), M(i, i));
  MatrixXd& Phi = s.basis.Phi = MatrixXd::Zero(K.rows(), 12 + modes);
  Phi(b, Eigen::seqN(0, 12)).setIdentity();
  Phi(i, Eigen::seqN(0, 12)) = -K(i, i).ldlt().solve(K(i, b));
  Phi(i, Eigen::seqN(12, modes)) = inner.eigenvectors().leftCols(modes);
  s.basis.omega = VectorXd::Zero(12 + modes);
  s.basis.omega.tail(modes) = inner.eigenvalues().head(modes).cwiseSqrt();
  s.basis.kind.assign(static_cast<size_t>(12 + modes), ModeKind::other);
  s.basis.unknowns = static_cast<int>(K.rows());
  s.basis.rigid_freedoms = 6;
  s.body = reduce(s.boom.mesh, s.boom.assembly, s.basis, "free boom");
  s.body.frame = "free";
  s.body.interfaces = {{"root", all_components, 0}, {"tip", all_components, 6}};
  apply_damping(s.body, {"rayleigh", 0, 0.3, 2e-5});
  return s;
}

/// Largest deviation, relative to the largest entry.
inline double error(const MatrixXd& A, const MatrixXd& B) {
  return (A - B).cwiseAbs().maxCoeff() / B.cwiseAbs().maxCoeff();
}

inline VectorXd frequencies(const MatrixXd& K, const MatrixXd& M) {
  return Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(K, M, Eigen::EigenvaluesOnly).eigenvalues();
}

inline MatrixXd tip_compliance(const MatrixXd& S, const MatrixXd& K) { return S * K.ldlt().solve(S.transpose()); }

}  // namespace flexboom::test
