#include "reduction/basis/mode_alignment.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// The nodes of the set "tip", or those furthest from what is clamped; of several at one distance, those at the upper
/// end along the long axis.
std::vector<int> tip_nodes(const Mesh& mesh, const Clamp& clamp) {
  const auto set = mesh.node_sets.find("tip");
  if (set != mesh.node_sets.end() && !set->second.empty()) return set->second;
  Vector3d held = mesh.nodes.rowwise().mean();
  if (!clamp.nodes.empty()) held = mesh.nodes(Eigen::all, clamp.nodes).rowwise().mean();
  constexpr double equal = 1 - 1e-9;
  const VectorXd distance = (mesh.nodes.colwise() - held).colwise().norm();
  const VectorXd height = mesh.nodes.row(long_axis(mesh)).array() - mesh.nodes.row(long_axis(mesh)).minCoeff();
  double furthest = distance.maxCoeff(), highest = 0;
  for (Index a = 0; a < distance.size(); ++a) {
    if (distance(a) >= equal * furthest) highest = std::max(highest, height(a));
  }
  std::vector<int> nodes;
  for (Index a = 0; a < distance.size(); ++a) {
    if (distance(a) >= equal * furthest && height(a) >= equal * highest) nodes.push_back(static_cast<int>(a));
  }
  return nodes;
}

/// Shares of nodes of solids in the area that they cover, int N_a dA, whatever the mesh of the face. N_a vanishes on
/// all other faces of the elements with a node there, but the outer ones beside it. Those stand on the face, so the
/// share is the part along the normal of int grad N_a dV. None where the nodes cover no face of the body.
std::vector<double> face_shares(const Mesh& mesh, const std::vector<int>& nodes) {
  std::vector<Index> place(static_cast<size_t>(mesh.nodes.cols()), -1);
  for (size_t i = 0; i < nodes.size(); ++i) place[static_cast<size_t>(nodes[i])] = static_cast<Index>(i);
  Eigen::Matrix3Xd area = Eigen::Matrix3Xd::Zero(3, std::ssize(nodes));
  double size = 0;  // of what the elements add
  for (const Element& element : mesh.elements) {
    const auto place_of = [&](Index a) { return place[static_cast<size_t>(element.nodes[static_cast<size_t>(a)])]; };
    std::vector<Index> here;
    for (Index a = 0; a < std::ssize(element.nodes); ++a) {
      if (place_of(a) >= 0) here.push_back(a);
    }
    if (here.empty()) continue;
    if (type_of(element).shape == Shape::line) return {};
    Eigen::Matrix3Xd part = Eigen::Matrix3Xd::Zero(3, std::ssize(here));
    type_of(element).strain_points(mesh, element, [&](double volume, const MatrixXd& B, const MatrixXd&) {
      for (size_t i = 0; i < here.size(); ++i) {
        const Index a = here[i];
        part.col(static_cast<Index>(i)) += volume * Vector3d(B(0, 3 * a), B(1, 3 * a + 1), B(2, 3 * a + 2));
      }
    });
    for (size_t i = 0; i < here.size(); ++i) area.col(place_of(here[i])) += part.col(static_cast<Index>(i));
    size += part.colwise().norm().sum();
  }
  const Vector3d normal = area.rowwise().sum();
  if (!(normal.norm() > 1e-6 * size)) return {};
  const VectorXd shares = area.transpose() * normal / normal.squaredNorm();
  return {shares.begin(), shares.end()};
}

/// Motions e^s along x, y, z and e^s of twist about the long axis, s = 0 .. 1 along the body, over all freedoms. No
/// bending, torsion or stretching of a body, symmetric or not, is orthogonal to them.
MatrixXd growing_motions(const Mesh& mesh, const DofMap& dofs, int axis) {
  const Vector3d low = mesh.nodes.rowwise().minCoeff();
  const Vector3d size = mesh.nodes.rowwise().maxCoeff() - low;
  const Vector3d middle = low + size / 2;
  const Vector3d along = Vector3d::Unit(axis);
  MatrixXd motions = MatrixXd::Zero(dofs.count, 4);
  for (int node = 0; node < mesh.nodes.cols(); ++node) {
    const Vector3d x = mesh.nodes.col(node);
    const double grown = std::exp((x - low)(axis) / std::max(size(axis), 1e-300));
    const int first = dofs.of_node(node, 0), freedoms = dofs.freedoms_of(node);
    if (freedoms < 3) continue;
    motions.block<3, 3>(first, 0) = grown * Eigen::Matrix3d::Identity();
    motions.block<3, 1>(first, 3) = grown * along.cross(x - middle);
    if (freedoms == 6) motions.block<3, 1>(first + 3, 3) = grown * along;
  }
  return motions;
}

/// What a group is aligned to, in this order: deflection of the tip along y, z, x, its rotations about x, y, z, then
/// the mean motions along y, z, x and the twist.
constexpr std::array<int, 10> alignment_order = {1, 2, 0, 3, 4, 5, 7, 8, 6, 9};

