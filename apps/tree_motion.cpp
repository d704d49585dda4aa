// Pictures of scenes with joints for ParaView.

#include "apps/tree_flight.hpp"

namespace flexboom {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

namespace {

constexpr int vtk_line = 3, vtk_triangle = 5, vtk_hexahedron = 12;  // lines of two points: meshio skips polylines

/// Corners of a box about the mass centre, VTK's order of a hexahedron, BRF.
Matrix3Xd box(const RigidScene& body) {
  Matrix3Xd corners(3, 8);
  for (int c = 0; c < 8; ++c)
    corners.col(c) =
        body.centre + Vector3d((c & 1) != ((c >> 1) & 1) ? 0.5 : -0.5, (c & 2) ? 0.5 : -0.5, (c & 4) ? 0.5 : -0.5)
                          .cwiseProduct(body.size);
  return corners;
}

/// A grid that grows body by body; cell data "body" numbers them from 0.
struct Picture {
  VtkGrid grid;
  std::vector<Vector3d> points, displacement;
  std::vector<double> body;

  void cell(int type, std::vector<int> nodes, size_t of) {
    grid.cells.push_back({type, std::move(nodes)});
    body.push_back(static_cast<double>(of));
  }
};

VtkGrid finished(Picture picture) {
  const auto matrix = [](const std::vector<Vector3d>& v) {
    Eigen::MatrixXd m(3, static_cast<Index>(v.size()));
    for (size_t i = 0; i < v.size(); ++i) m.col(static_cast<Index>(i)) = v[i];
    return m;
  };
  picture.grid.points = matrix(picture.points);
  picture.grid.point_data.emplace_back("displacement", matrix(picture.displacement));
  picture.grid.cell_data.emplace_back(
      "body", Eigen::Map<Eigen::RowVectorXd>(picture.body.data(), static_cast<Index>(picture.body.size())));
  return std::move(picture.grid);
}

void add_rigid(const RigidScene& body, const PlaceMotionInSpace& brf, size_t number, Picture& out) {
  const int first = static_cast<int>(out.points.size());
  const Matrix3Xd corners = box(body);
  for (const Vector3d corner : corners.colwise()) {
    out.points.push_back(brf.position + brf.axes * corner);
    out.displacement.push_back(Vector3d::Zero());
  }
  std::vector<int> nodes(8);
  for (int c = 0; c < 8; ++c) nodes[static_cast<size_t>(c)] = first + c;
  out.cell(vtk_hexahedron, std::move(nodes), number);
}

void add_flexible(const DisplayShape& shape, const PlaceMotionInSpace& brf, const Eigen::VectorXd& q, size_t number,
                  Picture& out) {
  const int first = static_cast<int>(out.points.size());
  for (Index i = 0; i < shape.points.cols(); ++i) {
    Vector3d u = Vector3d::Zero();
    if (q.size()) u.noalias() += shape.S[static_cast<size_t>(i)] * q;
    out.points.push_back(brf.position + brf.axes * (shape.points.col(i) + u));
    out.displacement.push_back(brf.axes * u);
  }
  for (const std::vector<int>& line : shape.lines)
    for (size_t k = 0; k + 1 < line.size(); ++k) out.cell(vtk_line, {first + line[k], first + line[k + 1]}, number);
  for (const auto& [a, b, c] : shape.triangles) out.cell(vtk_triangle, {first + a, first + b, first + c}, number);
}

}  // namespace

VtkGrid tree_picture(const RunResult& r, size_t row) {
  const Eigen::VectorXd& y = r.trajectory.y[row];
  const TreeState s = r.tree->unpack(y);
  Picture picture;
  for (size_t b = 0; b < r.bodies.size(); ++b) {
    Place place;
    place.body = static_cast<int>(b);
    const PlaceMotionInSpace brf = r.tree->motion(r.trajectory.time[row], y, place);
    if (r.scene.bodies[b].rigid)
      add_rigid(*r.scene.bodies[b].rigid, brf, b, picture);
    else
      add_flexible(r.bodies[b].body.display, brf, s.q[b], b, picture);
  }
  return finished(std::move(picture));
}

}  // namespace flexboom
