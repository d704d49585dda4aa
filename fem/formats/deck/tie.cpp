#include "fem/formats/deck/tie.hpp"

#include "fem/base/at.hpp"
#include "fem/mesh/element.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace flexboom {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3Xd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Weights = std::array<double, 8>;

constexpr int faces_per_leaf = 4;
constexpr int newton_steps = 40;

struct Shapes {
  Weights N{}, dr{}, ds{};
};

Shapes triangle(int count, double r, double s) {
  const double t = 1 - r - s;
  if (count == 3) return {{t, r, s}, {-1, 1, 0}, {-1, 0, 1}};
  return {{t * (2 * t - 1), r * (2 * r - 1), s * (2 * s - 1), 4 * t * r, 4 * r * s, 4 * s * t},
          {1 - 4 * t, 4 * r - 1, 0, 4 * (t - r), 4 * s, -4 * s},
          {1 - 4 * t, 0, 4 * s - 1, -4 * r, 4 * r, 4 * (t - s)}};
}

Shapes quadrangle(int count, double r, double s) {
  constexpr std::array<double, 4> sign_r = {-1, 1, 1, -1}, sign_s = {-1, -1, 1, 1};
  Shapes f;
  for (size_t i = 0; i < 4; ++i) {
    const double a = sign_r[i], b = sign_s[i], u = 1 + a * r, v = 1 + b * s;
    f.N[i] = u * v / 4;
    f.dr[i] = a * v / 4;
    f.ds[i] = b * u / 4;
    if (count == 4) continue;
    const double w = a * r + b * s - 1;  // serendipity corners
    f.N[i] = u * v * w / 4;
    f.dr[i] = a * v * (w + u) / 4;
    f.ds[i] = b * u * (w + v) / 4;
  }
  if (count == 4) return f;
  for (const size_t i : {size_t{4}, size_t{6}}) {  // edges along r
    const double b = i == 4 ? -1 : 1;
    f.N[i] = (1 - r * r) * (1 + b * s) / 2;
    f.dr[i] = -r * (1 + b * s);
    f.ds[i] = b * (1 - r * r) / 2;
  }
  for (const size_t i : {size_t{5}, size_t{7}}) {
    const double a = i == 5 ? 1 : -1;
    f.N[i] = (1 + a * r) * (1 - s * s) / 2;
    f.dr[i] = a * (1 - s * s) / 2;
    f.ds[i] = -s * (1 + a * r);
  }
  return f;
}

Shapes shapes(const Face& face, const Vector2d& at) {
  return face.corners() == 3 ? triangle(face.count, at(0), at(1)) : quadrangle(face.count, at(0), at(1));
}

Vector2d into_domain(const Face& face, Vector2d p) {
  if (face.corners() == 4) return p.cwiseMax(-1).cwiseMin(1);
  if (p.sum() > 1) p.array() -= (p.sum() - 1) / 2;
  return p.cwiseMax(0).cwiseMin(1);
}

// Gauss-Newton on the square of the distance, kept inside of the face.
Projection project(const Matrix3Xd& nodes, const Face& face, const Vector3d& point) {
  Vector2d p = face.corners() == 3 ? Vector2d(1.0 / 3, 1.0 / 3) : Vector2d(0, 0);
  Projection best;
  best.distance = std::numeric_limits<double>::infinity();
  for (int step = 0; step < newton_steps; ++step) {
    const Shapes f = shapes(face, p);
    Vector3d gap = point;
    Eigen::Matrix<double, 3, 2> J = Eigen::Matrix<double, 3, 2>::Zero();
    for (int i = 0; i < face.count; ++i) {
      const Vector3d x = nodes.col(face.nodes[at(i)]);
      gap -= f.N[at(i)] * x;
      J.col(0) += f.dr[at(i)] * x;
      J.col(1) += f.ds[at(i)] * x;
    }
    if (gap.norm() < best.distance) {
      best.distance = gap.norm();
      best.weights = f.N;
    }
    const Matrix2d H = J.transpose() * J;
    const double determinant = H.determinant();
    if (!(determinant > 0)) break;  // a face without area
    const Vector2d next = into_domain(face, p + H.inverse() * (J.transpose() * gap));
    const bool arrived = (next - p).norm() < 1e-13;
    p = next;
    if (arrived) break;
  }
  return best;
}

double distance_to_box(const Vector3d& low, const Vector3d& high, const Vector3d& point) {
  return (point - point.cwiseMax(low).cwiseMin(high)).norm();
}

using Corners = std::array<int, 4>;  // -1: a triangle
constexpr std::array<Corners, 6> faces_of_hexahedron = {
    {{0, 1, 2, 3}, {4, 7, 6, 5}, {0, 4, 5, 1}, {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 4, 0}}};
constexpr std::array<Corners, 4> faces_of_tetrahedron = {{{0, 1, 2, -1}, {0, 3, 1, -1}, {1, 3, 2, -1}, {2, 3, 0, -1}}};
constexpr std::array<Corners, 5> faces_of_wedge = {
    {{0, 1, 2, -1}, {3, 5, 4, -1}, {0, 3, 4, 1}, {1, 4, 5, 2}, {2, 5, 3, 0}}};

using Edge = std::array<int, 2>;
constexpr std::array<Edge, 12> edges_of_hexahedron = {
    {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6}, {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}}};
