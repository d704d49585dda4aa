#include "solid_testing.hpp"

namespace flexboom::testing {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Rows of beams, each with several orders: what one element and a chain of them owe to beam theory.
class BeamElements : public ::testing::TestWithParam<std::tuple<size_t, int>> {
 protected:
  const ElementType& type() const { return element_types()[std::get<0>(GetParam())]; }
  int order() const { return std::get<1>(GetParam()); }

  Mesh along(const Vector3d& axis, const Vector3d& y_axis, const SectionShape& start, const SectionShape& end) const {
    return one_element(type(), order(), axis, y_axis, start, end);
  }
  Mesh along_x() const { return along({0.3, 0, 0}, {0, 1, 0}, bar, bar); }
  Mesh oblique() const { return along(0.3 * Vector3d(1, -2, 2) / 3, {0.4, 0.1, 0.9}, bar, bar); }

  const Rectangle bar{0.02, 0.03};
};

VectorXd inverse_sqrt_diagonal(const MatrixXd& A) { return A.diagonal().cwiseSqrt().cwiseInverse(); }

TEST_P(BeamElements, MassMatrixOfRigidMotionIsMassCentreAndInertia) {
  const Mesh mesh = oblique();
  const Assembly a = assemble(mesh);
  const MatrixXd T = rigid_motions(mesh, a.dofs);
  const MatrixXd M = T.transpose() * full(a.M) * T;
  const double L = 0.3, m = aluminium.rho * bar.height * bar.width * L;
  const Vector3d x = Vector3d(1, -2, 2) / 3;
  const Vector3d y = (Vector3d(0.4, 0.1, 0.9) - x * x.dot(Vector3d(0.4, 0.1, 0.9))).normalized();
  Matrix3d A;
  A << x, y, x.cross(y);
  const Vector3d centre = mesh.nodes.rowwise().mean();
  const double h2 = bar.height * bar.height / 12, w2 = bar.width * bar.width / 12;
  const Matrix3d central = A * m * Vector3d(h2 + w2, L * L / 12 + w2, L * L / 12 + h2).asDiagonal() * A.transpose();
  const Matrix3d inertia = central + m * (centre.squaredNorm() * Matrix3d::Identity() - centre * centre.transpose());
  EXPECT_LT((M.topLeftCorner<3, 3>() - m * Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-13 * m);
  for (int k = 0; k < 3; ++k) {
    const Vector3d moment = m * Vector3d::Unit(k).cross(centre);
    EXPECT_LT((M.block<3, 1>(0, 3 + k) - moment).norm(), 1e-13 * m * centre.norm());
  }
  EXPECT_LT((M.bottomRightCorner<3, 3>() - inertia).cwiseAbs().maxCoeff(), 1e-13 * inertia.trace());
}

// Frustum of a cone: integrals of d^2, x d^2, x^2 d^2, d^4 over s with d = d0 + c s.
TEST_P(BeamElements, TaperedRoundBarHasExactMassCentreAndInertia) {
  const double d0 = 0.03, d1 = 0.01, L = 0.3, c = d1 - d0;
  Mesh mesh = along({L, 0, 0}, {0, 1, 0}, RoundBar{d0}, RoundBar{d1});
  mesh.nodes.colwise() -= Vector3d(mesh.nodes.col(0));
  const Assembly a = assemble(mesh);
  const MatrixXd T = rigid_motions(mesh, a.dofs);
  const MatrixXd M = T.transpose() * full(a.M) * T;
  const double area = aluminium.rho * pi / 4 * L;
  const double m = area * (d0 * d0 + d0 * c + c * c / 3);
  const double mx = area * L * (d0 * d0 / 2 + 2 * d0 * c / 3 + c * c / 4);
  const double mxx = area * L * L * (d0 * d0 / 3 + 2 * d0 * c / 4 + c * c / 5);
  const double section = aluminium.rho * pi / 64 * L * (std::pow(d1, 5) - std::pow(d0, 5)) / (5 * c);
  EXPECT_NEAR(M(0, 0) / m, 1, 1e-13);
  EXPECT_NEAR(M(2, 4) / -mx, 1, 1e-13);
  EXPECT_NEAR(M(5, 1) / mx, 1, 1e-13);
  EXPECT_NEAR(M(3, 3) / (2 * section), 1, 1e-13);
  EXPECT_NEAR(M(4, 4) / (mxx + section), 1, 1e-13);
  EXPECT_NEAR(M(5, 5) / (mxx + section), 1, 1e-13);
}

TEST_P(BeamElements, ExtraMassPointsChangeNothing) {
  const Mesh mesh = along({0.3, 0, 0}, {0, 1, 0}, Rectangle{0.02, 0.03}, Rectangle{0.03, 0.01});
  const auto mass = [&](int extra) {
    MatrixXd M;
    type().mass_points(mesh, mesh.elements[0], extra,
                       [&](double dm, const Vector3d&, const Eigen::Ref<const Eigen::Matrix3Xd>& N) {
                         if (M.size() == 0) M.setZero(N.cols(), N.cols());
                         M += dm * N.transpose() * N;
                       });
    return M;
  };
  const MatrixXd M = mass(0), finer = mass(3);
  const VectorXd scale = inverse_sqrt_diagonal(M);
  EXPECT_LT((scale.asDiagonal() * (M - finer) * scale.asDiagonal()).cwiseAbs().maxCoeff(), 1e-13);
}

// Patch test: a chain of three unequal elements, clamped at one end and loaded at the other by each force and moment,
// bends, shears, twists and stretches exactly as the differential equation says.
TEST_P(BeamElements, CantileverOfUnequalElementsIsExactUnderTipLoads) {
  const Section s{6e-4, 2e-8, 4.5e-8, 4.7e-8, 0.8, 0.6};  // everything differs between the planes
  Mesh mesh = along({0.3, 0, 0}, {0, 1, 0}, s, s);
  mesh.nodes.resize(3, 4);
  mesh.nodes << 0, 0.05, 0.2, 0.3, 0, 0, 0, 0, 0, 0, 0, 0;
  const Element first = mesh.elements[0];
  mesh.elements.assign(3, first);
  for (int e = 0; e < 3; ++e) mesh.elements[static_cast<size_t>(e)].nodes = {e, e + 1};
  const Assembly a = assemble(mesh);
  const std::vector<int> free = free_dofs(a.dofs, std::vector<int>{0});
  const MatrixXd K = full(a.K, free);
  const bool sheared = type().name == "beam-timoshenko";
  const double L = 0.3, E = aluminium.E, G = aluminium.shear_modulus();
  const double shear_y = sheared ? L / (s.kappa_y * G * s.A) : 0, shear_z = sheared ? L / (s.kappa_z * G * s.A) : 0;
  MatrixXd exact = MatrixXd::Zero(6, 6);  // tip motion under unit tip loads
  exact.diagonal() << L / (E * s.A), L * L * L / (3 * E * s.Iz) + shear_y, L * L * L / (3 * E * s.Iy) + shear_z,
      L / (G * s.J), L / (E * s.Iy), L / (E * s.Iz);
  exact(1, 5) = exact(5, 1) = L * L / (2 * E * s.Iz);
  exact(2, 4) = exact(4, 2) = -L * L / (2 * E * s.Iy);
  const int tip = static_cast<int>(std::find(free.begin(), free.end(), a.dofs.of_node(3, 0)) - free.begin());
  MatrixXd load = MatrixXd::Zero(K.rows(), 6);
  load.middleRows<6>(tip).setIdentity();
  const MatrixXd found = K.llt().solve(load).middleRows<6>(tip);
  const VectorXd scale = inverse_sqrt_diagonal(exact);
  EXPECT_LT((scale.asDiagonal() * (found - exact) * scale.asDiagonal()).cwiseAbs().maxCoeff(), 2e-12);  // condition 1e4
}

// The strains of that chain are constant where the load makes them so: pure bending, torsion, tension.
TEST_P(BeamElements, ConstantStrainIsReproduced) {
  const Mesh mesh = along_x();
  const Assembly a = assemble(mesh);
  const std::vector<int> free = free_dofs(a.dofs, std::vector<int>{0});
  const MatrixXd K = full(a.K, free);
  VectorXd load = VectorXd::Zero(K.rows());
  load.head<6>() << 1e5, 0, 0, 100, 200, 300;  // N and N m on node 1, whose freedoms come first
  VectorXd u = VectorXd::Zero(a.dofs.count);
  const VectorXd solution = K.llt().solve(load);
  for (size_t i = 0; i < free.size(); ++i) u(free[i]) = solution(static_cast<Index>(i));
  type().strain_points(mesh, mesh.elements[0], [&](double, const MatrixXd& B, const MatrixXd& D) {
    const VectorXd stress = D * (B * u);
    VectorXd expected = VectorXd::Zero(stress.size());
    expected(0) = 1e5;
    expected.tail<3>() << 100, 200, 300;
    EXPECT_LT((stress - expected).cwiseAbs().maxCoeff(), 1e-11 * 1e5);
  });
}

TEST_P(BeamElements, InterpolationTakesNodeValuesAtTheEnds) {
  const Mesh mesh = oblique();
  const auto at = [&](double s) { return type().interpolation(mesh, mesh.elements[0], {s, 0, 0}); };
  const Index n = at(0).cols();
  MatrixXd expected = MatrixXd::Zero(6, n);
  expected.leftCols<6>().setIdentity();
  EXPECT_LT((at(0) - expected).cwiseAbs().maxCoeff(), 10 * eps);
  expected.setZero();
  expected.middleCols<6>(6).setIdentity();
  EXPECT_LT((at(1) - expected).cwiseAbs().maxCoeff(), 10 * eps);
}

// Strains are derivatives of the interpolation: central differences of u and theta at a point inside.
TEST_P(BeamElements, StrainsAreDerivativesOfInterpolation) {
  const Mesh mesh = along_x();
  const double L = 0.3, step = 1e-5;
  const bool sheared = type().name == "beam-timoshenko";
  const Index n = type().interpolation(mesh, mesh.elements[0], {0.5, 0, 0}).cols();
  std::srand(1);
  const VectorXd q = VectorXd::Random(n);
  const GaussRule& rule = gauss_rule(order() + 10);
  Index point = 0;
  type().strain_points(mesh, mesh.elements[0], [&](double, const MatrixXd& B, const MatrixXd&) {
    const double s = (1 + rule.points(point++)) / 2;
    const auto motion = [&](double at) {
      return VectorXd(type().interpolation(mesh, mesh.elements[0], {at, 0, 0}) * q);
    };
    const VectorXd slope = (motion(s + step) - motion(s - step)) / (2 * step * L), here = motion(s);
    VectorXd expected(6);
    expected << slope(0), slope(1) - here(5), slope(2) + here(4), slope(3), slope(4), slope(5);
    const VectorXd strain = B * q;
    const double scale = strain.cwiseAbs().maxCoeff();
    const double tolerance = 1e-5 * scale;  // step^2 p^4 of truncation at p = 12
    if (sheared) {
      EXPECT_LT((strain - expected).cwiseAbs().maxCoeff(), tolerance);
    } else {
      EXPECT_LT((strain - expected({0, 3, 4, 5})).cwiseAbs().maxCoeff(), tolerance);
      EXPECT_LT(expected.segment<2>(1).cwiseAbs().maxCoeff(), tolerance) << "Euler-Bernoulli has no shear";
    }
  });
  EXPECT_EQ(point, rule.points.size());
}

INSTANTIATE_TEST_SUITE_P(Table, BeamElements,
                         ::testing::Combine(::testing::Values(size_t{0}, size_t{1}),
                                            ::testing::Values(1, 2, 3, 5, 8, 12)),
                         [](const auto& row) {
                           return row_name(element_types()[std::get<0>(row.param)], std::get<1>(row.param));
                         });

}  // namespace
}  // namespace flexboom::testing
