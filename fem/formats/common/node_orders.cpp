#include "fem/formats/common/node_orders.hpp"

#include "fem/mesh/element.hpp"
#include "fem/mesh/shape_functions.hpp"

#include <array>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Place = Eigen::Vector3i;  // i, j, k of a node

constexpr std::array<std::array<int, 3>, 8> corner_steps = {
    {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}};

/// Nodes of a line, quadrangle or hexahedron inside the big one, in the order of a format.
class NodeList {
 public:
  explicit NodeList(int p) : p_(p) {}

  void add(const Place& place) { order_.push_back(place[0] + (p_ + 1) * (place[1] + (p_ + 1) * place[2])); }

  /// The nodes strictly between two places that lie `steps` apart.
  void add_between(const Place& a, const Place& b, int steps) {
    for (int s = 1; s < steps; ++s) add(a + (b - a) / steps * s);
  }

  std::vector<int> order() && { return std::move(order_); }

 private:
  int p_;
  std::vector<int> order_;
};

std::array<Place, 8> corner_places(const Place& origin, int p) {
  std::array<Place, 8> result;
  for (size_t c = 0; c < 8; ++c)
    result[c] = origin + p * Place(corner_steps[c][0], corner_steps[c][1], corner_steps[c][2]);
  return result;
}

// A quadrangle of order p with corner a and unit steps u, v along its first and last edge.
void add_gmsh_quadrangle(NodeList& list, const Place& a, const Place& u, const Place& v, int p) {
  if (p < 0) return;
  list.add(a);
  if (p == 0) return;
  const Place b = a + p * u, c = b + p * v, d = a + p * v;
  for (const Place& corner : {b, c, d}) list.add(corner);
  list.add_between(a, b, p);
  list.add_between(b, c, p);
  list.add_between(c, d, p);
  list.add_between(d, a, p);
  add_gmsh_quadrangle(list, a + u + v, u, v, p - 2);
}

void add_gmsh_hexahedron(NodeList& list, const Place& origin, int p) {
  if (p < 0) return;
  const std::array<Place, 8> corner = corner_places(origin, p);
  if (p == 0) return list.add(origin);
  for (const Place& c : corner) list.add(c);
  constexpr std::array<std::array<size_t, 2>, 12> edges = {
      {{0, 1}, {0, 3}, {0, 4}, {1, 2}, {1, 5}, {2, 3}, {2, 6}, {3, 7}, {4, 5}, {4, 7}, {5, 6}, {6, 7}}};
  for (const auto& [a, b] : edges) list.add_between(corner[a], corner[b], p);
  constexpr std::array<std::array<size_t, 4>, 6> faces = {
      {{0, 3, 2, 1}, {0, 1, 5, 4}, {0, 4, 7, 3}, {1, 2, 6, 5}, {2, 3, 7, 6}, {4, 5, 6, 7}}};
  for (const auto& face : faces) {
    const Place u = (corner[face[1]] - corner[face[0]]) / p, v = (corner[face[3]] - corner[face[0]]) / p;
    add_gmsh_quadrangle(list, corner[face[0]] + u + v, u, v, p - 2);
  }
  add_gmsh_hexahedron(list, origin + Place::Ones(), p - 2);
}

// Weights of the p + 1 nodes at `from` for the values at `to`, one row per place: Lagrange's formula.
MatrixXd change_of_points(const Eigen::VectorXd& from, const Eigen::VectorXd& to) {
  MatrixXd result = MatrixXd::Ones(to.size(), from.size());
  for (Index i = 0; i < to.size(); ++i) {
    for (Index k = 0; k < from.size(); ++k) {
      for (Index m = 0; m < from.size(); ++m) {
        if (m != k) result(i, k) *= (to(i) - from(m)) / (from(k) - from(m));
      }
    }
  }
  return result;
}

// Values (components x (p + 1)^3) at new places in each of three directions. Each pass changes the points of the
// slowest direction and turns the directions round, so three passes change them all.
MatrixXd change_in_each_direction(const MatrixXd& change, MatrixXd values) {
  const Index components = values.rows(), n = change.rows(), plane = n * n;
  for (int pass = 0; pass < 3; ++pass) {
    MatrixXd turned(components, plane * n);
    for (Index c = 0; c < components; ++c) {
      const MatrixXd row = values.row(c).reshaped(plane, n);
      turned.row(c) = (change * row.transpose()).reshaped().transpose();
    }
    values = std::move(turned);
  }
  return values;
}

template <class Values>
Values moved(const Mesh& mesh, const Values& values, bool to_lobatto) {
  Values result = values;
  MatrixXd change;
  const int hex = element_type("hex");
  for (int order = 3; order <= max_hexahedron_order; ++order) {
    const Eigen::VectorXd lobatto = lobatto_basis(order).nodes();
    const Eigen::VectorXd equispaced = Eigen::VectorXd::LinSpaced(order + 1, -1, 1);
    change = to_lobatto ? change_of_points(equispaced, lobatto) : change_of_points(lobatto, equispaced);
    for (const Element& element : mesh.elements) {
      if (element.type != hex || element.order != order) continue;
      result(Eigen::all, element.nodes) = change_in_each_direction(change, values(Eigen::all, element.nodes));
    }
  }
  return result;
}

}  // namespace

std::vector<int> gmsh_hexahedron_order(int p) {
  NodeList list(p);
  add_gmsh_hexahedron(list, Place::Zero(), p);
  return std::move(list).order();
}

std::vector<int> vtk_hexahedron_order(int p, bool before_2_1) {
  NodeList list(p);
  const std::array<Place, 8> corner = corner_places(Place::Zero(), p);
  for (const Place& c : corner) list.add(c);
  constexpr std::array<std::array<size_t, 2>, 10> edges = {
      {{0, 1}, {1, 2}, {3, 2}, {0, 3}, {4, 5}, {5, 6}, {7, 6}, {4, 7}, {0, 4}, {1, 5}}};
  for (const auto& [a, b] : edges) list.add_between(corner[a], corner[b], p);
  for (const size_t c : before_2_1 ? std::array<size_t, 2>{3, 2} : std::array<size_t, 2>{2, 3})
    list.add_between(corner[c], corner[c + 4], p);
  // Faces -x +x -y +y -z +z, the first of their two directions fastest.
  for (int normal = 0; normal < 3; ++normal) {
    const int first = normal == 0 ? 1 : 0, second = normal == 2 ? 1 : 2;
    for (const int side : {0, p}) {
      for (int b = 1; b < p; ++b) {
        for (int a = 1; a < p; ++a)
          list.add(side * Place::Unit(normal) + a * Place::Unit(first) + b * Place::Unit(second));
      }
    }
  }
  for (int k = 1; k < p; ++k) {
    for (int j = 1; j < p; ++j) {
      for (int i = 1; i < p; ++i) list.add({i, j, k});
    }
  }
  return std::move(list).order();
}

Eigen::Matrix3Xd lobatto_from_equispaced(const Mesh& mesh, const Eigen::Matrix3Xd& points) {
  return moved(mesh, points, true);
}

MatrixXd equispaced_from_lobatto(const Mesh& mesh, const MatrixXd& values) { return moved(mesh, values, false); }

}  // namespace flexboom
