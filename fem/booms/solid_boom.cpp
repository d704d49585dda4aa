#include "fem/booms/solid_boom.hpp"
#include "fem/base/round_off.hpp"
#include "fem/mesh/shape_functions.hpp"

#include "fem/base/check.hpp"
#include "fem/booms/boom_plan.hpp"
#include "fem/booms/solid_cells.hpp"
#include "fem/mesh/element.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Lobatto points of the cells between cuts.
std::vector<double> cell_points(const std::vector<double>& cuts, int order) {
  const Eigen::VectorXd points = lobatto_basis(order).nodes();
  std::vector<double> all = {cuts.front()};
  for (size_t cell = 0; cell + 1 < cuts.size(); ++cell) {
    for (int i = 1; i <= order; ++i) all.push_back(std::lerp(cuts[cell], cuts[cell + 1], (1 + points(i)) / 2));
  }
  return all;
}

// Derivatives at Lobatto points of the polynomial through values there (barycentric weights).
Eigen::MatrixXd differentiation(int order) {
  const Eigen::VectorXd x = lobatto_basis(order).nodes();
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(order + 1);
  Eigen::MatrixXd D = Eigen::MatrixXd::Zero(order + 1, order + 1);
  for (int i = 0; i <= order; ++i) {
    for (int j = 0; j <= order; ++j) weight(i) /= i == j ? 1 : x(i) - x(j);
  }
  for (int i = 0; i <= order; ++i) {
    for (int j = 0; j <= order; ++j) D(i, j) = i == j ? 0 : weight(j) / weight(i) / (x(i) - x(j));
    D(i, i) = -D.row(i).sum();
  }
  return D;
}

// Nodes of all hexahedra of one order: profile nodes times places around the axis, then the inside of the core.
class Lattice {
 public:
  Lattice(const BeamGeometry& boom, const BoomPlan& plan)
      : boom_(boom), plan_(plan), order_(plan.options.order), closed_(plan.options.slit == 0) {
    const SolidGrading& g = plan.options.grading;
    profile_ = make_profile(
        plan.layers, {order_, plan.ring_cuts, plan.corners.empty() ? 0 : g.corner_levels, g.factor, plan.corners});
    along_y_ = cell_points(plan.sides[1], order_);
    along_z_ = cell_points(plan.sides[0], order_);
    for (size_t side = 0; side < plan.sides.size(); ++side) {
      const std::vector<double> points = cell_points(plan.sides[side], order_);
      for (size_t i = 0; i + 1 < points.size(); ++i) around_.push_back(static_cast<double>(side) + points[i]);
    }
    if (!closed_) around_.push_back(4);
    scale_ = equal_area_scale();
  }

  // Corners of every hexahedron, with the segment it belongs to.
  std::vector<LatticeCell> cells() const {
    std::vector<LatticeCell> cells;
    for (const ProfileQuad& quad : profile_.quads) add_swept(cells, quad);
    if (plan_.core) {
      for (size_t layer = 0; layer < plan_.layers.size(); ++layer) add_core(cells, static_cast<int>(layer));
    }
    return cells;
  }

  Eigen::Matrix3Xd positions() const {
    const Index swept = size(profile_.nodes) * turn();
    Eigen::Matrix3Xd nodes(3, swept + (plan_.core ? size(profile_.axis) * core_size() : 0));
    for (Index i = 0; i < size(profile_.nodes); ++i) {
      const ProfileNode& n = profile_.nodes[static_cast<size_t>(i)];
      const SectionGrid grid = section_at(boom_, plan_, n.run, n.x);
      for (Index m = 0; m < turn(); ++m) {
        nodes.col(i * turn() + m) << n.x, scale_ * ring_point(grid, around_[static_cast<size_t>(m)], n.tau);
      }
    }
    if (!plan_.core) return nodes;
    for (Index l = 0; l < size(profile_.axis); ++l) {
      const ProfileNode& n = profile_.nodes[static_cast<size_t>(profile_.axis[static_cast<size_t>(l)])];
      const SectionGrid grid = section_at(boom_, plan_, n.run, n.x);
      for (int j = 1; j < cells_z(); ++j) {
        for (int i = 1; i < cells_y(); ++i) {
          nodes.col(core_node(i, j, static_cast<int>(l))) << n.x,
              scale_ * core_point(grid, along_y_[static_cast<size_t>(i)], along_z_[static_cast<size_t>(j)]);
        }
      }
    }
    return nodes;
  }

