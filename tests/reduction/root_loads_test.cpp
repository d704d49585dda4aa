#include "reduction/invariants/root_loads.hpp"

#include "fem/assembly/constraints.hpp"
#include "tests/reduction/export_testing.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include <cmath>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using test::bent;
using test::BentBody;
using Vector6d = Eigen::Vector<double, 6>;

/// A random motion with deflections as large as the body.
BodyMotion random_motion(unsigned seed, Index n) {
  test::Random random(seed);
  return {.v = random.vector(),
          .omega = 3 * random.vector(),
          .a = random.vector(),
          .alpha = 5 * random.vector(),
          .q = 0.2 * random.matrix(n, 1),
          .q_dot = random.matrix(n, 1),
          .q_ddot = 7 * random.matrix(n, 1)};
}

Vector6d stacked(const RootLoads& r) { return (Vector6d() << r.force, r.moment).finished(); }

/// Visits the mass points of the bent body with their shapes S.
template <class Visit>
void for_each_point(const BentBody& b, const Visit& visit) {
  for_each_mass_point(b.mesh, b.assembly.dofs,
                      [&](double dm, const Vector3d& u0, const auto& N, std::span<const int> dofs) {
                        visit(dm, u0, Matrix3Xd(N * b.basis.Phi(dofs, Eigen::all)));
                      });
}

TEST(RootLoads, AreTheForcesOnAllMassPoints) {
  const BentBody b = test::bent_body();
  const BodyMotion t = random_motion(1, b.body.n());
  RootLoads sum;
  BodyMomenta held{Vector3d::Zero(), Vector3d::Zero(), 0};
  for_each_point(b, [&](double dm, const Vector3d& u0, const Matrix3Xd& S) {
    const Vector3d u = u0 + S * t.q, u_dot = S * t.q_dot;
    const Vector3d acceleration =
        t.a + t.alpha.cross(u) + t.omega.cross(t.omega.cross(u)) + 2 * t.omega.cross(u_dot) + Vector3d(S * t.q_ddot);
    const Vector3d velocity = t.v + t.omega.cross(u) + u_dot;
    sum.force += dm * acceleration;
    sum.moment += dm * u.cross(acceleration);
    held.linear += dm * velocity;
    held.angular += dm * u.cross(velocity);
    held.kinetic += dm / 2 * velocity.squaredNorm();
  });
  // Sums of a few hundred points: 100 eps of the sum of their sizes, which is some ten times the result.
  const RootLoads r = root_loads(b.body, t);
  EXPECT_LT((r.force - sum.force).norm(), 1e-12 * sum.force.norm());
  EXPECT_LT((r.moment - sum.moment).norm(), 1e-12 * sum.moment.norm());
  const BodyMomenta p = momenta(b.body, t);
  EXPECT_LT((p.linear - held.linear).norm(), 1e-13 * held.linear.norm());
  EXPECT_LT((p.angular - held.angular).norm(), 1e-12 * held.angular.norm());
  EXPECT_NEAR(p.kinetic / held.kinetic, 1, 1e-13);
}

/// The motion after a time t of constant a (inertial axes), alpha and q_ddot, to second order in t.
struct Flight {
  BodyMotion at;
  Eigen::Matrix3d A;  // BRF -> inertial
};

Flight after(const BodyMotion& start, double t) {
  Flight f;
  f.at = start;
  f.at.omega += t * start.alpha;
  f.at.q += t * start.q_dot + t * t / 2 * start.q_ddot;
  f.at.q_dot += t * start.q_ddot;
  const Vector3d turn = t * start.omega + t * t / 2 * start.alpha;
  f.A = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  f.at.v = f.A.transpose() * (start.v + t * start.a);
  return f;
}

TEST(RootLoads, AreTheRatesOfTheMomenta) {
  const BodyMotion start = random_motion(2, bent().n());
  // d/dt (A P) = A F and d/dt (A H) + v x P = A M, H about the moving origin; momenta from derivatives of the energy.
  const auto momentum = [&](double t) {
    const Flight f = after(start, t);
    const auto kinetic_slope = [&](Vector3d BodyMotion::*velocity) {
      Vector3d slope;
      for (int i = 0; i < 3; ++i) {  // the energy is quadratic: a central difference is exact, its step may be large
        BodyMotion up = f.at, down = f.at;
        (up.*velocity)(i) += 1;
        (down.*velocity)(i) -= 1;
        slope(i) = (momenta(bent(), up).kinetic - momenta(bent(), down).kinetic) / 2;
      }
      return slope;
    };
    return (Vector6d() << f.A * kinetic_slope(&BodyMotion::v), f.A * kinetic_slope(&BodyMotion::omega)).finished();
  };
  const auto rate = [&](double h) -> Vector6d { return (momentum(h) - momentum(-h)) / (2 * h); };
  Vector6d expected = (4 * rate(1e-4) - rate(2e-4)) / 3;  // truncation h^4 omega^5: 1e-14; round-off 1e-16 / h: 1e-11
  expected.tail<3>() += start.v.cross(momenta(bent(), start).linear);
  const Vector6d loads = stacked(root_loads(bent(), start));
  EXPECT_LT((loads - expected).norm(), 1e-9 * expected.norm());
}

/// The bent body with another basis.
ReducedBody body_with(const BentBody& b, const MatrixXd& Phi) {
  ModalBasis basis = b.basis;
  basis.Phi = Phi;
  basis.kind.assign(static_cast<size_t>(Phi.cols()), ModeKind::other);
  basis.omega = VectorXd::Zero(Phi.cols());
  basis.coordinates.clear();
  return reduce(b.mesh, b.assembly, basis, "response");
}

