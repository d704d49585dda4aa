#include "fem/base/at.hpp"
#include "fem/formats/abaqus/lookup.hpp"
#include "fem/mesh/element.hpp"
#include "fem/mesh/mesh_sets.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <set>

namespace flexboom::abaqus {
namespace {

using Eigen::Vector3d;

constexpr int beam_order = 4;  // of which one element is converged where a deck has many

/// A value between the rows of a table, that of an end beyond it.
template <class Row>
double value_at(const std::vector<Row>& rows, double Row::*value, double temperature) {
  const auto above = std::ranges::upper_bound(rows, temperature, {}, &Row::temperature);
  if (above == rows.begin()) return rows.front().*value;
  if (above == rows.end()) return rows.back().*value;
  const Row &a = *std::prev(above), &b = *above;
  return a.*value + (b.*value - a.*value) * (temperature - a.temperature) / (b.temperature - a.temperature);
}

/// Initial temperatures of nodes, zero where none is given, as in both programs.
class Temperatures {
 public:
  explicit Temperatures(const Lookup& lookup) : lookup_(lookup) {}

  /// The temperature that all elements of a section start with. @throws InputError if they differ.
  double of(const SectionLine& section, const MaterialLines& material) {
    Deck& deck = lookup_.deck();
    const std::string name = flexboom::quoted(material.name);
    if (!deck.temperature_file.empty())
      deck.fail(deck.temperature_file,
                fmt::format("material {} depends on temperature; write the initial temperatures out", name));
    if (!deck.step_temperature.empty() &&
        deck.dialect(deck.step_temperature,
                     fmt::format("material {} depends on temperature, which is that of the last step in Abaqus and the "
                                 "initial one in CalculiX",
                                 name)) == Dialect::abaqus)
      deck.fail(
          deck.step_temperature,
          fmt::format("material {} depends on the temperature of this step, which is not understood; give it that "
                      "as its initial temperature",
                      name));
    read();
    double lowest = 0, highest = 0;
    bool first = true;
    for (const int e : lookup_.elements(section.elements)) {
      const ElementLine& line = deck.elements[at(e)];
      for (int k = 0; k < line.kind->nodes; ++k) {
        const double t = of_node_[at(lookup_.nodes_of(line)[k])];
        lowest = first ? t : std::min(lowest, t);
        highest = first ? t : std::max(highest, t);
        first = false;
      }
    }
    if (lowest != highest)
      deck.fail(section.at,
                fmt::format("material {} depends on temperature, and these elements start between {} and {}; "
                            "give each temperature a section of its own",
                            name, lowest, highest));
    deck.notes.add(fmt::format("material {} depends on temperature: it is taken at the initial temperature, {}{}", name,
                               lowest, deck.initial_temperatures.empty() ? " where none is given" : ""));
    return lowest;
  }

 private:
  void read() {
    if (!of_node_.empty()) return;
    of_node_.assign(lookup_.deck().nodes.labels().size(), 0);
    for (const InitialTemperature& line : lookup_.deck().initial_temperatures) {
      for (const int node : lookup_.nodes(line.nodes)) of_node_[at(node)] = line.temperature;
    }
  }

