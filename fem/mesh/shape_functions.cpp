#include "fem/mesh/shape_functions.hpp"

#include "fem/base/check.hpp"
#include "fem/mesh/element.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Barycentric coordinates of a triangle (3) or tetrahedron (4) and their constant slopes.
constexpr std::array<std::array<double, 3>, 4> tetrahedron_slopes = {{{-1, -1, -1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
constexpr std::array<std::array<double, 2>, 3> triangle_slopes = {{{-1, -1}, {1, 0}, {0, 1}}};
constexpr std::array<std::array<int, 2>, 6> tetrahedron_edges = {{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};
constexpr std::array<std::array<int, 2>, 3> triangle_edges = {{{0, 1}, {1, 2}, {2, 0}}};

Vector3d slopes_of(const std::array<double, 3>& s) { return {s[0], s[1], s[2]}; }

ShapeFunctions sized(Index nodes) { return {VectorXd(nodes), Eigen::MatrixX3d(nodes, 3)}; }

// f = product of one factor per direction; `slope` holds the derivative of each factor.
void set_product(ShapeFunctions& shapes, Index node, const Vector3d& factor, const Vector3d& slope) {
  shapes.values(node) = factor.prod();
  shapes.gradients.row(node) << slope(0) * factor(1) * factor(2), factor(0) * slope(1) * factor(2),
      factor(0) * factor(1) * slope(2);
}

// The quadratic Lagrange polynomial of [-1, 1] that is 1 at `node` (-1, 0 or 1), and its slope.
std::array<double, 2> quadratic(double node, double x) {
  if (node == 0) return {1 - x * x, -2 * x};
  return {x * (x + node) / 2, x + node / 2};
}

// Corner and edge functions of triangle (z = +-1: the face that t = z names) with the factor of the height.
void set_wedge15_face(ShapeFunctions& shapes, const std::array<double, 3>& L, double t, double z, Index corner,
                      Index edge) {
  for (size_t i = 0; i < 3; ++i) {
    // L (2 L - 1) (1 + z t) / 2 - L (1 - t^2) / 2
    const auto node = corner + static_cast<Index>(i);
    const double dL = (4 * L[i] - 1) * (1 + z * t) / 2 - (1 - t * t) / 2;
    shapes.values(node) = L[i] * ((2 * L[i] - 1) * (1 + z * t) - (1 - t * t)) / 2;
    shapes.gradients.row(node) << dL * triangle_slopes[i][0], dL * triangle_slopes[i][1],
        L[i] * ((2 * L[i] - 1) * z + 2 * t) / 2;
  }
  for (size_t e = 0; e < 3; ++e) {
    const auto i = static_cast<size_t>(triangle_edges[e][0]), j = static_cast<size_t>(triangle_edges[e][1]);
    const auto node = edge + static_cast<Index>(e);
    shapes.values(node) = 2 * L[i] * L[j] * (1 + z * t);
    for (size_t d = 0; d < 2; ++d) {
      shapes.gradients(node, static_cast<Index>(d)) =
          2 * (triangle_slopes[i][d] * L[j] + L[i] * triangle_slopes[j][d]) * (1 + z * t);
    }
    shapes.gradients(node, 2) = 2 * L[i] * L[j] * z;
  }
}

// Permutations of barycentric coordinates: a point of a symmetric rule.
struct Orbit {
  double weight;  // of each point; all sum to 1
  std::vector<std::array<double, 4>> points;
};

PointRule from_orbits(const std::vector<Orbit>& orbits, double volume) {
  Index count = 0;
  for (const Orbit& orbit : orbits) count += std::ssize(orbit.points);
  PointRule rule{Matrix3Xd(3, count), VectorXd(count)};
  Index i = 0;
  for (const Orbit& orbit : orbits) {
    for (const std::array<double, 4>& L : orbit.points) {
      rule.points.col(i) << L[1], L[2], L[3];
      rule.weights(i++) = orbit.weight * volume;
    }
  }
  return rule;
}

// Points (a, b, b, b) and permutations, b = (1 - a) / 3.
Orbit tetrahedron_vertex_orbit(double weight, double a) {
  const double b = (1 - a) / 3;
  return {weight, {{a, b, b, b}, {b, a, b, b}, {b, b, a, b}, {b, b, b, a}}};
}

Orbit triangle_orbit(double weight, double a) {
  const double b = (1 - a) / 2;
  return {weight, {{a, b, b, 0}, {b, a, b, 0}, {b, b, a, 0}}};
}

PointRule triangle_rule(int points) {
  if (points == 1) return from_orbits({{1, {{1.0 / 3, 1.0 / 3, 1.0 / 3, 0}}}}, 0.5);
  if (points == 3) return from_orbits({triangle_orbit(1.0 / 3, 2.0 / 3)}, 0.5);
  require(points == 6, fmt::format("triangle rule of {} points; there are 1, 3, 6", points));
  // Roots of the moment equations of degree 4: weights (620 +- sqrt(213125 - 53320 sqrt(10))) / 3720.
  const double s10 = std::sqrt(10.0), w = std::sqrt(213125 - 53320 * s10), r = std::sqrt(38 - 44 * std::sqrt(0.4));
  return from_orbits({triangle_orbit((620 + w) / 3720, 1 - 2 * (8 - s10 + r) / 18),
                      triangle_orbit((620 - w) / 3720, 1 - 2 * (8 - s10 - r) / 18)},
                     0.5);
}

PointRule times_line(const PointRule& triangle, int n) {
  const GaussRule& line = gauss_rule(n);
  const Index base = triangle.weights.size();
  PointRule rule{Matrix3Xd(3, base * n), VectorXd(base * n)};
  for (Index k = 0; k < n; ++k) {
    for (Index i = 0; i < base; ++i) {
      rule.points.col(k * base + i) << triangle.points(0, i), triangle.points(1, i), line.points(k);
      rule.weights(k * base + i) = triangle.weights(i) * line.weights(k);
    }
  }
  return rule;
}

// Means of two rows of nodes.
void append_middles(Matrix3Xd& nodes, Index& next, const std::vector<std::array<int, 2>>& pairs) {
  for (const auto& [a, b] : pairs) nodes.col(next++) = (nodes.col(a) + nodes.col(b)) / 2;
}

Matrix3Xd make_hexahedron_nodes() {
  Matrix3Xd nodes = Matrix3Xd::Zero(3, 27);
  nodes.leftCols<8>() << -1, 1, 1, -1, -1, 1, 1, -1, -1, -1, 1, 1, -1, -1, 1, 1, -1, -1, -1, -1, 1, 1, 1, 1;
  Index next = 8;
  append_middles(nodes, next,
                 {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6}, {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}});
  append_middles(nodes, next, {{0, 7}, {1, 6}, {0, 5}, {3, 6}, {0, 2}, {4, 6}});  // faces -x +x -y +y -z +z
  return nodes;
}

Matrix3Xd make_tetrahedron_nodes() {
  Matrix3Xd nodes(3, 10);
  nodes.leftCols<4>() << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
  Index next = 4;
  append_middles(nodes, next, {tetrahedron_edges.begin(), tetrahedron_edges.end()});
  return nodes;
}

Matrix3Xd make_wedge_nodes() {
  Matrix3Xd nodes(3, 15);
  nodes.leftCols<6>() << 0, 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, -1, -1, -1, 1, 1, 1;
  Index next = 6;
  append_middles(nodes, next, {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}});
  return nodes;
}

// Interior Lobatto points are the roots of P_p'. Newton from the Chebyshev points in long double, so that the rounded
// values are correct doubles.
VectorXd make_lobatto_points(int p) {
  VectorXd points(p + 1);
  for (int i = 0; i <= p; ++i) {
    long double x = -std::cos(std::numbers::pi_v<long double> * i / p);
    for (int iteration = 0; iteration < 20 && i > 0 && i < p; ++iteration) {
      long double P = x, previous = 1;
      for (int k = 1; k < p; ++k) {
        const long double next = ((2 * k + 1) * x * P - k * previous) / (k + 1);
        previous = P;
        P = next;
      }
      const long double slope = p * (x * P - previous) / (x * x - 1);
      const long double curvature = (2 * x * slope - p * (p + 1) * P) / (1 - x * x);
      x -= slope / curvature;
    }
    points(i) = 2 * i == p ? 0 : static_cast<double>(x);
  }
  points(0) = -1;
  points(p) = 1;
  return points;
}

}  // namespace

ShapeFunctions hex8_shapes(const Vector3d& x) {
  ShapeFunctions shapes = sized(8);
  for (Index a = 0; a < 8; ++a) {
    const Vector3d at = hexahedron_nodes().col(a);
    set_product(shapes, a, (Vector3d::Ones() + at.cwiseProduct(x)) / 2, at / 2);
  }
  return shapes;
}

ShapeFunctions hex20_shapes(const Vector3d& x) {
  ShapeFunctions shapes = sized(20);
  for (Index a = 0; a < 20; ++a) {
    const Vector3d at = hexahedron_nodes().col(a);
    Vector3d factor, slope;
    for (Index d = 0; d < 3; ++d) {
      factor(d) = at(d) == 0 ? 1 - x(d) * x(d) : (1 + at(d) * x(d)) / 2;
      slope(d) = at(d) == 0 ? -2 * x(d) : at(d) / 2;
    }
    set_product(shapes, a, factor, slope);
    if (a < 8) {  // a corner also vanishes at the middles of its edges: times (at . x - 2)
      const double bend = at.dot(x) - 2;
      shapes.gradients.row(a) = shapes.gradients.row(a) * bend + shapes.values(a) * at.transpose();
      shapes.values(a) *= bend;
    }
  }
  return shapes;
}

ShapeFunctions hex27_shapes(const Vector3d& x) {
  ShapeFunctions shapes = sized(27);
  for (Index a = 0; a < 27; ++a) {
    Vector3d factor, slope;
    for (Index d = 0; d < 3; ++d) {
      const auto [value, rate] = quadratic(hexahedron_nodes()(d, a), x(d));
      factor(d) = value;
      slope(d) = rate;
    }
    set_product(shapes, a, factor, slope);
  }
  return shapes;
}

ShapeFunctions tet4_shapes(const Vector3d& x) {
  ShapeFunctions shapes = sized(4);
  shapes.values << 1 - x.sum(), x;
  for (Index a = 0; a < 4; ++a) shapes.gradients.row(a) = slopes_of(tetrahedron_slopes[static_cast<size_t>(a)]);
  return shapes;
}

ShapeFunctions tet10_shapes(const Vector3d& x) {
  const ShapeFunctions L = tet4_shapes(x);
  ShapeFunctions shapes = sized(10);
  for (Index a = 0; a < 4; ++a) {
    shapes.values(a) = L.values(a) * (2 * L.values(a) - 1);
    shapes.gradients.row(a) = (4 * L.values(a) - 1) * L.gradients.row(a);
  }
  for (Index e = 0; e < 6; ++e) {
    const auto [a, b] = tetrahedron_edges[static_cast<size_t>(e)];
    shapes.values(4 + e) = 4 * L.values(a) * L.values(b);
    shapes.gradients.row(4 + e) = 4 * (L.values(a) * L.gradients.row(b) + L.values(b) * L.gradients.row(a));
  }
  return shapes;
}

ShapeFunctions wedge6_shapes(const Vector3d& x) {
  const std::array<double, 3> L = {1 - x(0) - x(1), x(0), x(1)};
  ShapeFunctions shapes = sized(6);
  for (Index a = 0; a < 6; ++a) {
    const auto i = static_cast<size_t>(a % 3);
    const double z = a < 3 ? -1 : 1, height = (1 + z * x(2)) / 2;
    shapes.values(a) = L[i] * height;
    shapes.gradients.row(a) << triangle_slopes[i][0] * height, triangle_slopes[i][1] * height, L[i] * z / 2;
  }
  return shapes;
}

ShapeFunctions wedge15_shapes(const Vector3d& x) {
  const std::array<double, 3> L = {1 - x(0) - x(1), x(0), x(1)};
  ShapeFunctions shapes = sized(15);
  set_wedge15_face(shapes, L, x(2), -1, 0, 6);
  set_wedge15_face(shapes, L, x(2), 1, 3, 9);
  const double arch = 1 - x(2) * x(2);
  for (size_t i = 0; i < 3; ++i) {
    const auto a = static_cast<Index>(12 + i);
    shapes.values(a) = L[i] * arch;
    shapes.gradients.row(a) << triangle_slopes[i][0] * arch, triangle_slopes[i][1] * arch, -2 * L[i] * x(2);
  }
  return shapes;
}

const Matrix3Xd& hexahedron_nodes() {
  static const Matrix3Xd nodes = make_hexahedron_nodes();
  return nodes;
}

const Matrix3Xd& tetrahedron_nodes() {
  static const Matrix3Xd nodes = make_tetrahedron_nodes();
  return nodes;
}

const Matrix3Xd& wedge_nodes() {
  static const Matrix3Xd nodes = make_wedge_nodes();
  return nodes;
}

PointRule hexahedron_rule(int n) {
  const GaussRule& line = gauss_rule(n);
  PointRule rule{Matrix3Xd(3, n * n * n), VectorXd(n * n * n)};
  Index q = 0;
  for (Index k = 0; k < n; ++k) {
    for (Index j = 0; j < n; ++j) {
      for (Index i = 0; i < n; ++i, ++q) {
        rule.points.col(q) << line.points(i), line.points(j), line.points(k);
        rule.weights(q) = line.weights(i) * line.weights(j) * line.weights(k);
      }
    }
  }
  return rule;
}

PointRule tetrahedron_rule(int points) {
  constexpr double volume = 1.0 / 6;
  if (points == 1) return from_orbits({{1, {{0.25, 0.25, 0.25, 0.25}}}}, volume);
  if (points == 4) return from_orbits({tetrahedron_vertex_orbit(0.25, (5 + 3 * std::sqrt(5.0)) / 20)}, volume);
  require(points == 15, fmt::format("tetrahedron rule of {} points; there are 1, 4, 15", points));
  const double s = std::sqrt(15.0), c = (10 - 2 * s) / 40, d = 0.5 - c;
  return from_orbits(
      {{16.0 / 135, {{0.25, 0.25, 0.25, 0.25}}},
       tetrahedron_vertex_orbit((2665 + 14 * s) / 37800, (13 + 3 * s) / 34),
       tetrahedron_vertex_orbit((2665 - 14 * s) / 37800, (13 - 3 * s) / 34),
       {10.0 / 189, {{c, c, d, d}, {c, d, c, d}, {c, d, d, c}, {d, c, c, d}, {d, c, d, c}, {d, d, c, c}}}},
      volume);
}

PointRule collapsed_tetrahedron_rule(int n) {
  PointRule rule = hexahedron_rule(n);
  for (Index q = 0; q < rule.weights.size(); ++q) {
    const Vector3d u = (rule.points.col(q).array() + 1) / 2;
    rule.points.col(q) << u(0), u(1) * (1 - u(0)), u(2) * (1 - u(0)) * (1 - u(1));
    rule.weights(q) *= (1 - u(0)) * (1 - u(0)) * (1 - u(1)) / 8;
  }
  return rule;
}

PointRule wedge_rule(int triangle_points, int n) { return times_line(triangle_rule(triangle_points), n); }

PointRule collapsed_wedge_rule(int n) {
  PointRule rule = hexahedron_rule(n);
  for (Index q = 0; q < rule.weights.size(); ++q) {
    const double u = (1 + rule.points(0, q)) / 2, v = (1 + rule.points(1, q)) / 2;
    rule.points.col(q) << u, v * (1 - u), rule.points(2, q);
    rule.weights(q) *= (1 - u) / 4;
  }
  return rule;
}

LobattoBasis::LobattoBasis(int order) : nodes_(make_lobatto_points(order)) {
  const Index n = nodes_.size();
  barycentric_.setOnes(n);
  for (Index i = 0; i < n; ++i) {
    for (Index k = 0; k < n; ++k) {
      if (k != i) barycentric_(i) /= nodes_(i) - nodes_(k);
    }
  }
  derivative_.setZero(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index k = 0; k < n; ++k) {
      if (k != i) derivative_(i, k) = barycentric_(k) / barycentric_(i) / (nodes_(i) - nodes_(k));
    }
    derivative_(i, i) = -derivative_.row(i).sum();  // a constant has no slope
  }
}

VectorXd LobattoBasis::values(double x) const {
  const Index n = nodes_.size();
  for (Index k = 0; k < n; ++k) {
    if (x == nodes_(k)) return VectorXd::Unit(n, k);
  }
  VectorXd weights = barycentric_.array() / (x - nodes_.array());
  return weights / weights.sum();
}

const LobattoBasis& lobatto_basis(int order) {
  require(order >= 1 && order <= max_hexahedron_order,
          fmt::format("order is {}; it must be 1 to {}", order, max_hexahedron_order));
  static const std::array<LobattoBasis, max_hexahedron_order> bases = {
      LobattoBasis(1), LobattoBasis(2), LobattoBasis(3), LobattoBasis(4),
      LobattoBasis(5), LobattoBasis(6), LobattoBasis(7), LobattoBasis(8)};
  return bases[static_cast<size_t>(order - 1)];
}

}  // namespace flexboom
