#include "fem/assembly.hpp"

#include "fem/check.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Triplets = std::vector<Eigen::Triplet<double>>;

const ElementType& type_of(const Element& element) { return element_types()[static_cast<size_t>(element.type)]; }

const Element& element_of(const Mesh& mesh, int element) { return mesh.elements[static_cast<size_t>(element)]; }

DofMap number_dofs(const Mesh& mesh) {
  DofMap dofs;
  dofs.count = 6 * static_cast<int>(mesh.nodes.cols());
  for (const Element& element : mesh.elements) {
    dofs.element_offset.push_back(dofs.count);
    dofs.count += type_of(element).internal_freedoms(mesh, element);
  }
  dofs.absent.assign(static_cast<size_t>(dofs.count), 0);
  return dofs;
}

std::vector<int> of_node_body(int node) {
  std::vector<int> dofs(6);
  std::iota(dofs.begin(), dofs.end(), DofMap::of_node(node, 0));
  return dofs;
}

// Adds both triangles of a symmetric matrix given by its lower one. Entries that only the round-off of cancelling
// points left are dropped, so that the two bending planes, torsion and extension stay apart where the element says so.
void add(Triplets& triplets, const MatrixXd& lower, const std::vector<int>& dofs) {
  constexpr double noise = 16 * std::numeric_limits<double>::epsilon();
  const VectorXd scale = lower.diagonal().cwiseAbs().cwiseSqrt();
  for (Index j = 0; j < lower.cols(); ++j) {
    for (Index i = j; i < lower.rows(); ++i) {
      const double value = lower(i, j);
      if (i != j && std::abs(value) <= noise * scale(i) * scale(j)) continue;
      if (value == 0) continue;
      const int row = dofs[static_cast<size_t>(i)], column = dofs[static_cast<size_t>(j)];
      triplets.emplace_back(row, column, value);
      if (i != j) triplets.emplace_back(column, row, value);
    }
  }
}

SparseMatrix make_sparse(int size, const Triplets& triplets) {
  SparseMatrix A(size, size);
  A.setFromTriplets(triplets.begin(), triplets.end());
  return A;
}

// Sum of dm N^T N, lower triangle.
struct MassSum {
  MatrixXd lower;
  void operator()(double dm, const Vector3d&, const Eigen::Ref<const Matrix3Xd>& N) {
    if (lower.size() == 0) lower.setZero(N.cols(), N.cols());
    lower.selfadjointView<Eigen::Lower>().rankUpdate(N.transpose(), dm);
  }
};

SparseMatrix assemble_stiffness(const Mesh& mesh, const DofMap& dofs) {
  Triplets triplets;
  for (size_t e = 0; e < mesh.elements.size(); ++e) {
    const Element& element = mesh.elements[e];
    add(triplets, type_of(element).stiffness(mesh, element), dofs.of_element(mesh, static_cast<int>(e)));
  }
  return make_sparse(dofs.count, triplets);
}

SparseMatrix assemble_mass(const Mesh& mesh, const DofMap& dofs) {
  Triplets triplets;
  for (size_t e = 0; e < mesh.elements.size(); ++e) {
    const Element& element = mesh.elements[e];
    MassSum sum;
    type_of(element).mass_points(mesh, element, 0, std::ref(sum));
    add(triplets, sum.lower, dofs.of_element(mesh, static_cast<int>(e)));
  }
  for (const NodalBody& body : mesh.bodies) {
    MassSum sum;
    nodal_body_mass_points(mesh, body, std::ref(sum));
    if (sum.lower.size() > 0) add(triplets, sum.lower, of_node_body(body.node));
  }
  return make_sparse(dofs.count, triplets);
}

// Freedoms that no mass can reach through K: a connected group without any mass has no motion of its own and takes no
// part in that of others (torsion of a line mass).
std::vector<char> massless_groups(const SparseMatrix& K, const SparseMatrix& M) {
  std::vector<char> reached(static_cast<size_t>(K.cols()), 0);
  std::vector<Index> front;
  for (Index j = 0; j < M.cols(); ++j) {
    if (M.coeff(j, j) == 0) continue;
    reached[static_cast<size_t>(j)] = 1;
    front.push_back(j);
  }
  while (!front.empty()) {
    const Index j = front.back();
    front.pop_back();
    for (SparseMatrix::InnerIterator it(K, j); it; ++it) {
      if (reached[static_cast<size_t>(it.row())]) continue;
      reached[static_cast<size_t>(it.row())] = 1;
      front.push_back(it.row());
    }
  }
  for (char& flag : reached) flag = !flag;
  return reached;
}

VectorXd gather(const Eigen::Ref<const VectorXd>& u, std::span<const int> dofs) {
  VectorXd local(static_cast<Index>(dofs.size()));
  for (size_t i = 0; i < dofs.size(); ++i) local(static_cast<Index>(i)) = u(dofs[i]);
  return local;
}

}  // namespace

std::vector<int> DofMap::of_element(const Mesh& mesh, int element) const {
  std::vector<int> dofs;
  for (int node : element_of(mesh, element).nodes) {
    for (int component = 0; component < 6; ++component) dofs.push_back(of_node(node, component));
  }
  const auto e = static_cast<size_t>(element);
  const int end = e + 1 < element_offset.size() ? element_offset[e + 1] : count;
  for (int dof = element_offset[e]; dof < end; ++dof) dofs.push_back(dof);
  return dofs;
}