  // Nodes of the outer surface.
  std::vector<int> side() const {
    std::vector<int> nodes;
    for (const int i : profile_.side) {
      for (Index m = 0; m < turn(); ++m) nodes.push_back(static_cast<int>(i * turn() + m));
    }
    return nodes;
  }

 private:
  template <class T>
  static Index size(const std::vector<T>& v) {
    return static_cast<Index>(v.size());
  }
  Index turn() const { return size(around_); }
  int cells_y() const { return static_cast<int>(along_y_.size()) - 1; }
  int cells_z() const { return static_cast<int>(along_z_.size()) - 1; }
  Index core_size() const { return static_cast<Index>(cells_y() - 1) * (cells_z() - 1); }

  // Place around the axis of a point on the outline of the core, -1 inside.
  int place(int i, int j) const {
    const int ny = cells_y(), nz = cells_z();
    if (i == ny) return j;
    if (j == nz) return nz + ny - i;
    if (i == 0) return nz + ny + nz - j;
    return j == 0 ? 2 * nz + ny + i : -1;
  }

  int core_node(int i, int j, int l) const {
    const int m = place(i, j);
    if (m >= 0) return static_cast<int>(profile_.axis[static_cast<size_t>(l)] * turn() + m % turn());
    return static_cast<int>(size(profile_.nodes) * turn() + l * core_size()) + (i - 1) + (cells_y() - 1) * (j - 1);
  }

  // (tau, u, x) has the orientation of (y, z, x).
  void add_swept(std::vector<LatticeCell>& cells, const ProfileQuad& quad) const {
    const int p = order_, n = p + 1;
    const int sectors = static_cast<int>(turn() - (closed_ ? 0 : 1)) / p;
    for (int sector = 0; sector < sectors; ++sector) {
      LatticeCell cell{{}, plan_.layers[static_cast<size_t>(quad.layer)].segment};
      cell.nodes.reserve(static_cast<size_t>(n) * static_cast<size_t>(n) * static_cast<size_t>(n));
      for (int k = 0; k < n; ++k) {
        for (int j = 0; j < n; ++j) {
          for (int i = 0; i < n; ++i) {
            const Index base =
                quad.nodes[static_cast<size_t>(i) + static_cast<size_t>(n) * static_cast<size_t>(k)] * turn();
            cell.nodes.push_back(static_cast<int>(base + (sector * p + j) % turn()));
          }
        }
      }
      cells.push_back(std::move(cell));
    }
  }

  void add_core(std::vector<LatticeCell>& cells, int layer) const {
    const int p = order_;
    for (int b = 0; b < cells_z(); b += p) {
      for (int a = 0; a < cells_y(); a += p) {
        LatticeCell cell{{}, plan_.layers[static_cast<size_t>(layer)].segment};
        for (int k = 0; k <= p; ++k) {
          for (int j = 0; j <= p; ++j) {
            for (int i = 0; i <= p; ++i) cell.nodes.push_back(core_node(a + i, b + j, layer * p + k));
          }
        }
        cells.push_back(std::move(cell));
      }
    }
  }

