#include "fem/booms/solid_boom.hpp"
#include "reduction/basis/body_shapes.hpp"
#include "reduction/basis/reduced_matrices.hpp"
#include "reduction/basis/surface.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tests/fem/solid_testing.hpp"
#include "tests/reduction/booms.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;

struct Box {
  Mesh mesh;
  Assembly assembly;
};

/// A box 0.3 x 0.2 x 0.1 m of a row of the table.
Box box_of(const testing::Row& row) {
  Box box;
  box.mesh = testing::box(element_types()[row.type], row.order, {2, 2, 1}, testing::stretch(0.3, 0.2, 0.1));
  for (int node = 0; node < box.mesh.nodes.cols(); ++node) {
    if (box.mesh.nodes(0, node) < 1e-9) box.mesh.node_sets["root"].push_back(node);
    if (box.mesh.nodes(0, node) > 0.3 - 1e-9) box.mesh.node_sets["tip"].push_back(node);
  }
  box.assembly = assemble(box.mesh);
  return box;
}

std::vector<testing::Row> solid_rows() {
  std::vector<testing::Row> rows;
  for (size_t t = 0; t < element_types().size(); ++t) {
    if (!testing::is_solid(element_types()[t])) continue;
    for (const int order : element_types()[t].orders()) {
      if (order <= 4) rows.push_back({t, order});
    }
  }
  return rows;
}

class ReducedSolid : public ::testing::TestWithParam<testing::Row> {};
INSTANTIATE_TEST_SUITE_P(Rows, ReducedSolid, ::testing::ValuesIn(solid_rows()), testing::name_of_row);

TEST_P(ReducedSolid, GramByMassMatrixIsTheSumOverPoints) {
  Box box = box_of(GetParam());
  box.mesh.bodies.push_back({2, 0.3, Eigen::Matrix3d::Identity() * 1e-4, {0.01, 0.02, 0}});
  box.assembly = assemble(box.mesh);
  const MatrixXd Phi = MatrixXd::Random(box.assembly.dofs.count, 5);
  const MatrixXd by_points = gram_matrix_by_points(box.mesh, box.assembly.dofs, Phi);
  const MatrixXd gram = gram_matrix(box.mesh, box.assembly, Phi);
  EXPECT_LT((gram - by_points).cwiseAbs().maxCoeff(), 1e-13 * by_points.cwiseAbs().maxCoeff());
  EXPECT_LT((gram_matrix(box.mesh, box.assembly, Phi, 3) - gram).norm(), 1e-16 * gram.norm());
  EXPECT_EQ((gram_matrix_by_points(box.mesh, box.assembly.dofs, Phi, 3) - by_points).norm(), 0);
}

TEST_P(ReducedSolid, InvariantsAgreeWithIndependentRoutes) {
  const Box box = box_of(GetParam());
  const ModalBasis basis =
      clamped_modes(box.mesh, box.assembly, node_set(box.mesh, "root"), {.num_modes = 5, .sigma = {}});
  const ReducedBody body = reduce(box.mesh, box.assembly, basis, "box");
  EXPECT_EQ(body.structure, "solid");
  for (const BodyCheck& c : check_invariants(body, box.mesh, box.assembly, basis))
    EXPECT_TRUE(c.passed) << c.name << " " << c.value << " against " << c.reference << ", " << c.relative_error;
}

TEST_P(ReducedSolid, SurfaceIsClosedAndPointsOutward) {
  const Box box = box_of(GetParam());
  const Surface surface = surface_of(box.mesh);
  double volume = 0, area = 0;
  Vector3d closed = Vector3d::Zero();
  for (const auto& t : surface.triangles) {
    const auto x = [&](size_t i) -> Vector3d { return box.mesh.nodes.col(surface.nodes[static_cast<size_t>(t[i])]); };
    const Vector3d normal = (x(1) - x(0)).cross(x(2) - x(0)) / 2;
    volume += x(0).dot(normal) / 3;
    area += normal.norm();
    closed += normal;
  }
  EXPECT_NEAR(volume, 0.3 * 0.2 * 0.1, 1e-14);
  EXPECT_NEAR(area, 2 * (0.06 + 0.03 + 0.02), 1e-14);
  EXPECT_LT(closed.norm(), 1e-15);
}

