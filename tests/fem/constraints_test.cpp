#include "fem/assembly/constraints.hpp"

#include "fem_testing.hpp"

namespace flexboom::testing {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Boom along x, beside it a cloud of nodes that short beams carry, so that every node has six freedoms.
Mesh frame() {
  Mesh mesh = make_mesh(uniform_boom(Rectangle{0.02, 0.01}, 0.4, BeamTheory::timoshenko, 4, 2));
  const auto old_nodes = static_cast<int>(mesh.nodes.cols());
  mesh.nodes.conservativeResize(3, old_nodes + 4);
  const std::array<Vector3d, 4> cloud = {Vector3d(0.5, 0.05, 0), Vector3d(0.5, -0.04, 0.02), Vector3d(0.52, 0, 0.06),
                                         Vector3d(0.6, 0.01, -0.03)};
  BeamProperty property = mesh.beam_properties[0];
  property.y_axis = Vector3d(0.3, 0.2, 1).normalized();
  for (int i = 0; i < 4; ++i) {
    mesh.nodes.col(old_nodes + i) = cloud[static_cast<size_t>(i)];
    mesh.elements.push_back({element_type("beam-timoshenko"),
                             {old_nodes + (i + 3) % 4, old_nodes + i},
                             2,
                             static_cast<int>(mesh.beam_properties.size())});
    mesh.beam_properties.push_back(property);
  }
  return mesh;
}

const std::vector<int> cloud_nodes = {5, 6, 7, 8};

/// T of u = T x, dense.
MatrixXd transformation(const Unknowns& u) { return u.expanded(MatrixXd::Identity(u.count, u.count)); }

/// Whether a rigid motion of everything obeys the constraints: u at the followers from u at the unknowns.
double rigid_defect(const Mesh& mesh, const DofMap& dofs, const Unknowns& u) {
  const MatrixXd motions = rigid_motions(mesh, dofs);
  return (u.expanded(motions(u.free_dofs(), Eigen::all)) - motions).cwiseAbs().maxCoeff();
}

TEST(Unknowns, AreTheFreeFreedomsWithoutConnections) {
  const Mesh mesh = make_mesh(uniform_boom(RoundBar{0.01}, 0.3, BeamTheory::timoshenko, 3, 2));
  const Assembly a = assemble(mesh);
  const Unknowns u = unknowns(mesh, a.dofs, std::vector<int>{0, 2});
  EXPECT_EQ(u.free_dofs(), free_dofs(a.dofs, {0, 2}));
  EXPECT_EQ(full(u.reduced(a.M)), full(a.M, u.free_dofs()));
  EXPECT_TRUE(MatrixXd(u.reduced(a.K)).isLowerTriangular(0));
  EXPECT_EQ(input_error([&] { unknowns(mesh, a.dofs, std::vector<int>{99}); }), "clamp: node 99 is missing");
}

TEST(Unknowns, SupportsHoldTheirComponentsUnlessLeftOut) {
  Mesh mesh = make_mesh(uniform_boom(RoundBar{0.01}, 0.3, BeamTheory::timoshenko, 3, 2));
  mesh.supports = {{1, {true, false, true, false, false, true}}};
  const DofMap dofs = assemble(mesh).dofs;
  const Unknowns u = unknowns(mesh, dofs, {});
  EXPECT_EQ(u.count, dofs.count - 3);
  for (const int k : {0, 2, 5}) EXPECT_EQ(u.of_freedom[static_cast<size_t>(dofs.of_node(1, k))], -1);
  EXPECT_EQ(unknowns(mesh, dofs, Clamp({}, false)).count, dofs.count);
}

TEST(RigidFreedoms, CountWhatTheClampLeaves) {
  Mesh mesh = frame();
  mesh.rigid_connections = {{4, cloud_nodes, all_components}};
  const DofMap dofs = assemble(mesh).dofs;
  EXPECT_EQ(rigid_freedoms(mesh, dofs, {}), 6);
  EXPECT_EQ(rigid_freedoms(mesh, dofs, std::vector<int>{0}), 0);
  mesh.supports = {{0, {true, true, true, false, true, true}}};
  EXPECT_EQ(rigid_freedoms(mesh, dofs, {}), 1) << "a hinge about x";
  mesh.supports = {{0, {true, true, true, false, false, false}}, {4, {true, true, true, false, false, false}}};
  EXPECT_EQ(rigid_freedoms(mesh, dofs, {}), 1) << "two ball joints leave the turn about their line";
}

/// u along a direction at a node.
LinearEquation along(int node, const Vector3d& direction) {
  LinearEquation equation;
  for (int k = 0; k < 3; ++k) equation.terms.push_back({node, k, direction(k)});
  return equation;
}

/// Three, two and one direction of skew axes at nodes that no line joins: no rigid motion is left.
std::vector<LinearEquation> determinate_rollers() {
  const Matrix3d axes = Eigen::AngleAxisd(0.7, Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  return {along(5, axes.col(0)), along(5, axes.col(1)), along(5, axes.col(2)),
          along(7, axes.col(0)), along(7, axes.col(1)), along(0, axes.col(2))};
}

TEST(RigidFreedoms, RollersInTurnedAxesHold) {
  Mesh mesh = frame();
  mesh.rigid_connections = {{4, cloud_nodes, all_components}};
  mesh.equations = determinate_rollers();
  const DofMap dofs = assemble(mesh).dofs;
  EXPECT_EQ(rigid_freedoms(mesh, dofs, {}), 0);
  EXPECT_EQ(rigid_freedoms(mesh, dofs, Clamp({}, false)), 6);
  EXPECT_EQ(rigid_freedoms(mesh, dofs, Clamp({0}, false)), 0);
  for (size_t i = 0; i < mesh.equations.size(); ++i) {
    Mesh fewer = mesh;
    fewer.equations.erase(fewer.equations.begin() + static_cast<long>(i));
    EXPECT_EQ(rigid_freedoms(fewer, dofs, {}), 1) << i;
  }
  mesh.equations.push_back(along(6, {0.1, -0.4, 0.3}));
  EXPECT_EQ(rigid_freedoms(mesh, dofs, {}), 0) << "held more than once";
}

TEST(RigidFreedoms, TurnsOfANodeHeldByEquationsHold) {
  Mesh mesh = frame();
  mesh.rigid_connections = {{4, cloud_nodes, all_components}};
  mesh.supports = {{0, {true, true, true, false, false, false}}};
  mesh.equations = {{{{2, 3, 0.6}, {2, 4, 0.8}}}, {{{2, 4, 0.6}, {2, 3, -0.8}}}};
  const DofMap dofs = assemble(mesh).dofs;
  EXPECT_EQ(rigid_freedoms(mesh, dofs, {}), 1);
  EXPECT_EQ(rigid_freedoms(mesh, dofs, Clamp({}, false)), 6);
}

/// A reference node far away that only equations use: the x of two nodes and the y of a third follow it.
Mesh tied_to_reference(Mesh mesh, int& reference) {
  reference = static_cast<int>(mesh.nodes.cols());
  mesh.nodes.conservativeResize(3, reference + 1);
  mesh.nodes.col(reference) = Vector3d(100, -30, 7);
  mesh.equations = {
      {{{5, 0, 1}, {reference, 0, -1}}}, {{{7, 0, 1}, {reference, 0, -1}}}, {{{6, 1, 2}, {reference, 1, -1}}}};
  return mesh;
}

TEST(RigidFreedoms, ReferenceNodesOfEquationsMoveAsTheyMust) {
  int reference = 0;
  Mesh mesh = frame();
  mesh.rigid_connections = {{4, cloud_nodes, all_components}};
  mesh = tied_to_reference(mesh, reference);
  const DofMap dofs = assemble(mesh).dofs;
  EXPECT_EQ(rigid_freedoms(mesh, dofs, {}), 5) << "nodes 5 and 7 keep abreast";
  EXPECT_EQ(rigid_freedoms(mesh, dofs, Clamp({}, false)), 5) << "a tie is no support";
  mesh.supports = {{reference, {true, true, false, false, false, false}}};
  EXPECT_EQ(rigid_freedoms(mesh, dofs, {}), 3);
  EXPECT_EQ(rigid_freedoms(mesh, dofs, Clamp({}, false)), 6) << "what follows a held reference node is held";
  mesh.supports.clear();
  mesh.equations.push_back({{{reference, 0, 2}}});
  mesh.equations.push_back({{{reference, 1, 1}}});
  EXPECT_EQ(rigid_freedoms(mesh, dofs, {}), 3);
  EXPECT_EQ(rigid_freedoms(mesh, dofs, Clamp({}, false)), 6);
}

TEST(RigidFreedoms, HeldFreedomsThatNothingFollowsDoNotHold) {
  Mesh mesh = frame();
  const auto reference = static_cast<int>(mesh.nodes.cols());
  mesh.nodes.conservativeResize(3, reference + 1);
  mesh.nodes.col(reference) = Vector3d(0.6, 0.2, 0.1);
  mesh.rigid_connections = {{4, {5}, all_components}};
  mesh.distributing_connections = {{reference, cloud_nodes, {1, 1, 1, 1}, {true, true, true, false, false, false}}};
  mesh.supports = {{reference, {false, false, false, true, true, true}}};
  const DofMap dofs = assemble(mesh).dofs;
  EXPECT_EQ(rigid_freedoms(mesh, dofs, {}), 6);
  mesh.distributing_connections[0].components = all_components;
  EXPECT_EQ(rigid_freedoms(mesh, dofs, {}), 3);
}

TEST(Supports, LeftOutWithTheEquationsThatHoldOneNode) {
  Mesh mesh = frame();
  mesh.supports = {{1, all_components}};
  mesh.equations = determinate_rollers();
  mesh.equations.push_back({{{5, 0, 1}, {1, 0, -1}}});  // node 1 is of the body: a tie
  mesh.equations.push_back({{{3, 2, 4}}});
  const Mesh free = without_supports(mesh);
  EXPECT_TRUE(free.supports.empty());
  ASSERT_EQ(free.equations.size(), 1U);
  EXPECT_EQ(free.equations[0].terms[1].node, 1);
  const DofMap dofs = assemble(mesh).dofs;
  EXPECT_EQ(unknowns(mesh, dofs, Clamp({}, false)).count, dofs.count - 1);
}

/// Smallest pivot of K + M over the unknowns, each scaled to one.
double definiteness(const Assembly& a, const Unknowns& u) {
  MatrixXd A = full(u.reduced(a.K)) + full(u.reduced(a.M));
  const VectorXd scale = A.diagonal().cwiseSqrt().cwiseInverse();
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(scale.asDiagonal() * A * scale.asDiagonal()).eigenvalues()(0);
}

TEST(Unknowns, ReferenceNodesHaveThoseThatConstraintsDetermine) {
  const auto with_reference = [](const auto& connect) {
    Mesh mesh = frame();
    const auto reference = static_cast<int>(mesh.nodes.cols());
    mesh.nodes.conservativeResize(3, reference + 1);
    mesh.nodes.col(reference) = Vector3d(0.5, 0.3, 0);
    mesh.rigid_connections = {{4, {5}, all_components}};
    connect(mesh, reference);
    return mesh;
  };
  const Components x = {true, false, false, false, false, false}, moves = {true, true, true, false, false, false};
  const std::vector<std::pair<Mesh, int>> cases = {
      // mesh, unknowns more than without the reference node
      {with_reference([](Mesh& m, int r) {
         m.equations = {{{{6, 0, 1}, {r, 0, -1}}}};
       }),
       0},
      {with_reference([](Mesh& m, int r) {
         m.equations = {{{{6, 0, 1}, {r, 0, -1}, {r, 1, 3}}}};
       }),
       0},
      {with_reference([](Mesh& m, int r) {
         m.equations = {{{{6, 0, 1}, {r, 4, -1}}}, {{{7, 2, 1}, {r, 4, 0.5}}}};
       }),
       -1},
      {with_reference([&](Mesh& m, int r) {
         m.rigid_connections.push_back({r, {6}, x});
       }),
       0},
      {with_reference([&](Mesh& m, int r) {
         m.rigid_connections.push_back({r, {6}, moves});
       }),
       0},
      {with_reference([&](Mesh& m, int r) {
         m.rigid_connections.push_back({r, {6, 7}, moves});
       }),
       -1},
      {with_reference([&](Mesh& m, int r) {
         m.distributing_connections = {{r, cloud_nodes, {1, 1, 1, 1}, x}};
       }),
       0},
      {with_reference([&](Mesh& m, int r) {
         m.distributing_connections = {{r, cloud_nodes, {1, 1, 1, 1}, moves}};
       }),
       0},
  };
  const Mesh plain = with_reference([](Mesh& m, int) { m.nodes.conservativeResize(3, m.nodes.cols() - 1); });
  const int before = unknowns(plain, assemble(plain).dofs, {}).count;
  for (size_t i = 0; i < cases.size(); ++i) {
    const Assembly a = assemble(cases[i].first);
    const Unknowns u = unknowns(cases[i].first, a.dofs, {});
    EXPECT_EQ(u.count, before + cases[i].second) << i;
    EXPECT_GT(definiteness(a, u), 1e-12) << i;
  }
}

TEST(RigidConnection, MovesItsNodesAsOneBody) {
  Mesh mesh = frame();
  mesh.rigid_connections = {{4, cloud_nodes, all_components}};
  const Assembly a = assemble(mesh);
  const Unknowns u = unknowns(mesh, a.dofs, {});
  EXPECT_EQ(u.count, a.dofs.count - 6 * 4);
  EXPECT_LT(rigid_defect(mesh, a.dofs, u), 1e-15);
  const MatrixXd T = transformation(u);
  const MatrixXd expected = T.transpose() * full(a.K) * T;
  EXPECT_LT((full(u.reduced(a.K)) - expected).cwiseAbs().maxCoeff(), 64 * eps * expected.cwiseAbs().maxCoeff());
}

// A mass that a rigid connection carries beside the tip is a rigid body with that offset.
TEST(RigidConnection, CarriesAMassLikeABodyWithOffset) {
  const Vector3d arm(0.02, 0.03, -0.01);
  Mesh body = make_mesh(uniform_boom(RoundBar{0.01}, 0.3, BeamTheory::timoshenko, 3, 4));
  Mesh connected = body;
  body.bodies = {{3, 0.2, Matrix3d::Zero(), arm}};
  connected.nodes.conservativeResize(3, 5);
  connected.nodes.col(4) = connected.nodes.col(3) + arm;
  connected.rigid_connections = {{3, {4}, all_components}};
  connected.bodies = {{4, 0.2, Matrix3d::Zero(), Vector3d::Zero()}};
  const auto mass = [](const Mesh& mesh) {
    const Assembly a = assemble(mesh);
    return full(unknowns(mesh, a.dofs, std::vector<int>{0}).reduced(a.M));
  };
  const MatrixXd expected = mass(body), got = mass(connected);
  ASSERT_EQ(got.rows(), expected.rows());
  EXPECT_LT((got - expected).cwiseAbs().maxCoeff(), 16 * eps * expected.cwiseAbs().maxCoeff());
}

TEST(RigidConnection, ChainsResolve) {
  Mesh mesh = frame();
  mesh.rigid_connections = {{5, {6, 7}, all_components}, {8, {5}, all_components}, {4, {8}, all_components}};
  const DofMap dofs = assemble(mesh).dofs;
  const Unknowns u = unknowns(mesh, dofs, {});
  EXPECT_EQ(u.count, dofs.count - 6 * 4);
  EXPECT_LT(rigid_defect(mesh, dofs, u), 1e-15);
}

TEST(RigidConnection, ALoopIsRedundantAndDropsOut) {
  Mesh mesh = frame();
  mesh.rigid_connections = {{5, {6}, all_components}, {6, {7}, all_components}, {7, {5}, all_components}};
  const DofMap dofs = assemble(mesh).dofs;
  const Unknowns u = unknowns(mesh, dofs, {});
  EXPECT_EQ(u.count, dofs.count - 6 * 2);
  EXPECT_LT(rigid_defect(mesh, dofs, u), 1e-14);
}

TEST(RigidConnection, AHeldFollowerHoldsItsReference) {
  Mesh mesh = frame();
  mesh.rigid_connections = {{4, {5}, all_components}};
  mesh.supports = {{5, all_components}};
  const DofMap dofs = assemble(mesh).dofs;
  const Unknowns u = unknowns(mesh, dofs, {});
  EXPECT_EQ(u.count, dofs.count - 12);
  const MatrixXd T = transformation(u);
  EXPECT_LT(T.middleRows<6>(dofs.of_node(4, 0)).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(DistributingConnection, FollowsTheMeanMotionAndSpreadsForces) {
  Mesh mesh = frame();
  mesh.distributing_connections = {{4, cloud_nodes, {1, 2, 1, 0.5}, all_components}};
  const Assembly a = assemble(mesh);
  const Unknowns u = unknowns(mesh, a.dofs, {});
  EXPECT_EQ(u.count, a.dofs.count - 6);
  EXPECT_LT(rigid_defect(mesh, a.dofs, u), 1e-14);
  // A force and a moment on the reference node arrive at the nodes as forces with the same resultant.
  const MatrixXd T = transformation(u);
  const MatrixXd motions = rigid_motions(mesh, a.dofs);
  for (int k = 0; k < 6; ++k) {
    VectorXd load = VectorXd::Zero(a.dofs.count);
    load(a.dofs.of_node(4, k)) = 1;
    const VectorXd spread = T.transpose() * load;
    const VectorXd resultant = motions(u.free_dofs(), Eigen::all).transpose() * spread;
    EXPECT_LT((resultant - motions.transpose() * load).norm(), 1e-14) << k;
  }
}

TEST(DistributingConnection, NodesOnALineAreRefused) {
  Mesh mesh = frame();
  for (int i = 0; i < 4; ++i) mesh.nodes.col(5 + i) = Vector3d(0.5 + 0.1 * i, 0, 0);
  mesh.elements.resize(7);  // the closing beam would fold back
  mesh.distributing_connections = {{4, cloud_nodes, {1, 1, 1, 1}, all_components}};
  EXPECT_EQ(
      input_error([&] { unknowns(mesh, assemble(mesh).dofs, {}); }),
      "distributing connection of node 4: its nodes lie on a line and cannot carry a rotation about it; add nodes "
      "beside the line");
}

TEST(LinearEquation, FirstTermFollowsOrTheNextThatCan) {
  Mesh mesh = frame();
  mesh.equations = {{{{5, 0, 2}, {6, 1, -1}, {0, 2, 4}}}};
  const DofMap dofs = assemble(mesh).dofs;
  const Unknowns u = unknowns(mesh, dofs, {});
  const MatrixXd T = transformation(u);
  EXPECT_EQ(u.follower, (std::vector<int>{dofs.of_node(5, 0)}));
  EXPECT_LT((2 * T.row(dofs.of_node(5, 0)) - T.row(dofs.of_node(6, 1)) + 4 * T.row(dofs.of_node(0, 2))).norm(), 1e-15);

  mesh.supports = {{5, {true, false, false, false, false, false}}};  // the first term is held: 4 u_0z = u_6y
  const Unknowns held = unknowns(mesh, dofs, {});
  const MatrixXd S = transformation(held);
  EXPECT_EQ(held.count, dofs.count - 2);
  EXPECT_LT((S.row(dofs.of_node(6, 1)) - 4 * S.row(dofs.of_node(0, 2))).norm(), 1e-15);

  mesh.equations.push_back(mesh.equations.front());
  EXPECT_EQ(unknowns(mesh, dofs, {}).count, dofs.count - 2) << "said twice counts once";
}

}  // namespace
}  // namespace flexboom::testing
