#include "apps/model/picture.hpp"

#include <Eigen/Eigenvalues>

#include <cmath>

namespace flexboom {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

void add_cells(const DisplayShape& shape, int first, VtkGrid& grid) {
  constexpr int vtk_line = 3, vtk_triangle = 5;  // lines of two points: meshio skips polylines
  for (const std::vector<int>& line : shape.lines)
    for (size_t k = 0; k + 1 < line.size(); ++k)
      grid.cells.push_back({vtk_line, {first + line[k], first + line[k + 1]}});
  for (const auto& [a, b, c] : shape.triangles) grid.cells.push_back({vtk_triangle, {first + a, first + b, first + c}});
}

DisplayShape box_of(const ReducedBody& body, const Vector3d& size) {
  const Vector3d centre = body.mc0 / body.m;
  Matrix3d axes = Matrix3d::Identity();
  Vector3d sides = size;
  if (size.isZero(0)) {
    const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(Matrix3d(body.J0 - centre_inertia(body.m, body.mc0)));
    const Vector3d& J = principal.eigenvalues();
    axes = principal.eigenvectors();
    // J_i = m (a_j^2 + a_k^2) / 12
    sides = (6 / body.m * (J.sum() - 2 * J.array())).max(0).sqrt();
  }
  DisplayShape shape;
  shape.points.resize(3, 8);
  for (int c = 0; c < 8; ++c)
    shape.points.col(c) = centre + axes * Vector3d((c & 1 ? 0.5 : -0.5) * sides[0], (c & 2 ? 0.5 : -0.5) * sides[1],
                                                   (c & 4 ? 0.5 : -0.5) * sides[2]);
  shape.S.assign(8, MatrixXd::Zero(3, body.n()));
  for (int c = 0; c < 8; ++c)
    for (const int other : {c | 1, c | 2, c | 4})
      if (other != c) shape.lines.push_back({c, other});
  shape.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                     {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return shape;
}

VtkGrid picture(const Tree& tree, double t, const Eigen::VectorXd& y) {
  const TreeState s = tree.unpack(y);
  const std::vector<ReducedBody>& bodies = tree.scene().bodies;
  Index total = 0;
  for (const ReducedBody& b : bodies) total += b.display.points.cols();
  VtkGrid grid;
  grid.points.resize(3, total);
  MatrixXd displacement(3, total);
  std::vector<double> body_of_cell;
  Index first = 0;
  for (size_t b = 0; b < bodies.size(); ++b) {
    const DisplayShape& shape = bodies[b].display;
    const PlaceMotionInSpace brf = tree.motion(t, y, Place{.body = static_cast<int>(b), .marker = {}});
    add_cells(shape, static_cast<int>(first), grid);
    body_of_cell.resize(grid.cells.size(), static_cast<double>(b));
    for (Index i = 0; i < shape.points.cols(); ++i, ++first) {
      Vector3d u = Vector3d::Zero();
      if (s.q[b].size() > 0) u = shape.S[static_cast<size_t>(i)] * s.q[b];
      grid.points.col(first) = brf.position + brf.axes * (shape.points.col(i) + u);
      displacement.col(first) = brf.axes * u;
    }
  }
  grid.point_data.emplace_back("displacement", std::move(displacement));
  grid.cell_data.emplace_back(
      "body", Eigen::Map<Eigen::RowVectorXd>(body_of_cell.data(), static_cast<Index>(body_of_cell.size())));
  return grid;
}

}  // namespace flexboom