Assembly assemble(const Mesh& mesh) {
  mesh.validate();
  DofMap dofs = number_dofs(mesh);
  SparseMatrix K = assemble_stiffness(mesh, dofs);
  SparseMatrix M = assemble_mass(mesh, dofs);
  dofs.absent = massless_groups(K, M);
  return {std::move(K), std::move(M), std::move(dofs)};
}

void for_each_mass_point(const Mesh& mesh, const DofMap& dofs, const MeshMassPointVisitor& visit, int extra) {
  for (size_t e = 0; e < mesh.elements.size(); ++e) {
    const Element& element = mesh.elements[e];
    const std::vector<int> element_dofs = dofs.of_element(mesh, static_cast<int>(e));
    type_of(element).mass_points(
        mesh, element, extra,
        [&](double dm, const Vector3d& u0, const Eigen::Ref<const Matrix3Xd>& N) { visit(dm, u0, N, element_dofs); });
  }
  for (const NodalBody& body : mesh.bodies) {
    const std::vector<int> body_dofs = of_node_body(body.node);
    nodal_body_mass_points(mesh, body, [&](double dm, const Vector3d& u0, const Eigen::Ref<const Matrix3Xd>& N) {
      visit(dm, u0, N, body_dofs);
    });
  }
}

PointEnergies point_energies(const Mesh& mesh, const DofMap& dofs, const Eigen::Ref<const VectorXd>& u) {
  require(u.size() == dofs.count, "point_energies: the vector has " + std::to_string(u.size()) +
                                      " entries, the mesh has " + std::to_string(dofs.count) + " freedoms");
  PointEnergies energy;
  for (size_t e = 0; e < mesh.elements.size(); ++e) {
    const Element& element = mesh.elements[e];
    const VectorXd q = gather(u, dofs.of_element(mesh, static_cast<int>(e)));
    type_of(element).strain_points(mesh, element, [&](double weight, const MatrixXd& B, const MatrixXd& D) {
      const VectorXd strain = B * q;
      energy.strain += weight / 2 * strain.dot(D * strain);
    });
  }
  for_each_mass_point(
      mesh, dofs,
      [&](double dm, const Vector3d&, const Eigen::Ref<const Matrix3Xd>& N, std::span<const int> point_dofs) {
        energy.kinetic += dm / 2 * (N * gather(u, point_dofs)).squaredNorm();
      });
  return energy;
}

std::vector<int> free_dofs(const DofMap& dofs, std::span<const int> clamped_nodes) {
  std::vector<char> leaves = dofs.absent;
  for (int node : clamped_nodes) {
    const int first = DofMap::of_node(node, 0);
    require(node >= 0 && first + 6 <= dofs.count, "clamp: node " + std::to_string(node) + " is missing");
    std::fill_n(leaves.begin() + first, 6, char{1});
  }
  std::vector<int> free;
  for (int dof = 0; dof < dofs.count; ++dof) {
    if (!leaves[static_cast<size_t>(dof)]) free.push_back(dof);
  }
  return free;
}

SparseMatrix submatrix(const SparseMatrix& A, std::span<const int> dofs) {
  std::vector<int> position(static_cast<size_t>(A.rows()), -1);
  for (size_t i = 0; i < dofs.size(); ++i) position[static_cast<size_t>(dofs[i])] = static_cast<int>(i);
  Triplets triplets;
  for (size_t j = 0; j < dofs.size(); ++j) {
    for (SparseMatrix::InnerIterator it(A, dofs[j]); it; ++it) {
      const int row = position[static_cast<size_t>(it.row())];
      if (row >= 0) triplets.emplace_back(row, static_cast<int>(j), it.value());
    }
  }
  return make_sparse(static_cast<int>(dofs.size()), triplets);
}

Eigen::MatrixXd rigid_motions(const Mesh& mesh, const DofMap& dofs) {
  // u = t + r x X, theta = r at the nodes; the node shapes contain every linear motion, so internal freedoms stay zero.
  MatrixXd T = MatrixXd::Zero(dofs.count, 6);
  for (int node = 0; node < mesh.nodes.cols(); ++node) {
    for (int k = 0; k < 3; ++k) {
      T(DofMap::of_node(node, k), k) = 1;
      T.block<3, 1>(DofMap::of_node(node, 0), 3 + k) = Vector3d::Unit(k).cross(Vector3d(mesh.nodes.col(node)));
      T(DofMap::of_node(node, 3 + k), 3 + k) = 1;
    }
  }
  return T;
}

DisplayLines display_lines(const Mesh& mesh, int points_per_element) {
  require(points_per_element >= 2, "display_lines: a line needs at least 2 points");
  DisplayLines display;
  const int elements = static_cast<int>(mesh.elements.size());
  display.points.resize(3, static_cast<Index>(elements) * points_per_element);
  for (int e = 0; e < elements; ++e) {
    const std::vector<int>& nodes = element_of(mesh, e).nodes;
    std::vector<int>& line = display.lines.emplace_back();
    for (int i = 0; i < points_per_element; ++i) {
      const double s = static_cast<double>(i) / (points_per_element - 1);
      const int point = e * points_per_element + i;
      display.points.col(point) = (1 - s) * mesh.nodes.col(nodes[0]) + s * mesh.nodes.col(nodes[1]);
      display.element.push_back(e);
      display.parameter.push_back(s);
      line.push_back(point);
    }
  }
  return display;
}

}  // namespace flexboom
