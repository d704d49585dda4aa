#include "fem/formats/abaqus/deck.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

// Nodes, elements, sets, surfaces, and the part that they may stand in.
namespace flexboom::abaqus {
namespace {

using Eigen::Vector3d;
using Fields = std::vector<std::string_view>;

constexpr size_t most_copied_members = 10'000'000;
constexpr int degrees_per_half_turn = 180;

constexpr std::array<ElementKind, 49> kinds{{
    {"C3D4", "tet4", 4, Role::solid,
     "C3D4 has the mass of more points than in CalculiX, whose one point loses the element's own inertia: coarse "
     "meshes "
     "differ"},
    {"C3D10", "tet10", 10, Role::solid},
    {"C3D8", "hex8", 8, Role::solid, "C3D8 is computed with incompatible modes, as C3D8I is: it does not lock"},
    {"C3D8I", "hex8", 8, Role::solid,
     "C3D8I is computed with twelve enhanced strains (Q1/E12), not with those of CalculiX or Abaqus: coarse meshes "
     "differ"},
    {"C3D8R", "hex8-reduced", 8, Role::solid,
     "C3D8R is computed with its mean gradient and enhanced strains against hourglass motions, which CalculiX leaves "
     "free "
     "and Abaqus holds otherwise"},
    {"C3D20", "hex20", 20, Role::solid},
    {"C3D20R", "hex20-reduced", 20, Role::solid},
    {"C3D6", "wedge6", 6, Role::solid,
     "C3D6 is held against the motion without stiffness of its two points and has the mass of more points than in "
     "CalculiX: "
     "coarse meshes differ"},
    {"C3D15", "wedge15", 15, Role::solid},
    {"B31", "beam-timoshenko", 2, Role::beam},
    {"B31R", "beam-timoshenko", 2, Role::beam},
    {"B32", "beam-timoshenko", 3, Role::beam},
    {"B32R", "beam-timoshenko", 3, Role::beam},
    {"MASS", "", 1, Role::mass},
    {"DCOUP3D", "", 1, Role::reference},
    // Lower-dimensional groups that mesh generators write along; with a section they are an error.
    {"T2D2", "", 2, Role::left_out},
    {"T3D2", "", 2, Role::left_out},
    {"T3D3", "", 3, Role::left_out},
    {"S3", "", 3, Role::left_out},
    {"S3R", "", 3, Role::left_out},
    {"STRI3", "", 3, Role::left_out},
    {"STRI65", "", 6, Role::left_out},
    {"S4", "", 4, Role::left_out},
    {"S4R", "", 4, Role::left_out},
    {"S6", "", 6, Role::left_out},
    {"S8", "", 8, Role::left_out},
    {"S8R", "", 8, Role::left_out},
    {"S9R5", "", 9, Role::left_out},
    {"M3D3", "", 3, Role::left_out},
    {"M3D4", "", 4, Role::left_out},
    {"M3D4R", "", 4, Role::left_out},
    {"M3D6", "", 6, Role::left_out},
    {"M3D8", "", 8, Role::left_out},
    {"M3D8R", "", 8, Role::left_out},
    {"M3D9", "", 9, Role::left_out},
    {"CPS3", "", 3, Role::left_out},
    {"CPS4", "", 4, Role::left_out},
    {"CPS4R", "", 4, Role::left_out},
    {"CPS6", "", 6, Role::left_out},
    {"CPS8", "", 8, Role::left_out},
    {"CPS8R", "", 8, Role::left_out},
    {"CPE3", "", 3, Role::left_out},
    {"CPE4", "", 4, Role::left_out},
    {"CPE6", "", 6, Role::left_out},
    {"CPE8", "", 8, Role::left_out},
    {"CPE8R", "", 8, Role::left_out},
    {"CAX4", "", 4, Role::left_out},
    {"CAX6", "", 6, Role::left_out},
    {"CAX8", "", 8, Role::left_out},
}};

const ElementKind& kind_of(const Deck& deck, std::string_view type) {
  const std::string name = upper_key(type);
  std::string known;
  for (const ElementKind& kind : kinds) {
    if (kind.name == name) return kind;
    if (kind.role == Role::solid || kind.role == Role::beam || kind.role == Role::mass)
      known += fmt::format("{}{}", known.empty() ? "" : ", ", kind.name);
  }
  deck.fail(type, fmt::format("element type {} is not understood; there are {}", quoted(type), known));
}

Set& set_named(Deck& deck, Sets& sets, std::string_view name, const Keyword& keyword) {
  if (name.empty()) deck.fail(keyword.at, fmt::format("{}: the name of the set is missing", keyword.at));
  Set& set = sets[deck.key(name, deck.in_part)];
  if (set.name.empty()) set.name = name;
  return set;
}

/// A set for what a keyword defines, if it says so.
Set* set_of(Deck& deck, Sets& sets, const Keyword& keyword, std::string_view parameter) {
  const auto name = keyword.find(parameter);
  return name ? &set_named(deck, sets, *name, keyword) : nullptr;
}

Vector3d cartesian(Deck& deck, const Keyword& keyword, const Vector3d& x) {
  const std::string system = upper_key(keyword.find("SYSTEM").value_or("R"));
  if (system == "R") return x;
  const double angle = x(1) * std::numbers::pi / degrees_per_half_turn;
  if (system == "C") return {x(0) * std::cos(angle), x(0) * std::sin(angle), x(2)};
  if (system != "S") deck.fail(keyword.at, "SYSTEM must be R, C or S");
  const double height = x(2) * std::numbers::pi / degrees_per_half_turn;
  return {x(0) * std::cos(angle) * std::cos(height), x(0) * std::sin(angle) * std::cos(height),
          x(0) * std::sin(height)};
}

/// Numbers of the nodes of an element, over as many lines as they take. @returns what was wrong, or nothing.
void element_numbers(Deck& deck, const ElementKind& kind, const Fields& first, std::string_view at) {
  const size_t wanted = deck.element_nodes.size() + static_cast<size_t>(kind.nodes);
  const auto append = [&deck](const Fields& fields, size_t from) {
    for (size_t i = from; i < fields.size(); ++i) {
      if (!fields[i].empty()) deck.element_nodes.push_back(deck.label(fields[i], "number of a node"));
    }
  };
  append(first, 1);
  while (deck.element_nodes.size() < wanted) {
    const Fields* more = deck.lines.next_data();
    if (more == nullptr) break;
    append(*more, 0);
  }
  if (deck.element_nodes.size() != wanted) {
    const auto count = static_cast<long>(deck.element_nodes.size()) - static_cast<long>(wanted) + kind.nodes;
    deck.fail(at, fmt::format("element {} {} {} nodes here; {} has {}", at,
                              count < kind.nodes ? "has only" : "would have", count, kind.name, kind.nodes));
  }
  const long* nodes = &deck.element_nodes[wanted - static_cast<size_t>(kind.nodes)];
  const long twice = repeated(nodes, static_cast<size_t>(kind.nodes));
  if (twice != -1) deck.fail(at, fmt::format("element {} has node {} more than once", at, std::abs(twice)));
}

void read_members(Deck& deck, const Keyword& keyword, Sets& sets, Set& set) {
  const bool generate = keyword.has("GENERATE");
  const auto instance = keyword.find("INSTANCE");
  const bool outside = deck.in_part;
  if (instance) {
    if (!deck.instance || upper_key(*instance) != upper_key(deck.instance->name))
      deck.fail(keyword.at, fmt::format("there is no instance {}", quoted(*instance)));
    deck.in_part = true;
  }
  while (const Fields* fields = deck.lines.next_data()) {
    if (generate) {
      if (fields->size() < 2) deck.fail(deck.lines.line(), "GENERATE needs first, last and increment");
      const DeckText& text = deck.lines.text();
      const long first = text.integer((*fields)[0], "first number", 1, largest_label);
      const bool has_step = fields->size() > 2 && !(*fields)[2].empty();
      const long step = has_step ? text.integer((*fields)[2], "increment", 1, largest_label) : 1;
      long last = text.integer((*fields)[1], "last number", 1, largest_label);
      if (last < first) deck.fail((*fields)[1], fmt::format("the last number is below the first, {}", first));
      last -= (last - first) % step;
      const bool mirrored = deck.has_part && !deck.in_part;
      set.ranges.push_back({mirrored ? -last : first, mirrored ? -first : last, step, true, (*fields)[0]});
      continue;
    }
    for (const std::string_view field : *fields) {
      if (field.empty()) continue;
      const Reference member = deck.reference(unquoted(field));
      if (const auto number = deck.number(member)) {
        set.ranges.push_back({*number, *number, 1, false, field});
        continue;
      }
      const auto other = sets.find(deck.key(member));
      if (other == sets.end()) deck.fail(field, fmt::format("set {} is not defined above", quoted(field)));
      if (&other->second == &set) continue;
      set.ranges.insert(set.ranges.end(), other->second.ranges.begin(), other->second.ranges.end());
      set.element_sets.insert(set.element_sets.end(), other->second.element_sets.begin(),
                              other->second.element_sets.end());
      deck.copied_members += other->second.ranges.size() + other->second.element_sets.size();
      if (deck.copied_members > most_copied_members) deck.fail(field, "sets of sets grow beyond ten million members");
    }
  }
  deck.in_part = outside;
}

}  // namespace

void read_node(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"NSET", "SYSTEM"});
  Set* set = set_of(deck, deck.node_sets, keyword, "NSET");
  while (const Fields* fields = deck.lines.next_data()) {
    const std::string_view at = (*fields)[0];
    const long label = deck.label(at, "number of a node");
    if (fields->size() > 7) deck.fail((*fields)[7], "a node has a number, three coordinates and three directions");
    Vector3d x;
    for (int k = 0; k < 3; ++k) x(k) = deck.real_or_zero(*fields, static_cast<size_t>(k) + 1, "coordinate");
    deck.nodes.add(label, cartesian(deck, keyword, x), at);
    if (set != nullptr) set->ranges.push_back({label, label, 1, false, at});
  }
}

