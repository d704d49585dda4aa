#include "reduction/basis/surface.hpp"

#include "fem/mesh/element.hpp"
#include "fem/mesh/shape_functions.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Triangles = std::vector<std::array<int, 3>>;

/// A face of a reference element, in numbers of the nodes of the element.
struct Face {
  std::vector<int> corners;
  Triangles triangles;
};

Matrix3Xd reference_nodes(const ElementType& type, int order) {
  const Index count = type.node_count(order);
  if (type.shape == Shape::tetrahedron) return tetrahedron_nodes().leftCols(count);
  if (type.shape == Shape::wedge) return wedge_nodes().leftCols(count);
  if (type.name != "hex") return hexahedron_nodes().leftCols(count);
  const Eigen::VectorXd& line = lobatto_basis(order).nodes();
  const Index n = line.size();
  Matrix3Xd nodes(3, count);
  for (Index a = 0; a < count; ++a) nodes.col(a) << line(a % n), line(a / n % n), line(a / (n * n));
  return nodes;
}

/// Outward normals of the faces of a reference element and their distances: normal . x = distance.
std::vector<std::pair<Vector3d, double>> planes(Shape shape) {
  if (shape == Shape::hexahedron)
    return {{{-1, 0, 0}, 1}, {{1, 0, 0}, 1}, {{0, -1, 0}, 1}, {{0, 1, 0}, 1}, {{0, 0, -1}, 1}, {{0, 0, 1}, 1}};
  if (shape == Shape::tetrahedron) return {{{-1, 0, 0}, 0}, {{0, -1, 0}, 0}, {{0, 0, -1}, 0}, {{1, 1, 1}, 1}};
  return {{{-1, 0, 0}, 0}, {{0, -1, 0}, 0}, {{1, 1, 0}, 1}, {{0, 0, -1}, 1}, {{0, 0, 1}, 1}};
}

constexpr double tiny = 1e-9;  // of reference elements of size 1 or 2

int node_at(const Matrix3Xd& reference, const std::vector<int>& nodes, const Vector3d& place) {
  for (const int node : nodes) {
    if ((reference.col(node) - place).norm() < tiny) return node;
  }
  return -1;
}

/// Corners of a face: its nodes that are corners of the element, all of whose coordinates are extreme.
std::vector<int> corners_of(Shape shape, const Matrix3Xd& reference, const std::vector<int>& nodes) {
  std::vector<int> corners;
  for (const int node : nodes) {
    const Eigen::Array3d x = reference.col(node).array();
    const double low = shape == Shape::hexahedron ? -1 : 0;
    Eigen::Array<bool, 3, 1> extreme = (x - low).abs() < tiny || (x - 1).abs() < tiny;
    if (shape == Shape::wedge) extreme(2) = std::abs(std::abs(x(2)) - 1) < tiny;
    if (extreme.all()) corners.push_back(node);
  }
  return corners;
}

/// Triangle or, with nodes amid its sides, four.
Triangles cut_triangle(const Matrix3Xd& reference, const std::vector<int>& nodes, const std::vector<int>& c) {
  if (nodes.size() == 3) return {{c[0], c[1], c[2]}};
  const auto mid = [&](size_t a, size_t b) {
    return node_at(reference, nodes, (reference.col(c[a]) + reference.col(c[b])) / 2);
  };
  const int m01 = mid(0, 1), m12 = mid(1, 2), m20 = mid(2, 0);
  return {{c[0], m01, m20}, {m01, c[1], m12}, {m20, m12, c[2]}, {m01, m12, m20}};
}

