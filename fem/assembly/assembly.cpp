#include "fem/assembly/assembly.hpp"

#include "fem/assembly/constraints.hpp"
#include "fem/assembly/pattern.hpp"
#include "fem/base/check.hpp"
#include "fem/base/parallel.hpp"

#include <fmt/format.h>
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

const Element& element_of(const Mesh& mesh, int element) { return mesh.elements[static_cast<size_t>(element)]; }

/// Freedoms of each node: as many as the elements around it have; a reference node of a connection and a node that an
/// equation turns have rotations.
std::vector<int> node_freedoms(const Mesh& mesh) {
  std::vector<int> freedoms(static_cast<size_t>(mesh.nodes.cols()), 0);
  const auto at_least = [&freedoms](int node, int wanted) {
    int& present = freedoms[static_cast<size_t>(node)];
    present = std::max(present, wanted);
  };
  for (const Element& element : mesh.elements) {
    for (const int node : element.nodes) at_least(node, type_of(element).node_freedoms);
  }
  for (const RigidConnection& c : mesh.rigid_connections) {
    at_least(c.reference, 6);
    for (const int node : c.nodes) at_least(node, 3);
  }
  for (const DistributingConnection& c : mesh.distributing_connections) {
    at_least(c.reference, 6);
    for (const int node : c.nodes) at_least(node, 3);
  }
  for (const LinearEquation& equation : mesh.equations) {
    for (const LinearEquation::Term& term : equation.terms) at_least(term.node, term.component < 3 ? 3 : 6);
  }
  for (const NodalBody& body : mesh.bodies) at_least(body.node, 3);
  return freedoms;
}

DofMap number_dofs(const Mesh& mesh) {
  DofMap dofs;
  for (const int freedoms : node_freedoms(mesh)) {
    dofs.node_offset.push_back(dofs.count);
    dofs.count += freedoms;
  }
  dofs.node_offset.push_back(dofs.count);
  for (const Element& element : mesh.elements) {
    dofs.element_offset.push_back(dofs.count);
    dofs.count += type_of(element).internal_freedoms(mesh, element);
  }
  dofs.element_offset.push_back(dofs.count);
  dofs.absent.assign(static_cast<size_t>(dofs.count), 0);
  return dofs;
}

std::vector<int> of_node_body(const DofMap& dofs, int node) {
  std::vector<int> result(static_cast<size_t>(dofs.freedoms_of(node)));
  std::iota(result.begin(), result.end(), dofs.of_node(node, 0));
  return result;
}

// Zeroes what only the round-off of cancelling points left, so that the two bending planes, torsion and extension of a
// beam stay apart where the element says so.
void drop_noise(MatrixXd& lower) {
  constexpr double noise = 16 * std::numeric_limits<double>::epsilon();
  const VectorXd scale = lower.diagonal().cwiseAbs().cwiseSqrt();
  for (Index j = 0; j < lower.cols(); ++j) {
    for (Index i = j + 1; i < lower.rows(); ++i) {
      if (std::abs(lower(i, j)) <= noise * scale(i) * scale(j)) lower(i, j) = 0;
    }
  }
}

// Sum of dm N^T N, lower triangle. A node without rotations carries the mass of a body and not its inertia.
MatrixXd body_mass(const Mesh& mesh, const DofMap& dofs, const NodalBody& body) {
  const Index freedoms = dofs.freedoms_of(body.node);
  MatrixXd lower = MatrixXd::Zero(freedoms, freedoms);
  nodal_body_mass_points(mesh, body, [&](double dm, const Vector3d&, const Eigen::Ref<const Matrix3Xd>& N) {
    lower.selfadjointView<Eigen::Lower>().rankUpdate(N.leftCols(freedoms).transpose(), dm);
  });
  return lower;
}

// Without beams every entry of the pattern is kept: the columns of a node's freedoms are then alike.
void finish(SparseMatrix& A, bool has_beams) {
  if (has_beams) A.prune([](Index, Index, double value) { return value != 0; });
}