  const Lookup& lookup_;
  std::vector<double> of_node_;
};

const MaterialLines& material_lines(const Deck& deck, const SectionLine& section) {
  const auto found = deck.materials.find(section.material);
  if (found == deck.materials.end())
    deck.fail(section.at, fmt::format("material {} is not defined", flexboom::quoted(section.material)));
  if (found->second.elastic.empty())
    deck.fail(section.at, fmt::format("material {} has no *ELASTIC", flexboom::quoted(found->second.name)));
  return found->second;
}

/// Properties of the sections: solids share one per material and temperature, beams have one each.
std::vector<int> add_properties(const Lookup& lookup, Mesh& mesh) {
  Deck& deck = lookup.deck();
  Temperatures temperatures(lookup);
  std::vector<int> property;
  std::map<std::pair<std::string, double>, int> solids;
  for (SectionLine& section : deck.sections) {
    Material material = section.beam.material;
    double temperature = 0;
    std::string name;
    if (deck.options.material) {
      material = *deck.options.material;
    } else if (!section.material.empty()) {
      const MaterialLines& lines = material_lines(deck, section);
      name = lines.name;
      if (lines.depends_on_temperature()) {
        temperature = temperatures.of(section, lines);
        name += fmt::format("_{}", temperature);
      }
      material = {value_at(lines.elastic, &ElasticRow::E, temperature),
                  value_at(lines.elastic, &ElasticRow::nu, temperature),
                  lines.density.empty() ? 0 : value_at(lines.density, &DensityRow::rho, temperature)};
      if (lines.density.empty())
        deck.notes.add(fmt::format("material {} has no *DENSITY: it weighs nothing", flexboom::quoted(name)));
    }
    if (section.role == Role::beam) {
      property.push_back(static_cast<int>(mesh.beam_properties.size()));
      section.beam.material = material;
      mesh.beam_properties.push_back(section.beam);
      continue;
    }
    const auto [place, is_new] =
        solids.try_emplace({section.material, temperature}, static_cast<int>(mesh.solid_properties.size()));
    if (is_new) mesh.solid_properties.push_back({name, material});
    property.push_back(place->second);
  }
  return property;
}

bool alike(const SectionLine& one, const SectionLine& two) {
  return one.role == Role::solid && two.role == Role::solid && one.material == two.material;
}

void assign_sections(const Lookup& lookup) {
  Deck& deck = lookup.deck();
  for (size_t s = 0; s < deck.sections.size(); ++s) {
    const SectionLine& section = deck.sections[s];
    for (const int e : lookup.elements(section.elements)) {
      ElementLine& line = deck.elements[at(e)];
      if (line.kind->role == Role::mass || line.kind->role == Role::reference) continue;
      if (line.kind->role == Role::left_out)
        deck.fail(section.at,
                  fmt::format("element {} is a {}: shells, membranes, trusses and plane elements are out of "
                              "scope; there are solids and beams",
                              line.at, line.kind->name));
      if (line.kind->role != section.role)
        deck.fail(section.at, fmt::format("element {} is a {} and cannot have this section", line.at, line.kind->name));
      if (line.section >= 0 && !alike(deck.sections[at(line.section)], section))
        deck.fail(section.at, fmt::format("element {} already has a section ({})", line.at,
                                          deck.lines.text().line_location(deck.sections[at(line.section)].at)));
      line.section = static_cast<int>(s);
    }
  }
}

void require_direction(const Deck& deck, const Mesh& mesh, const ElementLine& line, const Element& element) {
  const Vector3d axis = mesh.nodes.col(element.nodes[1]) - mesh.nodes.col(element.nodes[0]);
  if (axis.norm() == 0) deck.fail(line.at, fmt::format("beam {} has no length", line.at));
  if (axis.normalized().cross(mesh.beam_properties[at(element.property)].y_axis).norm() <= 1e-6)
    deck.fail(line.at,
              fmt::format("beam {} runs along direction 1 of its section; give another direction in the second "
                          "line of its section ({})",
                          line.at, deck.lines.text().line_location(deck.sections[at(line.section)].at)));
}

bool is_bent(const Mesh& mesh, const int* nodes) {
  constexpr double straight = 1e-3;  // of its length; the halves are shorter than an arc by 7e-7 of it then
  const Vector3d chord = mesh.nodes.col(nodes[2]) - mesh.nodes.col(nodes[0]);
  const Vector3d to_middle = mesh.nodes.col(nodes[1]) - mesh.nodes.col(nodes[0]);
  return chord.cross(to_middle).norm() > straight * chord.squaredNorm();
}

void add_element(const Lookup& lookup, Mesh& mesh, const ElementLine& line, int type, int property) {
  const int* nodes = lookup.nodes_of(line);
  if (line.kind->role == Role::solid) {
    const int order = type_of(Element{type, {}, 1, 0}).orders().front();
    mesh.elements.push_back({type, std::vector<int>(nodes, nodes + line.kind->nodes), order, property});
    mesh.element_labels.push_back(std::abs(line.label));
    return;
  }
  for (int k = 0; k + 1 < line.kind->nodes; ++k) {  // B32 has its middle node second
    mesh.elements.push_back({type, {nodes[k], nodes[k + 1]}, beam_order, property});
    mesh.element_labels.push_back(std::abs(line.label));
    require_direction(lookup.deck(), mesh, line, mesh.elements.back());
  }
  if (line.kind->nodes == 3 && is_bent(mesh, nodes))
    lookup.deck().notes.add(
        "beams with three nodes are curved: two straight halves stand for each, which are shorter and "
        "lighter than its arc; more elements make that small");
}

void add_elements(Lookup& lookup, Mesh& mesh) {
  Deck& deck = lookup.deck();
  const std::vector<int> property = add_properties(lookup, mesh);
  assign_sections(lookup);
  const bool without_sections = deck.sections.empty() && (deck.materials.empty() || deck.options.material);
  std::map<std::string_view, int> types;
  std::map<std::string_view, int> left_out;
  lookup.mesh_element.assign(deck.elements.size(), -1);
  lookup.mesh_elements.assign(deck.elements.size(), 0);
  const ElementKind* last_kind = nullptr;
  int type = -1;
  for (size_t e = 0; e < deck.elements.size(); ++e) {
    const ElementLine& line = deck.elements[e];
    if (line.kind->role == Role::left_out) ++left_out[line.kind->name];
    if (line.kind->role != Role::solid && line.kind->role != Role::beam) continue;
    const bool later = without_sections && line.kind->role == Role::solid;
    if (line.section < 0 && !later)
      deck.fail(line.at, fmt::format("element {} ({}) has no section; give it a *{} SECTION", line.at, line.kind->name,
                                     line.kind->role == Role::beam ? "BEAM" : "SOLID"));
    if (later && mesh.solid_properties.empty()) {
      mesh.solid_properties.push_back({"solid", {}});
      if (!deck.options.material) deck.notes.add("the deck has no material; give it one");
    }
    if (line.kind != last_kind) type = element_type(line.kind->row);
    last_kind = line.kind;
    lookup.mesh_element[e] = static_cast<int>(mesh.elements.size());
    add_element(lookup, mesh, line, type, line.section < 0 ? 0 : property[at(line.section)]);
    lookup.mesh_elements[e] = static_cast<int>(mesh.elements.size()) - lookup.mesh_element[e];
  }
  for (const auto& [kind, count] : left_out)
    deck.notes.add(fmt::format("{} elements {} without a section were left out", count, kind));
}

void place_nodes(const Deck& deck, Mesh& mesh) {
  mesh.nodes = deck.nodes.positions();
  const std::vector<long>& labels = deck.nodes.labels();
  for (const long label : labels) mesh.node_labels.push_back(std::abs(label));
  if (!deck.instance) return;
  const Instance& instance = *deck.instance;
  for (size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] < 0) continue;  // of the assembly
    mesh.nodes.col(static_cast<int>(i)) = instance.place(mesh.nodes.col(static_cast<int>(i)));
  }
}

