// What each target program computes from its file, by its own formulas, against the sum over the mass points of a body
// in arbitrary motion: index orders and signs that writer and reader share are found here.
#include "reduction/body/tilde.hpp"
#include "reduction/exports/coupling.hpp"
#include "reduction/exports/integrals.hpp"
#include "reduction/exports/mbdyn.hpp"
#include "reduction/exports/nasa42.hpp"
#include "reduction/exports/sid.hpp"
#include "tests/reduction/export_testing.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using test::BentBody;
using test::Random;

const BentBody& bent() {
  static const BentBody body = test::bent_body();
  return body;
}

/// Motion of a body in its own axes: accelerations of the origin and of rotation, rate, coordinates.
struct Motion {
  Vector3d a, alpha, w;
  VectorXd q, qd, qdd;
};

/// Coordinates of the body as it is: q of a size that makes all orders count.
Motion random_motion(unsigned seed) {
  Random random(seed);
  const Index n = bent().body.n();
  return {random.vector(),           random.vector(),     2 * random.vector(),
          0.1 * random.matrix(n, 1), random.matrix(n, 1), random.matrix(n, 1)};
}

/// The same motion in the coordinates of unit modal mass.
Motion in_modal(Motion x) {
  const MatrixXd T = modal_coordinates(bent().body).T;
  for (VectorXd* v : {&x.q, &x.qd, &x.qdd}) *v = T.fullPivLu().solve(*v).eval();
  return x;
}

/// Inertia force, torque about the origin and generalised inertia forces.
struct Loads {
  Vector3d force = Vector3d::Zero();
  Vector3d torque = Vector3d::Zero();
  VectorXd modal;
};

/// By definition: sums of dm times acceleration over the points of the finite elements.
Loads by_points(const Motion& x) {
  const MatrixXd& Phi = bent().basis.Phi;
  Loads sum;
  sum.modal = VectorXd::Zero(Phi.cols());
  for_each_mass_point(bent().mesh, bent().assembly.dofs,
                      [&](double dm, const Vector3d& u0, const auto& N, std::span<const int> dofs) {
                        const Matrix3Xd S = N * Phi(dofs, Eigen::all);
                        const Vector3d u = u0 + S * x.q;
                        const Vector3d acceleration =
                            x.a + x.alpha.cross(u) + x.w.cross(x.w.cross(u)) + 2 * x.w.cross(S * x.qd) + S * x.qdd;
                        sum.force += dm * acceleration;
                        sum.torque += dm * u.cross(acceleration);
                        sum.modal += dm * S.transpose() * acceleration;
                      });
  return sum;
}

/// The products of the invariants are sums over some 100 points: 1e-12 of the size of the result is round-off.
void expect_near(const VectorXd& A, const VectorXd& B, double tolerance = 1e-12) {
  EXPECT_LE((A - B).norm(), tolerance * B.norm()) << A.transpose() << "\n" << B.transpose();
}

MbdynFile written_mbdyn(const ReducedBody& body, const ExportOptions& options) {
  const auto path = test::test_folder() / "bent.fem";
  write_mbdyn(body, options, path);
  return read_mbdyn(path);
}

/// Inertia terms of AssRes in MBDyn's modal.cc, with R = I.
Loads by_mbdyn(const MbdynFile& f, const Motion& x) {
  const Index n = x.q.size();
  Matrix3d Inv8jaj = Matrix3d::Zero(), Inv8jaPj = Matrix3d::Zero(), Inv9aa = Matrix3d::Zero(),
           Inv9aP = Matrix3d::Zero();
  MatrixXd Inv5jaj = MatrixXd::Zero(3, n), Inv5jaPj = MatrixXd::Zero(3, n);
  for (Index j = 0; j < n; ++j) {
    Inv5jaj += x.q(j) * f.Inv5.middleCols(j * n, n);
    Inv5jaPj += x.qd(j) * f.Inv5.middleCols(j * n, n);
    Inv8jaj += x.q(j) * f.Inv8.middleCols<3>(3 * j);
    Inv8jaPj += x.qd(j) * f.Inv8.middleCols<3>(3 * j);
    for (Index k = 0; k < n; ++k) {
      const Matrix3d Inv9 = f.Inv9.middleCols<3>(3 * n * j + 3 * k);
      Inv9aa += x.q(j) * x.q(k) * Inv9;
      Inv9aP += x.q(j) * x.qd(k) * Inv9;
    }
  }
  const Vector3d S = f.m * f.centre + f.Inv3 * x.q;
  const Matrix3d J = f.inertia + centre_inertia(f.m, f.m * f.centre) + Inv8jaj + Inv8jaj.transpose() - Inv9aa;
  Loads loads;
  loads.force =
      x.a * f.m - S.cross(x.alpha) + x.w.cross(x.w.cross(S)) + f.Inv3 * x.qdd + 2 * x.w.cross(Vector3d(f.Inv3 * x.qd));
  loads.torque =
      S.cross(x.a) + J * x.alpha + x.w.cross(J * x.w) + (f.Inv4 + Inv5jaj) * x.qdd + 2 * (Inv8jaPj - Inv9aP) * x.w;
  loads.modal = f.mass * x.qdd + f.Inv3.transpose() * x.a + (f.Inv4 + Inv5jaj).transpose() * x.alpha +
                2 * Inv5jaPj.transpose() * x.w;
  for (Index j = 0; j < n; ++j) {
    Matrix3d M = f.Inv8.middleCols<3>(3 * j).transpose();
    for (Index k = 0; k < n; ++k) M -= x.q(k) * f.Inv9.middleCols<3>(3 * n * j + 3 * k);
    loads.modal(j) -= x.w.dot(M * x.w);
  }
  return loads;
}

