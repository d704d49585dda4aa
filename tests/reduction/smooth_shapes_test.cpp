#include "reduction/basis/smooth_shapes.hpp"

#include "fem/assembly/constraints.hpp"
#include "fem/booms/solid_boom.hpp"
#include "reduction/eigen/solver.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>

namespace flexboom::test {
namespace {

using Eigen::MatrixXd;

Mesh bar(double length) {
  BeamGeometry geometry;
  geometry.segments.push_back({RoundBar{0.01}, RoundBar{0.01}, length, Material{67e9, 0.33, 2840}});
  SolidOptions options;
  options.element = "hex20";
  return make_solid_mesh(geometry, options);
}

/// A clamped bar of hexahedra with more than 2000 unknowns: blocks by themselves.
struct ClampedBar {
  Mesh mesh = bar(0.3);
  Assembly assembly = assemble(mesh);
  Unknowns unknowns = flexboom::unknowns(mesh, assembly.dofs, Clamp(mesh.node_sets.at("root")));
  SparseMatrix K = unknowns.reduced(assembly.K), M = unknowns.reduced(assembly.M);

  EigenPairs modes(MatrixXd start) const {
    EigenOptions options;
    options.num_modes = 10;
    options.backend = "block";
    return solve_modes({K, M, false, std::move(start)}, options);
  }
  MatrixXd smooth() const { return smooth_shapes(mesh, assembly.dofs)(unknowns.free_dofs(), Eigen::all); }
};

TEST(SmoothShapes, EightOfASlenderBodyNoneOfACompactOne) {
  const Mesh slender = bar(0.3);
  const MatrixXd shapes = smooth_shapes(slender, assemble(slender).dofs);
  ASSERT_EQ(shapes.cols(), 8);
  EXPECT_EQ(Eigen::ColPivHouseholderQR<MatrixXd>(shapes).rank(), 8);
  // Moving by 1 across the body; on its rim a turn by 3 / half a length makes at most 3 x 1/30 more (degree 2).
  EXPECT_NEAR(shapes.cwiseAbs().maxCoeff(), 1, 0.1);
  const Mesh compact = bar(0.02);
  EXPECT_EQ(smooth_shapes(compact, assemble(compact).dofs).cols(), 0);
}

TEST(SmoothShapes, SaveSolvesAndChangeNothing) {
  const ClampedBar bar;
  const EigenPairs random = bar.modes({}), helped = bar.modes(bar.smooth());
  EXPECT_LT(helped.summary.solves, random.summary.solves);
  // Eigenvalues err by the square of the residual asked for (2e-7).
  EXPECT_LT((helped.lambda - random.lambda).cwiseQuotient(random.lambda).cwiseAbs().maxCoeff(), 1e-11);
}

// Start vectors that hold nothing of some modes: the random part of them finds those.
TEST(SmoothShapes, AStartWithoutTheModesWantedLosesNone) {
  const ClampedBar bar;
  const EigenPairs random = bar.modes({});
  MatrixXd start = bar.smooth();
  start -= random.Phi * (random.Phi.transpose() * symmetric_product(bar.M, start)).eval();
  const EigenPairs found = bar.modes(start);
  EXPECT_LE(found.summary.solves, random.summary.solves + 8) << found.summary.note;  // one step
  EXPECT_LT((found.lambda - random.lambda).cwiseQuotient(random.lambda).cwiseAbs().maxCoeff(), 1e-11);
}

}  // namespace
}  // namespace flexboom::test
