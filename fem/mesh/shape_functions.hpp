#pragma once

#include <Eigen/Core>

namespace flexboom {

/// Values (n) and gradients (n x 3, by the reference coordinates) of the shape functions of an element at a point.
struct ShapeFunctions {
  Eigen::VectorXd values;
  Eigen::MatrixX3d gradients;
};

/// Points and weights of a rule on a reference element.
struct PointRule {
  Eigen::Matrix3Xd points;
  Eigen::VectorXd weights;
};

// Shape functions at a point of the reference element: hexahedra on [-1, 1]^3, tetrahedra on r, s, t >= 0, r + s + t <=
// 1, wedges on r, s >= 0, r + s <= 1, t in [-1, 1]. Node orders as in README (VTK and Abaqus).
ShapeFunctions hex8_shapes(const Eigen::Vector3d&);
ShapeFunctions hex20_shapes(const Eigen::Vector3d&);
ShapeFunctions hex27_shapes(const Eigen::Vector3d&);
ShapeFunctions tet4_shapes(const Eigen::Vector3d&);
ShapeFunctions tet10_shapes(const Eigen::Vector3d&);
ShapeFunctions wedge6_shapes(const Eigen::Vector3d&);
ShapeFunctions wedge15_shapes(const Eigen::Vector3d&);

/// Reference positions of the nodes of hex8, hex20 and hex27, which begin alike (3 x 27).
const Eigen::Matrix3Xd& hexahedron_nodes();
/// Of tet4 and tet10 (3 x 10).
const Eigen::Matrix3Xd& tetrahedron_nodes();
/// Of wedge6 and wedge15 (3 x 15).
const Eigen::Matrix3Xd& wedge_nodes();

/// n^3 Gauss points of a hexahedron: exact to degree 2 n - 1 in each coordinate; the first runs fastest.
PointRule hexahedron_rule(int n);

/// 1, 4 or 15 points of a tetrahedron: exact to degree 1, 2, 5 (Stroud, Approximate Calculation of Multiple Integrals,
/// 1971, T3:5-1).
PointRule tetrahedron_rule(int points);

/// n^3 Gauss points of the cube collapsed to a tetrahedron: exact to degree 2 n - 3.
PointRule collapsed_tetrahedron_rule(int n);

/// 1, 3 or 6 points of the triangle (exact to degree 1, 2, 4; Dunavant, Int. J. Numer. Meth. Eng. 21 (1985) 1129) times
/// n Gauss points.
PointRule wedge_rule(int triangle_points, int n);

/// n^2 Gauss points of the square collapsed to a triangle (exact to degree 2 n - 2) times n Gauss points.
PointRule collapsed_wedge_rule(int n);

/// The order + 1 Lagrange polynomials on the Gauss-Lobatto-Legendre points of [-1, 1].
class LobattoBasis {
 public:
  explicit LobattoBasis(int order);

  const Eigen::VectorXd& nodes() const { return nodes_; }
  Eigen::VectorXd values(double x) const;
  Eigen::VectorXd slopes(double x) const { return derivative_.transpose() * values(x); }

 private:
  Eigen::VectorXd nodes_, barycentric_;
  Eigen::MatrixXd derivative_;  // (i, k): slope of polynomial k at node i
};

/// Basis of an order, made once. @throws InputError unless order is 1 to 8.
const LobattoBasis& lobatto_basis(int order);
inline constexpr int max_hexahedron_order = 8;

}  // namespace flexboom