void expect_inertia_forces_of_the_body(const MbdynFile& file) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Motion x = random_motion(seed);
    const Loads exact = by_points(x);
    const Loads program = by_mbdyn(file, x);
    expect_near(program.force, exact.force);
    expect_near(program.torque, exact.torque);
    expect_near(program.modal, exact.modal);
  }
}

TEST(ExportMotion, MbdynComputesTheInertiaForcesOfTheBody) {
  expect_inertia_forces_of_the_body(written_mbdyn(bent().body, {{{"invariants", "groups"}}}));
}

TEST(ExportMotion, MbdynComputesThemFromMassPoints) {
  MbdynFile file = written_mbdyn(bent().body, {});
  EXPECT_EQ(file.Inv3.size(), 0);
  sum_nodal_masses(file);
  expect_inertia_forces_of_the_body(file);
}

TEST(ExportMotion, MbdynStiffensByLoadsInItsOrder) {
  ReducedBody body = bent().body;
  test::add_random_stiffening(body, 5);
  const MbdynFile f = written_mbdyn(body, {{{"invariants", "groups"}, {"stiffening", "yes"}}});
  const auto& Kg = body.Kg;
  ASSERT_EQ(f.stiffening.size(), 12U + 3 * 6U);
  // omega products as mboct-fem takes them: squares, then xy, yz, zx; angular acceleration; acceleration; node loads.
  EXPECT_EQ(f.stiffening.at(3), Kg.spin[2]);
  EXPECT_EQ(f.stiffening.at(5), Kg.spin[4]);
  EXPECT_EQ(f.stiffening.at(7), Kg.angular_acceleration[0]);
  EXPECT_EQ(f.stiffening.at(12), Kg.acceleration[2]);
  EXPECT_EQ(f.stiffening.at(12 + 2), Kg.markers[0].force[1]);
  EXPECT_EQ(f.stiffening.at(12 + 6 + 6 + 6), Kg.markers[2].torque[2]);
}

/// Q, R, S as InitFlexModes of 42 makes them from L and N.
struct Tensors42 {
  explicit Tensors42(const File42& f) {
    for (size_t i = 0; i < f.L.size(); ++i) {
      R.push_back(f.L[i].transpose() - f.L[i].trace() * Matrix3d::Identity());
      Q.emplace_back();
      S.emplace_back();
      for (size_t j = 0; j < f.L.size(); ++j) {
        const Matrix3d& N = f.N[i][j];
        Q.back().emplace_back(N(2, 1) - N(1, 2), N(0, 2) - N(2, 0), N(1, 0) - N(0, 1));
        S.back().emplace_back(N.transpose() - N.trace() * Matrix3d::Identity());
      }
    }
  }
  std::vector<Matrix3d> R;
  std::vector<std::vector<Vector3d>> Q;
  std::vector<std::vector<Matrix3d>> S;
};