/// Directions that a part gives turn with its instance.
void place_directions(Deck& deck) {
  if (!deck.instance) return;
  const Instance& instance = *deck.instance;
  for (SectionLine& section : deck.sections)
    if (section.elements.in_part) section.beam.y_axis = instance.turn * section.beam.y_axis;
  for (Transform& t : deck.transforms) {
    if (!t.nodes.in_part) continue;
    t.a = t.cylindrical ? instance.place(t.a) : Vector3d(instance.turn * t.a);
    t.b = t.cylindrical ? instance.place(t.b) : Vector3d(instance.turn * t.b);
  }
  if (instance.turn.isIdentity()) return;
  for (const Equation& equation : deck.equations)
    if (equation.terms.front().node.in_part)
      deck.fail(equation.at,
                "an equation in a part whose instance is rotated: programs differ in whether its directions "
                "turn as well; give it in the assembly");
}

void add_masses(const Lookup& lookup, Mesh& mesh) {
  Deck& deck = lookup.deck();
  std::vector<char> weighed(deck.elements.size(), 0);
  for (const auto& [reference, mass] : deck.masses) {
    for (const int e : lookup.elements(reference)) {
      const ElementLine& line = deck.elements[at(e)];
      if (line.kind->role != Role::mass)
        deck.fail(reference.text, fmt::format("*MASS: element {} is a {}, not a MASS", line.at, line.kind->name));
      NodalBody body;
      body.node = lookup.nodes_of(line)[0];
      body.mass = mass;
      if (mass > 0) mesh.bodies.push_back(body);
      weighed[at(e)] = 1;
    }
  }
  for (size_t e = 0; e < deck.elements.size(); ++e) {
    const ElementLine& line = deck.elements[e];
    if (line.kind->role == Role::mass && !weighed[e])
      deck.fail(line.at, fmt::format("MASS element {} has no *MASS", line.at));
  }
}

