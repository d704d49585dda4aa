// The second-order displacements of geometric stiffness: a kinetic energy that is a square, whatever the deflection.

#include "dynamics/model/second_order_shapes.hpp"

#include "dynamics/redundant/multipliers.hpp"
#include "dynamics/relative/tree.hpp"
#include "fem/base/check.hpp"
#include "fem/booms/boom.hpp"
#include "reduction/invariants/geometric_stiffness.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tree_testing.hpp"

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

#include <cmath>
#include <numbers>
#include <string>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::at_marker;
using testing::place;

/// A clamped beam with a mass beside its tip, all its lowest modes, with the geometric stiffness of its motion and of
/// loads at its tip.
ReducedBody stiffened_beam(const SectionShape& section, double length, double tip_mass, int modes) {
  BeamGeometry g;
  g.segments.push_back({section, section, length, Material{70e9, 0.33, 2700}, 12});
  if (tip_mass > 0)
    g.attachments.push_back({"load", length, tip_mass, 1e-4 * tip_mass * Matrix3d::Identity(), {0.01, 0.02, -0.01}});
  const Mesh mesh = make_mesh(g);
  const Assembly assembly = assemble(mesh);
  const Clamp clamp = node_set(mesh, "root");
  const ModalBasis basis = clamped_modes(mesh, assembly, clamp, {.num_modes = modes, .sigma = {}, .backend = "dense"});
  ReducedBody body = reduce(mesh, assembly, basis, "beam");
  body.Kg = geometric_stiffness(mesh, assembly, clamp, basis.Phi, {.markers = {"tip"}});
  return body;
}

/// Mass matrix over u: twice the kinetic energy is u^T M u.
MatrixXd mass_matrix(const Tree& tree, const VectorXd& y0) {
  const TreeLayout& l = tree.layout();
  VectorXd y = y0;
  y.segment(l.p, l.u).setZero();
  const auto energy = [&](Index i, Index j) {
    VectorXd moving = y;
    moving[l.p + i] += 1;
    if (j >= 0) moving[l.p + j] += 1;
    return tree.balance(0, moving).kinetic;
  };
  MatrixXd M(l.u, l.u);
  for (Index i = 0; i < l.u; ++i) M(i, i) = 2 * energy(i, -1);
  for (Index i = 0; i < l.u; ++i)
    for (Index j = 0; j < i; ++j) M(i, j) = M(j, i) = energy(i, j) - 0.5 * (M(i, i) + M(j, j));
  return M;
}

/// Least eigenvalue of a symmetric matrix scaled to a diagonal of 1.
double least_eigenvalue(const MatrixXd& M) {
  const VectorXd scale = M.diagonal().cwiseSqrt().cwiseInverse();
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(scale.asDiagonal() * M * scale.asDiagonal(), Eigen::EigenvaluesOnly)
      .eigenvalues()[0];
}

TEST(SecondOrder, MassMatrixIsPositiveDefiniteHoweverTheBodyBends) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const SectionShape& section : {SectionShape{RoundBar{0.01}}, SectionShape{Rectangle{0.005, 0.05}}})
    for (const double tip_mass : {0.0, 0.5})
      for (const int modes : {1, 2, 3, 5, 8, 13, 20, 40}) {
        Multibody scene;
        scene.bodies.push_back(stiffened_beam(section, 1.0, tip_mass, modes));
        scene.joints.push_back(testing::joint("shaft", JointKind::hinge, place(-1), place(0)));
        const Tree tree(scene, {Stiffening::on});
        const ReducedBody& body = scene.bodies[0];
        for (int trial = 0; trial < 14; ++trial) {
          TreeState s = tree.at_rest();
          VectorXd noise = VectorXd::NullaryExpr(modes, [&] { return uniform(random); });
          // Deflections from 1e-3 of the beam's length to all of it with curvatures alike, to a tenth with coordinates
          // alike: there the curvature of forty modes makes inertias of a million times the beam's.
          const bool rough = trial % 2 == 1;
          for (int k = 0; k < modes && !rough; ++k) noise[k] /= (k + 1.0) * (k + 1.0);
          const double size = std::pow(10, -3 + (rough ? 1.0 / 3 : 0.5) * (trial / 2));
          s.q[0] = noise * size / (marker(body, "tip").S * noise).cwiseAbs().maxCoeff();
          const double least = least_eigenvalue(mass_matrix(tree, tree.pack(s)));
          EXPECT_GT(least, 0) << modes << " modes, tip mass " << tip_mass << ", trial " << trial;
        }
      }
}

// A thin rod on a universal joint: at a right angle the first axis of the joint is the rod itself.
Multibody rod_on_a_gimbal() {
  Multibody scene;
  scene.bodies.push_back(rigid_body("rod", 2.0, Vector3d(0.5, 0, 0), Vector3d(0, 1, 1).asDiagonal()));
  scene.joints.push_back(testing::joint("gimbal", JointKind::universal, place(-1), place(0)));
  return scene;
}

template <class Run>
void expect_numerical_error_naming_the_rod(const Run& run) {
  try {
    run();
    ADD_FAILURE() << "no error";
  } catch (const NumericalError& error) {
    EXPECT_NE(std::string(error.what()).find("body rod"), std::string::npos) << error.what();
  }
}

TEST(SecondOrder, SingularMassMatrixIsAnErrorThatNamesTheBody) {
  const Tree tree(rod_on_a_gimbal());
  TreeState s = tree.at_rest();
  s.joints[0].coordinate = {0.3, 1.2};
  VectorXd y = tree.pack(s), y_dot(y.size());
  const std::vector<char> open(1, 0);
  tree.derivative(0, y.data(), open, *tree.workspace(), y_dot.data());
  s.joints[0].coordinate = {0.3, std::numbers::pi / 2};
  y = tree.pack(s);
  expect_numerical_error_naming_the_rod([&] { tree.derivative(0, y.data(), open, *tree.workspace(), y_dot.data()); });
}

TEST(SecondOrder, SingularMassMatrixByMultipliersIsAnErrorThatNamesTheBody) {
  const Multipliers system(rod_on_a_gimbal());
  MultipliersOptions options;
  options.duration = 0.1;
  const auto fly = [&](double angle) {
    return integrate_multipliers(system, place_bodies(system.multibody(), {{0.3, angle}}), options);
  };
  EXPECT_EQ(fly(1.2).time.back(), 0.1);
  expect_numerical_error_naming_the_rod([&] { fly(std::numbers::pi / 2); });
}

}  // namespace
}  // namespace flexboom
