#include "reduction/invariants/geometric_stiffness.hpp"

#include "fem/base/check.hpp"
#include "fem/booms/solid_boom.hpp"
#include "fem/linear_algebra/sparse_factor.hpp"
#include "fem/mesh/shape_pairs.hpp"
#include "reduction/basis/modal_basis.hpp"
#include "reduction/basis/reduced_matrices.hpp"
#include "reduction/body/geometric_stiffness_loads.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "tests/reduction/geometric_stiffness_testing.hpp"

#include <gtest/gtest.h>

namespace flexboom::testing {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Entry (k, l), k >= l, of a packed lower triangle of n columns.
Index pair_of(Index k, Index l, Index n) { return l * n - l * (l - 1) / 2 + (k - l); }

MatrixXd unpacked(const VectorXd& pairs, Index n) {
  MatrixXd A(n, n);
  for (Index l = 0; l < n; ++l) {
    for (Index k = l; k < n; ++k) A(k, l) = A(l, k) = pairs(pair_of(k, l, n));
  }
  return A;
}

// ---- every row of the table ----

std::vector<Row> all_rows() {
  std::vector<Row> rows;
  for (size_t i = 0; i < element_types().size(); ++i) {
    for (const int order : element_types()[i].orders()) rows.push_back({i, order});
  }
  return rows;
}

class PrestressWork : public ::testing::TestWithParam<Row> {
 protected:
  const ElementType& type() const { return element_types()[GetParam().type]; }
  int order() const { return GetParam().order; }
  Mesh body(const Map3& map) const {
    if (is_solid(type())) return one_solid(type(), order(), map);
    return one_element(type(), order(), 0.3 * Vector3d(1, -2, 2) / 3, {0.4, 0.1, 0.9}, Rectangle{0.02, 0.03},
                       Rectangle{0.02, 0.03});
  }
  Index freedoms(const Mesh& mesh) const {
    return type().node_freedoms * mesh.nodes.cols() + type().internal_freedoms(mesh, mesh.elements[0]);
  }
  MatrixXd some_vectors(const Mesh& mesh, Index count) const {
    std::srand(7);
    return MatrixXd::Random(freedoms(mesh), count);
  }
  /// Vector of the linear displacement A X; rotations of beams follow the skew part.
  VectorXd linear(const Mesh& mesh, const Matrix3d& A) const {
    VectorXd q = VectorXd::Zero(freedoms(mesh));
    for (Index node = 0; node < mesh.nodes.cols(); ++node) {
      q.segment<3>(type().node_freedoms * node) = A * mesh.nodes.col(node);
      if (type().node_freedoms == 3) continue;
      q.segment<3>(6 * node + 3) = Vector3d(A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1)) / 2;
    }
    return q;
  }
  MatrixXd work(const Mesh& mesh, const MatrixXd& q0, const MatrixXd& q) const {
    MatrixXd work = MatrixXd::Zero(number_of_pairs(q.cols()), q0.cols());
    type().add_prestress_work(mesh, mesh.elements[0], q0, q, work);
    return work;
  }
};

// Pairs in another order are other rows: what says k, l must say l, k.
TEST_P(PrestressWork, IsSymmetricInTheShapesAndLinearInTheLoads) {
  const Mesh mesh = body(distort);
  const MatrixXd q = some_vectors(mesh, 4), q0 = some_vectors(mesh, 6).rightCols(2);
  MatrixXd load(q0.rows(), 3);
  load << q0, 2 * q0.col(0) - 3 * q0.col(1);
  const MatrixXd W = work(mesh, load, q), reversed = work(mesh, load, q.rowwise().reverse());
  const double scale = W.cwiseAbs().maxCoeff();
  ASSERT_EQ(W.rows(), 10);
  for (Index c = 0; c < 3; ++c) {
    const MatrixXd A = unpacked(W.col(c), 4), B = unpacked(reversed.col(c), 4).reverse();
    EXPECT_LT((A - B).cwiseAbs().maxCoeff(), 1e-13 * scale);
  }
  EXPECT_LT((W.col(2) - 2 * W.col(0) + 3 * W.col(1)).cwiseAbs().maxCoeff(), 1e-12 * scale);
}