void read_element(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"TYPE", "ELSET", "FILE", "UNSYMM"});
  const ElementKind& kind = kind_of(deck, deck.lines.need(keyword, "TYPE"));
  Set* set = set_of(deck, deck.element_sets, keyword, "ELSET");
  if (!kind.note.empty()) deck.notes.add(std::string(kind.note));
  if (kind.role == Role::beam)
    deck.notes.add(
        fmt::format("{} is computed as a Timoshenko beam with its full mass; CalculiX makes a solid of it, Abaqus "
                    "lumps the mass of B31",
                    kind.name));
  while (const Fields* fields = deck.lines.next_data()) {
    const std::string_view at = (*fields)[0];
    const long label = deck.label(at, "number of an element");
    const size_t first = deck.element_nodes.size();
    element_numbers(deck, kind, *fields, at);
    deck.elements.push_back({label, &kind, first, at, -1});
    if (set != nullptr) set->ranges.push_back({label, label, 1, false, at});
  }
}

void read_node_set(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"NSET", "GENERATE", "ELSET", "INSTANCE", "INTERNAL", "UNSORTED"});
  Set& set = set_named(deck, deck.node_sets, deck.lines.need(keyword, "NSET"), keyword);
  if (const auto elements = keyword.find("ELSET")) set.element_sets.push_back(deck.reference(*elements));
  set.is_unsorted = set.is_unsorted || keyword.has("UNSORTED");
  read_members(deck, keyword, deck.node_sets, set);
}

