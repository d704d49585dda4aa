#include "fem/formats/abaqus/write.hpp"

#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "fem/formats/common/node_orders.hpp"
#include "fem/mesh/element.hpp"
#include "fem/mesh/mesh_sets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <iterator>
#include <map>
#include <set>
#include <utility>

namespace flexboom {
namespace {

constexpr size_t numbers_per_line = 8;  // CalculiX reads 16, and 132 characters
constexpr size_t longest_name = 80;

struct DeckRow {
  std::string_view row, deck;
};
constexpr std::array<DeckRow, 9> deck_rows = {{
    {"beam-timoshenko", "B31"},
    {"hex8", "C3D8I"},
    {"hex8-reduced", "C3D8R"},
    {"hex20", "C3D20"},
    {"hex20-reduced", "C3D20R"},
    {"tet4", "C3D4"},
    {"tet10", "C3D10"},
    {"wedge6", "C3D6"},
    {"wedge15", "C3D15"},
}};

/// Letters, digits, _ . - only, not beginning with a digit, which would be a number of a node.
std::string deck_name(const std::string& name) {
  std::string result = name.substr(0, longest_name - 2);
  for (char& c : result) {
    const bool fits =
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '-';
    if (!fits) c = '_';
  }
  return result.empty() || (result[0] >= '0' && result[0] <= '9') ? "S_" + result : result;
}

/// Gives each name once, whatever the case of its letters.
class DeckNames {
 public:
  std::string add(const std::string& name) {
    std::string key = deck_name(name);
    for (char& c : key) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    require(used_.insert(key).second, fmt::format("two sets would be called {} in a deck, which has one case", key));
    return deck_name(name);
  }

 private:
  std::set<std::string> used_;
};

class DeckWriter {
 public:
  explicit DeckWriter(const Mesh& mesh)
      : mesh_(mesh),
        nodes_(file_labels(mesh.node_labels, static_cast<size_t>(mesh.nodes.cols()))),
        elements_(file_labels(mesh.element_labels, mesh.elements.size())) {
    for (const Element& element : mesh.elements)
      if (type_of(element).shape == Shape::line) of_beams_.insert(element.nodes.begin(), element.nodes.end());
  }

  std::string text(std::optional<int> modes) {
    require(!mesh_.elements.empty(), "the mesh has no elements");
    text_ = "*HEADING\nwritten by flexboom; units as in the mesh\n";
    number_rotation_nodes();
    write_nodes();
    write_elements();
    write_bodies();
    write_sets();
    write_materials();
    for (size_t i = 0; i < mesh_.rigid_connections.size(); ++i) write_rigid(i);
    require(mesh_.distributing_connections.empty(),
            "a deck of ours cannot hold a distributing connection; no format does");
    write_equations();
    write_supports();
    if (modes) put("*STEP\n*FREQUENCY\n{}\n*END STEP\n", *modes);
    return std::move(text_);
  }

 private:
  template <class... Values>
  void put(fmt::format_string<Values...> format, Values&&... values) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Values>(values)...);
  }
  long node(int i) const { return nodes_[static_cast<size_t>(i)]; }
  std::string name_of(size_t e) const {
    return fmt::format("{} element {}", type_of(mesh_.elements[e]).name, mesh_.element_label(static_cast<int>(e)));
  }

  void number_rotation_nodes();
  void write_nodes();
  void write_elements();
  void write_element(size_t e, const std::vector<int>& order);
  void write_bodies();
  void write_numbers(const std::vector<long>& numbers);
  void write_sets();
  void write_material(const std::string& name, const Material& material);
  void write_materials();
  void write_beam_section(size_t i);
  void write_rigid(size_t i);
  void write_equations();
  void write_supports();
  std::string_view deck_row(size_t e) const;

  const Mesh& mesh_;
  std::vector<long> nodes_, elements_;  // labels
  std::map<int, long> rotation_nodes_;  // of the references of rigid connections
  std::set<int> of_beams_;              // nodes
  long next_element_ = 0;
  std::string text_;
};

// CalculiX keeps the rotation of a rigid body in the displacements of a node of its own.
void DeckWriter::number_rotation_nodes() {
  long next = std::ranges::max(nodes_);
  for (const RigidConnection& connection : mesh_.rigid_connections) {
    const bool is_new = rotation_nodes_.try_emplace(connection.reference, next + 1).second;
    next += is_new;
  }
  next_element_ = std::ranges::max(elements_) + 1;
}

void DeckWriter::write_nodes() {
  text_ += "*NODE\n";
  const auto write = [this](long label, const Eigen::Vector3d& x) {
    put("{}, {:.12e}, {:.12e}, {:.12e}\n", label, x(0), x(1), x(2));
  };
  for (int i = 0; i < mesh_.nodes.cols(); ++i) write(node(i), mesh_.nodes.col(i));
  for (const auto& [reference, label] : rotation_nodes_) write(label, mesh_.nodes.col(reference));
}