// Kernels take eight pairs and six loads at a time: more than that, and what is left over.
TEST_P(PrestressWork, OfManyIsThatOfEach) {
  const Mesh mesh = body(distort);
  const Index shapes = 11, loads = 8;
  const MatrixXd q = some_vectors(mesh, shapes), q0 = some_vectors(mesh, shapes + loads).rightCols(loads);
  const MatrixXd W = work(mesh, q0, q);
  for (Index c = 0; c < loads; ++c) {
    const MatrixXd A = unpacked(W.col(c), shapes);
    for (Index k = 0; k < shapes; ++k) {
      MatrixXd two(q.rows(), 2);
      two << q.col(k), q.col(shapes - 1);
      const VectorXd alone = work(mesh, q0.col(c), two);  // kk, k last, last last
      const double scale = 1e-13 * A.cwiseAbs().maxCoeff();
      EXPECT_NEAR(A(k, k), alone(0), scale);
      EXPECT_NEAR(A(k, shapes - 1), alone(1), scale);
    }
  }
}

TEST_P(PrestressWork, OfARigidTranslationIsZero) {
  const Mesh mesh = body(distort);
  MatrixXd q = some_vectors(mesh, 5);
  for (Index k = 0; k < 3; ++k) {
    VectorXd u = VectorXd::Zero(q.rows());
    for (Index node = 0; node < mesh.nodes.cols(); ++node) u(type().node_freedoms * node + k) = 1;
    q.col(k) = u;
  }
  const MatrixXd W = work(mesh, some_vectors(mesh, 1), q), A = unpacked(W.col(0), 5);
  EXPECT_LT(A.leftCols(3).cwiseAbs().maxCoeff(), 1e-11 * A.cwiseAbs().maxCoeff());  // slopes are eps / h
  EXPECT_GT(A.bottomRightCorner(2, 2).cwiseAbs().minCoeff(), 0);
}

TEST_P(PrestressWork, OfATurnedElementIsTheSame) {
  const Matrix3d R = Eigen::AngleAxisd(1.1, Vector3d(1, 2, -0.5).normalized()).toRotationMatrix();
  const Mesh mesh = body(distort);
  Mesh turned = mesh;
  turned.nodes = R * mesh.nodes;
  for (BeamProperty& property : turned.beam_properties) property.y_axis = R * property.y_axis;
  const MatrixXd q = some_vectors(mesh, 4);
  MatrixXd turned_q = q;
  for (Index i = 0; i < type().node_freedoms * mesh.nodes.cols(); i += 3) {
    turned_q.middleRows<3>(i) = R * q.middleRows<3>(i);
  }
  const MatrixXd W = work(mesh, q, q);
  EXPECT_LT((work(turned, turned_q, turned_q) - W).cwiseAbs().maxCoeff(), 1e-11 * W.cwiseAbs().maxCoeff());
}

