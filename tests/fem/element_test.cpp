#include "solid_testing.hpp"

namespace flexboom::testing {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

std::vector<Row> all_rows() {
  std::vector<Row> rows;
  for (size_t i = 0; i < element_types().size(); ++i) {
    for (const int order : element_types()[i].orders()) rows.push_back({i, order});
  }
  return rows;
}

// Every row of the table in each of its orders: a new row is tested by being there. The body is one element, oblique
// and distorted where its row allows.
class Elements : public ::testing::TestWithParam<Row> {
 protected:
  const ElementType& type() const { return element_types()[GetParam().type]; }
  int order() const { return GetParam().order; }
  Mesh body() const { return is_solid(type()) ? one_solid(type(), order(), distort) : oblique_beam(); }

  // The rigid motions of its freedoms about the origin (freedoms x 6).
  MatrixXd rigid(const Mesh& mesh) const {
    const Index per_node = type().node_freedoms;
    MatrixXd T = MatrixXd::Zero(freedoms(mesh), 6);
    for (Index node = 0; node < mesh.nodes.cols(); ++node) {
      for (Index k = 0; k < 3; ++k) {
        T(per_node * node + k, k) = 1;
        T.block<3, 1>(per_node * node, 3 + k) = Vector3d::Unit(k).cross(Vector3d(mesh.nodes.col(node)));
        if (per_node == 6) T(per_node * node + 3 + k, 3 + k) = 1;
      }
    }
    return T;
  }
  Index freedoms(const Mesh& mesh) const {
    return type().node_freedoms * mesh.nodes.cols() + type().internal_freedoms(mesh, mesh.elements[0]);
  }
  MatrixXd stiffness(const Mesh& mesh) const {
    return type().stiffness(mesh, mesh.elements[0]).selfadjointView<Eigen::Lower>();
  }
  MatrixXd mass(const Mesh& mesh) const { return type().mass(mesh, mesh.elements[0]).selfadjointView<Eigen::Lower>(); }
  // Strain energies of vectors, 1/2 q^T K q.
  VectorXd energies(const Mesh& mesh, const MatrixXd& q) const {
    return type().energy_strains(mesh, mesh.elements[0], q).rowwise().squaredNorm() / 2;
  }
  MatrixXd some_vectors(const Mesh& mesh) const {
    std::srand(3);
    return MatrixXd::Random(freedoms(mesh), 4);
  }
  // A point of the reference element.
  Vector3d inside() const {
    if (type().shape == Shape::line) return {0.3, 0, 0};
    return type().shape == Shape::hexahedron ? Vector3d(0.3, -0.6, 0.45) : Vector3d(0.2, 0.3, 0.4);
  }

