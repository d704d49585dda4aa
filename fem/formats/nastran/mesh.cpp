#include "fem/base/at.hpp"
#include "fem/formats/nastran/bulk.hpp"
#include "fem/mesh/element.hpp"
#include "fem/mesh/mesh_sets.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <cmath>
#include <numbers>
#include <tuple>

namespace flexboom::nastran {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int deepest_system = 100;  // systems defined in systems
constexpr int beam_order = 4;        // of which one element is converged where a deck has many
constexpr double radians_per_degree = std::numbers::pi / 180;

/// Origin and axes of a coordinate system in the basic one.
struct Placed {
  char kind = 'R';
  Vector3d origin = Vector3d::Zero();
  Matrix3d axes = Matrix3d::Identity();

  Vector3d basic(const Vector3d& x) const {
    const double angle = x(1) * radians_per_degree, second = x(2) * radians_per_degree;
    Vector3d local = x;
    if (kind == 'C') local << x(0) * std::cos(angle), x(0) * std::sin(angle), x(2);
    if (kind == 'S')  // (r, theta from z, phi)
      local << x(0) * std::sin(angle) * std::cos(second), x(0) * std::sin(angle) * std::sin(second),
          x(0) * std::cos(angle);
    return origin + axes * local;
  }
};

class Systems {
 public:
  explicit Systems(const Bulk& bulk) : bulk_(bulk) { placed_[0] = {}; }

  const Placed& find(long id, std::string_view at, int depth = 0) {
    if (const auto known = placed_.find(id); known != placed_.end()) return known->second;
    const auto lines = bulk_.systems.find(id);
    if (lines == bulk_.systems.end()) bulk_.fail(at, fmt::format("coordinate system {} is not defined", id));
    const System& system = lines->second;
    if (system.kind == '1')
      bulk_.fail(at, fmt::format("coordinate system {} is defined by grids (CORD1.), which is not understood", id));
    if (depth > deepest_system) bulk_.fail(system.at, fmt::format("coordinate system {} is defined by itself", id));
    const Placed reference = find(system.reference, system.at, depth + 1);
    const Vector3d a = reference.basic(system.origin);
    Placed placed{system.kind, a, {}};
    const Vector3d z = reference.basic(system.z) - a, xz = reference.basic(system.xz) - a;
    if (z.cross(xz).norm() <= 1e-12 * z.norm() * xz.norm())
      bulk_.fail(system.at, fmt::format("coordinate system {}: points A, B and C lie on a line", id));
    placed.axes.col(2) = z.normalized();
    placed.axes.col(1) = z.cross(xz).normalized();
    placed.axes.col(0) = placed.axes.col(1).cross(placed.axes.col(2));
    return placed_[id] = placed;
  }

 private:
  const Bulk& bulk_;
  std::map<long, Placed> placed_;
};

const Material& material_of(const Bulk& bulk, long id, std::string_view at, Material MaterialLine::*use) {
  if (bulk.material) return *bulk.material;
  const auto found = bulk.materials.find(id);
  if (found == bulk.materials.end()) bulk.fail(at, fmt::format("material {} is not defined", id));
  if (!found->second.refusal.empty()) bulk.fail(found->second.at, found->second.refusal);
  return found->second.*use;
}

DeckNodes place_nodes(const Bulk& bulk) {
  Systems systems(bulk);
  DeckNodes placed;
  const DeckNodes& written = bulk.nodes;
  for (size_t i = 0; i < bulk.grids.size(); ++i) {
    const Grid& grid = bulk.grids[i];
    const Vector3d& x = written.position(static_cast<int>(i));
    placed.add(bulk.grid_labels[i], grid.system == 0 ? x : systems.find(grid.system, grid.at).basic(x), grid.at);
  }
  return placed;
}

class Elements {
 public:
  Elements(Bulk& bulk, Mesh& mesh) : bulk_(bulk), mesh_(mesh) {
    for (const auto& [id, name] : bulk.cards.property_names()) names_[id] = name;
  }