// Freedoms that no mass can reach through K, connections and equations. A connected group without any mass has no
// motion of its own and takes no part in that of others. An example is the torsion of a line mass.
std::vector<char> massless_groups(const Mesh& mesh, const DofMap& dofs, const SparseMatrix& K, const SparseMatrix& M) {
  std::vector<char> massless(static_cast<size_t>(K.cols()), 0);
  const VectorXd mass = M.diagonal();
  if ((mass.array() != 0).all()) return massless;

  std::vector<int> parent(static_cast<size_t>(K.cols()));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&parent](int i) {
    while (parent[static_cast<size_t>(i)] != i) {
      i = parent[static_cast<size_t>(i)] = parent[static_cast<size_t>(parent[static_cast<size_t>(i)])];
    }
    return i;
  };
  const auto join = [&](int i, int j) { parent[static_cast<size_t>(root(i))] = root(j); };
  for (int j = 0; j < K.cols(); ++j) {
    for (SparseMatrix::InnerIterator it(K, j); it; ++it) join(static_cast<int>(it.row()), j);
  }
  for (const ConstraintRow& row : constraint_rows(mesh, dofs)) {
    for (const auto& [dof, coefficient] : row.terms) {
      if (coefficient != 0) join(dof, row.terms.front().first);
    }
  }
  std::vector<char> has_mass(parent.size(), 0);
  for (int i = 0; i < K.cols(); ++i) {
    if (mass(i) != 0) has_mass[static_cast<size_t>(root(i))] = 1;
  }
  for (int i = 0; i < K.cols(); ++i) massless[static_cast<size_t>(i)] = !has_mass[static_cast<size_t>(root(i))];
  return massless;
}

}  // namespace

std::vector<int> DofMap::of_element(const Mesh& mesh, int element) const {
  std::vector<int> dofs;
  const int per_node = type_of(element_of(mesh, element)).node_freedoms;
  for (int node : element_of(mesh, element).nodes) {
    for (int component = 0; component < per_node; ++component) dofs.push_back(of_node(node, component));
  }
  const auto e = static_cast<size_t>(element);
  for (int dof = element_offset[e]; dof < element_offset[e + 1]; ++dof) dofs.push_back(dof);
  return dofs;
}

Assembly assemble(const Mesh& mesh, int threads) {
  mesh.validate(threads);
  DofMap dofs = number_dofs(mesh);
  const EntityGraph graph = entity_graph(mesh, dofs);
  PatternMatrix K(graph, Coupling::full, threads);
  PatternMatrix M(graph, Coupling::by_component, threads);
  bool has_beams = false;
  for (const Element& element : mesh.elements) has_beams = has_beams || type_of(element).shape == Shape::line;
  for (const std::vector<int>& group : independent_groups(mesh, dofs)) {
    parallel_for(threads, static_cast<int>(group.size()), 8, [&](int i) {
      const int e = group[static_cast<size_t>(i)];
      const Element& element = element_of(mesh, e);
      const ElementType& type = type_of(element);
      MatrixXd stiffness = type.stiffness(mesh, element);
      MatrixXd mass = type.mass(mesh, element);
      if (type.shape == Shape::line) {
        drop_noise(stiffness);
        drop_noise(mass);
      }
      const std::vector<int> entities = entities_of(mesh, dofs, e);
      K.add(entities, type.node_freedoms, stiffness);
      M.add(entities, type.node_freedoms, mass);
    });
  }
  for (const NodalBody& body : mesh.bodies) {
    MatrixXd mass = body_mass(mesh, dofs, body);
    drop_noise(mass);
    M.add({body.node}, dofs.freedoms_of(body.node), mass);
  }
  Assembly result{K.take(), M.take(), std::move(dofs)};
  finish(result.K, has_beams);
  finish(result.M, has_beams);
  result.dofs.absent = massless_groups(mesh, result.dofs, result.K, result.M);
  return result;
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
    const std::vector<int> body_dofs = of_node_body(dofs, body.node);
    nodal_body_mass_points(mesh, body, [&](double dm, const Vector3d& u0, const Eigen::Ref<const Matrix3Xd>& N) {
      visit(dm, u0, N.leftCols(std::ssize(body_dofs)), body_dofs);
    });
  }
}