// Constant stress and constant slopes: volume sigma : A_k^T A_l of solids; of a beam whose stress is a tension N,
// N h (slope across the axis)^2.
TEST_P(PrestressWork, OfAUniformPrestressIsExact) {
  const Mesh mesh = body([](const Vector3d& x) {  // a parallelepiped, on which every rule is exact
    return Vector3d(0.7 + 0.11 * x(0) + 0.02 * x(1), -0.3 + 0.09 * x(1) - 0.01 * x(2), 1.1 + 0.13 * x(2) + 0.01 * x(0));
  });
  std::srand(11);
  const Matrix3d A0 = Matrix3d::Random();
  const std::array<Matrix3d, 2> A = {Matrix3d::Random(), Matrix3d::Random()};
  const double E = aluminium.E, nu = aluminium.nu;
  if (is_solid(type())) {
    double volume = 0;
    type().mass_points(mesh, mesh.elements[0], 0,
                       [&](double dm, const Vector3d&, const auto&) { volume += dm / aluminium.rho; });
    const Matrix3d strain = (A0 + A0.transpose()) / 2;
    const Matrix3d stress = E / (1 + nu) * (strain + nu / (1 - 2 * nu) * strain.trace() * Matrix3d::Identity());
    MatrixXd q(freedoms(mesh), 2);
    q << linear(mesh, A[0]), linear(mesh, A[1]);
    const MatrixXd W = unpacked(work(mesh, linear(mesh, A0), q).col(0), 2);
    for (Index k = 0; k < 2; ++k) {
      for (Index l = 0; l < 2; ++l) {
        const double exact = volume * (stress * A[size_t(k)].transpose() * A[size_t(l)]).trace();
        EXPECT_NEAR(W(k, l), exact, 1e-12 * volume * stress.norm() * A[0].norm() * A[1].norm());
      }
    }
    return;
  }
  const Vector3d axis = mesh.nodes.col(1) - mesh.nodes.col(0), t = axis.normalized();
  MatrixXd q(freedoms(mesh), 3);  // rigid rotations
  for (int k = 0; k < 3; ++k) {
    Matrix3d spin;
    for (int j = 0; j < 3; ++j) spin.col(j) = Vector3d::Unit(k).cross(Vector3d::Unit(j));
    q.col(k) = linear(mesh, spin);
  }
  const MatrixXd W = unpacked(work(mesh, linear(mesh, 1e-3 * t * t.transpose()), q).col(0), 3);
  const double N = E * 0.02 * 0.03 * 1e-3;
  const Matrix3d exact = N * axis.norm() * (Matrix3d::Identity() - t * t.transpose());
  EXPECT_LT((W - exact).cwiseAbs().maxCoeff(), 1e-11 * N * axis.norm());
}

INSTANTIATE_TEST_SUITE_P(Rows, PrestressWork, ::testing::ValuesIn(all_rows()), name_of_row);

// ---- beams against solids ----

/// Deflections x^2 and x^3 along y and z with sections normal to the axis, and the twist x: in the shapes of beams
/// (Hermite) and of solids of order 3.
MatrixXd five_shapes(const Model& model) {
  MatrixXd Phi = MatrixXd::Zero(model.assembly.dofs.count, 5);
  for (int node = 0; node < model.mesh.nodes.cols(); ++node) {
    const double x = model.mesh.nodes(0, node);
    const Vector3d arm(0, model.mesh.nodes(1, node), model.mesh.nodes(2, node));
    Eigen::Matrix<double, 3, 5> axis, theta;
    axis << 0, 0, 0, 0, 0, x * x, x * x * x, 0, 0, 0, 0, 0, x * x, x * x * x, 0;
    theta << 0, 0, 0, 0, x, 0, 0, -2 * x, -3 * x * x, 0, 2 * x, 3 * x * x, 0, 0, 0;
    const int first = model.assembly.dofs.of_node(node, 0);
    for (Index k = 0; k < 5; ++k) {
      Phi.block<3, 1>(first, k) = axis.col(k) + Vector3d(theta.col(k)).cross(arm);
    }
    if (model.assembly.dofs.freedoms_of(node) == 6) Phi.middleRows<3>(first + 3) = theta;
  }
  return Phi;
}

std::vector<MatrixXd> all_matrices(const GeometricStiffness& Kg) {
  std::vector<MatrixXd> all = Kg.spin;
  all.insert(all.end(), Kg.acceleration.begin(), Kg.acceleration.end());
  all.insert(all.end(), Kg.angular_acceleration.begin(), Kg.angular_acceleration.end());
  for (const MarkerStiffness& marker : Kg.markers) {
    all.insert(all.end(), marker.force.begin(), marker.force.end());
    all.insert(all.end(), marker.torque.begin(), marker.torque.end());
  }
  return all;
}

/// Unit torque about y or z at the tip of a solid: forces along x on arms in the section, whose work on the second
/// order of the rotation, u_x = theta_x (theta . r) / 2, a torque on the rotation vector does not have.
MatrixXd traction_term(const Model& model, const MatrixXd& Phi, int axis) {
  const int tip = model.assembly.dofs.of_node(node_set(model.mesh, "tip")[0], 3);
  const VectorXd x = Phi.row(tip), other = Phi.row(tip + 3 - axis);
  return (axis == 1 ? -0.5 : 0.5) * (x * other.transpose() + other * x.transpose());
}