  void add_all() {
    for (const SolidLine& line : bulk_.solids) add(line);
    for (const BeamLine& line : bulk_.beams) add(line);
    require_different_labels();
  }

 private:
  void add(const SolidLine&);
  void add(const BeamLine&);
  int solid_property(const SolidLine&);
  int beam_property(const BeamLine&, const BeamPropertyLine&, const Vector3d& y);
  void require_different_labels() const;
  std::string name_of(std::string_view kind, long property) const {
    const auto name = names_.find(property);
    return name == names_.end() ? fmt::format("{}_{}", kind, property) : name->second;
  }

  Bulk& bulk_;
  Mesh& mesh_;
  std::map<long, std::string> names_;
  std::map<long, int> solids_;
  std::map<std::tuple<long, double, double, double>, int> beams_;
  std::map<long, std::vector<int>*> sets_;
  std::string_view last_row_;
  int last_type_ = -1, last_order_ = 1;
  std::vector<std::string_view> where_;  // of the elements
};

int Elements::solid_property(const SolidLine& line) {
  if (const auto known = solids_.find(line.property); known != solids_.end()) return known->second;
  const auto lines = bulk_.solid_properties.find(line.property);
  if (lines == bulk_.solid_properties.end())
    bulk_.fail(line.at, fmt::format("element {}: PSOLID {} is not defined", line.label, line.property));
  SolidProperty property{name_of("PSOLID", line.property),
                         material_of(bulk_, lines->second.material, lines->second.at, &MaterialLine::of_solids)};
  if (property.material.nu >= 0.5)
    bulk_.fail(lines->second.at, fmt::format("{}: Poisson's ratio of material {} is {}; of a solid it must lie between "
                                             "-1 and 0.5",
                                             property.name, lines->second.material, property.material.nu));
  property.material.rho *= bulk_.mass_factor;
  mesh_.solid_properties.push_back(property);
  sets_[line.property] = &mesh_.element_sets[property.name];
  return solids_[line.property] = static_cast<int>(mesh_.solid_properties.size()) - 1;
}

void Elements::add(const SolidLine& line) {
  Element element;
  for (int k = 0; k < line.nodes; ++k)
    element.nodes.push_back(node_of(bulk_, bulk_.element_nodes[line.first_node + at(k)], line.at));
  if (line.row != last_row_) {
    last_type_ = element_type(line.row);
    last_order_ = type_of(Element{last_type_, {}, 1, 0}).orders().front();
    last_row_ = line.row;
  }
  element.type = last_type_;
  element.order = last_order_;
  element.property = solid_property(line);
  sets_[line.property]->push_back(static_cast<int>(mesh_.elements.size()));
  mesh_.elements.push_back(std::move(element));
  mesh_.element_labels.push_back(line.label);
  where_.push_back(line.at);
}

int Elements::beam_property(const BeamLine& line, const BeamPropertyLine& lines, const Vector3d& y) {
  const auto [place, is_new] =
      beams_.try_emplace({line.property, y(0), y(1), y(2)}, static_cast<int>(mesh_.beam_properties.size()));
  if (!is_new) return place->second;
  BeamProperty property;
  property.start = property.end = lines.shape;
  property.material = material_of(bulk_, lines.material, lines.at, &MaterialLine::of_bars);
  property.theory = lines.shear ? BeamTheory::timoshenko : BeamTheory::euler_bernoulli;
  property.y_axis = y;
  property.line_mass = lines.line_mass * bulk_.mass_factor;
  if (property.line_mass < 0) bulk_.fail(lines.at, "the nonstructural mass is negative");
  property.material.rho *= bulk_.mass_factor;
  mesh_.beam_properties.push_back(property);
  return place->second;
}

void Elements::add(const BeamLine& line) {
  const auto lines = bulk_.beam_properties.find(line.property);
  if (lines == bulk_.beam_properties.end())
    bulk_.fail(line.at, fmt::format("element {}: PBAR or PBEAM {} is not defined", line.label, line.property));
  if (line.is_bar != lines->second.is_of_bars)
    bulk_.fail(line.at, line.is_bar ? fmt::format("CBAR {}: property {} is a PBEAM; a CBAR has PBAR or PBARL",
                                                  line.label, line.property)
                                    : fmt::format("CBEAM {}: property {} is a PBAR; a CBEAM has PBEAM or PBEAML",
                                                  line.label, line.property));
  const int a = node_of(bulk_, line.nodes[0], line.at), b = node_of(bulk_, line.nodes[1], line.at);
  Vector3d y = line.direction;
  if (line.direction_node != 0) y = mesh_.nodes.col(node_of(bulk_, line.direction_node, line.at)) - mesh_.nodes.col(a);
  const Vector3d axis = mesh_.nodes.col(b) - mesh_.nodes.col(a);
  if (axis.norm() == 0) bulk_.fail(line.at, fmt::format("element {} has no length", line.label));
  if (axis.cross(y).norm() <= 1e-6 * axis.norm() * y.norm())
    bulk_.fail(line.at, fmt::format("element {}: the orientation vector runs along it", line.label));
  const bool shear = lines->second.shear;
  bulk_.notes.add("CBAR and CBEAM are computed with consistent mass and rotary inertia");
  if (!sets_.contains(line.property)) sets_[line.property] = &mesh_.element_sets[name_of("PBEAM", line.property)];
  sets_[line.property]->push_back(static_cast<int>(mesh_.elements.size()));
  mesh_.elements.push_back({element_type(shear ? "beam-timoshenko" : "beam-euler-bernoulli"),
                            {a, b},
                            beam_order,
                            beam_property(line, lines->second, y.normalized())});
  mesh_.element_labels.push_back(line.label);
  where_.push_back(line.at);
}

void Elements::require_different_labels() const {
  const auto twice = LabelIndex(mesh_.element_labels).duplicate();
  if (!twice) return;
  std::string_view where;
  for (size_t e = 0; e < where_.size(); ++e) {
    if (mesh_.element_labels[e] == *twice) where = where_[e];
  }
  bulk_.fail(where, fmt::format("element {} is defined twice", *twice));
}

void select_modes(const Bulk& bulk, MeshFile& file) {
  const auto& wanted = bulk.cards.case_control().method;
  if (!wanted && bulk.methods.empty()) return;
  const auto method = wanted ? bulk.methods.find(*wanted) : bulk.methods.begin();
  if (method == bulk.methods.end())
    bulk.fail(bulk.cards.case_control().method_at, fmt::format("METHOD = {}: there is no such EIGRL or EIGR", *wanted));
  if (wanted || bulk.methods.size() == 1) file.modes = method->second;
}

}  // namespace

int node_of(const Bulk& bulk, long id, std::string_view at) {
  const int node = bulk.nodes.find(id);
  if (node < 0) bulk.fail(at, fmt::format("grid {} is not defined", id));
  return node;
}

MeshFile mesh_of(Bulk& bulk) {
  bulk.nodes = place_nodes(bulk);
  bulk.nodes.finish(bulk.cards.text());
  MeshFile file;
  Mesh& mesh = file.mesh;
  mesh.nodes = bulk.nodes.positions();
  mesh.node_labels = bulk.nodes.labels();
  Elements(bulk, mesh).add_all();
  if (mesh.elements.empty()) bulk.fail({}, "there are no solids (CTETRA, CHEXA, CPENTA) or beams (CBAR, CBEAM)");
  add_connections(bulk, mesh);
  select_modes(bulk, file);
  file.notes = bulk.cards.case_notes();
  if (bulk.cards.is_cut_off()) file.notes.emplace_back("the deck has no ENDDATA: is it whole?");
  file.notes.insert(file.notes.end(), bulk.notes.list().begin(), bulk.notes.list().end());
  drop_unused_nodes(file.mesh, file.notes);
  return file;
}

}  // namespace flexboom::nastran