MatrixXd full(const SparseMatrix& A) { return MatrixXd(A).selfadjointView<Eigen::Lower>(); }

/// Force and moment about the origin of the residual loads f (all freedoms) at the clamp.
Vector6d at_clamp(const BentBody& b, const VectorXd& f) {
  VectorXd held = VectorXd::Zero(f.size());
  for (int c = 0; c < 6; ++c) {
    const int freedom = b.assembly.dofs.of_node(node_set(b.mesh, "root").front(), c);
    held(freedom) = f(freedom);
  }
  return rigid_motions(b.mesh, b.assembly.dofs).transpose() * held;
}

TEST(RootLoads, AreTheReactionsOfTheClampToALoadAtTheTip) {
  const BentBody b = test::bent_body();
  const Unknowns left = unknowns(b.mesh, b.assembly.dofs, node_set(b.mesh, "root"));
  const MatrixXd K = full(b.assembly.K);
  const std::vector<int> i = left.free_dofs();
  for (int c = 0; c < 6; ++c) {
    VectorXd f = VectorXd::Zero(K.rows());
    // So small that the load does not move with its point: linear statics.
    const double size = 1e-8;
    f(b.assembly.dofs.of_node(node_set(b.mesh, "tip").front(), c)) = size;
    VectorXd u = VectorXd::Zero(K.rows());
    const MatrixXd K_ii = K(i, i);
    const VectorXd f_i = f(i);
    u(i) = VectorXd(K_ii.llt().solve(f_i));
    const Vector6d reaction = at_clamp(b, K * u);
    const ReducedBody body = body_with(b, u / u.norm());
    MarkerLoad load{"tip"};
    (c < 3 ? load.force : load.torque)(c % 3) = size;
    const Vector6d r = stacked(root_loads(body, {.q = VectorXd::Constant(1, u.norm())}, {load}));
    EXPECT_LT((r - reaction).norm(), 1e-7 * reaction.norm()) << c;  // digits that K u loses, and u / length
  }
}

TEST(RootLoads, AreTheReactionsToAHarmonicMotionOfTheClamp) {
  const BentBody b = test::bent_body();
  const Unknowns left = unknowns(b.mesh, b.assembly.dofs, node_set(b.mesh, "root"));
  const MatrixXd K = full(b.assembly.K), M = full(b.assembly.M), T = rigid_motions(b.mesh, b.assembly.dofs);
  const std::vector<int> i = left.free_dofs();
  const double squared = std::pow(1.3 * b.basis.omega(1), 2);  // between resonances
  for (int c = 0; c < 6; ++c) {
    // (K - w^2 M) u = -M T a, a and alpha of amplitude 1: the response u and its reaction are real.
    VectorXd u = VectorXd::Zero(K.rows());
    const MatrixXd dynamic = K(i, i) - squared * M(i, i);
    const VectorXd load = -(M * T.col(c))(i);
    u(i) = VectorXd(dynamic.lu().solve(load));
    const Vector6d reaction = at_clamp(b, K * u + M * (T.col(c) - squared * u));
    BodyMotion motion{.q_ddot = VectorXd::Constant(1, -squared)};
    (c < 3 ? motion.a : motion.alpha)(c % 3) = 1;
    const Vector6d r = stacked(root_loads(body_with(b, u), motion));
    // rows of K of 1e9 N/m and displacements of 1e-3 m leave 1e-10 N of reactions of 0.1 to 1 N
    EXPECT_LT((r - reaction).norm(), 1e-8 * reaction.norm()) << c;
  }
}

TEST(RootLoads, ParticipationIsTheReactionToAVibration) {
  const BentBody b = test::bent_body();
  const MatrixXd K = full(b.assembly.K), M = full(b.assembly.M), L = root_load_participation(b.body);
  for (Index k = 0; k < b.body.n(); ++k) {
    const double squared = std::pow(b.basis.omega(k), 2);
    const VectorXd phi = b.basis.Phi.col(k);
    const Vector6d reaction = at_clamp(b, K * phi - squared * (M * phi));
    EXPECT_LT((reaction + L.col(k)).norm(), 1e-7 * reaction.norm()) << k;  // digits that K phi loses
    const Vector6d loads = stacked(root_loads(b.body, {.q_ddot = -squared * VectorXd::Unit(b.body.n(), k)}));
    EXPECT_LT((loads + L.col(k)).norm(), 1e-12 * L.col(k).norm()) << k;
  }
}

TEST(RootLoads, OfRigidBodies) {
  const ReducedBody body = rigid_body("rod", 2, {1, 0, 0}, Vector3d(0, 2.0 / 3, 2.0 / 3).asDiagonal() * 4.0);
  // Spinning about z: centripetal force m w^2 l / 2 toward the root, no moment.
  const RootLoads spin = root_loads(body, {.omega = {0, 0, 3}});
  EXPECT_LT((spin.force - Vector3d(-9, 0, 0)).norm() + spin.moment.norm(), 1e-14);
  const RootLoads hang = root_loads(body, {.a = {0, 0, 9.81}});
  EXPECT_LT((hang.force - Vector3d(0, 0, 19.62)).norm() + (hang.moment - Vector3d(0, -9.81, 0)).norm(), 1e-13);
  EXPECT_EQ(root_load_participation(body).size(), 0);
}

TEST(RootLoads, BadInputIsNamed) {
  EXPECT_NE(test::message([] { root_loads(bent(), {.q_dot = VectorXd::Ones(2)}); }).find("2 values of q_dot"),
            std::string::npos);
  EXPECT_NE(test::message([] { root_loads(bent(), {}, {{"tipp"}}); }).find("no marker \"tipp\""), std::string::npos);
}

}  // namespace
}  // namespace flexboom
