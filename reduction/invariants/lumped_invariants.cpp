#include "reduction/invariants/lumped_invariants.hpp"

#include "fem/base/check.hpp"
#include "reduction/basis/reduced_matrices.hpp"

#include <fmt/format.h>

namespace flexboom {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Adds the mass of one element to its nodes.
void add_element(VectorXd& masses, const Mesh& mesh, const Element& element) {
  const ElementType& type = type_of(element);
  const VectorXd diagonal = type.mass(mesh, element).diagonal();
  double mass = 0;
  type.mass_points(mesh, element, 0, [&mass](double dm, const auto&, const auto&) { mass += dm; });
  VectorXd weights(std::ssize(element.nodes));  // tr M_ii of the translations of each node
  for (Index i = 0; i < weights.size(); ++i) weights(i) = diagonal.segment<3>(type.node_freedoms * i).sum();
  masses(element.nodes) += mass / weights.sum() * weights;
}

}  // namespace

VectorXd nodal_masses(const Mesh& mesh) {
  VectorXd masses = VectorXd::Zero(mesh.nodes.cols());
  for (const Element& element : mesh.elements) add_element(masses, mesh, element);
  return masses;
}

ReducedBody lumped_invariants(const Mesh& mesh, const Assembly& assembly, const MatrixXd& Phi) {
  require(Phi.rows() == assembly.dofs.count,
          fmt::format("lumped invariants: shapes have {} entries, the mesh has {} freedoms", Phi.rows(),
                      assembly.dofs.count));
  // The sum over nodes is that of a mesh without elements, whose nodes carry points of mass beside their bodies.
  Mesh points;
  points.nodes = mesh.nodes;
  points.bodies = mesh.bodies;
  const VectorXd masses = nodal_masses(mesh);
  for (int node = 0; node < masses.size(); ++node) points.bodies.push_back({.node = node, .mass = masses(node)});
  ReducedBody body = blank_body("lumped", static_cast<int>(Phi.cols()));
  set_invariants(body, gram_matrix_by_points(points, assembly.dofs, Phi));
  return body;
}

}  // namespace flexboom
