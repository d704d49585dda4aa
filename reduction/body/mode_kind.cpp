#include "reduction/body/mode_kind.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;

/// Mass-weighted squares of the motion of the sections along x, y, z and of their twist, and of all motion; one column
/// per mode.
using Shares = Eigen::Matrix<double, 5, Eigen::Dynamic>;

/// Of beams: motion of the axis at the stations of the mass points.
Shares beam_shares(const Mesh& mesh, const DofMap& dofs, const MatrixXd& Phi) {
  Shares shares = Shares::Zero(5, Phi.cols());
  for (size_t e = 0; e < mesh.elements.size(); ++e) {
    const Element& element = mesh.elements[e];
    const ElementType& type = type_of(element);
    const MatrixXd shapes = Phi(dofs.of_element(mesh, static_cast<int>(e)), Eigen::all);
    const Vector3d start = mesh.nodes.col(element.nodes.front());
    const Vector3d along = mesh.nodes.col(element.nodes.back()) - start;
    const Vector3d axis = along.normalized();
    double last = -1;
    MatrixXd motion;  // 6 x n: displacement and rotation of the axis abreast of the point
    type.mass_points(mesh, element, 0, [&](double dm, const Vector3d& u0, const Eigen::Ref<const Eigen::Matrix3Xd>&) {
      const double s = (u0 - start).dot(along) / along.squaredNorm();
      if (std::abs(s - last) > 1e-12)
        motion = type.interpolation(mesh, element, {s, 0, 0}) * shapes;  // one station has several points
      last = s;
      const double radius_squared = (u0 - start - s * along).squaredNorm();
      shares.topRows(3).array() += dm * motion.topRows(3).array().square();
      shares.row(3).array() += dm * radius_squared * (axis.transpose() * motion.bottomRows(3)).array().square();
    });
  }
  shares.row(4) = shares.topRows(4).colwise().sum();
  return shares;
}

/// One slice of a solid: first and second moments of its nodes and of their motion.
struct Slice {
  double weight = 0;
  Vector3d moment = Vector3d::Zero();  // sum w r
  double polar = 0;                    // sum w r^2 normal to the long axis
  Eigen::Matrix3Xd momentum;           // sum w u, 3 x n
  Eigen::RowVectorXd spin;             // sum w (r x u) about the long axis
};

/// Of solids: nodes, weighted by the diagonal of M, in slices across the long axis.
Shares solid_shares(const Mesh& mesh, const DofMap& dofs, const Eigen::VectorXd& weights, const MatrixXd& Phi) {
  constexpr int slices = 64;
  const int axis = long_axis(mesh);
  const double start = mesh.nodes.row(axis).minCoeff();
  const double extent = mesh.nodes.row(axis).maxCoeff() - start;
  const Vector3d middle = mesh.nodes.rowwise().mean();
  std::vector<Slice> slice(slices);
  for (Slice& s : slice) {
    s.momentum.setZero(3, Phi.cols());
    s.spin.setZero(Phi.cols());
  }
  Shares shares = Shares::Zero(5, Phi.cols());
  const int b = (axis + 1) % 3, c = (axis + 2) % 3;
  for (int node = 0; node < mesh.nodes.cols(); ++node) {
    if (dofs.freedoms_of(node) < 3) continue;
    const int first = dofs.of_node(node, 0);
    const double weight = weights(first);
    const Vector3d r = mesh.nodes.col(node) - middle;
    const double station = (mesh.nodes(axis, node) - start) / extent * slices;
    Slice& s = slice[static_cast<size_t>(std::clamp(static_cast<int>(station), 0, slices - 1))];
    const auto u = Phi.middleRows<3>(first);
    s.weight += weight;
    s.moment += weight * r;
    s.polar += weight * (r(b) * r(b) + r(c) * r(c));
    s.momentum += weight * u;
    s.spin += weight * (r(b) * u.row(c) - r(c) * u.row(b));
    shares.row(4).array() += weight * u.colwise().squaredNorm().array();
  }
  for (const Slice& s : slice) {
    if (!(s.weight > 0)) continue;
    shares.topRows(3).array() += s.momentum.array().square() / s.weight;
    const Vector3d centre = s.moment / s.weight;
    const double polar = s.polar - s.weight * (centre(b) * centre(b) + centre(c) * centre(c));
    const Eigen::RowVectorXd spin = s.spin - centre(b) * s.momentum.row(c) + centre(c) * s.momentum.row(b);
    if (polar > 0) shares.row(3).array() += spin.array().square() / polar;
  }
  return shares;
}

ModeKind kind_of(const Eigen::Vector<double, 5>& shares, int axis) {
  constexpr std::array bending = {ModeKind::bending_x, ModeKind::bending_y, ModeKind::bending_z};
  Index largest = 0;
  if (shares.head<4>().maxCoeff(&largest) <= 0.5 * shares(4)) return ModeKind::other;
  if (largest == 3) return ModeKind::torsion;
  return largest == axis ? ModeKind::axial : bending[static_cast<size_t>(largest)];
}

}  // namespace

std::string_view name_of(ModeKind kind) {
  switch (kind) {
    case ModeKind::bending_x:
      return "bending_x";
    case ModeKind::bending_y:
      return "bending_y";
    case ModeKind::bending_z:
      return "bending_z";
    case ModeKind::torsion:
      return "torsion";
    case ModeKind::axial:
      return "axial";
    case ModeKind::rigid:
      return "rigid";
    case ModeKind::other:
      break;
  }
  return "other";
}

int long_axis(const Mesh& mesh) {
  Index axis = 0;
  const Vector3d extent = mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff();
  extent.maxCoeff(&axis);
  const auto root = mesh.node_sets.find("root"), tip = mesh.node_sets.find("tip"), none = mesh.node_sets.end();
  if (root == none || tip == none || root->second.empty() || tip->second.empty()) return static_cast<int>(axis);
  const auto middle = [&mesh](const std::vector<int>& nodes) {
    return Vector3d(mesh.nodes(Eigen::all, nodes).rowwise().mean());
  };
  const Vector3d way = middle(tip->second) - middle(root->second);
  constexpr double apart = 1e-6;
  if (way.norm() > apart * extent.norm()) way.cwiseAbs().maxCoeff(&axis);
  return static_cast<int>(axis);
}

std::vector<ModeKind> mode_kinds(const Mesh& mesh, const DofMap& dofs, const Eigen::VectorXd& weights,
                                 const Eigen::Ref<const MatrixXd>& Phi) {
  const bool beams =
      std::ranges::all_of(mesh.elements, [](const Element& e) { return type_of(e).shape == Shape::line; });
  const Shares shares = beams ? beam_shares(mesh, dofs, Phi) : solid_shares(mesh, dofs, weights, Phi);
  const int axis = long_axis(mesh);
  std::vector<ModeKind> kinds;
  for (Index i = 0; i < Phi.cols(); ++i) kinds.push_back(kind_of(shares.col(i), axis));
  return kinds;
}

}  // namespace flexboom