/// FindInertiaFrc, FindInertiaTrq, FindFlexInertiaFrc of 42 with REFPT_JOINT and second order flex terms, CN = I, signs
/// turned: inertia forces on the left side.
Loads by_42(const File42& f, const Motion& x) {
  const Tensors42 t(f);
  const Index n = x.q.size();
  Matrix3Xd HplusQeta = f.Hf;
  Matrix3Xd Qxi = Matrix3Xd::Zero(3, n);
  for (Index j = 0; j < n; ++j) {
    for (Index k = 0; k < n; ++k) {
      HplusQeta.col(j) += t.Q[static_cast<size_t>(j)][static_cast<size_t>(k)] * x.q(k);
      Qxi.col(j) += t.Q[static_cast<size_t>(j)][static_cast<size_t>(k)] * x.qd(k);
    }
  }
  const Vector3d c = f.mass * f.centre + f.Pf * x.q;
  Loads loads;
  loads.force = f.mass * x.a + x.alpha.cross(c) + x.w.cross(x.w.cross(c)) + 2 * x.w.cross(f.Pf * x.qd) + f.Pf * x.qdd;
  loads.torque = f.inertia * x.alpha + x.w.cross(f.inertia * x.w) + c.cross(x.a) + HplusQeta * x.qdd;
  loads.modal = f.Mf * x.qdd + f.Pf.transpose() * x.a + HplusQeta.transpose() * x.alpha;
  for (Index i = 0; i < n; ++i) {
    Matrix3d RS = t.R[static_cast<size_t>(i)];
    for (Index k = 0; k < n; ++k) RS += x.q(k) * t.S[static_cast<size_t>(i)][static_cast<size_t>(k)];
    loads.modal(i) += x.w.dot(RS * x.w) + 2 * x.w.dot(Qxi.col(i));
  }
  return loads;
}

File42 written_42(const ReducedBody& body, const ExportOptions& options = {}) {
  const auto folder = test::test_folder() / "bent";
  std::filesystem::create_directories(folder);
  write_42(body, options, folder);
  return read_42(folder);
}

TEST(ExportMotion, NASA42ComputesForcesAndModesOfTheBody) {
  const File42 file = written_42(bent().body);
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Motion x = random_motion(seed);
    expect_near(by_42(file, x).force, by_points(x).force);
    expect_near(by_42(file, x).modal, by_points(x).modal);
    // Its torque has the terms that do not change with q and q': as cannot_hold_42 says.
    Motion undeformed = x;
    undeformed.q.setZero();
    undeformed.qd.setZero();
    expect_near(by_42(file, undeformed).torque, by_points(undeformed).torque);
    Motion modal_only = x;
    modal_only.alpha.setZero();
    modal_only.w.setZero();
    expect_near(by_42(file, modal_only).torque, by_points(modal_only).torque);
  }
}

/// Wallrapp's equations, as EMBSlib has them, with Coriolis force of the mass centre.
Loads by_sid(const SidFile& f, const Motion& x) {
  const Index n = x.q.size();
  const auto at_q = [&x](const Taylor& t) {
    MatrixXd A = t.m0;
    for (size_t k = 0; k < t.m1.size(); ++k) A += x.q(static_cast<Index>(k)) * t.m1[k];
    return A;
  };
  const Vector3d mc = at_q(f.mdCM);
  const Matrix3d J = at_q(f.J);
  const MatrixXd Ct = at_q(f.Ct), Cr = at_q(f.Cr), Gr_all = at_q(f.Gr), Oe = at_q(f.Oe);
  Matrix3d Gr = Matrix3d::Zero();
  MatrixXd Ge = MatrixXd::Zero(n, 3);
  for (Index k = 0; k < n; ++k) {
    Gr += x.qd(k) * Gr_all.middleCols<3>(3 * k);
    Ge += x.qd(k) * f.Ge.m0.middleCols<3>(3 * k);
  }
  const Vector3d& w = x.w;
  VectorXd Omega(6);
  Omega << w(0) * w(0), w(1) * w(1), w(2) * w(2), w(0) * w(1), w(1) * w(2), w(0) * w(2);
  Loads loads;
  loads.force = f.mass * x.a - tilde(mc) * x.alpha + w.cross(w.cross(mc)) + f.Ct.m0.transpose() * x.qdd +
                2 * w.cross(Vector3d(f.Ct.m0.transpose() * x.qd));
  loads.torque = tilde(mc) * x.a + J * x.alpha + Cr.transpose() * x.qdd + Gr * w + w.cross(J * w);
  loads.modal = Ct * x.a + Cr * x.alpha + f.Me.m0 * x.qdd + Ge * w + Oe * Omega;
  return loads;
}

SidFile written_sid(const ReducedBody& body, const ExportOptions& options) {
  const auto path = test::test_folder() / "bent.SID_FEM";
  write_sid(body, options, path);
  return read_sid(path, options);
}

