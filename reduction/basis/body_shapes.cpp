#include "reduction/basis/body_shapes.hpp"

#include "reduction/basis/surface.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <set>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

bool has_rotations(const DofMap& dofs, const std::vector<int>& nodes) {
  return std::ranges::all_of(nodes, [&](int node) { return dofs.freedoms_of(node) == 6; });
}

/// Nodes with their shares in a mean, of sum 1.
struct Weighted {
  std::vector<int> nodes;
  std::vector<double> weights;
};

Weighted equally(std::vector<int> nodes) {
  const double weight = 1 / static_cast<double>(nodes.size());
  std::vector<double> weights(nodes.size(), weight);
  return {std::move(nodes), std::move(weights)};
}

/// J of the least squares theta = J^-1 sum w r x u about the centre of the nodes.
Matrix3d second_moment(const Mesh& mesh, const Weighted& mean, const Vector3d& centre) {
  Matrix3d J = Matrix3d::Zero();
  for (size_t i = 0; i < mean.nodes.size(); ++i) {
    const Vector3d r = mesh.nodes.col(mean.nodes[i]) - centre;
    J += mean.weights[i] * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose());
  }
  return J;
}

bool carries_rotation(const Matrix3d& J) {
  const Vector3d moments = Eigen::SelfAdjointEigenSolver<Matrix3d>(J, Eigen::EigenvaluesOnly).eigenvalues();
  return moments(0) > 1e-9 * moments(2);  // else the nodes lie on a line
}

/// The nodes of all solids that have one of the nodes.
std::vector<int> around(const Mesh& mesh, const std::vector<int>& nodes) {
  const std::set<int> wanted(nodes.begin(), nodes.end());
  std::set<int> found;
  for (const Element& element : mesh.elements) {
    if (std::ranges::any_of(element.nodes, [&](int node) { return wanted.contains(node); }))
      found.insert(element.nodes.begin(), element.nodes.end());
  }
  return {found.begin(), found.end()};
}

Vector3d centre_of(const Mesh& mesh, const Weighted& mean) {
  Vector3d centre = Vector3d::Zero();
  for (size_t i = 0; i < mean.nodes.size(); ++i) centre += mean.weights[i] * mesh.nodes.col(mean.nodes[i]);
  return centre;
}

/// theta = J^-1 sum w r x u
void add_fitted_rotation(MeanMotion& motion, const Mesh& mesh, const DofMap& dofs, const Weighted& mean) {
  const Vector3d centre = centre_of(mesh, mean);
  const Matrix3d J = second_moment(mesh, mean, centre);
  motion.turns = carries_rotation(J);
  if (!motion.turns) return;
  const Matrix3d inverse = J.inverse();
  for (size_t i = 0; i < mean.nodes.size(); ++i) {
    const Vector3d r = mesh.nodes.col(mean.nodes[i]) - centre;
    for (int j = 0; j < 3; ++j) {
      const Vector3d theta = mean.weights[i] * (inverse * r.cross(Vector3d::Unit(j)));
      for (int k = 0; k < 3; ++k) motion.rows.emplace_back(3 + k, dofs.of_node(mean.nodes[i], j), theta(k));
    }
  }
}

Marker marker_of(const std::string& name, const MeanMotion& motion, const MatrixXd& Phi) {
  const MatrixXd S = motion.of(Phi);
  return {name, motion.position, S.topRows<3>(), S.bottomRows<3>()};
}

}  // namespace

MatrixXd MeanMotion::of(const MatrixXd& Phi) const {
  MatrixXd S = MatrixXd::Zero(6, Phi.cols());
  for (const auto& entry : rows) S.row(entry.row()) += entry.value() * Phi.row(entry.col());
  return S;
}

MatrixXd MeanMotion::loads(int freedoms) const {
  MatrixXd f = MatrixXd::Zero(freedoms, 6);
  for (const auto& entry : rows) f(entry.col(), entry.row()) += entry.value();
  return f;
}

MeanMotion mean_motion(const Mesh& mesh, const DofMap& dofs, const std::vector<int>& nodes,
                       const std::vector<double>& weights) {
  const Weighted mean = weights.empty() ? equally(nodes) : Weighted{nodes, weights};
  MeanMotion motion;
  motion.position = centre_of(mesh, mean);
  const bool own_rotations = has_rotations(dofs, nodes);
  for (size_t i = 0; i < nodes.size(); ++i) {
    for (int k = 0; k < (own_rotations ? 6 : 3); ++k)
      motion.rows.emplace_back(k, dofs.of_node(nodes[i], k), mean.weights[i]);
  }
  if (own_rotations) return motion;
  add_fitted_rotation(motion, mesh, dofs, mean);
  if (!motion.turns) add_fitted_rotation(motion, mesh, dofs, equally(around(mesh, nodes)));
  return motion;
}

std::vector<Marker> body_markers(const Mesh& mesh, const DofMap& dofs, const ModalBasis& basis) {
  std::vector<Marker> markers;
  std::set<std::string> done;
  for (size_t i = 0; i < basis.interfaces.size(); ++i) {
    if (i >= basis.interface_nodes.size() || basis.interface_nodes[i] < 0) continue;  // its node set follows below
    const std::string& name = basis.interfaces[i].name;
    const MeanMotion motion = mean_motion(mesh, dofs, {basis.interface_nodes[i]});
    if (motion.turns && done.insert(name).second) markers.push_back(marker_of(name, motion, basis.Phi));
  }
  for (const auto& [name, nodes] : mesh.node_sets) {
    const bool moves = std::ranges::all_of(nodes, [&](int node) { return dofs.freedoms_of(node) >= 3; });
    if (nodes.empty() || !moves || done.contains(name)) continue;
    const MeanMotion motion = mean_motion(mesh, dofs, nodes);
    if (motion.turns) markers.push_back(marker_of(name, motion, basis.Phi));
  }
  return markers;
}

DisplayShape display_shape(const Mesh& mesh, const DofMap& dofs, const MatrixXd& Phi) {
  const auto beams = static_cast<int>(std::ranges::count_if(
      mesh.elements, [](const Element& element) { return type_of(element).shape == Shape::line; }));
  DisplayLines lines = display_lines(mesh, std::max(3, 1 + 20 / std::max(beams, 1)));
  const Surface surface = surface_of(mesh);
  const Index on_lines = lines.points.cols();
  DisplayShape display;
  display.points.resize(3, on_lines + std::ssize(surface.nodes));
  display.points << lines.points, mesh.nodes(Eigen::all, surface.nodes);
  for (size_t i = 0; i < lines.element.size(); ++i) {
    const Element& element = mesh.elements[static_cast<size_t>(lines.element[i])];
    const auto N = type_of(element).interpolation(mesh, element, {lines.parameter[i], 0, 0});
    const MatrixXd S = N * Phi(dofs.of_element(mesh, lines.element[i]), Eigen::all);
    display.S.emplace_back(S.topRows<3>());
    if (surface.nodes.empty()) display.S_theta.emplace_back(S.bottomRows<3>());  // nodes of solids have none
  }
  for (const int node : surface.nodes) display.S.emplace_back(Phi.middleRows<3>(dofs.of_node(node, 0)));
  display.lines = std::move(lines.lines);
  for (std::array<int, 3> triangle : surface.triangles) {
    for (int& point : triangle) point += static_cast<int>(on_lines);
    display.triangles.push_back(triangle);
  }
  return display;
}

}  // namespace flexboom