// Tension, bending, shear and torsion of both, each against the other: what differs is of order (d / L)^2. With a heavy
// body off the axis at the tip, the arms of nodal bodies and rigid connections as well.
TEST(GeometricStiffness, OfBeamsIsThatOfSolids) {
  for (const bool heavy : {false, true}) {
    std::vector<std::vector<double>> errors(18);
    for (const double d : {0.1, 0.05}) {
      BeamGeometry g;
      g.segments.push_back({RoundBar{d}, RoundBar{d}, 1.0, soft, 4});
      if (heavy)
        g.attachments.push_back(
            {"body", 1.0, 2.0 * d * d / 0.01, d * d * Vector3d(2, 3, 4).asDiagonal(), {2 * d, d, -1.5 * d}});
      const Model beams = clamped(make_mesh(g)), solids = clamped(make_solid_mesh(g, coarse("hex", 3)));
      const MatrixXd Phi = five_shapes(beams);
      const auto exact =
          all_matrices(geometric_stiffness(beams.mesh, beams.assembly, beams.clamp, Phi, {.markers = {"tip"}}));
      const auto found = all_matrices(
          geometric_stiffness(solids.mesh, solids.assembly, solids.clamp, five_shapes(solids), {.markers = {"tip"}}));
      for (size_t i = 0; i < exact.size(); ++i) {
        MatrixXd expected = exact[i];
        if (i >= 16) expected += traction_term(beams, Phi, static_cast<int>(i) - 15);
        const double scale = i == 4 ? exact[1].cwiseAbs().maxCoeff() : expected.cwiseAbs().maxCoeff();  // w_y w_z: zero
        errors[i].push_back((found[i] - expected).cwiseAbs().maxCoeff() / scale);
      }
    }
    for (size_t i = 0; i < errors.size(); ++i) {
      EXPECT_LT(errors[i][1], 2e-3) << i << heavy;
      // 3e-4: the circle of cubic elements has a slightly different area.
      EXPECT_LT(errors[i][1], std::max(errors[i][0] / 3, 3e-4)) << i << heavy;
    }
  }
}

// A line mass on a clamp is statically determinate: both theories have the same resultants, and on shapes without shear
// the same Kg. (Prandtl's load does not see every sign: transposed couplings have the same critical load.)
TEST(GeometricStiffness, OfBothBeamTheoriesIsTheSameWithoutShear) {
  std::array<std::vector<MatrixXd>, 2> Kg;
  for (const BeamTheory theory : {BeamTheory::euler_bernoulli, BeamTheory::timoshenko}) {
    BeamGeometry g = uniform_boom(strip, 1.0, theory, 3, 4);
    g.rotary_inertia = false;
    const Model m = clamped(make_mesh(g));
    Kg[size_t(theory)] =
        all_matrices(geometric_stiffness(m.mesh, m.assembly, m.clamp, five_shapes(m), {.markers = {"tip"}}));
  }
  for (size_t i = 0; i < Kg[0].size(); ++i) {
    const double scale = std::max(Kg[1][i].cwiseAbs().maxCoeff(), 1e-3 * Kg[1][2].cwiseAbs().maxCoeff());
    EXPECT_LT((Kg[0][i] - Kg[1][i]).cwiseAbs().maxCoeff(), 1e-8 * scale) << i;  // eps cond(K)
  }
}

// ---- bodies that nothing holds ----

