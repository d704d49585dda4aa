#include "reduction/basis/smooth_shapes.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr double slender_from = 3.5;  // length over width

/// Legendre polynomial and its derivative at s.
struct Legendre {
  double value = 1, slope = 0;
};

Legendre legendre(int degree, double s) {
  double before = 0, value = 1, slope_before = 0, slope = 0;
  for (int k = 0; k < degree; ++k) {
    const double next = ((2 * k + 1) * s * value - k * before) / (k + 1);
    const double slope_next = slope_before + (2 * k + 1) * value;
    before = std::exchange(value, next);
    slope_before = std::exchange(slope, slope_next);
  }
  return {value, slope};
}

/// Axes of the spread of nodes: the first column along the body.
struct BodyAxes {
  explicit BodyAxes(const Matrix3Xd& nodes) : centre(nodes.rowwise().mean()) {
    const Matrix3Xd d = nodes.colwise() - centre;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(Eigen::Matrix3d(d * d.transpose()));
    axes = eigen.eigenvectors().rowwise().reverse();
    half_length = (axes.col(0).transpose() * d).cwiseAbs().maxCoeff();
    half_width = (axes.rightCols<2>().transpose() * d).colwise().norm().maxCoeff();
    slender = half_width > 0 && half_length > slender_from * half_width;
  }

  Vector3d centre;
  Eigen::Matrix3d axes;
  double half_length = 0, half_width = 0;  // [m]
  bool slender = false;
};

/// Motion along the body.
enum class Family { bending_1, bending_2, twist, stretching };

struct SmoothShape {
  Family family;
  int degree;
};

constexpr std::array<SmoothShape, 8> shapes = {{{Family::bending_1, 0},
                                                {Family::bending_2, 0},
                                                {Family::twist, 0},
                                                {Family::stretching, 0},
                                                {Family::bending_1, 1},
                                                {Family::bending_2, 1},
                                                {Family::bending_1, 2},
                                                {Family::bending_2, 2}}};

/// Displacement at r from the centre. Cross-sections turn with the slope, as those of a slender beam.
Vector3d displacement(const BodyAxes& body, const SmoothShape& shape, const Vector3d& r) {
  const Vector3d along = body.axes.col(0);
  const Legendre p = legendre(shape.degree, along.dot(r) / body.half_length);
  if (shape.family == Family::twist) return along.cross(r) / body.half_width * p.value;
  if (shape.family == Family::stretching) return along * p.value;
  const Vector3d across = body.axes.col(shape.family == Family::bending_1 ? 1 : 2);
  return across * p.value - along * (across.dot(r) / body.half_length * p.slope);
}

}  // namespace

MatrixXd smooth_shapes(const Mesh& mesh, const DofMap& dofs) {
  const BodyAxes body(mesh.nodes);
  MatrixXd result = MatrixXd::Zero(dofs.count, body.slender ? std::ssize(shapes) : 0);
  if (!body.slender) return result;
  for (int node = 0; node < mesh.nodes.cols(); ++node) {
    if (dofs.freedoms_of(node) < 3) continue;
    const Vector3d r = mesh.nodes.col(node) - body.centre;
    for (size_t i = 0; i < shapes.size(); ++i)
      result.col(static_cast<Eigen::Index>(i)).segment<3>(dofs.of_node(node, 0)) = displacement(body, shapes[i], r);
  }
  return result;
}

}  // namespace flexboom
