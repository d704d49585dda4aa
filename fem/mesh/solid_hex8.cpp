#include "fem/mesh/solid_hex8.hpp"

#include "fem/mesh/elastic_fields.hpp"
#include "fem/mesh/elasticity.hpp"
#include "fem/mesh/shape_functions.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <array>
#include <cmath>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using elasticity::Lame;

using CornerRows = Eigen::Matrix<double, 8, 3>;
// Unknowns: displacements of the corners (24), amplitudes of the three incompatible displacements (9), of the
// volumetric strains (3).
constexpr Index displacements = 24, enhanced = 12, volumetric = 33;
using Amplitudes = Eigen::Matrix<double, enhanced, displacements>;

struct Point {
  double volume = 0;
  Eigen::Matrix<double, 11, 3> gradients;  // of the corners' functions, then of the incompatible ones
  Vector3d dilatation;                     // volumetric strains
};
using Points = std::array<Point, 8>;

// Shape functions at the points and the centre of the reference cube.
struct CubeTable {
  Eigen::Matrix3Xd points;
  std::array<CornerRows, 8> slopes;
  CornerRows centre;
  // The parts of a trilinear function beyond the linear ones, eta zeta, zeta xi, xi eta, xi eta zeta: at the corners,
  // and their slopes at the points.
  Eigen::Matrix<double, 8, 4> hourglass;
  std::array<Eigen::Matrix<double, 4, 3>, 8> hourglass_slopes;
};

const CubeTable& cube_table() {
  static const CubeTable made = [] {
    CubeTable t;
    t.points = hexahedron_rule(2).points;
    t.centre = hex8_shapes(Vector3d::Zero()).gradients;
    for (Index a = 0; a < 8; ++a) {
      const Vector3d x = hexahedron_nodes().col(a), p = t.points.col(a);
      t.hourglass.row(a) << x(1) * x(2), x(2) * x(0), x(0) * x(1), x.prod();
      t.slopes[static_cast<size_t>(a)] = hex8_shapes(p).gradients;
      t.hourglass_slopes[static_cast<size_t>(a)] << 0, p(2), p(1), p(2), 0, p(0), p(1), p(0), 0, p(1) * p(2),
          p(2) * p(0), p(0) * p(1);
    }
    return t;
  }();
  return made;
}

// Enhanced strains vanish in the mean over the element when they grow like 1 / det J: so constant stress does no work
// on them, which is the patch test.
void set_enhanced(Point& point, const Vector3d& xi, double ratio, const Matrix3d& G_centre) {
  point.gradients.bottomRows<3>() = -ratio * xi.asDiagonal() * G_centre;
  point.dilatation = ratio * Vector3d(xi(0) * xi(1), xi(1) * xi(2), xi(2) * xi(0));
}

// G(r, i) = d xi_r / d x_i.
Points full_points(const CornerRows& X) {
  const CubeTable& t = cube_table();
  const Matrix3d J_centre = X.transpose() * t.centre, G_centre = J_centre.inverse();
  const double volume_centre = J_centre.determinant();
  Points points;
  for (size_t q = 0; q < 8; ++q) {
    const Matrix3d J = X.transpose() * t.slopes[q];
    points[q].volume = J.determinant();
    points[q].gradients.topRows<8>() = t.slopes[q] * J.inverse();
    set_enhanced(points[q], t.points.col(static_cast<Index>(q)), volume_centre / points[q].volume, G_centre);
  }
  return points;
}

Points reduced_points(const CornerRows& X) {
  const CubeTable& t = cube_table();
  CornerRows mean = CornerRows::Zero();
  double volume = 0;
  for (size_t q = 0; q < 8; ++q) {
    const Matrix3d J = X.transpose() * t.slopes[q];
    const double part = J.determinant();
    mean += part * t.slopes[q] * J.inverse();
    volume += part;
  }
  mean /= volume;
  // Hourglass amplitudes that a linear displacement does not have.
  const Eigen::Matrix<double, 8, 4> gamma = (t.hourglass - mean * (X.transpose() * t.hourglass)) / 8;
  const Matrix3d G_centre = (X.transpose() * t.centre).inverse();
  Points points;
  for (size_t q = 0; q < 8; ++q) {
    points[q].volume = volume / 8;
    points[q].gradients.topRows<8>() = mean + gamma * (t.hourglass_slopes[q] * G_centre);
    set_enhanced(points[q], t.points.col(static_cast<Index>(q)), 1, G_centre);
  }
  return points;
}

template <Hex8Strain strain>
Points points_of(const Mesh& mesh, const Element& element) {
  const CornerRows X = elasticity::local_positions(mesh, element);
  return strain == Hex8Strain::full ? full_points(X) : reduced_points(X);
}