// The mean stress of a free body is known whatever its elasticity: integral sigma = sum f x^T (the virial). On linear
// shapes, here rigid rotations, Kg needs no more.
TEST(InertiaRelief, OfAFreeBoomHasItsMeanStress) {
  enum class Kind { beam, line_mass, solid };  // a line mass has no inertia about itself: five rigid motions
  BeamGeometry g = uniform_boom(Rectangle{0.02, 0.03}, 0.4, BeamTheory::timoshenko, 3, 4);
  for (const Kind kind : {Kind::beam, Kind::line_mass, Kind::solid}) {
    g.rotary_inertia = kind != Kind::line_mass;
    Model model = clamped(kind == Kind::solid ? make_solid_mesh(g, coarse("hex20")) : make_mesh(g));
    model.clamp = Clamp();
    const MatrixXd T = rigid_motions(model.mesh, model.assembly.dofs);
    const GeometricStiffness Kg = geometric_stiffness(model.mesh, model.assembly, model.clamp, T, {.markers = {"tip"}});
    const double m = aluminium.rho * 0.02 * 0.03 * 0.4, Sxx = m * 0.4 * 0.4 / 12,
                 Syy = kind == Kind::line_mass ? 0 : m * 0.02 * 0.02 / 12;
    const auto expected = [](double xx, double yy) {  // of rotations: tr(sigma) I - sigma
      MatrixXd K = MatrixXd::Zero(6, 6);
      K.diagonal().tail<3>() << yy, xx, xx + yy;
      return K;
    };
    const double tolerance = 1e-9 * Sxx;  // eps cond(K)
    EXPECT_LT((Kg.spin[2] - expected(Sxx, Syy)).cwiseAbs().maxCoeff(), tolerance);
    EXPECT_LT((Kg.markers[0].force[0] - expected(0.2, 0)).cwiseAbs().maxCoeff(), 1e-9 * 0.2);
    for (size_t i = 0; i < 3; ++i) {
      EXPECT_LT(Kg.acceleration[i].cwiseAbs().maxCoeff(), tolerance / 0.4);
      EXPECT_LT(Kg.angular_acceleration[i].cwiseAbs().maxCoeff(), tolerance);
    }
  }
}

// ---- loads ----

// The inertial loads of everything that has mass, by definition at every mass point, and what they do on the second
// order of the rotation of a body on a node.
TEST(GeometricStiffness, OfAnAccelerationIsThatOfItsInertialForces) {
  BeamGeometry g = uniform_boom(Rectangle{0.02, 0.03}, 0.4, BeamTheory::timoshenko, 2, 3);
  g.attachments.push_back({"lump", 0.2, 0.3, Vector3d(2e-3, 3e-3, 4e-3).asDiagonal(), {0.05, 0.02, -0.03}});
  g.rotary_inertia = false;
  for (const bool solid : {false, true}) {
    const Model model = clamped(solid ? make_solid_mesh(g, coarse("hex20")) : make_mesh(g));
    const MatrixXd Phi = clamped_modes(model.mesh, model.assembly, model.clamp, {.num_modes = 6, .sigma = {}}).Phi;
    ReducedBody body = blank_body("boom", 6);
    body.Me.setIdentity();
    body.Kg = geometric_stiffness(model.mesh, model.assembly, model.clamp, Phi);
    const Vector3d omega(1.5, -2, 0.7), a(3, 1, -2), alpha(-4, 5, 2);
    const auto inertial = [&](const Vector3d& u0) {
      return Vector3d(-a - alpha.cross(u0) - omega.cross(omega.cross(u0)));
    };
    VectorXd f = VectorXd::Zero(model.assembly.dofs.count);
    for_each_mass_point(model.mesh, model.assembly.dofs,
                        [&](double dm, const Vector3d& u0, const auto& N, std::span<const int> dofs) {
                          f(dofs) += dm * N.transpose() * inertial(u0);
                        });
    const Unknowns left = unknowns(model.mesh, model.assembly.dofs, model.clamp);
    const MatrixXd K = full(left.reduced(model.assembly.K));
    const MatrixXd T = left.expanded(MatrixXd::Identity(left.count, left.count));
    const VectorXd u0 = T * K.llt().solve(T.transpose() * f);
    MatrixXd expected = MatrixXd::Zero(6, 6);
    for (int e = 0; e < std::ssize(model.mesh.elements); ++e) {
      const Element& element = model.mesh.elements[size_t(e)];
      const std::vector<int> dofs = model.assembly.dofs.of_element(model.mesh, e);
      VectorXd work = VectorXd::Zero(21);
      type_of(element).add_prestress_work(model.mesh, element, u0(dofs), Phi(dofs, Eigen::all), work);
      expected += unpacked(work, 6);
    }
    const NodalBody& lump = model.mesh.bodies.at(0);
    const MatrixXd theta = Phi.middleRows<3>(model.assembly.dofs.of_node(lump.node, 3));
    nodal_body_mass_points(model.mesh, lump, [&](double dm, const Vector3d& x0, const auto&) {
      const Vector3d r = x0 - model.mesh.nodes.col(lump.node), force = dm * inertial(x0);
      for (Index k = 0; k < 6; ++k) {
        for (Index l = 0; l < 6; ++l) {
          const Vector3d x = theta.col(k), y = theta.col(l);
          expected(k, l) -= force.dot(x.cross(y.cross(r)) + y.cross(x.cross(r))) / 2;
        }
      }
    });
    const MatrixXd found = motion_stiffness(body, omega, a, alpha);
    EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-9 * expected.cwiseAbs().maxCoeff());  // eps cond(K)
  }
}

