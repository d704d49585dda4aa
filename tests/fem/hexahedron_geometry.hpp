#pragma once

#include "fem/mesh/element.hpp"
#include "fem/mesh/section_grid.hpp"
#include "fem/mesh/shape_functions.hpp"

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>
#include <vector>

// Volume, surface and Jacobians of meshes of "hex" elements, by a route that shares nothing with the elements.
namespace flexboom::testing {

// Lagrange polynomials on Lobatto points and their derivatives, by their products (points x nodes).
struct Lagrange {
  Eigen::MatrixXd value, slope;
};
inline Lagrange lagrange(int order, const Eigen::VectorXd& points) {
  const Eigen::VectorXd g = lobatto_basis(order).nodes();
  Lagrange l{Eigen::MatrixXd(points.size(), g.size()), Eigen::MatrixXd(points.size(), g.size())};
  for (Eigen::Index k = 0; k < points.size(); ++k) {
    for (Eigen::Index i = 0; i < g.size(); ++i) {
      double value = 1, slope = 0;
      for (Eigen::Index j = 0; j < g.size(); ++j) {
        if (j == i) continue;
        slope = slope * (points(k) - g(j)) / (g(i) - g(j)) + value / (g(i) - g(j));
        value *= (points(k) - g(j)) / (g(i) - g(j));
      }
      l.value(k, i) = value;
      l.slope(k, i) = slope;
    }
  }
  return l;
}

// Values at tensor points of a polynomial through values at the nodes of a hexahedron, one matrix per direction.
inline Eigen::VectorXd tensor(const std::array<const Eigen::MatrixXd*, 3>& matrices, const Eigen::VectorXd& values) {
  const Eigen::Index n = matrices[0]->cols();
  Eigen::MatrixXd t = values.reshaped(n, n * n);
  for (size_t d = 0; d < 3; ++d) {
    const Eigen::MatrixXd turned = (*matrices[d] * t).transpose();  // the next direction comes first
    t = d < 2 ? Eigen::MatrixXd(turned.reshaped(n, turned.size() / n)) : turned;
  }
  return t.reshaped();
}

// Positions and Jacobian matrices of "hex" elements at tensor points; independent of the elements of the program.
class Geometry {
 public:
  Geometry(int order, const Eigen::VectorXd& points) : l_(lagrange(order, points)) {}

  template <class Visit>  // visit(point, position, Jacobian matrix)
  void visit(const Mesh& mesh, const Element& element, const Visit& visit) const {
    const Eigen::MatrixXd nodes = mesh.nodes(Eigen::all, element.nodes).transpose();
    const Eigen::Index q = l_.value.rows();
    std::array<Eigen::MatrixXd, 4> x;  // positions, and derivatives along each direction
    for (size_t d = 0; d < 4; ++d) {
      x[d].resize(q * q * q, 3);
      for (Eigen::Index c = 0; c < 3; ++c) {
        x[d].col(c) =
            tensor({d == 1 ? &l_.slope : &l_.value, d == 2 ? &l_.slope : &l_.value, d == 3 ? &l_.slope : &l_.value},
                   nodes.col(c));
      }
    }
    for (Eigen::Index i = 0; i < q * q * q; ++i) {
      Eigen::Matrix3d J;
      J << x[1].row(i), x[2].row(i), x[3].row(i);
      visit(i, Eigen::Vector3d(x[0].row(i)), J);
    }
  }

 private:
  Lagrange l_;
};

struct Integrals {
  double volume = 0, yy = 0, zz = 0, yz = 0, smallest = 1;
};
inline Integrals integrals(const Mesh& mesh) {
  const int order = mesh.elements.front().order;
  const GaussRule& rule =
      gauss_rule(std::max(order + 5, 2 * order + 1));  // y^2 det J has degree 5 p at most, and little of that
  const Geometry geometry(order, rule.points);
  const Eigen::Index q = rule.points.size();
  Integrals sum;
  for (const Element& element : mesh.elements) {
    geometry.visit(mesh, element, [&](Eigen::Index c, const Eigen::Vector3d& x, const Eigen::Matrix3d& J) {
      const double w = rule.weights(c % q) * rule.weights(c / q % q) * rule.weights(c / q / q) * J.determinant();
      sum.volume += w;
      sum.yy += w * x.y() * x.y();
      sum.zz += w * x.z() * x.z();
      sum.yz += w * x.y() * x.z();
    });
  }
  return sum;
}

// Smallest Jacobian over the largest of the element, at nodes and Gauss points.
inline double worst_jacobian(const Mesh& mesh) {
  const int order = mesh.elements.front().order;
  double worst = 1;
  for (const Eigen::VectorXd& points : {Eigen::VectorXd(lobatto_basis(order).nodes()), gauss_rule(order + 2).points}) {
    const Geometry geometry(order, points);
    for (const Element& element : mesh.elements) {
      double least = 1e300, most = -1e300;
      geometry.visit(mesh, element, [&](Eigen::Index, const Eigen::Vector3d&, const Eigen::Matrix3d& J) {
        least = std::min(least, J.determinant());
        most = std::max(most, J.determinant());
      });
      worst = std::min(worst, least / most);
    }
  }
  return worst;
}

inline std::vector<std::vector<int>> faces_of(const Element& element) {
  const int n = element.order + 1;
  std::vector<std::vector<int>> faces(6);
  for (int s = 0; s < n * n * n; ++s) {
    const std::array<int, 3> at = {s % n, s / n % n, s / n / n};
    for (size_t d = 0; d < 3; ++d) {
      if (at[d] == 0) faces[2 * d].push_back(element.nodes[static_cast<size_t>(s)]);
      if (at[d] == n - 1) faces[2 * d + 1].push_back(element.nodes[static_cast<size_t>(s)]);
    }
  }
  return faces;
}

inline double area(const Mesh& mesh, const std::vector<int>& face, int order) {
  const GaussRule& rule = gauss_rule(order + 4);
  const Lagrange l = lagrange(order, rule.points);
  const Eigen::Index n = order + 1, q = rule.points.size();
  double sum = 0;
  for (Eigen::Index c = 0; c < q * q; ++c) {
    Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = Eigen::Vector3d::Zero();
    for (Eigen::Index s = 0; s < n * n; ++s) {
      const Eigen::Vector3d x = mesh.nodes.col(face[static_cast<size_t>(s)]);
      a += l.slope(c % q, s % n) * l.value(c / q, s / n) * x;
      b += l.value(c % q, s % n) * l.slope(c / q, s / n) * x;
    }
    sum += rule.weights(c % q) * rule.weights(c / q) * a.cross(b).norm();
  }
  return sum;
}

// Every face belongs to one or two elements, and those of one make up the whole surface and nothing else.
inline double surface(const Mesh& mesh) {
  std::map<std::set<int>, std::pair<int, std::vector<int>>> count;
  for (const Element& element : mesh.elements) {
    for (const std::vector<int>& face : faces_of(element)) {
      auto& [times, nodes] = count[{face.begin(), face.end()}];
      ++times;
      nodes = face;
    }
  }
  double sum = 0;
  for (const auto& [key, face] : count) {
    EXPECT_LE(face.first, 2);
    if (face.first == 1) sum += area(mesh, face.second, mesh.elements.front().order);
  }
  return sum;
}

}  // namespace flexboom::testing