std::string_view DeckWriter::deck_row(size_t e) const {
  const Element& element = mesh_.elements[e];
  const std::string_view row = type_of(element).name;
  if (row == "hex" && element.order == 1) return "C3D8I";
  const auto* const found = std::ranges::find(deck_rows, row, &DeckRow::row);
  const bool is_connected = !mesh_.rigid_connections.empty() || !mesh_.equations.empty();  // only decks hold that
  require(found != deck_rows.end(),
          fmt::format("{} of order {} has no type in CalculiX; {}", name_of(e), element.order,
                      !is_connected ? "write .vtu or .msh"
                      : type_of(element).shape == Shape::line
                          ? "other formats hold no connections: none holds this mesh"
                          : "take elements that have one (hex20, tet10): other formats hold no connections"));
  return found->deck;
}

void DeckWriter::write_elements() {
  std::map<std::tuple<bool, int, int>, std::vector<size_t>> blocks;  // by beam or solid, row, property
  for (size_t e = 0; e < mesh_.elements.size(); ++e) {
    const Element& element = mesh_.elements[e];
    blocks[{type_of(element).shape == Shape::line, element.type, element.property}].push_back(e);
  }
  const std::vector<int> lexicographic = vtk_hexahedron_order(1, false);
  for (const auto& [key, elements] : blocks) {
    const auto& [is_beam, row, property] = key;
    for (const size_t e : elements) deck_row(e);
    put("*ELEMENT, TYPE={}, ELSET={}_{}\n", deck_row(elements.front()), is_beam ? "BEAM" : "SOLID", property + 1);
    const bool is_hex = type_of(mesh_.elements[elements.front()]).name == "hex";
    for (const size_t e : elements) write_element(e, is_hex ? lexicographic : std::vector<int>{});
  }
}

// A line that ends with a comma goes on.
void DeckWriter::write_element(size_t e, const std::vector<int>& order) {
  const std::vector<int>& nodes = mesh_.elements[e].nodes;
  put("{}", elements_[e]);
  for (size_t i = 0; i < nodes.size(); ++i) {
    text_ += (i + 1) % numbers_per_line == 0 ? ",\n" : ", ";
    put("{}", node(nodes[order.empty() ? i : static_cast<size_t>(order[i])]));
  }
  text_ += '\n';
}

void DeckWriter::write_bodies() {
  for (size_t i = 0; i < mesh_.bodies.size(); ++i) {
    const NodalBody& body = mesh_.bodies[i];
    const bool is_point = body.inertia.isZero(0) && body.offset.isZero(0);
    require(is_point, fmt::format("the body at node {} has inertia or an offset; a deck holds point masses only "
                                  "(write .vtu)",
                                  mesh_.node_label(body.node)));
    put("*ELEMENT, TYPE=MASS, ELSET=MASS_{}\n{}, {}\n*MASS, ELSET=MASS_{}\n{:.12e}\n", i + 1, next_element_,
        node(body.node), i + 1, body.mass);
    ++next_element_;
  }
}

void DeckWriter::write_numbers(const std::vector<long>& numbers) {
  for (size_t i = 0; i < numbers.size(); ++i) {
    const bool line_ends = (i + 1) % numbers_per_line == 0 || i + 1 == numbers.size();
    put("{}{}", numbers[i], line_ends ? "\n" : ", ");
  }
}

void DeckWriter::write_sets() {
  const auto write = [this](const char* keyword, const auto& sets, const std::vector<long>& labels) {
    DeckNames names;
    for (const auto& [name, members] : sets) {
      std::vector<long> numbers;
      for (const int member : members) numbers.push_back(labels[static_cast<size_t>(member)]);
      put("*{0}, {0}={1}\n", keyword, names.add(name));
      write_numbers(numbers);
    }
  };
  write("NSET", mesh_.node_sets, nodes_);
  write("ELSET", mesh_.element_sets, elements_);
}

void DeckWriter::write_material(const std::string& name, const Material& material) {
  require(material.E != 0, fmt::format("material {} is missing; give E, nu and rho (--material E,nu,rho)", name));
  require(material.nu < 0.5,
          fmt::format("a deck gives G by E and nu, and this beam's G makes nu {}; write .vtu", material.nu));
  put("*MATERIAL, NAME={}\n*ELASTIC\n{:.12e}, {:.12e}\n*DENSITY\n{:.12e}\n", name, material.E, material.nu,
      material.rho);
}

void DeckWriter::write_materials() {
  DeckNames names;
  std::set<int> solids, beams;
  for (const Element& element : mesh_.elements)
    (type_of(element).shape == Shape::line ? beams : solids).insert(element.property);
  for (const int i : solids) {
    const SolidProperty& property = mesh_.solid_properties.at(static_cast<size_t>(i));
    const std::string name = names.add(property.name.empty() ? fmt::format("MATERIAL_{}", i + 1) : property.name);
    write_material(name, property.material);
    put("*SOLID SECTION, ELSET=SOLID_{}, MATERIAL={}\n", i + 1, name);
  }
  for (const int i : beams) {
    const std::string name = names.add(fmt::format("BEAM_MATERIAL_{}", i + 1));
    write_material(name, mesh_.beam_properties.at(static_cast<size_t>(i)).material);
    put("*BEAM SECTION, ELSET=BEAM_{}, MATERIAL={}", i + 1, name);
    write_beam_section(static_cast<size_t>(i));
  }
}