void read_element_set(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"ELSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED"});
  Set& set = set_named(deck, deck.element_sets, deck.lines.need(keyword, "ELSET"), keyword);
  read_members(deck, keyword, deck.element_sets, set);
}

void read_surface(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"NAME", "TYPE", "INTERNAL"});
  const std::string_view name = deck.lines.need(keyword, "NAME");
  const std::string type = upper_key(keyword.find("TYPE").value_or("ELEMENT"));
  if (type != "ELEMENT" && type != "NODE")
    deck.fail(keyword.at, fmt::format("surfaces of TYPE={} are not understood; there are ELEMENT and NODE", type));
  Surface& surface = deck.surfaces[deck.key(name, deck.in_part)];
  if (!surface.name.empty()) deck.fail(keyword.at, fmt::format("surface {} is defined twice", quoted(name)));
  surface.name = name;
  surface.at = keyword.at;
  std::optional<double> area;  // of each node
  while (const Fields* fields = deck.lines.next_data()) {
    int face = 0;
    if (type == "NODE") {
      const double here = fields->size() > 1 && !(*fields)[1].empty() ? deck.real_or_zero(*fields, 1, "area") : 1;
      if (here != area.value_or(here))
        deck.fail(fields->back(),
                  "nodes of a surface with different areas are not understood: programs weight them in different ways");
      area = here;
    }
    if (type == "ELEMENT") {
      const std::string label = fields->size() > 1 ? upper_key((*fields)[1]) : "";
      if (label.size() != 2 || label[0] != 'S' || label[1] < '1' || label[1] > '6')
        deck.fail(deck.lines.line(), "a surface of elements needs their face, S1 to S6, after the element or set");
      face = label[1] - '0';
    }
    surface.parts.push_back({deck.reference(unquoted((*fields)[0])), face, (*fields)[0]});
  }
}

void read_part(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"NAME"});
  if (deck.has_part) deck.fail(keyword.at, "decks of several parts are not read; write the model flat (without parts)");
  if (deck.nodes.count() > 0) deck.fail(keyword.at, "*PART must come before the nodes");
  deck.has_part = deck.in_part = true;
}

void read_end_part(Deck& deck, const Keyword&) { deck.in_part = false; }

void read_instance(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"NAME", "PART"});
  if (!deck.has_part) deck.fail(keyword.at, "*INSTANCE without a *PART above");
  if (deck.instance)
    deck.fail(keyword.at, "decks of several instances are not read; write the model flat (without parts)");
  Instance& instance = deck.instance.emplace();
  instance.name = deck.lines.need(keyword, "NAME");
  const auto vector = [&deck](const Fields& fields, size_t from) {
    Vector3d v;
    for (size_t k = 0; k < 3; ++k) v(static_cast<int>(k)) = deck.real_or_zero(fields, from + k, "coordinate");
    return v;
  };
  if (const Fields* fields = deck.lines.next_data()) instance.shift = vector(*fields, 0);
  if (const Fields* fields = deck.lines.next_data()) {
    instance.pivot = vector(*fields, 0);
    const Vector3d axis = vector(*fields, 3) - instance.pivot;
    if (axis.norm() == 0) deck.fail((*fields)[0], "the axis of rotation has no length");
    const double angle = deck.real_or_zero(*fields, 6, "angle") * std::numbers::pi / degrees_per_half_turn;
    instance.turn = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
  }
  deck.in_part = true;  // of an instance that holds its nodes itself
}

void read_end_instance(Deck& deck, const Keyword&) { deck.in_part = false; }

}  // namespace flexboom::abaqus