TEST(GeometricStiffness, ItsSizeDoesNotDependOnTheCoordinates) {
  // Coordinates of modes, whose Ke is diagonal, and others that span the same.
  ReducedBody modes, mixed;
  modes.Me = MatrixXd::Identity(4, 4);
  modes.Ke = Eigen::Vector4d(3, 40, 500, 6000).asDiagonal();
  modes.Ct = mixed.Ct = Eigen::Matrix3Xd::Zero(3, 4);
  MatrixXd Kg(4, 4), T(4, 4);
  Kg << -2, 1, 0.5, 3, 1, 7, -4, 2, 0.5, -4, 90, 8, 3, 2, 8, -700;
  T << 1, 0.2, -0.3, 0.1, 0, 1, 0.4, 0.2, 0.1, 0, 1, -0.5, 0, 0.3, 0, 1;
  mixed.Me = T.transpose() * T;
  mixed.Ke = T.transpose() * modes.Ke * T;
  ASSERT_EQ(modes.n(), 4);
  const auto here = relative_stiffness(modes, Kg), there = relative_stiffness(mixed, T.transpose() * Kg * T);
  for (size_t i = 0; i < 2; ++i) EXPECT_NEAR(here[i], there[i], 1e-12 * std::abs(here[i]));  // round-off
  EXPECT_LT(here[0], -2.0 / 3);                                                              // what the diagonal has
  EXPECT_GT(here[1], 90.0 / 500);
}

TEST(GeometricStiffness, DoesNotDependOnThreadsNorOnWhoFactorises) {
  const Model model = beam(strip, length, BeamTheory::timoshenko, 9, 3);
  const ModalBasis basis =
      clamped_modes(model.mesh, model.assembly, model.clamp, {.num_modes = 4, .sigma = {}, .keep_factor = true});
  const MatrixXd& Phi = basis.Phi;
  const auto matrices = [&](const GeometricOptions& options) {
    return all_matrices(geometric_stiffness(model.mesh, model.assembly, model.clamp, Phi, options));
  };
  const SparseMatrix K = unknowns(model.mesh, model.assembly.dofs, model.clamp).reduced(model.assembly.K);
  ASSERT_NE(basis.factor, nullptr);  // of K: a clamped body is solved with shift 0
  ASSERT_NE(basis.K, nullptr);
  EXPECT_EQ((*basis.K - K).norm(), 0);
  const StaticSolver statics(K, {}), of_modes(basis.factor, basis.K);
  const MatrixXd Ke = reduced_stiffness(model.mesh, model.assembly.dofs, Phi);
  const std::vector<MatrixXd> one = matrices({}), three = matrices({.markers = {}, .threads = 3}),
                              given = matrices({.markers = {}, .threads = 1, .statics = &statics}),
                              handed = matrices({.markers = {}, .threads = 1, .statics = &of_modes}),
                              once = matrices({.markers = {}, .threads = 1, .statics = &of_modes, .Ke = &Ke});
  for (size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i], three[i]);
    EXPECT_LT((one[i] - given[i]).norm(), 1e-9 * (one[i].norm() + one[2].norm()));
    EXPECT_LT((one[i] - handed[i]).norm(), 1e-9 * (one[i].norm() + one[2].norm()));
    EXPECT_LT((one[i] - once[i]).norm(), 1e-9 * (one[i].norm() + one[2].norm()));
  }
}

