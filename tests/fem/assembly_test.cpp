#include "fem_testing.hpp"

namespace flexboom::testing {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

BeamGeometry boom_with_bodies(BeamTheory theory = BeamTheory::timoshenko) {
  BeamGeometry boom = uniform_boom(Rectangle{0.02, 0.01}, 0.2, theory, 2, 4);
  boom.segments.push_back({Tube{0.02, 0.002}, Tube{0.01, 0.001}, 0.3, aluminium, 3});
  boom.attachments.push_back({"camera", 0.3, 0.2, Vector3d(1e-4, 2e-4, 2.5e-4).asDiagonal(), {0.01, 0.02, -0.03}});
  boom.attachments.push_back({"lump", 0.5, 0.1, Matrix3d::Zero(), Vector3d::Zero()});
  return boom;
}

TEST(Assembly, StoresTheLowerTriangle) {
  const Assembly a = assemble(make_mesh(boom_with_bodies()));
  EXPECT_TRUE(MatrixXd(a.K).isLowerTriangular(0));
  EXPECT_TRUE(MatrixXd(a.M).isLowerTriangular(0));
}

TEST(Assembly, DoesNotDependOnTheNumberOfThreads) {
  const Mesh mesh = make_mesh(boom_with_bodies());
  const Assembly one = assemble(mesh, 1), three = assemble(mesh, 3);
  EXPECT_EQ(MatrixXd(one.K), MatrixXd(three.K));
  EXPECT_EQ(MatrixXd(one.M), MatrixXd(three.M));
}

TEST(Assembly, MassMatrixIsTheSumOverMassPoints) {
  const Mesh mesh = make_mesh(boom_with_bodies());
  const Assembly a = assemble(mesh);
  MatrixXd M = MatrixXd::Zero(a.dofs.count, a.dofs.count);
  for_each_mass_point(
      mesh, a.dofs,
      [&](double dm, const Vector3d&, const Eigen::Ref<const Eigen::Matrix3Xd>& N, std::span<const int> dofs) {
        const MatrixXd local = dm * N.transpose() * N;
        for (size_t i = 0; i < dofs.size(); ++i) {
          for (size_t j = 0; j < dofs.size(); ++j) {
            M(dofs[i], dofs[j]) += local(static_cast<Index>(i), static_cast<Index>(j));
          }
        }
      });
  const VectorXd scale = M.diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_LT((scale.asDiagonal() * (M - full(a.M)) * scale.asDiagonal()).cwiseAbs().maxCoeff(), 32 * eps);
}

TEST(Assembly, RigidMotionsSeeMassOfBeamAndBodies) {
  const Mesh mesh = make_mesh(boom_with_bodies());
  const Assembly a = assemble(mesh);
  const MatrixXd T = rigid_motions(mesh, a.dofs);
  MatrixXd expected = MatrixXd::Zero(6, 6);
  for_each_mass_point(mesh, a.dofs, [&](double dm, const Vector3d& x, const auto&, std::span<const int>) {
    MatrixXd motion(3, 6);
    motion << Matrix3d::Identity(), Vector3d::UnitX().cross(x), Vector3d::UnitY().cross(x), Vector3d::UnitZ().cross(x);
    expected += dm * motion.transpose() * motion;
  });
  const MatrixXd M = quadratic_form(a.M, T);
  EXPECT_LT((M - expected).cwiseAbs().maxCoeff(), 1e-14 * expected.norm());
  const double tube =
      aluminium.rho * 0.3 * pi / 3 * ((1e-4 + 5e-5 + 2.5e-5) - (6.4e-5 + 3.2e-5 + 1.6e-5));  // two frusta, radii
  EXPECT_NEAR(M(0, 0), aluminium.rho * 0.2 * 2e-4 + tube + 0.3, 1e-14);
}

TEST(Assembly, PointEnergiesAreTheQuadraticForms) {
  const Mesh mesh = make_mesh(boom_with_bodies());
  const Assembly a = assemble(mesh);
  std::srand(2);
  const VectorXd u = VectorXd::Random(a.dofs.count);
  const PointEnergies energy = point_energies(mesh, a, u);
  EXPECT_NEAR(energy.strain(0) / (u.dot(full(a.K) * u) / 2), 1, 1e-13);
  EXPECT_NEAR(energy.kinetic(0) / (u.dot(full(a.M) * u) / 2), 1, 1e-13);
  EXPECT_EQ(input_error([&] { point_energies(mesh, a, VectorXd::Zero(3)); }),
            "strain_energies: vectors have 3 entries, the mesh has " + std::to_string(a.dofs.count) + " freedoms");
}

TEST(Assembly, NumbersNodesFirstThenElements) {
  for (const BeamTheory theory : {BeamTheory::euler_bernoulli, BeamTheory::timoshenko}) {
    const Mesh mesh = make_mesh(boom_with_bodies(theory));
    const Assembly a = assemble(mesh);
    const int p = 4, internal = theory == BeamTheory::timoshenko ? 6 * p + 2 : 4 * p - 2;
    EXPECT_EQ(a.dofs.count, 6 * mesh.nodes.cols() + internal * static_cast<int>(mesh.elements.size()));
    const std::vector<int> dofs = a.dofs.of_element(mesh, 1);
    EXPECT_EQ(dofs.size(), static_cast<size_t>(12 + internal));
    EXPECT_EQ(dofs[0], 6);
    EXPECT_EQ(dofs[12], a.dofs.element_offset[1]);
  }
}

// The planes, torsion and extension of a symmetric beam share no entry of K or M.
TEST(Assembly, KeepsPlanesApart) {
  const Mesh mesh = make_mesh(uniform_boom(RoundBar{0.01}, 0.3, BeamTheory::timoshenko, 3, 6));
  const Assembly a = assemble(mesh);
  const std::vector<int> free = free_dofs(a.dofs, node_set(mesh, "root"));
  size_t sum = 0;
  for (int component : {0, 1, 2, 3}) {
    sum += coupled_with(a, free, a.dofs.of_node(node_set(mesh, "tip")[0], component)).size();
  }
  EXPECT_EQ(sum, free.size());
}

TEST(LineMass, HasNoTorsion) {
  BeamGeometry boom = uniform_boom(RoundBar{0.01}, 0.3, BeamTheory::euler_bernoulli, 3, 5);
  boom.rotary_inertia = false;
  const Mesh mesh = make_mesh(boom);
  const Assembly a = assemble(mesh);
  int absent = 0;
  for (int dof = 0; dof < a.dofs.count; ++dof) absent += a.dofs.absent[static_cast<size_t>(dof)];
  EXPECT_EQ(absent, 4 + 3 * 5);  // rx of 4 nodes, p internal twists of 3 elements
  for (int node = 0; node < 4; ++node) EXPECT_TRUE(a.dofs.absent[static_cast<size_t>(a.dofs.of_node(node, 3))]);
  const std::vector<int> free = free_dofs(a.dofs, node_set(mesh, "root"));
  EXPECT_EQ(free.size(), static_cast<size_t>(a.dofs.count - absent - 5));
  const MatrixXd M = full(a.M, free);
  EXPECT_EQ(Eigen::LLT<MatrixXd>(M).info(), Eigen::Success) << "what is left has mass";
}

TEST(LineMass, ABodyWithInertiaBringsTorsionBack) {
  BeamGeometry boom = uniform_boom(RoundBar{0.01}, 0.3, BeamTheory::euler_bernoulli, 3, 5);
  boom.rotary_inertia = false;
  boom.attachments.push_back({"lump", 0.3, 0.1, Matrix3d::Zero(), Vector3d::Zero()});
  const auto absent_twists = [&] {
    const DofMap dofs = assemble(make_mesh(boom)).dofs;
    int count = 0;
    for (int node = 0; node < 4; ++node) count += dofs.absent[static_cast<size_t>(dofs.of_node(node, 3))];
    return count;
  };
  EXPECT_EQ(absent_twists(), 4) << "a lump on the axis";
  boom.attachments[0].offset = {0, 0.01, 0};
  EXPECT_EQ(absent_twists(), 0) << "a lump beside the axis";
}

TEST(DisplayLines, RunAlongEveryElement) {
  const Mesh mesh = make_mesh(boom_with_bodies());
  const DisplayLines display = display_lines(mesh, 5);
  ASSERT_EQ(display.lines.size(), mesh.elements.size());
  EXPECT_EQ(display.points.cols(), static_cast<Index>(5 * mesh.elements.size()));
  for (size_t e = 0; e < mesh.elements.size(); ++e) {
    ASSERT_EQ(display.lines[e].size(), 5U);
    EXPECT_EQ(display.points.col(display.lines[e].front()), mesh.nodes.col(mesh.elements[e].nodes[0]));
    EXPECT_EQ(display.points.col(display.lines[e].back()), mesh.nodes.col(mesh.elements[e].nodes[1]));
    const auto middle = static_cast<size_t>(display.lines[e][2]);
    EXPECT_EQ(display.parameter[middle], 0.5);
    EXPECT_EQ(display.element[middle], static_cast<int>(e));
  }
}

// A frame of two beams at a right angle hangs together through its common node.
TEST(Assembly, ConnectsBeamsInSeveralDirections) {
  Mesh mesh;
  mesh.nodes.resize(3, 3);
  mesh.nodes << 0, 0.3, 0.3, 0, 0, 0.2, 0, 0, 0;
  const RoundBar bar{0.01};
  mesh.beam_properties = {{bar, bar, aluminium, BeamTheory::timoshenko, {}, true, Vector3d::UnitZ()}};
  mesh.elements = {{element_type("beam-timoshenko"), {0, 1}, 4, 0}, {element_type("beam-timoshenko"), {1, 2}, 4, 0}};
  const Assembly a = assemble(mesh);
  const std::vector<int> free = free_dofs(a.dofs, std::vector<int>{0});
  VectorXd load = VectorXd::Zero(static_cast<Index>(free.size()));
  load(8) = 1;  // force along z on the tip (nodes 1, 2 come first)
  const VectorXd u = full(a.K, free).llt().solve(load);
  const double I = pi * 1e-8 / 64, A = pi * 1e-4 / 4, G = aluminium.shear_modulus(), EI = aluminium.E * I;
  const double b = 0.3, c = 0.2, kappa = section_of(bar, aluminium.nu, {}).kappa_y;
  // Bending and shear of both legs, torsion of the first.
  const double expected = (b * b * b + c * c * c) / (3 * EI) + (b + c) / (kappa * G * A) + c * c * b / (G * 2 * I);
  EXPECT_NEAR(u(8) / expected, 1, 1e-11);
}

}  // namespace
}  // namespace flexboom::testing
