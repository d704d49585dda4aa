#include "fem/mesh/element.hpp"
#include "reduction/body_file/sha256.hpp"
#include "reduction/invariants/certificate.hpp"

#include <type_traits>

namespace flexboom {
namespace {

/// Feeds values to a digest, each run of values with its length before it so that no two meshes look alike.
class MeshDigest {
 public:
  template <class Value>
  void add(const Value& value) {
    static_assert(std::is_trivially_copyable_v<Value>);
    digest_.add({reinterpret_cast<const char*>(&value), sizeof value});
  }

  template <class Value>
  void add_all(const Value* values, size_t count) {
    add(count);
    digest_.add({reinterpret_cast<const char*>(values), count * sizeof(Value)});
  }

  void add_text(std::string_view text) { add_all(text.data(), text.size()); }
  void add_nodes(const std::vector<int>& nodes) { add_all(nodes.data(), nodes.size()); }
  void add_components(const Components& components) { add_all(components.data(), components.size()); }

  void add_material(const Material& m) {
    for (const double value : {m.E, m.nu, m.rho}) add(value);
  }

  void add_section(const SectionShape& shape) {
    add(shape.index());
    std::visit(
        [this](const auto& s) {
          static_assert(sizeof s % sizeof(double) == 0, "doubles only: no padding between them");
          add(s);
        },
        shape);
  }

  std::string digest() { return digest_.digest(); }

 private:
  Sha256 digest_;
};

void add_properties(MeshDigest& digest, const Mesh& mesh) {
  digest.add(mesh.beam_properties.size());
  for (const BeamProperty& p : mesh.beam_properties) {
    digest.add_section(p.start);
    digest.add_section(p.end);
    digest.add_material(p.material);
    digest.add(p.theory);
    digest.add_text(p.shear.name);
    digest.add(p.shear.value);
    digest.add(p.rotary_inertia);
    digest.add(p.line_mass);
    digest.add_all(p.y_axis.data(), 3);
  }
  digest.add(mesh.solid_properties.size());
  for (const SolidProperty& p : mesh.solid_properties) digest.add_material(p.material);
  digest.add(mesh.bodies.size());
  for (const NodalBody& b : mesh.bodies) {
    digest.add(b.node);
    digest.add(b.mass);
    digest.add_all(b.inertia.data(), 9);
    digest.add_all(b.offset.data(), 3);
  }
}

void add_constraints(MeshDigest& digest, const Mesh& mesh) {
  digest.add(mesh.supports.size());
  for (const Support& s : mesh.supports) {
    digest.add(s.node);
    digest.add_components(s.components);
  }
  digest.add(mesh.rigid_connections.size());
  for (const RigidConnection& c : mesh.rigid_connections) {
    digest.add(c.reference);
    digest.add_nodes(c.nodes);
    digest.add_components(c.components);
  }
  digest.add(mesh.distributing_connections.size());
  for (const DistributingConnection& c : mesh.distributing_connections) {
    digest.add(c.reference);
    digest.add_nodes(c.nodes);
    digest.add_all(c.weights.data(), c.weights.size());
    digest.add_components(c.components);
  }
  digest.add(mesh.equations.size());
  for (const LinearEquation& e : mesh.equations) {
    digest.add(e.terms.size());
    for (const LinearEquation::Term& t : e.terms) {
      digest.add(t.node);
      digest.add(t.component);
      digest.add(t.coefficient);
    }
  }
}

}  // namespace

std::string mesh_hash(const Mesh& mesh) {
  MeshDigest digest;
  digest.add_all(mesh.nodes.data(), static_cast<size_t>(mesh.nodes.size()));
  digest.add(mesh.elements.size());
  for (const Element& e : mesh.elements) {
    digest.add_text(type_of(e).name);
    digest.add_nodes(e.nodes);
    digest.add(e.order);
    digest.add(e.property);
  }
  add_properties(digest, mesh);
  add_constraints(digest, mesh);
  for (const auto& [name, nodes] : mesh.node_sets) {
    digest.add_text(name);
    digest.add_nodes(nodes);
  }
  return digest.digest();
}

}  // namespace flexboom