  // Polynomials through points of a circle enclose another area than the circle. Distances from the axis are scaled so
  // that they enclose the same: area and second moments are then right to the first order of the difference. Without
  // it, bending frequencies approach their limit from both sides, and two meshes can agree by accident.
  double equal_area_scale() const {
    const SectionGrid grid = section_at(boom_, plan_, 0, 0);
    if (!std::holds_alternative<RoundBar>(grid.shape) && !std::holds_alternative<Tube>(grid.shape)) return 1;
    const Eigen::MatrixXd D = differentiation(order_);
    const Eigen::VectorXd weights = lobatto_weights(order_);
    const auto circle = [&](Index m) { return ring_point(grid, around_[static_cast<size_t>(m % turn())], 1); };
    const Index intervals = closed_ ? turn() : turn() - 1;
    double meshed = 0;  // twice the area between the curve and the axis
    for (Index start = 0; start < intervals; start += order_) {
      Eigen::Matrix2Xd points(2, order_ + 1);
      for (Index i = 0; i <= order_; ++i) points.col(i) = circle(start + i);
      const Eigen::Matrix2Xd slopes = points * D.transpose();
      const Eigen::ArrayXXd a = points.array(), b = slopes.array();
      meshed += (a.row(0) * b.row(1) - a.row(1) * b.row(0)).matrix().dot(weights);
    }
    const double angle = 2 * (std::numbers::pi - grid.slit);
    return std::sqrt(angle * circle(0).squaredNorm() / meshed);
  }

  const BeamGeometry& boom_;
  const BoomPlan& plan_;
  int order_;
  bool closed_;
  Profile profile_;
  std::vector<double> along_y_, along_z_;  // Lobatto points of the core
  std::vector<double> around_;             // u of the places around the axis
  double scale_ = 1;                       // of distances from the axis
};

bool same(const Material& a, const Material& b) { return a.E == b.E && a.nu == b.nu && a.rho == b.rho; }

// Index into solid_properties of each segment.
std::vector<int> add_materials(Mesh& mesh, const BeamGeometry& boom) {
  std::vector<int> property;
  for (const BeamSegment& segment : boom.segments) {
    const auto found = std::find_if(mesh.solid_properties.begin(), mesh.solid_properties.end(),
                                    [&](const SolidProperty& p) { return same(p.material, segment.material); });
    property.push_back(static_cast<int>(found - mesh.solid_properties.begin()));
    if (found == mesh.solid_properties.end()) {
      mesh.solid_properties.push_back({fmt::format("material_{}", mesh.solid_properties.size() + 1), segment.material});
    }
  }
  return property;
}

std::vector<int> nodes_at(const Mesh& mesh, double x, double length) {
  std::vector<int> nodes;
  for (Index i = 0; i < mesh.nodes.cols(); ++i) {
    if (std::abs(mesh.nodes(0, i) - x) <= same_station * length) nodes.push_back(static_cast<int>(i));
  }
  return nodes;
}

void add_face_sets(Mesh& mesh, double length) {
  mesh.node_sets["root"] = nodes_at(mesh, 0, length);
  const std::vector<int>& tip = mesh.node_sets["tip"] = nodes_at(mesh, length, length);
  for (const int i : tip) {
    if (mesh.nodes.col(i).tail<2>().norm() <= relative_round_off * length) mesh.node_sets["tip_center"] = {i};
  }
}

// Shares of nodes in the area of their section, by Gauss-Lobatto quadrature over the ends of cells.
std::vector<double> section_shares(const std::vector<LatticeCell>& cells, const Eigen::Matrix3Xd& nodes, int order) {
  const Index n = order + 1;
  const Eigen::MatrixXd D = differentiation(order);
  const Eigen::VectorXd weights = lobatto_weights(order);
  std::vector<double> shares(static_cast<size_t>(nodes.cols()), 0.0);
  Eigen::MatrixXd y(n, n), z(n, n);
  for (const LatticeCell& cell : cells) {
    const auto face = std::span(cell.nodes).last(static_cast<size_t>(n * n));
    for (Index s = 0; s < n * n; ++s) {
      y(s % n, s / n) = nodes(1, face[static_cast<size_t>(s)]);
      z(s % n, s / n) = nodes(2, face[static_cast<size_t>(s)]);
    }
    const Eigen::ArrayXXd jacobian =
        (D * y).array() * (z * D.transpose()).array() - (D * z).array() * (y * D.transpose()).array();
    for (Index s = 0; s < n * n; ++s) {
      shares[static_cast<size_t>(face[static_cast<size_t>(s)])] +=
          weights(s % n) * weights(s / n) * jacobian(s % n, s / n);
    }
  }
  return shares;
}