 private:
  Mesh oblique_beam() const {
    return one_element(type(), order(), 0.3 * Vector3d(1, -2, 2) / 3, {0.4, 0.1, 0.9}, Rectangle{0.02, 0.03},
                       Rectangle{0.02, 0.03});
  }
};

TEST_P(Elements, StiffnessIsSumOverStrainPoints) {
  const Mesh mesh = body();
  const MatrixXd X = some_vectors(mesh), expected = X.transpose() * stiffness(mesh) * X;
  MatrixXd sum = MatrixXd::Zero(4, 4);
  type().strain_points(mesh, mesh.elements[0], [&](double weight, const MatrixXd& B, const MatrixXd& D) {
    EXPECT_EQ(D, D.transpose());
    const MatrixXd strain = B * X;
    sum += weight * strain.transpose() * D * strain;
  });
  EXPECT_LT((sum - expected).cwiseAbs().maxCoeff(), 1e-12 * expected.diagonal().maxCoeff());  // 1e3 points, 1e6 entries
}

TEST_P(Elements, MassIsSumOverMassPoints) {
  const Mesh mesh = body();
  const MatrixXd X = some_vectors(mesh), expected = X.transpose() * mass(mesh) * X;
  MatrixXd sum = MatrixXd::Zero(4, 4);
  type().mass_points(mesh, mesh.elements[0], 0, [&](double dm, const Vector3d&, const Eigen::Ref<const Matrix3Xd>& N) {
    const MatrixXd u = N * X;
    sum += dm * u.transpose() * u;
  });
  EXPECT_LT((sum - expected).cwiseAbs().maxCoeff(), 1e-12 * expected.diagonal().maxCoeff());
}

TEST_P(Elements, StrainEnergyIsHalfOfQuadraticForm) {
  const Mesh mesh = body();
  const MatrixXd X = some_vectors(mesh);
  const VectorXd expected = (X.cwiseProduct(stiffness(mesh) * X)).colwise().sum().transpose() / 2;
  const VectorXd energy = energies(mesh, X);
  EXPECT_LT((energy - expected).cwiseAbs().maxCoeff(), 1e-12 * expected.maxCoeff());
}

TEST_P(Elements, EnergyStrainsOfTwoVectorsHaveTheProductByTheStiffness) {
  const Mesh mesh = body();
  const MatrixXd X = some_vectors(mesh), E = type().energy_strains(mesh, mesh.elements[0], X);
  const MatrixXd expected = X.transpose() * stiffness(mesh) * X;
  EXPECT_LT((E * E.transpose() - expected).cwiseAbs().maxCoeff(), 1e-12 * expected.cwiseAbs().maxCoeff());
}

TEST_P(Elements, RigidMotionsStoreNoEnergy) {
  const Mesh mesh = body();
  const MatrixXd T = rigid(mesh), K = stiffness(mesh);
  const double scale = K.diagonal().maxCoeff();
  // Strains are differences of order eps / h, squared.
  EXPECT_LT(energies(mesh, T).maxCoeff(), 1e3 * eps * eps * scale);
  EXPECT_LT((K * T).cwiseAbs().maxCoeff(), 2e2 * eps * scale);
}

// K of a free body is positive definite once its six rigid motions have stiffness: nothing else is left without.
TEST_P(Elements, OnlySixMotionsStoreNoEnergy) {
  const Mesh mesh = body();
  const MatrixXd K = stiffness(mesh), T = rigid(mesh);
  const VectorXd scale = K.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixXd unit_K = scale.asDiagonal() * K * scale.asDiagonal();
  const MatrixXd scaled_T = scale.cwiseInverse().asDiagonal() * T;
  const Eigen::Matrix<double, 6, 6> R = (scaled_T.transpose() * scaled_T).llt().matrixU();
  const MatrixXd unit_T = scaled_T * R.inverse();
  EXPECT_LT((unit_K * unit_T).norm(), 1e-12);
  const Eigen::LLT<MatrixXd> factor(unit_K + unit_T * unit_T.transpose());
  ASSERT_EQ(factor.info(), Eigen::Success);
  EXPECT_GT(factor.matrixLLT().diagonal().cwiseAbs2().minCoeff(),
            1e-8);  // a lone hex20-reduced or wedge6 is held by a share of 1e-5
}

TEST_P(Elements, MassOfRigidMotionIsThatOfItsPoints) {
  const Mesh mesh = body();
  const MatrixXd T = rigid(mesh), M = T.transpose() * mass(mesh) * T;
  MatrixXd expected = MatrixXd::Zero(6, 6);
  type().mass_points(mesh, mesh.elements[0], 0, [&](double dm, const Vector3d& x, const Eigen::Ref<const Matrix3Xd>&) {
    Eigen::Matrix<double, 3, 6> N;  // u = t + r x X
    N.leftCols<3>().setIdentity();
    for (Index k = 0; k < 3; ++k) N.col(3 + k) = Vector3d::Unit(k).cross(x);
    expected += dm * N.transpose() * N;
  });
  EXPECT_LT((M - expected).cwiseAbs().maxCoeff(), 1e-12 * expected.diagonal().maxCoeff());
}

// K and M of a turned element are the turned K and M: node freedoms turn, internal ones stay.
TEST_P(Elements, TurnedElementHasTurnedMatrices) {
  const Matrix3d A = Eigen::AngleAxisd(1.1, Vector3d(1, 2, -0.5).normalized()).toRotationMatrix();
  const Mesh mesh = body();
  Mesh turned = mesh;
  turned.nodes = A * mesh.nodes;
  for (BeamProperty& property : turned.beam_properties) property.y_axis = A * property.y_axis;
  const MatrixXd X = some_vectors(mesh);
  MatrixXd turned_X = X;
  for (Index i = 0; i < type().node_freedoms * mesh.nodes.cols(); i += 3) {
    turned_X.middleRows<3>(i) = A * X.middleRows<3>(i);
  }
  const MatrixXd K = X.transpose() * stiffness(mesh) * X, M = X.transpose() * mass(mesh) * X;
  const MatrixXd turned_K = turned_X.transpose() * stiffness(turned) * turned_X,
                 turned_M = turned_X.transpose() * mass(turned) * turned_X;
  EXPECT_LT((turned_K - K).cwiseAbs().maxCoeff(), 1e-12 * K.diagonal().maxCoeff());
  EXPECT_LT((turned_M - M).cwiseAbs().maxCoeff(), 1e-12 * M.diagonal().maxCoeff());
}

TEST_P(Elements, InterpolationOfRigidMotionIsRigid) {
  const Mesh mesh = body();
  const MatrixXd T = rigid(mesh);
  const MatrixXd motion = type().interpolation(mesh, mesh.elements[0], inside()) * T;
  const Vector3d x = type().position(mesh, mesh.elements[0], inside());
  MatrixXd expected = MatrixXd::Identity(6, 6);
  for (Index k = 0; k < 3; ++k) expected.block<3, 1>(0, 3 + k) = Vector3d::Unit(k).cross(x);
  EXPECT_LT((motion - expected).cwiseAbs().maxCoeff(), 1e-12);  // of rotation 1
}

TEST_P(Elements, InvalidMeshIsRefused) {
  Mesh mesh = body();
  EXPECT_EQ(input_error([&] { type().validate(mesh, mesh.elements[0]); }), "nothing was thrown");
  mesh.elements[0].property = 7;
  EXPECT_EQ(
      input_error([&] { type().validate(mesh, mesh.elements[0]); }),
      is_solid(type()) ? "solid property 7 is missing; the mesh has 1" : "beam property 7 is missing; the mesh has 1");
}

// Solids alone: what follows from the map of the reference element.
class Solids : public Elements {
 protected:
  // The map that an element of this row can have exactly, so that sums are exact: any of degree 2 (of degree 1 in each
  // coordinate for order 1) where quadrature allows it, affine elsewhere. Bodies have volumes of some cm^3.
  Vector3d exact(const Vector3d& x) const {
    Vector3d at = affine * x + Vector3d(0.4, -0.2, 0.7);
    if (type().name == "hex") at += 0.01 * Vector3d(x(1) * x(2), x(0) * x(2), x.prod());
    if (type().name == "hex" && order() > 1)
      at += 0.008 * Vector3d(x(1) * x(1), x(2) * x(2) - x(0), x(0) * x(0) * x(1));
    return at;
  }
  // Central differences are exact for degree 2.
  template <class Function>
  static Matrix3d slopes(const Function& f, const Vector3d& x) {
    Matrix3d J;
    for (Index d = 0; d < 3; ++d) J.col(d) = f(x + Vector3d::Unit(d) / 2) - f(x - Vector3d::Unit(d) / 2);
    return J;
  }
  PointRule fine_rule() const {
    if (type().shape == Shape::tetrahedron) return collapsed_tetrahedron_rule(9);
    if (type().shape == Shape::wedge) return collapsed_wedge_rule(9);
    return hexahedron_rule(9);
  }
  const Matrix3d affine = (Matrix3d() << 0.10, 0.02, -0.01, 0.01, 0.12, 0.03, -0.02, 0.01, 0.09).finished();
};

TEST_P(Solids, MassCentreAndInertiaAreThoseOfFineQuadrature) {
  const Mesh mesh = one_solid(type(), order(), [this](const Vector3d& x) { return exact(x); });
  const MatrixXd T = rigid(mesh), M = T.transpose() * mass(mesh) * T;
  MatrixXd expected = MatrixXd::Zero(6, 6);
  const PointRule rule = fine_rule();
  for (Index q = 0; q < rule.weights.size(); ++q) {
    const Vector3d xi = rule.points.col(q), x = exact(xi);
    const Matrix3d J = slopes([this](const Vector3d& at) { return exact(at); }, xi);
    Eigen::Matrix<double, 3, 6> N;
    N.leftCols<3>().setIdentity();
    for (Index k = 0; k < 3; ++k) N.col(3 + k) = Vector3d::Unit(k).cross(x);
    expected += aluminium.rho * rule.weights(q) * J.determinant() * N.transpose() * N;
  }
  EXPECT_LT((M - expected).cwiseAbs().maxCoeff(), 1e-12 * expected.diagonal().maxCoeff());
}

TEST_P(Solids, ExtraMassPointsChangeNothingThatIsExact) {
  const Mesh mesh = one_solid(type(), order(), [this](const Vector3d& x) { return exact(x); });
  const auto second_moments = [&](int extra) {
    Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
    type().mass_points(mesh, mesh.elements[0], extra,
                       [&](double dm, const Vector3d& x, const Eigen::Ref<const Matrix3Xd>&) {
                         sum += dm * x.homogeneous() * x.homogeneous().transpose();
                       });
    return sum;
  };
  const Eigen::Matrix4d sum = second_moments(0);
  EXPECT_LT((second_moments(2) - sum).cwiseAbs().maxCoeff(), 1e-13 * sum(3, 3));
}

TEST_P(Solids, TranslationsStoreNothingAtAll) {
  const Mesh mesh = body();
  const VectorXd energy = energies(mesh, 1e3 * rigid(mesh).leftCols<3>());
  EXPECT_EQ(energy, VectorXd::Zero(3));
}

// Strains of a linear displacement are its gradient anywhere in any valid element.
TEST_P(Solids, LinearDisplacementIsReproduced) {
  const Mesh mesh = body();
  const Matrix3d G = (Matrix3d() << 1e-3, 2e-3, -1e-3, 4e-4, -2e-3, 3e-3, 1e-3, 0, 5e-4).finished();
  VectorXd q(freedoms(mesh));
  for (Index a = 0; a < mesh.nodes.cols(); ++a) q.segment<3>(3 * a) = G * mesh.nodes.col(a) + Vector3d(1, 2, 3);
  VectorXd strain(6);
  strain << G(0, 0), G(1, 1), G(2, 2), G(0, 1) + G(1, 0), G(1, 2) + G(2, 1), G(2, 0) + G(0, 2);
  double energy = 0;
  type().strain_points(mesh, mesh.elements[0], [&](double weight, const MatrixXd& B, const MatrixXd& D) {
    EXPECT_LT((B * q - strain).cwiseAbs().maxCoeff(), 1e-11 * 3e-3 + 1e-12);  // translation of 1 in elements of 0.1
    energy += weight / 2 * strain.dot(D * strain);
  });
  EXPECT_NEAR(energies(mesh, q)(0) / energy, 1, 1e-11);
  const VectorXd motion = type().interpolation(mesh, mesh.elements[0], inside()) * q;
  const Vector3d x = type().position(mesh, mesh.elements[0], inside());
  EXPECT_LT((motion.head<3>() - (G * x + Vector3d(1, 2, 3))).norm(), 1e-13 * 3);
  const Vector3d turn = Vector3d(G(2, 1) - G(1, 2), G(0, 2) - G(2, 0), G(1, 0) - G(0, 1)) / 2;
  EXPECT_LT((motion.tail<3>() - turn).norm(), 1e-12);
}

// Rotation is half the curl of displacement; gradients from central differences of the interpolation and the position.
TEST_P(Solids, RotationIsHalfCurlOfInterpolation) {
  const Mesh mesh = body();
  const VectorXd q = some_vectors(mesh).col(0);
  const auto u = [&](const Vector3d& at) {
    return Vector3d((type().interpolation(mesh, mesh.elements[0], at) * q).head<3>());
  };
  const auto x = [&](const Vector3d& at) { return type().position(mesh, mesh.elements[0], at); };
  constexpr double step = 1e-5;
  const auto small_slopes = [&](const auto& f) {
    Matrix3d J;
    for (Index d = 0; d < 3; ++d) {
      J.col(d) = (f(inside() + step * Vector3d::Unit(d)) - f(inside() - step * Vector3d::Unit(d))) / (2 * step);
    }
    return J;
  };
  const Matrix3d G = small_slopes(u) * small_slopes(x).inverse();
  const Vector3d turn = Vector3d(G(2, 1) - G(1, 2), G(0, 2) - G(2, 0), G(1, 0) - G(0, 1)) / 2;
  const VectorXd motion = type().interpolation(mesh, mesh.elements[0], inside()) * q;
  EXPECT_LT((motion.tail<3>() - turn).norm(), 1e-7 * G.norm());  // step^2 p^4
}

// Strain energy is the integral of that of the interpolation's gradients, wherever the element's rule is exact.
TEST_P(Solids, StrainEnergyIsThatOfInterpolation) {
  const bool exact_rule = type().name == "hex" || type().name == "hex20" || type().name == "hex27" ||
                          type().name == "tet4" || type().name == "tet10";
  if (!exact_rule) GTEST_SKIP() << "enhanced strains or reduced points";
  const auto map = [this](const Vector3d& x) { return Vector3d(affine * x + Vector3d(0.4, -0.2, 0.7)); };
  const Mesh mesh = one_solid(type(), order(), map);
  const VectorXd q = some_vectors(mesh).col(1);
  double energy = 0;
  const PointRule rule = order() > 4 ? hexahedron_rule(order() + 1) : fine_rule();
  const double lambda = aluminium.E * aluminium.nu / ((1 + aluminium.nu) * (1 - 2 * aluminium.nu));
  for (Index p = 0; p < rule.weights.size(); ++p) {
    Matrix3d G;
    constexpr double step = 2e-5;
    for (Index d = 0; d < 3; ++d) {
      const Vector3d xi = rule.points.col(p), h = step * Vector3d::Unit(d);
      G.col(d) = ((type().interpolation(mesh, mesh.elements[0], xi + h) -
                   type().interpolation(mesh, mesh.elements[0], xi - h)) *
                  q)
                     .head<3>() /
                 (2 * step);
    }
    G = (G * affine.inverse()).eval();
    const Matrix3d strain = (G + G.transpose()) / 2;
    energy += rule.weights(p) * affine.determinant() *
              (lambda / 2 * strain.trace() * strain.trace() + aluminium.shear_modulus() * strain.squaredNorm());
  }
  EXPECT_NEAR(energies(mesh, q)(0) / energy, 1, 1e-6);  // step^2 p^4 of differences
}

std::vector<Row> solid_rows() {
  std::vector<Row> rows = all_rows();
  std::erase_if(rows, [](const Row& row) { return !is_solid(element_types()[row.type]); });
  return rows;
}

INSTANTIATE_TEST_SUITE_P(Table, Elements, ::testing::ValuesIn(all_rows()), name_of_row);
INSTANTIATE_TEST_SUITE_P(Table, Solids, ::testing::ValuesIn(solid_rows()), name_of_row);

TEST(ElementTable, UnknownNameListsThoseThatExist) {
  EXPECT_EQ(element_types()[static_cast<size_t>(element_type("beam-timoshenko"))].name, "beam-timoshenko");
  EXPECT_EQ(
      input_error([] { element_type("beam"); }),
      "element type \"beam\" is not known; there are \"beam-euler-bernoulli\", \"beam-timoshenko\", \"hex\", \"hex8\", "
      "\"hex8-reduced\", \"hex20\", \"hex20-reduced\", \"hex27\", \"tet4\", \"tet10\", \"wedge6\", \"wedge15\"");
}

// Exact for every polynomial up to degree 2 n - 1; moments of even powers are 2 / (k + 1).
TEST(GaussRule, IntegratesItsDegreeExactly) {
  for (int n = 1; n <= 40; ++n) {
    const GaussRule& rule = gauss_rule(n);
    for (int k = 0; k <= 2 * n - 1; ++k) {
      const double sum = (rule.weights.array() * rule.points.array().pow(k)).sum();
      EXPECT_NEAR(sum, k % 2 ? 0 : 2.0 / (k + 1), 8 * eps) << n << " points, power " << k;
    }
  }
  EXPECT_EQ(input_error([] { gauss_rule(0); }), "Gauss rule of 0 points; there are 1 to 64");
}

TEST(NodalBody, MassPointsHaveItsMassCentreAndInertia) {
  Mesh mesh;
  mesh.nodes = Vector3d(0.1, 0.2, -0.3);
  const Matrix3d A = Eigen::AngleAxisd(0.7, Vector3d(1, 1, 2).normalized()).toRotationMatrix();
  const Matrix3d inertia = A * Vector3d(2e-3, 3e-3, 4.5e-3).asDiagonal() * A.transpose();
  const NodalBody body{0, 0.7, inertia, {0.05, -0.02, 0.01}};
  double m = 0;
  Vector3d first = Vector3d::Zero();
  Matrix3d second = Matrix3d::Zero();
  const Vector3d centre = Vector3d(mesh.nodes.col(0)) + body.offset;
  nodal_body_mass_points(mesh, body, [&](double dm, const Vector3d& x, const Eigen::Ref<const Eigen::Matrix3Xd>& N) {
    const Vector3d r = x - centre;
    m += dm;
    first += dm * r;
    second += dm * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose());
    const Vector3d theta(0.1, -0.3, 0.2), from_node = x - Vector3d(mesh.nodes.col(0));
    EXPECT_LT((N.rightCols<3>() * theta - theta.cross(from_node)).norm(), 4 * eps);
    EXPECT_TRUE((N.leftCols<3>().isIdentity(0)));
  });
  EXPECT_NEAR(m, body.mass, 4 * eps);
  EXPECT_LT(first.norm(), 4 * eps * body.mass);
  EXPECT_LT((second - inertia).cwiseAbs().maxCoeff(), 1e-14 * inertia.trace());
}

}  // namespace
}  // namespace flexboom::testing
