#include "reduction/basis/mode_alignment.hpp"

#include "fem/booms/solid_boom.hpp"
#include "reduction/basis/craig_bampton.hpp"
#include "reduction/basis/mean_axis.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tests/reduction/booms.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <numeric>
#include <random>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using test::boom4;
using test::make_boom;

/// The same mesh with its nodes and elements in another order.
Mesh renumbered(const Mesh& mesh, unsigned seed) {
  const auto count = static_cast<size_t>(mesh.nodes.cols());
  std::vector<int> place(count);
  std::iota(place.begin(), place.end(), 0);
  std::mt19937 generator(seed);
  for (size_t i = count; i-- > 1;) std::swap(place[i], place[generator() % (i + 1)]);
  Mesh result = mesh;
  for (size_t i = 0; i < count; ++i) result.nodes.col(place[i]) = mesh.nodes.col(static_cast<Index>(i));
  const auto renumber = [&place](std::vector<int>& nodes) {
    for (int& node : nodes) node = place[static_cast<size_t>(node)];
  };
  for (Element& element : result.elements) renumber(element.nodes);
  for (auto& [name, nodes] : result.node_sets) renumber(nodes);
  for (NodalBody& body : result.bodies) body.node = place[static_cast<size_t>(body.node)];
  std::ranges::reverse(result.elements);
  return result;
}

/// Largest difference of what a body is, each relative to its scale.
double difference(const ReducedBody& a, const ReducedBody& b) {
  EXPECT_EQ(a.n(), b.n());
  double largest = 0;
  const auto compare = [&largest](const MatrixXd& A, const MatrixXd& B, double scale) {
    largest = std::max(largest, (A - B).cwiseAbs().maxCoeff() / scale);
  };
  const double m = a.m, modal = a.Me.diagonal().maxCoeff();
  compare(a.Me, b.Me, modal);
  const Eigen::VectorXd root = a.Ke.diagonal().cwiseSqrt();
  compare(root.cwiseInverse().asDiagonal() * a.Ke * root.cwiseInverse().asDiagonal(),
          root.cwiseInverse().asDiagonal() * b.Ke * root.cwiseInverse().asDiagonal(), 1);
  compare(a.Ct, b.Ct, std::sqrt(m * modal));
  compare(a.Cr0, b.Cr0, std::sqrt(a.J0.trace() * modal));
  for (int k = 0; k < a.n(); ++k) {
    const auto kk = static_cast<size_t>(k);
    compare(a.Cr1[kk], b.Cr1[kk], modal);
    compare(a.J1[kk], b.J1[kk], std::sqrt(a.J0.trace() * modal));
    EXPECT_EQ(a.coordinates[kk].kind, b.coordinates[kk].kind) << k;
    for (size_t l = 0; l < kk; ++l) compare(a.J2[kk][l], b.J2[kk][l], modal);
  }
  return largest;
}

using MakeBody = std::function<ReducedBody(const Mesh&, const std::string& backend)>;

EigenOptions first(int modes, const std::string& backend) {
  // Beyond 2000 unknowns the default tolerances leave 1e-9 in the shapes.
  return {.num_modes = modes, .sigma = {}, .tolerance = backend == "block" ? 1e-12 : 1e-14, .backend = backend};
}

ReducedBody clamped(const Mesh& mesh, const std::string& backend) {
  const Assembly assembly = assemble(mesh);
  return reduce(mesh, assembly, clamped_modes(mesh, assembly, node_set(mesh, "root"), first(10, backend)), "b");
}

ReducedBody free_body(const Mesh& mesh, const std::string& backend) {
  const Assembly assembly = assemble(mesh);
  return reduce(mesh, assembly, mean_axis_modes(mesh, assembly, first(10, backend)), "b");
}

/// Both ends held: the tip stands still, every other mode is antisymmetric.
ReducedBody held_twice(const Mesh& mesh, const std::string& backend) {
  Mesh with_ends = mesh;
  const auto ends = place_interfaces(with_ends, {{"a", "root"}, {"b", "tip"}});
  const Assembly assembly = assemble(with_ends);
  CraigBamptonOptions options;
  options.modes = first(8, backend);
  return reduce(with_ends, assembly, craig_bampton(with_ends, assembly, ends, options), "b");
}

