#include "fem/formats/deck/nodes.hpp"

#include "fem/mesh/element.hpp"

namespace flexboom {
namespace {

void mark(std::vector<char>& flags, const std::vector<int>& nodes) {
  for (const int node : nodes) flags[static_cast<size_t>(node)] = 1;
}

}  // namespace

std::vector<char> nodes_that_rotate(const Mesh& mesh) {
  std::vector<char> flags(static_cast<size_t>(mesh.nodes.cols()), 0);
  for (const Element& element : mesh.elements) {
    if (type_of(element).node_freedoms == 6) mark(flags, element.nodes);
  }
  for (const RigidConnection& c : mesh.rigid_connections) mark(flags, {c.reference});
  for (const DistributingConnection& c : mesh.distributing_connections) mark(flags, {c.reference});
  return flags;
}

std::vector<char> nodes_in_use(const Mesh& mesh) {
  std::vector<char> flags = nodes_that_rotate(mesh);
  for (const Element& element : mesh.elements) mark(flags, element.nodes);
  for (const RigidConnection& c : mesh.rigid_connections) mark(flags, c.nodes);
  for (const DistributingConnection& c : mesh.distributing_connections) mark(flags, c.nodes);
  for (const LinearEquation& equation : mesh.equations) {
    for (const LinearEquation::Term& term : equation.terms) mark(flags, {term.node});
  }
  return flags;
}

}  // namespace flexboom