constexpr std::array<Edge, 6> edges_of_tetrahedron = {{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};
constexpr std::array<Edge, 9> edges_of_wedge = {
    {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}}};

struct Topology {
  std::span<const Corners> faces;
  std::span<const Edge> edges;
  int corners;
};

Topology topology(Shape shape) {
  switch (shape) {
    case Shape::hexahedron:
      return {faces_of_hexahedron, edges_of_hexahedron, 8};
    case Shape::tetrahedron:
      return {faces_of_tetrahedron, edges_of_tetrahedron, 4};
    case Shape::wedge:
      return {faces_of_wedge, edges_of_wedge, 6};
    default:
      return {};
  }
}

}  // namespace

FaceSearch::FaceSearch(const Matrix3Xd& nodes, std::span<const Face> faces) : nodes_(nodes), faces_(faces) {
  order_.resize(faces.size());
  std::iota(order_.begin(), order_.end(), 0);
  std::vector<Vector3d> centres;
  double edges = 0;
  for (const Face& face : faces) {
    Vector3d centre = Vector3d::Zero();
    for (int i = 0; i < face.corners(); ++i) {
      const Vector3d x = nodes.col(face.nodes[at(i)]);
      centre += x / face.corners();
      mean_edge_ += (nodes.col(face.nodes[at((i + 1) % face.corners())]) - x).norm();
    }
    edges += face.corners();
    centres.push_back(centre);
  }
  if (faces.empty()) return;
  mean_edge_ /= edges;
  build(0, static_cast<int>(faces.size()), centres);
}

int FaceSearch::build(int first, int last, const std::vector<Vector3d>& centres) {
  const int index = static_cast<int>(boxes_.size());
  Box box{Vector3d::Constant(std::numeric_limits<double>::infinity()), {}, -1, -1, first, last};
  box.high = -box.low;
  for (int i = first; i < last; ++i) {
    const Face& face = faces_[at(order_[at(i)])];
    for (int k = 0; k < face.count; ++k) {
      box.low = box.low.cwiseMin(nodes_.col(face.nodes[at(k)]));
      box.high = box.high.cwiseMax(nodes_.col(face.nodes[at(k)]));
    }
  }
  // A curved face stays within its nodes enlarged by their extent; an eighth is generous.
  const Vector3d margin = Vector3d::Constant((box.high - box.low).maxCoeff() / 8);
  boxes_.push_back(box);
  boxes_[at(index)].low -= margin;
  boxes_[at(index)].high += margin;
  if (last - first <= faces_per_leaf) return index;
  Eigen::Index axis = 0;
  (box.high - box.low).maxCoeff(&axis);
  const int middle = (first + last) / 2;
  std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last,
                   [&](int a, int b) { return centres[at(a)](axis) < centres[at(b)](axis); });
  const int left = build(first, middle, centres);
  const int right = build(middle, last, centres);
  boxes_[at(index)].left = left;
  boxes_[at(index)].right = right;
  return index;
}

void FaceSearch::search(int box, const Vector3d& point, Projection& best) const {
  const Box& here = boxes_[at(box)];
  if (distance_to_box(here.low, here.high, point) >= best.distance) return;
  if (here.left < 0) {
    for (int i = here.first; i < here.last; ++i) {
      const Projection candidate = project(nodes_, faces_[at(order_[at(i)])], point);
      if (candidate.distance >= best.distance) continue;
      best = candidate;
      best.face = order_[at(i)];
    }
    return;
  }
  int near = here.left, far = here.right;
  const auto distance = [&](int b) { return distance_to_box(boxes_[at(b)].low, boxes_[at(b)].high, point); };
  if (distance(far) < distance(near)) std::swap(near, far);
  search(near, point, best);
  search(far, point, best);
}

Projection FaceSearch::nearest(const Vector3d& point) const {
  Projection best;
  best.distance = std::numeric_limits<double>::infinity();
  if (!boxes_.empty()) search(0, point, best);
  return best;
}

double area(const Matrix3Xd& nodes, const Face& face) {
  const auto corner = [&](size_t i) -> Vector3d { return nodes.col(face.nodes[i]); };
  if (face.corners() == 3) return (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm() / 2;
  return (corner(2) - corner(0)).cross(corner(3) - corner(1)).norm() / 2;
}

Face face_of(const Element& element, int number) {
  const Topology solid = topology(type_of(element).shape);
  if (number < 1 || number > std::ssize(solid.faces)) return {};
  const Corners& corners = solid.faces[at(number - 1)];
  Face face;
  const int count = corners[3] < 0 ? 3 : 4;
  for (int i = 0; i < count; ++i) face.nodes[at(i)] = element.nodes[at(corners[at(i)])];
  face.count = count;
  if (std::ssize(element.nodes) <= solid.corners) return face;
  for (int i = 0; i < count; ++i) {
    const int a = corners[at(i)], b = corners[at((i + 1) % count)];
    for (size_t e = 0; e < solid.edges.size(); ++e) {
      const auto [c, d] = solid.edges[e];
      if ((a == c && b == d) || (a == d && b == c)) face.nodes[at(face.count++)] = element.nodes[at(solid.corners) + e];
    }
  }
  return face;
}

}  // namespace flexboom