/// Orthogonal matrix Q such that the columns of (shapes * Q) take up the functionals one after the other: F Q is lower
/// triangular, with F the functionals (rows in alignment order) of the shapes. Those below their `limit` are skipped.
MatrixXd alignment(const MatrixXd& F, const VectorXd& limit) {
  const Index g = F.cols();
  MatrixXd Q(g, g);
  Index found = 0;
  for (Index row = 0; row < F.rows() && found < g; ++row) {
    VectorXd direction = F.row(row).transpose();
    for (int twice = 0; twice < 2; ++twice)
      direction -= Q.leftCols(found) * (Q.leftCols(found).transpose() * direction);
    if (direction.norm() > limit(row)) Q.col(found++) = direction.normalized();
  }
  for (Index axis = 0; found < g; ++axis) {  // no motion left to align to: any complement will do
    VectorXd direction = VectorXd::Unit(g, axis);
    for (int twice = 0; twice < 2; ++twice)
      direction -= Q.leftCols(found) * (Q.leftCols(found).transpose() * direction);
    if (direction.norm() > 0.5 / std::sqrt(static_cast<double>(g))) Q.col(found++) = direction.normalized();
  }
  return Q;
}

/// Freedom of the tip that gives a mode of that kind its sign; -1: none.
int leading_component(ModeKind kind, int axis) {
  switch (kind) {
    case ModeKind::bending_x:
      return 0;
    case ModeKind::bending_y:
      return 1;
    case ModeKind::bending_z:
      return 2;
    case ModeKind::axial:
      return axis;
    case ModeKind::torsion:
      return 3 + axis;
    case ModeKind::rigid:
    case ModeKind::other:
      break;
  }
  return -1;
}

}  // namespace

ModeConvention::ModeConvention(const Mesh& mesh, const Assembly& assembly, const Clamp& clamp)
    : axis_(long_axis(mesh)), length_((mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff()).norm()) {
  std::vector<int> tip = tip_nodes(mesh, clamp);
  std::erase_if(tip, [&](int node) { return assembly.dofs.freedoms_of(node) < 3; });
  if (!tip.empty()) tip_ = mean_motion(mesh, assembly.dofs, tip, face_shares(mesh, tip));
  mass_ = total_mass(mesh, assembly);
  const MatrixXd motions = growing_motions(mesh, assembly.dofs, axis_);
  M_mean_ = symmetric_product(assembly.M, motions);
  mean_scale_ = motions.cwiseProduct(M_mean_).colwise().sum().cwiseMax(0).cwiseSqrt().transpose();
}

/// The motions of the tip, then the mean motions: 10 x n.
MatrixXd ModeConvention::functionals(const MatrixXd& Phi) const {
  MatrixXd F(10, Phi.cols());
  F.topRows(6) = tip_.of(Phi);
  F.bottomRows(4) = M_mean_.transpose() * Phi;
  return F;
}

void ModeConvention::align(MatrixXd& Phi, const std::vector<std::vector<int>>& groups) const {
  // M-orthonormal shapes have tip deflections of the order of 1 / sqrt(m). The limit is 1e-5 of that. It is far above
  // what the solver leaves in a mode of the other plane, and far below a real motion. Mean motions fall off with the
  // number of the mode.
  const double deflection = 1 / std::sqrt(mass_);
  VectorXd limit(10);
  limit << VectorXd::Constant(3, 1e-5 * deflection), VectorXd::Constant(3, 1e-5 * deflection / length_),
      1e-3 * mean_scale_;
  for (const std::vector<int>& group : groups) {
    auto shapes = Phi.middleCols(group.front(), static_cast<Index>(group.size()));
    const MatrixXd F = functionals(shapes);
    shapes = (shapes * alignment(F(alignment_order, Eigen::all), limit(alignment_order))).eval();
  }
}

/// 2 over the tip's deflection, else sqrt(m) with a sign. The sign is that of the tip's leading motion, of the mean
/// motion, or of the largest entry: the first that is there. Where the tip hardly moves (under a tenth of the
/// root-mean-square motion of the body, 1 / sqrt(m)) a deflection of 2 would blow the shape up.
double ModeConvention::factor(const VectorXd& phi, const VectorXd& tip, const VectorXd& mean, int component) const {
  const double rms = 1 / std::sqrt(mass_);
  if (component < 0) {
    Index largest = 0;
    tip.head<3>().cwiseAbs().maxCoeff(&largest);
    component = static_cast<int>(largest);
  }
  const double leading = tip(component);
  if (component < 3 && std::abs(leading) > 0.1 * rms) return 2 / leading;
  const int moved = std::min(component, 3);
  if (std::abs(leading) > 1e-6 * (component < 3 ? rms : rms / length_)) return std::copysign(std::sqrt(mass_), leading);
  if (std::abs(mean(moved)) > 1e-4 * mean_scale_(moved)) return std::copysign(std::sqrt(mass_), mean(moved));
  Index largest = 0;
  phi.cwiseAbs().maxCoeff(&largest);
  return std::copysign(std::sqrt(mass_), phi(largest));
}

void ModeConvention::scale(MatrixXd& Phi, const std::vector<ModeKind>& kinds) const {
  const MatrixXd F = functionals(Phi);
  for (Index i = 0; i < Phi.cols(); ++i) {
    const int component = leading_component(kinds[static_cast<size_t>(i)], axis_);
    Phi.col(i) *= factor(Phi.col(i), F.col(i).head<6>(), F.col(i).tail<4>(), component);
  }
}

std::vector<std::vector<int>> equal_groups(const VectorXd& omega) {
  std::vector<std::vector<int>> groups;
  for (int i = 1; i < omega.size(); ++i) {
    const double square = omega(i) * omega(i);
    if (square - omega(i - 1) * omega(i - 1) > 1e-8 * square) continue;
    if (groups.empty() || groups.back().back() != i - 1) groups.push_back({i - 1});
    groups.back().push_back(i);
  }
  return groups;
}

}  // namespace flexboom
