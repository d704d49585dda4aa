#include "reduction/basis/mean_axis.hpp"

#include "fem/base/check.hpp"
#include "fem/booms/solid_boom.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tests/reduction/booms.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace flexboom {
namespace {

using test::boom4;
using test::make_boom;

EigenOptions first(int modes) { return {.num_modes = modes, .sigma = {}, .backend = "arpack"}; }

/// Ct and Cr0 over what Cauchy-Schwarz allows them to be.
double coupling(const ReducedBody& body) {
  double largest = 0;
  for (Eigen::Index k = 0; k < body.n(); ++k) {
    largest = std::max(largest, body.Ct.col(k).norm() / std::sqrt(body.m * body.Me(k, k)));
    largest = std::max(largest, body.Cr0.col(k).norm() / std::sqrt(body.J0.trace() * body.Me(k, k)));
  }
  return largest;
}

BeamGeometry loaded_boom() {
  BeamGeometry g = boom4(BeamTheory::timoshenko, true, 4, 6);
  g.attachments.push_back({"probe", 0.302, 0.05, Eigen::Matrix3d::Identity() * 3e-5, {0.02, 0.01, -0.005}});
  return g;
}

TEST(MeanAxis, CouplingToRigidMotionVanishesAboutAnyOrigin) {
  test::Boom boom = make_boom(loaded_boom());
  const ModalBasis basis = mean_axis_modes(boom.mesh, boom.assembly, first(10));
  ReducedBody body = reduce(boom.mesh, boom.assembly, basis, "boom");
  EXPECT_EQ(body.frame, "mean-axis");
  EXPECT_EQ(body.n(), 10);
  EXPECT_LT(coupling(body), 1e-12);
  boom.mesh.nodes.colwise() += Eigen::Vector3d(0.5, -0.3, 0.2);  // the BRF elsewhere
  body = reduce(boom.mesh, boom.assembly, basis, "boom");
  EXPECT_LT(coupling(body), 1e-12);
  for (const BodyCheck& c : check_invariants(body, boom.mesh, assemble(boom.mesh), basis))
    EXPECT_TRUE(c.passed) << c.name << " " << c.relative_error;
}

TEST(MeanAxis, ModesAreThoseOfTheFreeBody) {
  const test::Boom boom = make_boom(boom4(BeamTheory::euler_bernoulli, false, 8, 8));
  const ModalBasis basis = mean_axis_modes(boom.mesh, boom.assembly, first(6));
  // cos(a) cosh(a) = 1 (free-free beam): a_1, a_2, a_3.
  const double alpha[] = {4.730040744862704, 7.853204624095838, 10.995607838001671};
  const double unit = std::sqrt(67e9 * 4.908738521234052e-10 / (2840 * 7.853981633974483e-5)) / (0.302 * 0.302);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(basis.omega(i) / (alpha[i / 2] * alpha[i / 2] * unit), 1, 1e-11) << i;
  EXPECT_EQ(basis.coordinates[0].kind, "bending_y");
  EXPECT_LT(coupling(reduce(boom.mesh, boom.assembly, basis, "b")), 1e-12);
}

TEST(MeanAxis, SupportsAreLeftOut) {
  Mesh mesh = make_mesh(boom4(BeamTheory::timoshenko, true));
  const Assembly assembly = assemble(mesh);
  const ModalBasis plain = mean_axis_modes(mesh, assembly, first(4));
  mesh.supports.push_back({0, all_components});
  const ModalBasis supported = mean_axis_modes(mesh, assembly, first(4));
  EXPECT_LT((plain.omega - supported.omega).norm(), 1e-12 * plain.omega.norm());
}

TEST(MeanAxis, SolidsToo) {
  SolidOptions options;
  options.order = 2;
  options.grading = {.sectors = 1, .rings = 1, .long_elements = 6, .end_layers = 0, .corner_levels = 0};
  const Mesh mesh = make_solid_mesh(boom4(BeamTheory::timoshenko, true), options);
  const Assembly assembly = assemble(mesh);
  const ReducedBody body = reduce(mesh, assembly, mean_axis_modes(mesh, assembly, first(6)), "boom");
  EXPECT_LT(coupling(body), 1e-12);
}

TEST(MeanAxis, ABodyInPiecesIsRefused) {
  Mesh mesh = make_mesh(boom4(BeamTheory::timoshenko, true, 2));
  const auto nodes = static_cast<int>(mesh.nodes.cols());
  Mesh both = mesh;
  both.nodes.resize(3, 2 * nodes);
  both.nodes << mesh.nodes, mesh.nodes.colwise() + Eigen::Vector3d(0, 1, 0);
  for (Element element : mesh.elements) {
    for (int& node : element.nodes) node += nodes;
    both.elements.push_back(element);
  }
  EXPECT_THROW(mean_axis_modes(both, assemble(both), first(4)), InputError);
}

}  // namespace
}  // namespace flexboom