VectorXd strain_energies(const Mesh& mesh, const DofMap& dofs, const Eigen::Ref<const MatrixXd>& U, int threads) {
  require(U.rows() == dofs.count,
          fmt::format("strain_energies: vectors have {} entries, the mesh has {} freedoms", U.rows(), dofs.count));
  // Summed in blocks of fixed size, so that the result is the same for any number of threads.
  constexpr int block = 256;
  const auto elements = static_cast<int>(mesh.elements.size());
  const int blocks = (elements + block - 1) / block;
  MatrixXd strain = MatrixXd::Zero(U.cols(), blocks);
  parallel_for(threads, blocks, 1, [&](int b) {
    for (int e = b * block; e < std::min(elements, (b + 1) * block); ++e) {
      const Element& element = element_of(mesh, e);
      const MatrixXd q = U(dofs.of_element(mesh, e), Eigen::all);
      strain.col(b) += type_of(element).energy_strains(mesh, element, q).rowwise().squaredNorm() / 2;
    }
  });
  return strain.rowwise().sum();
}

PointEnergies point_energies(const Mesh& mesh, const Assembly& assembly, const Eigen::Ref<const MatrixXd>& U,
                             int threads) {
  return {strain_energies(mesh, assembly.dofs, U, threads),
          U.cwiseProduct(symmetric_product(assembly.M, U)).colwise().sum().transpose() / 2};
}

double total_mass(const Mesh& mesh, const Assembly& assembly) {
  return quadratic_form(assembly.M, rigid_motions(mesh, assembly.dofs).leftCols<1>())(0, 0);
}

MatrixXd rigid_motions(const Mesh& mesh, const DofMap& dofs) {
  // u = t + r x X, theta = r at the nodes; the node shapes contain every linear motion, so internal freedoms stay zero.
  MatrixXd T = MatrixXd::Zero(dofs.count, 6);
  for (int node = 0; node < mesh.nodes.cols(); ++node) {
    if (dofs.freedoms_of(node) == 0) continue;
    for (int k = 0; k < 3; ++k) {
      T(dofs.of_node(node, k), k) = 1;
      T.block<3, 1>(dofs.of_node(node, 0), 3 + k) = Vector3d::Unit(k).cross(Vector3d(mesh.nodes.col(node)));
      if (dofs.freedoms_of(node) == 6) T(dofs.of_node(node, 3 + k), 3 + k) = 1;
    }
  }
  return T;
}

Matrix3Xd nodal_displacement(const Mesh& mesh, const DofMap& dofs, const Eigen::Ref<const VectorXd>& u) {
  Matrix3Xd result = Matrix3Xd::Zero(3, mesh.nodes.cols());
  for (int node = 0; node < mesh.nodes.cols(); ++node) {
    if (dofs.freedoms_of(node) > 0) result.col(node) = u.segment<3>(dofs.of_node(node, 0));
  }
  return result;
}

DisplayLines display_lines(const Mesh& mesh, int points_per_element) {
  require(points_per_element >= 2, "display_lines: a line needs at least 2 points");
  DisplayLines display;
  std::vector<Vector3d> points;
  for (int e = 0; e < std::ssize(mesh.elements); ++e) {
    if (type_of(element_of(mesh, e)).shape != Shape::line) continue;
    const std::vector<int>& nodes = element_of(mesh, e).nodes;
    std::vector<int>& line = display.lines.emplace_back();
    for (int i = 0; i < points_per_element; ++i) {
      const double s = static_cast<double>(i) / (points_per_element - 1);
      line.push_back(static_cast<int>(points.size()));
      points.emplace_back((1 - s) * mesh.nodes.col(nodes[0]) + s * mesh.nodes.col(nodes[1]));
      display.element.push_back(e);
      display.parameter.push_back(s);
    }
  }
  display.points.resize(3, std::ssize(points));
  for (Index i = 0; i < display.points.cols(); ++i) display.points.col(i) = points[static_cast<size_t>(i)];
  return display;
}

}  // namespace flexboom