/// Name of a set in the mesh: as written, with the instance before it where the assembly has one of that name as well.
std::string exported_name(const Deck& deck, const std::string& key, const std::string& name, const auto& sets) {
  const bool of_part = key.starts_with("PART.");
  return of_part && sets.contains(upper_key(name)) && deck.instance ? deck.instance->name + "." + name : name;
}

void add_sets(const Lookup& lookup, Mesh& mesh) {
  Deck& deck = lookup.deck();
  for (const auto& [key, nodes] : lookup.node_sets()) {
    if (!nodes.empty()) mesh.node_sets[exported_name(deck, key, deck.node_sets.at(key).name, deck.node_sets)] = nodes;
  }
  for (const auto& [key, lines] : lookup.element_sets()) {
    const std::string name = exported_name(deck, key, deck.element_sets.at(key).name, deck.element_sets);
    std::vector<int> elements, nodes;
    for (const int e : lines) {
      const ElementLine& line = deck.elements[at(e)];
      for (int k = 0; k < lookup.mesh_elements[at(e)]; ++k) elements.push_back(lookup.mesh_element[at(e)] + k);
      if (line.kind->role == Role::left_out)
        nodes.insert(nodes.end(), lookup.nodes_of(line), lookup.nodes_of(line) + line.kind->nodes);
    }
    if (!elements.empty()) {
      mesh.element_sets[name] = std::move(elements);
    } else if (!nodes.empty()) {  // a group of a mesh generator on a surface or line
      mesh.node_sets.try_emplace(node_set_name(mesh, name), sorted_unique(std::move(nodes)));
    }
  }
  for (const auto& [key, surface] : deck.surfaces) {
    const SurfaceParts parts = surface_parts(lookup, mesh, surface);
    const std::string name = exported_name(deck, key, surface.name, deck.surfaces);
    if (!parts.nodes.empty()) mesh.node_sets.try_emplace(node_set_name(mesh, name), parts.nodes);
  }
}

}  // namespace

MeshFile mesh_of(Deck& deck) {
  Lookup lookup(deck);
  MeshFile file;
  file.modes = deck.modes;
  place_nodes(deck, file.mesh);
  place_directions(deck);
  add_elements(lookup, file.mesh);
  if (file.mesh.elements.empty()) deck.fail({}, "the deck has no solid or beam elements");
  add_masses(lookup, file.mesh);
  add_sets(lookup, file.mesh);
  add_connections(lookup, file.mesh);
  file.notes = deck.notes.list();
  drop_unused_nodes(file.mesh, file.notes);
  return file;
}

}  // namespace flexboom::abaqus