// CalculiX counts full axes of CIRC, and the outer radius of PIPE; direction 1 is our y, 2 our z.
void DeckWriter::write_beam_section(size_t i) {
  const BeamProperty& property = mesh_.beam_properties[i];
  const auto where = [i](const char* what) { return fmt::format("beam property {} {}", i, what); };
  require(property.rotary_inertia, where("is without rotary inertia, which B31 always has"));
  require(property.line_mass == 0, where("has mass on its axis beside that of its material, which no deck holds"));
  require(property.shear.name == ShearRule{}.name, where("has a shear coefficient of its own, which no deck holds"));
  const SectionShape middle = interpolate(property.start, property.end, 0.5);
  if (const auto* bar = std::get_if<RoundBar>(&property.start)) {
    require(std::get<RoundBar>(middle).diameter == bar->diameter, where("is tapered, which no deck holds"));
    put(", SECTION=CIRC\n{0:.12e}, {0:.12e}\n", bar->diameter);
  } else if (const auto* tube = std::get_if<Tube>(&property.start)) {
    const Tube& m = std::get<Tube>(middle);
    require(m.diameter == tube->diameter && m.thickness == tube->thickness, where("is tapered, which no deck holds"));
    put(", SECTION=PIPE\n{:.12e}, {:.12e}\n", tube->diameter / 2, tube->thickness);
  } else if (const auto* r = std::get_if<Rectangle>(&property.start)) {
    const auto& m = std::get<Rectangle>(middle);
    require(m.height == r->height && m.width == r->width, where("is tapered, which no deck holds"));
    put(", SECTION=RECT\n{:.12e}, {:.12e}\n", r->height, r->width);
  } else if (const auto* box = std::get_if<RectangularTube>(&property.start)) {
    const auto& m = std::get<RectangularTube>(middle);
    const bool uniform = m.height == box->height && m.width == box->width && m.thickness == box->thickness;
    require(uniform, where("is tapered, which no deck holds"));
    put(", SECTION=BOX\n{0:.12e}, {1:.12e}, {2:.12e}, {2:.12e}, {2:.12e}, {2:.12e}\n", box->height, box->width,
        box->thickness);
  } else {
    throw InputError(where("has a general section, which CalculiX does not have"));
  }
  put("{:.12e}, {:.12e}, {:.12e}\n", property.y_axis(0), property.y_axis(1), property.y_axis(2));
}

void DeckWriter::write_rigid(size_t i) {
  const RigidConnection& connection = mesh_.rigid_connections[i];
  const auto lacks = [&](const char* what) {
    return fmt::format("the rigid connection of node {} leaves {} free, which *RIGID BODY cannot",
                       mesh_.node_label(connection.reference), what);
  };
  const Components& c = connection.components;
  require(c[0] && c[1] && c[2], lacks("displacements"));
  std::vector<long> numbers;
  for (const int n : connection.nodes) {
    require((c[3] && c[4] && c[5]) || !of_beams_.contains(n), lacks("rotations of beams"));
    numbers.push_back(node(n));
  }
  put("*NSET, NSET=RIGID_{}\n", i + 1);
  write_numbers(numbers);
  put("*RIGID BODY, NSET=RIGID_{}, REF NODE={}, ROT NODE={}\n", i + 1, node(connection.reference),
      rotation_nodes_.at(connection.reference));
}

void DeckWriter::write_equations() {
  for (const LinearEquation& equation : mesh_.equations) {
    put("*EQUATION\n{}\n", equation.terms.size());
    for (const LinearEquation::Term& term : equation.terms)
      put("{}, {}, {:.12e}\n", node(term.node), term.component + 1, term.coefficient);
  }
}

void DeckWriter::write_supports() {
  if (mesh_.supports.empty()) return;
  text_ += "*BOUNDARY\n";
  for (const Support& support : mesh_.supports) {
    const auto rotation = rotation_nodes_.find(support.node);
    for (int k = 0; k < 6; ++k) {
      if (!support.components[static_cast<size_t>(k)]) continue;
      if (k >= 3 && rotation != rotation_nodes_.end())
        put("{0}, {1}, {1}\n", rotation->second, k - 2);
      else if (k < 3 || of_beams_.contains(support.node))
        put("{0}, {1}, {1}\n", node(support.node), k + 1);
    }
  }
}

}  // namespace

void write_abaqus(const std::filesystem::path& path, const Mesh& mesh, std::optional<int> modes) {
  std::string text;
  try {
    text = DeckWriter(mesh).text(modes);
  } catch (const InputError& error) {
    throw InputError(fmt::format("cannot write {}: {}", path.string(), error.what()));
  }
  write_file(path, text);
}

}  // namespace flexboom