/// What the body has at the second order of q beyond a SID file: J2 in the torque.
Vector3d second_order_torque(const ReducedBody& body, const Motion& x) {
  Matrix3d J2 = Matrix3d::Zero();
  for (Index k = 0; k < x.q.size(); ++k) {
    for (Index l = 0; l < x.q.size(); ++l) {
      J2 += x.q(k) * x.q(l) * body.J2[static_cast<size_t>(k)][static_cast<size_t>(l)];
    }
  }
  return J2 * x.alpha + x.w.cross(J2 * x.w);
}

TEST(ExportMotion, SidComputesTheInertiaForcesOfTheBody) {
  const SidFile as_is = written_sid(bent().body, {{{"modal_mass", "as-is"}, {"Gr", "1"}}});
  const SidFile unit = written_sid(bent().body, {{{"Gr", "1"}}});
  const MatrixXd T = modal_coordinates(bent().body).T;
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Motion x = random_motion(seed);
    const Loads exact = by_points(x);
    const Vector3d torque = exact.torque - second_order_torque(bent().body, x);
    expect_near(by_sid(as_is, x).force, exact.force);
    expect_near(by_sid(as_is, x).torque, torque);
    expect_near(by_sid(as_is, x).modal, exact.modal);
    const Loads modal = by_sid(unit, in_modal(x));
    expect_near(modal.force, exact.force);
    expect_near(modal.torque, torque);
    expect_near(modal.modal, T.transpose() * exact.modal);
  }
}

TEST(ExportMotion, SidStiffensByEveryLoad) {
  ReducedBody body = bent().body;
  test::add_random_stiffening(body, 7);
  const SidFile file = written_sid(body, {{{"modal_mass", "as-is"}, {"Gr", "1"}}});
  const Motion x = random_motion(4);
  const Vector3d& w = x.w;
  MatrixXd K = MatrixXd::Zero(body.n(), body.n());
  const double products[] = {w(0) * w(0), w(1) * w(1), w(2) * w(2), w(0) * w(1), w(1) * w(2), w(2) * w(0)};
  for (size_t i = 0; i < 6; ++i) K += products[i] * body.Kg.spin[i];
  for (size_t i = 0; i < 3; ++i) {
    K += x.a(static_cast<Index>(i)) * body.Kg.acceleration[i] +
         x.alpha(static_cast<Index>(i)) * body.Kg.angular_acceleration[i];
  }
  const VectorXd stiffened = by_points(x).modal + K * x.q;
  expect_near(by_sid(file, x).modal, stiffened);
  const MatrixXd T = modal_coordinates(body).T;
  expect_near(by_sid(written_sid(body, {{{"Gr", "1"}}}), in_modal(x)).modal, T.transpose() * stiffened);
  // A force F and a torque T at a node do the work (F phi(q) + T psi(q)) dq: the stiffness is less of it.
  Random random(8);
  const Vector3d F = random.vector(), torque = random.vector();
  VectorXd work = VectorXd::Zero(body.n());
  MatrixXd K_node = MatrixXd::Zero(body.n(), body.n());
  const SidNode& node = file.nodes.back();
  for (size_t l = 0; l < node.phi.m1.size(); ++l) {
    work += x.q(static_cast<Index>(l)) * (node.phi.m1[l].transpose() * F + node.psi.m1[l].transpose() * torque);
  }
  for (size_t i = 0; i < 3; ++i) {
    K_node += F(static_cast<Index>(i)) * body.Kg.markers.back().force[i] +
              torque(static_cast<Index>(i)) * body.Kg.markers.back().torque[i];
  }
  expect_near(work, -K_node * x.q);
}

TEST(ExportMotion, CouplingIsTheLinearModel) {
  const auto path = test::test_folder() / "bent.json";
  write_coupling(bent().body, {}, path);
  const CouplingFile f = read_coupling(path);
  Motion x = random_motion(5);
  x.q.setZero();
  x.qd.setZero();
  x.w.setZero();
  const Loads exact = by_points(x);
  const Motion modal = in_modal(x);
  VectorXd base(6);
  base << x.a, x.alpha;
  // W = M_r x'' + L_P q'' with M_r = residual + L_P L_P^T.
  const VectorXd W = f.residual * base + f.L_P * (f.L_P.transpose() * base + modal.qdd);
  expect_near(W.head(3), exact.force);
  expect_near(W.tail(3), exact.torque);
  expect_near(modal.qdd + f.L_P.transpose() * base, modal_coordinates(bent().body).T.transpose() * exact.modal);
}

}  // namespace
}  // namespace flexboom