TEST_P(ReducedSolid, MarkersOfFacesFollowRigidMotionAndMeanDeflection) {
  const Box box = box_of(GetParam());
  ModalBasis basis;
  basis.Phi = rigid_motions(box.mesh, box.assembly.dofs);
  const std::vector<Marker> markers = body_markers(box.mesh, box.assembly.dofs, basis);
  ASSERT_EQ(markers.size(), 2U);
  for (const Marker& m : markers) {
    EXPECT_NEAR(m.position.x(), m.name == "tip" ? 0.3 : 0, 1e-15);
    for (int k = 0; k < 3; ++k) {
      EXPECT_LT((m.S.col(k) - Vector3d::Unit(k)).norm() + m.S_theta.col(k).norm(), 1e-12);
      EXPECT_LT((m.S.col(3 + k) - Vector3d::Unit(k).cross(m.position)).norm(), 1e-13);
      EXPECT_LT((m.S_theta.col(3 + k) - Vector3d::Unit(k)).norm(), 1e-12);
    }
  }
}

TEST_P(ReducedSolid, ANodeAloneTurnsWithItsElements) {
  Box box = box_of(GetParam());
  box.mesh.node_sets["corner"] = {box.mesh.node_sets["tip"].front()};
  ModalBasis basis;
  basis.Phi = rigid_motions(box.mesh, box.assembly.dofs);
  const std::vector<Marker> markers = body_markers(box.mesh, box.assembly.dofs, basis);
  const auto corner = std::ranges::find(markers, "corner", &Marker::name);
  ASSERT_NE(corner, markers.end());
  EXPECT_LT((corner->S_theta.rightCols<3>() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  EXPECT_LT((corner->S.leftCols<3>() - Eigen::Matrix3d::Identity()).norm(), 1e-15);
}

TEST(ReducedSolidBoom, IsNearTheBeam) {
  SolidOptions options;
  options.order = 4;
  const Mesh mesh = make_solid_mesh(test::boom4(BeamTheory::timoshenko, true), options);
  const Assembly assembly = assemble(mesh, 2);
  const ModalBasis basis = clamped_modes(mesh, assembly, node_set(mesh, "root"), {.num_modes = 4, .sigma = {}});
  const ReducedBody solid = reduce(mesh, assembly, basis, "solid", 2);
  const test::Boom boom = test::make_boom(test::boom4(BeamTheory::timoshenko, true));
  const ModalBasis beams =
      clamped_modes(boom.mesh, boom.assembly, node_set(boom.mesh, "root"), {.num_modes = 4, .sigma = {}});
  const ReducedBody beam = reduce(boom.mesh, boom.assembly, beams, "beam");
  EXPECT_NEAR(solid.m / beam.m, 1, 1e-5);  // the circle is of quartic pieces
  // boom4_clamped_3d_hz: the clamp of a solid is stiffer by 0.16 %.
  EXPECT_NEAR(solid.coordinates[0].frequency_hz / beam.coordinates[0].frequency_hz, 1.0016, 3e-4);
  EXPECT_LT((solid.Ct - beam.Ct).norm(), 5e-3 * beam.Ct.norm());
  EXPECT_LT((solid.Cr0 - beam.Cr0).norm(), 5e-3 * beam.Cr0.norm());
  EXPECT_LT((solid.J1[0] - beam.J1[0]).norm(), 5e-3 * beam.J1[0].norm());
  EXPECT_LT((solid.J2[0][0] - beam.J2[0][0]).norm(), 5e-3 * beam.J2[0][0].norm());
  EXPECT_LT((marker(solid, "tip").S - marker(beam, "tip").S).norm(), 1e-2);
  EXPECT_LT((marker(solid, "tip").S_theta - marker(beam, "tip").S_theta).norm(),
            1e-2 * marker(beam, "tip").S_theta.norm());
}

}  // namespace
}  // namespace flexboom