TEST(ModeAlignment, BackendsAndNumberingGiveTheSameBody) {
  const Mesh mesh = make_mesh(boom4(BeamTheory::timoshenko, true, 6, 6));
  for (const MakeBody& make : {MakeBody(clamped), MakeBody(free_body), MakeBody(held_twice)}) {
    const ReducedBody body = make(mesh, "arpack");
    for (const std::string backend : {"block", "dense"})
      EXPECT_LT(difference(body, make(mesh, backend)), 1e-9) << backend;
    EXPECT_LT(difference(body, make(mesh, "arpack")), 1e-15);  // two runs
    EXPECT_LT(difference(body, make(renumbered(mesh, 7), "arpack")), 1e-9);
    EXPECT_LT(difference(body, make(renumbered(mesh, 8), "block")), 1e-9);
  }
}

TEST(ModeAlignment, TwoMeshesOfOneFamilyGiveTheSameBody) {
  // Order 8: both are exact to 1e-12 in the modes kept.
  const Mesh coarse = make_mesh(boom4(BeamTheory::timoshenko, true, 6, 8));
  const Mesh fine = make_mesh(boom4(BeamTheory::timoshenko, true, 9, 8));
  for (const MakeBody& make : {MakeBody(clamped), MakeBody(free_body), MakeBody(held_twice)})
    EXPECT_LT(difference(make(coarse, "arpack"), make(fine, "block")), 1e-9);
}

TEST(ModeAlignment, PairsOfARoundSolidBar) {
  SolidOptions options;
  options.order = 3;
  options.grading = {.sectors = 1, .rings = 1, .long_elements = 5, .end_layers = 0, .corner_levels = 0};
  const Mesh mesh = make_solid_mesh(boom4(BeamTheory::timoshenko, true), options);
  for (const MakeBody& make : {MakeBody(clamped), MakeBody(held_twice)}) {
    const ReducedBody body = make(mesh, "arpack");
    // 1e-9 by round-off of pairs, which the order of the unknowns changes.
    EXPECT_LT(difference(body, make(mesh, "block")), 3e-9);
    EXPECT_LT(difference(body, make(renumbered(mesh, 3), "arpack")), 3e-9);
  }
}

/// One cell across and an odd order: no node lies on the axis, and the face of the tip decides. A short bar: a slender
/// one has 1e-9 of round-off in its factor at order 5.
Mesh without_axis(int order, int along) {
  BeamGeometry bar = boom4(BeamTheory::timoshenko, true);
  bar.segments[0].length = 0.06;
  SolidOptions options;
  options.order = order;
  options.grading = {.sectors = 1, .rings = 1, .long_elements = along, .end_layers = 0, .corner_levels = 0};
  return make_solid_mesh(bar, options);
}

/// Largest part of Ct and Cr0 of bending modes outside their plane.
double out_of_plane(const ReducedBody& body) {
  double largest = 0;
  for (Index k = 0; k < body.n(); ++k) {
    const std::string& kind = body.coordinates[static_cast<size_t>(k)].kind;
    if (kind != "bending_y" && kind != "bending_z") continue;
    const Index along = kind == "bending_y" ? 1 : 2;
    largest = std::max(largest, std::abs(body.Ct(3 - along, k)) / std::sqrt(body.m * body.Me(k, k)));
    largest = std::max(largest, std::abs(body.Cr0(along, k)) / std::sqrt(body.J0.trace() * body.Me(k, k)));
  }
  return largest;
}

TEST(ModeAlignment, PairsOfABarWithoutANodeOnItsAxis) {
  for (const int order : {3, 5}) {
    const Mesh mesh = without_axis(order, 2);
    ASSERT_FALSE(mesh.node_sets.contains("tip_center"));
    for (const MakeBody& make : {MakeBody(clamped), MakeBody(free_body), MakeBody(held_twice)}) {
      const ReducedBody body = make(mesh, "arpack");
      EXPECT_LT(difference(body, make(mesh, "block")), 1e-9) << order;
      EXPECT_LT(difference(body, make(renumbered(mesh, 3), "arpack")), 1e-9) << order;
    }
    EXPECT_LT(out_of_plane(clamped(mesh, "arpack")), 1e-9) << order;
    EXPECT_LT(out_of_plane(clamped(without_axis(order, 3), "block")), 1e-9) << order;
  }
}

TEST(ModeAlignment, AntisymmetricModesHaveASign) {
  const ReducedBody body = held_twice(make_mesh(boom4(BeamTheory::euler_bernoulli, true, 6, 6)), "arpack");
  // Second bending mode between the held ends: the weight e^s prefers the half at the tip, there it is positive.
  const auto& display = body.display;
  Index near = 0;
  (display.points.row(0).array() - 0.75 * 0.302).abs().minCoeff(&near);
  EXPECT_EQ(body.coordinates[14].kind, "bending_y");
  EXPECT_GT(display.S[static_cast<size_t>(near)](1, 14), 0.5);
}

}  // namespace
}  // namespace flexboom