// A node on the axis that carries bodies. See make_solid_mesh for the two ways of holding it.
int add_reference(Mesh& mesh, const std::vector<double>& shares, double x, double length) {
  std::vector<int> section = nodes_at(mesh, x, length);
  const int reference = static_cast<int>(mesh.nodes.cols());
  mesh.nodes.conservativeResize(3, reference + 1);
  mesh.nodes.col(reference) << x, 0, 0;
  if (x >= length * (1 - same_station)) {
    mesh.rigid_connections.push_back({reference, std::move(section), all_components});
    return reference;
  }
  // The root is clamped. At a step, corners of cells that meet at almost half a turn have no share, or less than none.
  const auto share = [&](int i) { return x > 0 ? shares[static_cast<size_t>(i)] : 1; };
  std::erase_if(section, [&](int i) { return !(share(i) > 0); });
  std::vector<double> weights(section.size());
  std::ranges::transform(section, weights.begin(), share);
  mesh.distributing_connections.push_back({reference, std::move(section), std::move(weights), all_components});
  return reference;
}

void add_attachments(Mesh& mesh, const BeamGeometry& boom, const std::vector<double>& shares) {
  const double length = boom.length();
  std::vector<std::pair<double, int>> references;  // (position, node): bodies at one place share a node
  for (const RigidAttachment& attachment : boom.attachments) {
    const double x = std::min(attachment.position, length);
    const auto found = std::find_if(references.begin(), references.end(),
                                    [&](const auto& r) { return std::abs(r.first - x) <= same_station * length; });
    const int node = found != references.end() ? found->second : add_reference(mesh, shares, x, length);
    if (found == references.end()) references.emplace_back(x, node);
    mesh.bodies.push_back({node, attachment.mass, attachment.inertia, attachment.offset});
    if (attachment.name.empty()) continue;
    require(!mesh.node_sets.contains(attachment.name),
            fmt::format("attachment \"{}\": a solid mesh has a node set of that name already; choose another",
                        attachment.name));
    mesh.node_sets[attachment.name] = {node};
  }
}

}  // namespace

Mesh make_solid_mesh(const BeamGeometry& boom, const SolidOptions& options) {
  const CellKind& kind = cell_kind(options.element);
  // Cut trapezoids of a refined corner would be slivers with bent edges.
  require(!options.element.starts_with("tet") || options.grading.corner_levels <= 0,
          fmt::format("grading: corner_levels is {}; it is for hexahedra, leave it out for \"{}\"",
                      options.grading.corner_levels, kind.name));
  const BoomPlan plan = plan_of(boom, options);
  const Lattice lattice(boom, plan);
  Mesh mesh;
  mesh.nodes = lattice.positions();
  const std::vector<int> property = add_materials(mesh, boom);
  const int type = element_type(kind.name);
  const std::vector<LatticeCell> cells = lattice.cells();
  std::vector<double> shares;
  if (!boom.attachments.empty()) shares = section_shares(cells, mesh.nodes, plan.options.order);
  for (const LatticeCell& cell : cells) {
    std::vector<int>& set = mesh.element_sets[fmt::format("segment_{}", cell.segment + 1)];
    for (std::vector<int>& nodes : kind.cut(cell.nodes, plan.options.order)) {
      set.push_back(static_cast<int>(mesh.elements.size()));
      mesh.elements.push_back(
          {type, std::move(nodes), plan.options.order, property[static_cast<size_t>(cell.segment)]});
    }
  }
  mesh.node_sets["side"] = lattice.side();
  shares = remove_unused_nodes(mesh, shares);
  add_face_sets(mesh, boom.length());
  add_attachments(mesh, boom, shares);
  return mesh;
}

}  // namespace flexboom