/// Quadrangle over its grid of nodes; eight nodes are cut at their corners.
Triangles cut_quadrangle(const Matrix3Xd& reference, const std::vector<int>& nodes, const std::vector<int>& c) {
  const Vector3d origin = reference.col(c[0]);
  const Vector3d a = reference.col(c[1]) - origin, b = reference.col(c[2]) - origin;  // sides: see faces_of
  std::vector<double> steps;                                                          // along a; the same along b
  for (const int node : nodes) {
    const Vector3d x = reference.col(node) - origin;
    if (std::abs(x.dot(b)) < tiny) steps.push_back(x.dot(a) / a.squaredNorm());
  }
  std::ranges::sort(steps);
  const auto at = [&](size_t i, size_t j) { return node_at(reference, nodes, origin + steps[i] * a + steps[j] * b); };
  if (nodes.size() == 8) {
    const std::array<int, 4> mid = {at(1, 0), at(2, 1), at(1, 2), at(0, 1)};
    return {{at(0, 0), mid[0], mid[3]}, {at(2, 0), mid[1], mid[0]}, {at(2, 2), mid[2], mid[1]},
            {at(0, 2), mid[3], mid[2]}, {mid[0], mid[1], mid[2]},   {mid[0], mid[2], mid[3]}};
  }
  Triangles triangles;
  for (size_t i = 0; i + 1 < steps.size(); ++i) {
    for (size_t j = 0; j + 1 < steps.size(); ++j) {
      triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return triangles;
}

std::vector<Face> faces_of(const ElementType& type, int order) {
  const Matrix3Xd reference = reference_nodes(type, order);
  std::vector<Face> faces;
  for (const auto& [normal, distance] : planes(type.shape)) {
    std::vector<int> nodes;
    for (int a = 0; a < reference.cols(); ++a) {
      if (std::abs(normal.dot(reference.col(a)) - distance) < tiny) nodes.push_back(a);
    }
    Face face{corners_of(type.shape, reference, nodes), {}};
    std::vector<int>& c = face.corners;
    if (c.size() == 4) {  // the two nearest to the first are at the ends of its sides
      std::ranges::sort(c.begin() + 1, c.end(), {},
                        [&](int node) { return (reference.col(node) - reference.col(c[0])).norm(); });
      // The far end of a wedge's quadrangle is further than both sides as well.
    }
    face.triangles = c.size() == 3 ? cut_triangle(reference, nodes, c) : cut_quadrangle(reference, nodes, c);
    for (auto& [i, j, k] : face.triangles) {
      const Vector3d area = (reference.col(j) - reference.col(i)).cross(reference.col(k) - reference.col(i));
      if (area.dot(normal) < 0) std::swap(j, k);
    }
    faces.push_back(std::move(face));
  }
  return faces;
}

}  // namespace

Surface surface_of(const Mesh& mesh) {
  std::map<std::pair<int, int>, std::vector<Face>> known;   // by row and order
  std::map<std::vector<int>, std::pair<int, size_t>> open;  // sorted corners -> element and face
  const auto faces_of_element = [&](const Element& element) -> const std::vector<Face>& {
    const auto [place, is_new] = known.try_emplace({element.type, element.order});
    if (is_new) place->second = faces_of(type_of(element), element.order);
    return place->second;
  };
  for (int e = 0; e < std::ssize(mesh.elements); ++e) {
    const Element& element = mesh.elements[static_cast<size_t>(e)];
    if (type_of(element).shape == Shape::line) continue;
    const std::vector<Face>& faces = faces_of_element(element);
    for (size_t f = 0; f < faces.size(); ++f) {
      std::vector<int> key;
      for (const int corner : faces[f].corners) key.push_back(element.nodes[static_cast<size_t>(corner)]);
      std::ranges::sort(key);
      const auto [place, alone] = open.try_emplace(std::move(key), e, f);
      if (!alone) open.erase(place);
    }
  }
  std::vector<std::pair<int, size_t>> outside;
  outside.reserve(open.size());
  for (const auto& [corners, place] : open) outside.push_back(place);
  std::ranges::sort(outside);
  Surface surface;
  for (const auto& [e, f] : outside) {
    const Element& element = mesh.elements[static_cast<size_t>(e)];
    for (std::array<int, 3> triangle : faces_of_element(element)[f].triangles) {
      for (int& node : triangle) node = element.nodes[static_cast<size_t>(node)];
      surface.triangles.push_back(triangle);
      surface.nodes.insert(surface.nodes.end(), triangle.begin(), triangle.end());
    }
  }
  std::ranges::sort(surface.nodes);
  surface.nodes.erase(std::unique(surface.nodes.begin(), surface.nodes.end()), surface.nodes.end());
  for (std::array<int, 3>& triangle : surface.triangles) {
    for (int& node : triangle)
      node = static_cast<int>(std::ranges::lower_bound(surface.nodes, node) - surface.nodes.begin());
  }
  return surface;
}

}  // namespace flexboom