// Stiffness over all unknowns, lower triangle.
MatrixXd complete_stiffness(const Points& points, const Lame& lame) {
  const double bulk = 3 * lame.lambda + 2 * lame.mu;  // stress of a volumetric strain of 1 in each direction
  Eigen::Matrix<double, volumetric, 8> scaled;
  Eigen::Matrix<double, 3, 8> dilatations;
  for (size_t q = 0; q < 8; ++q) {
    const double root = std::sqrt(points[q].volume);
    scaled.col(static_cast<Index>(q)) = root * points[q].gradients.reshaped();
    dilatations.col(static_cast<Index>(q)) = root * points[q].dilatation;
  }
  MatrixXd K(volumetric + 3, volumetric + 3);
  K.topLeftCorner(volumetric, volumetric) =
      elasticity::stiffness_from_gradients(scaled.lazyProduct(scaled.transpose()), lame);
  const Eigen::Matrix<double, 3, volumetric> coupling = bulk * dilatations.lazyProduct(scaled.transpose());
  for (Index a = 0; a < 11; ++a) {  // from stacked by component to stacked by node
    for (Index i = 0; i < 3; ++i) K.block<3, 1>(volumetric, 3 * a + i) = coupling.col(11 * i + a);
  }
  K.bottomRightCorner<3, 3>() = 3 * bulk * dilatations.lazyProduct(dilatations.transpose());
  return K;
}

// Enhanced amplitudes that make the energy least: -K_aa^-1 K_au.
Amplitudes amplitudes(const MatrixXd& K) {
  const Eigen::Matrix<double, enhanced, enhanced> K_aa = K.bottomRightCorner<enhanced, enhanced>();
  return -K_aa.llt().solve(K.bottomLeftCorner<enhanced, displacements>());
}

// Displacements of the corners and of the incompatible modes, amplitudes of the volumetric strains.
struct Motion {
  Eigen::Matrix<double, 3, 11> U;
  Vector3d dilatation;
};

Motion motion_of(Eigen::Matrix<double, displacements, 1> u, const Amplitudes& A) {
  u -= u.head<3>().eval().replicate<8, 1>();  // a translation strains nothing
  const Eigen::Matrix<double, enhanced, 1> amplitude = A * u;
  Motion motion;
  motion.U << u.reshaped(3, 8), amplitude.head<9>().reshaped(3, 3);
  motion.dilatation = amplitude.tail<3>();
  return motion;
}

// (m, i): slope of component m along x_i.
Matrix3d gradient_at(const Point& point, const Motion& motion) {
  Matrix3d gradient = motion.U * point.gradients;
  gradient.diagonal().array() += point.dilatation.dot(motion.dilatation);
  return gradient;
}

elasticity::FieldSlopes field_slopes(const Points& points, const Amplitudes& A, const Eigen::Ref<const MatrixXd>& q) {
  elasticity::FieldSlopes fields(q.cols(), std::ssize(points));
  for (size_t p = 0; p < points.size(); ++p) fields.volumes(static_cast<Index>(p)) = points[p].volume;
  for (Index k = 0; k < q.cols(); ++k) {
    const Motion motion = motion_of(q.col(k), A);
    for (size_t p = 0; p < points.size(); ++p)
      fields.slopes.block<1, 9>(k, 9 * static_cast<Index>(p)) = gradient_at(points[p], motion).reshaped().transpose();
  }
  return fields;
}

Lame lame_of(const Mesh& mesh, const Element& element) {
  return elasticity::lame(elasticity::material_of(mesh, element));
}

}  // namespace

template <Hex8Strain strain>
MatrixXd Hex8<strain>::stiffness(const Mesh& mesh, const Element& element) {
  const MatrixXd K = complete_stiffness(points_of<strain>(mesh, element), lame_of(mesh, element));
  MatrixXd condensed = K.topLeftCorner<displacements, displacements>();
  condensed.triangularView<Eigen::Lower>() += K.bottomLeftCorner<enhanced, displacements>().transpose() * amplitudes(K);
  return condensed;
}

template <Hex8Strain strain>
void Hex8<strain>::strain_points(const Mesh& mesh, const Element& element, const StrainPointVisitor& visit) {
  const Points points = points_of<strain>(mesh, element);
  const Lame lame = lame_of(mesh, element);
  const Amplitudes A = amplitudes(complete_stiffness(points, lame));
  const MatrixXd D = elasticity::elasticity_matrix(lame);
  for (const Point& point : points) {
    const MatrixXd rows = elasticity::strain_rows(point.gradients);
    MatrixXd B = rows.leftCols<displacements>() + rows.rightCols<9>() * A.topRows<9>();
    B.topRows<3>().rowwise() += point.dilatation.transpose() * A.bottomRows<3>();
    visit(point.volume, B, D);
  }
}

template <Hex8Strain strain>
MatrixXd Hex8<strain>::energy_strains(const Mesh& mesh, const Element& element, const Eigen::Ref<const MatrixXd>& q) {
  const Points points = points_of<strain>(mesh, element);
  const Lame lame = lame_of(mesh, element);
  return elasticity::energy_strains(field_slopes(points, amplitudes(complete_stiffness(points, lame)), q), lame);
}

template <Hex8Strain strain>
void Hex8<strain>::add_prestress_work(const Mesh& mesh, const Element& element, const Eigen::Ref<const MatrixXd>& q0,
                                      const Eigen::Ref<const MatrixXd>& q, Eigen::Ref<MatrixXd> work) {
  const Points points = points_of<strain>(mesh, element);
  const Lame lame = lame_of(mesh, element);
  const Amplitudes A = amplitudes(complete_stiffness(points, lame));
  elasticity::add_prestress_work(field_slopes(points, A, q0), field_slopes(points, A, q), lame, work);
}

template struct Hex8<Hex8Strain::full>;
template struct Hex8<Hex8Strain::reduced>;

}  // namespace flexboom