// A factor that is wrong by 1e-3: shapes that hold the static displacements restore all that it loses.
TEST(GeometricStiffness, StaticsAreCorrectedInTheSpanOfTheShapes) {
  const Model model = beam(strip, length, BeamTheory::timoshenko, 4, 3);
  const Unknowns left = unknowns(model.mesh, model.assembly.dofs, model.clamp);
  const SparseMatrix K = left.reduced(model.assembly.K), wrong = 1.001 * K;
  const MatrixXd f = left.reduced_loads(inertial_forces(model.mesh, model.assembly));
  const MatrixXd Phi = left.expanded(StaticSolver(K, {}).loaded(f(Eigen::all, {2, 7})));  // stretched, bent
  const MatrixXd Ke = reduced_stiffness(model.mesh, model.assembly.dofs, Phi);
  auto factor = std::make_shared<SparseFactor>(wrong, FactorKind::definite);
  factor->factorise(wrong);
  const StaticSolver statics(factor, std::make_shared<const SparseMatrix>(K));
  const auto matrices = [&](const GeometricOptions& options) {
    return geometric_stiffness(model.mesh, model.assembly, model.clamp, Phi, options);
  };
  const GeometricStiffness exact = matrices({}),
                           corrected = matrices({.markers = {}, .threads = 1, .statics = &statics, .Ke = &Ke});
  EXPECT_LT((corrected.spin[2] - exact.spin[2]).norm(), 1e-9 * exact.spin[2].norm());
}

TEST(GeometricStiffness, SaysWhatIsWrong) {
  Model model = beam(strip, length, BeamTheory::timoshenko, 2, 2);
  const MatrixXd Phi = MatrixXd::Random(model.assembly.dofs.count, 2);
  const auto call = [&](const MatrixXd& shapes, const Clamp& clamp, const GeometricOptions& options) {
    return input_error([&] { geometric_stiffness(model.mesh, model.assembly, clamp, shapes, options); });
  };
  EXPECT_NE(call(Phi.topRows(3), model.clamp, {}).find("shapes have 3 entries"), std::string::npos);
  EXPECT_NE(call(Phi, model.clamp, {.markers = {"tpi"}}).find("tpi"), std::string::npos);
  model.mesh.node_sets["axis"] = {0, 1, 2};
  EXPECT_NE(call(Phi, model.clamp, {.markers = {"axis"}}).find("lie on a line"), std::string::npos);
  model.mesh.supports.push_back({0, {true, true, true, false, false, false}});
  EXPECT_NE(call(Phi, Clamp(), {}).find("leaves 3 of the 6 rigid motions"), std::string::npos);
  model.assembly.K = SparseMatrix();
  EXPECT_NE(call(Phi, model.clamp, {}).find("was released"), std::string::npos);
}

TEST(GeometricStiffness, OfALoneNodeOfASolidHasNoTorque) {
  Model model = clamped(make_solid_mesh(uniform_boom(strip, 0.2, BeamTheory::timoshenko, 1, 1), coarse("hex8")));
  model.mesh.node_sets["corner"] = {node_set(model.mesh, "tip").front()};
  const MatrixXd Phi = MatrixXd::Random(model.assembly.dofs.count, 2);
  const GeometricStiffness Kg =
      geometric_stiffness(model.mesh, model.assembly, model.clamp, Phi, {.markers = {"corner"}});
  EXPECT_EQ(Kg.markers[0].force.size(), 3U);
  EXPECT_EQ(Kg.markers[0].torque.size(), 0U);
}

}  // namespace
}  // namespace flexboom::testing
