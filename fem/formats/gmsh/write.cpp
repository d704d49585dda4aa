#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "fem/formats/common/node_orders.hpp"
#include "fem/formats/gmsh/data.hpp"
#include "fem/formats/gmsh/gmsh.hpp"
#include "fem/mesh/element.hpp"
#include "fem/mesh/mesh_sets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <string_view>
#include <utility>

namespace flexboom {
namespace {

using Groups = std::vector<int>;  // tags of physical groups, ascending

auto text_end_of(std::string& text) { return std::back_inserter(text); }

void require_gmsh_holds(const Mesh& mesh) {
  const auto lacks = [&mesh](const char* what, int node, const char* where) {
    throw InputError(fmt::format("a .msh file cannot hold {} (node {}); {}", what, mesh.node_label(node), where));
  };
  if (!mesh.bodies.empty()) lacks("a body", mesh.bodies.front().node, "write .vtu or .inp");
  if (!mesh.supports.empty()) lacks("a support", mesh.supports.front().node, "write .vtu or .inp");
  if (!mesh.rigid_connections.empty())
    lacks("a rigid connection", mesh.rigid_connections.front().reference, "write .inp");
  if (!mesh.distributing_connections.empty())
    lacks("a distributing connection", mesh.distributing_connections.front().reference, "no format does");
  if (!mesh.equations.empty() && !mesh.equations.front().terms.empty())
    lacks("an equation", mesh.equations.front().terms.front().node, "write .inp");
  for (size_t e = 0; e < mesh.elements.size(); ++e)
    require(!std::string_view(type_of(mesh.elements[e]).name).ends_with("-reduced"),
            fmt::format("a .msh file cannot say that {} element {} has reduced integration; write .vtu or .inp",
                        type_of(mesh.elements[e]).name, mesh.element_label(static_cast<int>(e))));
}

/// Elements of one dimension, kind and groups, which make an entity of Gmsh.
struct Part {
  const GmshKind* kind = nullptr;
  std::string_view row;  // "hex" of order 1 and 2 counts its nodes as no other row of the same kind
  Groups groups;
  auto operator<=>(const Part&) const = default;  // NOLINT(modernize-use-nullptr): a false alarm at the zero behind <=>
};

/// What the file lists, sorted into entities. Tags of groups: properties first, since a reader takes an element's first
/// group for its property, then element sets, then node sets.
struct Content {
  std::vector<std::pair<int, std::string>> names;  // dimension and name of group tag - 1
  std::map<Part, std::vector<int>> parts;          // elements
  std::map<Groups, std::vector<int>> points;       // nodes of node sets
};

void add_element_groups(Content& content, const Mesh& mesh, std::vector<Groups>& groups) {
  const auto add = [&](const std::string& name, const std::vector<int>& elements) {
    bool of_dimension[2] = {};
    for (const int e : elements)
      of_dimension[type_of(mesh.elements[static_cast<size_t>(e)]).shape != Shape::line] = true;
    for (const bool solid : {false, true}) {
      if (!of_dimension[solid]) continue;
      content.names.emplace_back(solid ? 3 : 1, name);
      for (const int e : elements) {
        const auto at = static_cast<size_t>(e);
        if ((type_of(mesh.elements[at]).shape != Shape::line) == solid)
          groups[at].push_back(static_cast<int>(content.names.size()));
      }
    }
  };
  std::vector<std::vector<int>> of_property(mesh.solid_properties.size());
  for (size_t e = 0; e < mesh.elements.size(); ++e) {
    const auto property = static_cast<size_t>(mesh.elements[e].property);
    if (type_of(mesh.elements[e]).shape != Shape::line && property < of_property.size())
      of_property[property].push_back(static_cast<int>(e));
  }
  for (size_t i = 0; i < of_property.size(); ++i) {
    const std::string& name = mesh.solid_properties[i].name;
    const auto same = mesh.element_sets.find(name);
    const bool is_set = same != mesh.element_sets.end() && same->second != of_property[i];
    if (!name.empty() && !is_set) add(name, of_property[i]);
  }
  for (const auto& [name, elements] : mesh.element_sets) {
    const bool done = std::ranges::count(content.names, name, &std::pair<int, std::string>::second) > 0;
    if (!done) add(name, elements);
  }
}

Content content_of(const Mesh& mesh) {
  Content content;
  std::vector<Groups> groups(mesh.elements.size());
  add_element_groups(content, mesh, groups);
  for (size_t e = 0; e < mesh.elements.size(); ++e) {
    const Element& element = mesh.elements[e];
    const GmshKind* kind = gmsh_kind_of(element);
    require(kind != nullptr, fmt::format("{} element {} of order {}: Gmsh has no such element", type_of(element).name,
                                         mesh.element_label(static_cast<int>(e)), element.order));
    content.parts[{kind, type_of(element).name, std::move(groups[e])}].push_back(static_cast<int>(e));
  }
  std::map<int, Groups> of_node;
  for (const auto& [name, nodes] : mesh.node_sets) {
    content.names.emplace_back(0, name);
    for (const int node : nodes) of_node[node].push_back(static_cast<int>(content.names.size()));
  }
  for (const auto& [node, sets] : of_node) content.points[sets].push_back(node);
  for (const auto& [dimension, name] : content.names) {
    require(name.find_first_of("\"\n") == std::string::npos,
            fmt::format("set \"{}\": a name in a .msh file cannot have quotes or line ends", name));
  }
  return content;
}

void append_tags(std::string& text, const Groups& groups) {
  fmt::format_to(text_end_of(text), " {}", groups.size());
  for (const int tag : groups) fmt::format_to(text_end_of(text), " {}", tag);
}

void append_entities(std::string& text, const Mesh& mesh, const Content& content) {
  const auto lines =
      std::ranges::count_if(content.parts, [](const auto& part) { return part.first.kind->dimension == 1; });
  fmt::format_to(text_end_of(text), "$Entities\n{} {} 0 {}\n", content.points.size(), lines,
                 content.parts.size() - static_cast<size_t>(lines));
  int tag = 0;
  for (const auto& [sets, nodes] : content.points) {
    const auto point = mesh.nodes.col(nodes.front());
    fmt::format_to(text_end_of(text), "{} {} {} {}", ++tag, point(0), point(1), point(2));
    append_tags(text, sets);
    text += '\n';
  }
  const Eigen::Vector3d low = mesh.nodes.rowwise().minCoeff(), high = mesh.nodes.rowwise().maxCoeff();
  for (const int dimension : {1, 3}) {
    tag = 0;
    for (const auto& [part, elements] : content.parts) {
      ++tag;
      if (part.kind->dimension != dimension) continue;
      fmt::format_to(text_end_of(text), "{} {} {} {} {} {} {}", tag, low(0), low(1), low(2), high(0), high(1), high(2));
      append_tags(text, part.groups);
      text += " 0\n";
    }
  }
  text += "$EndEntities\n";
}

void append_nodes(std::string& text, const Mesh& mesh, const Part& home, const std::vector<long>& labels) {
  const Eigen::MatrixXd points = equispaced_from_lobatto(mesh, mesh.nodes);
  fmt::format_to(text_end_of(text), "$Nodes\n1 {0} {1} {2}\n{3} 1 0 {0}\n", labels.size(), std::ranges::min(labels),
                 std::ranges::max(labels), home.kind->dimension);
  for (const long label : labels) fmt::format_to(text_end_of(text), "{}\n", label);
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    fmt::format_to(text_end_of(text), "{} {} {}\n", points(0, i), points(1, i), points(2, i));
  text += "$EndNodes\n";
}

void append_element(std::string& text, const Element& element, const std::vector<int>& order,
                    const std::vector<long>& labels) {
  for (size_t i = 0; i < element.nodes.size(); ++i) {
    const int node = element.nodes[order.empty() ? i : static_cast<size_t>(order[i])];
    fmt::format_to(text_end_of(text), " {}", labels[static_cast<size_t>(node)]);
  }
  text += '\n';
}

void append_elements(std::string& text, const Mesh& mesh, const Content& content,
                     const std::vector<long>& node_labels) {
  const std::vector<long> labels = file_labels(mesh.element_labels, mesh.elements.size());
  size_t points = 0;
  for (const auto& [sets, nodes] : content.points) points += nodes.size();
  const long highest = std::ranges::max(labels);
  fmt::format_to(text_end_of(text), "$Elements\n{} {} {} {}\n", content.points.size() + content.parts.size(),
                 points + labels.size(), std::min(std::ranges::min(labels), highest + 1),
                 highest + static_cast<long>(points));
  long label = highest;
  int tag = 0;
  for (const auto& [sets, nodes] : content.points) {
    fmt::format_to(text_end_of(text), "0 {} 15 {}\n", ++tag, nodes.size());
    for (const int node : nodes)
      fmt::format_to(text_end_of(text), "{} {}\n", ++label, node_labels[static_cast<size_t>(node)]);
  }
  tag = 0;
  for (const auto& [part, elements] : content.parts) {
    const int p = mesh.elements[static_cast<size_t>(elements.front())].order;
    const std::vector<int> order = part.row == "hex" ? gmsh_hexahedron_order(p) : part.kind->node_order;
    fmt::format_to(text_end_of(text), "{} {} {} {}\n", part.kind->dimension, ++tag, part.kind->type, elements.size());
    for (const int e : elements) {
      const Element& element = mesh.elements[static_cast<size_t>(e)];
      fmt::format_to(text_end_of(text), "{}", labels[static_cast<size_t>(e)]);
      append_element(text, element, order, node_labels);
    }
  }
  text += "$EndElements\n";
}

std::string gmsh_text(const Mesh& mesh) {
  require(mesh.nodes.cols() > 0 && !mesh.elements.empty(), "the mesh has no elements");
  require_gmsh_holds(mesh);
  const Content content = content_of(mesh);
  std::string text = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
  fmt::format_to(text_end_of(text), "$PhysicalNames\n{}\n", content.names.size());
  for (size_t i = 0; i < content.names.size(); ++i)
    fmt::format_to(text_end_of(text), "{} {} \"{}\"\n", content.names[i].first, i + 1, content.names[i].second);
  text += "$EndPhysicalNames\n";
  append_entities(text, mesh, content);
  const std::vector<long> labels = file_labels(mesh.node_labels, static_cast<size_t>(mesh.nodes.cols()));
  append_nodes(text, mesh, content.parts.begin()->first, labels);
  append_elements(text, mesh, content, labels);
  return text;
}

}  // namespace

void write_gmsh(const std::filesystem::path& path, const Mesh& mesh) {
  std::string text;
  try {
    text = gmsh_text(mesh);
  } catch (const InputError& error) {
    throw InputError(fmt::format("cannot write {}: {}", path.string(), error.what()));
  }
  write_file(path, text);
}

}  // namespace flexboom
