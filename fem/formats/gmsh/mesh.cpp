#include "fem/base/check.hpp"
#include "fem/formats/common/node_orders.hpp"
#include "fem/formats/gmsh/data.hpp"
#include "fem/mesh/element.hpp"
#include "fem/mesh/mesh_sets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>

namespace flexboom {
namespace {

using Block = GmshData::Block;

constexpr std::array<std::string_view, 4> dimension_names = {"point", "line", "surface", "volume"};

/// Names of groups: as written in the file, else their number; without any group, kind and number of the entity.
class GroupNames {
 public:
  explicit GroupNames(const GmshData& data) {
    for (const GmshData::Group& group : data.names) names_[{group.dimension, group.tag}] = group.name;
    has_groups_ = std::ranges::any_of(data.blocks, [](const Block& block) { return !block.physical.empty(); });
  }

  std::vector<std::string> of(const Block& block) const {
    std::vector<std::string> result;
    const int dimension = block.kind->dimension;
    for (const int tag : block.physical) {
      const auto found = names_.find({dimension, tag});
      const bool named = found != names_.end() && !found->second.empty();
      result.push_back(named ? found->second : fmt::format("{}", tag));
    }
    if (!has_groups_)
      result.push_back(fmt::format("{}_{}", dimension_names[static_cast<size_t>(dimension)], block.entity));
    return result;
  }

 private:
  std::map<std::pair<int, int>, std::string> names_;
  bool has_groups_ = false;
};

// Version 2.2 writes an element once for each of its groups. Entities that this concerns.
std::set<int> entities_of_several_groups(const GmshData& data) {
  std::map<int, std::vector<int>> groups;
  std::set<int> result;
  for (const Block& block : data.blocks) {
    if (block.kind->dimension != 3) continue;
    const auto [first, is_new] = groups.try_emplace(block.entity, block.physical);
    if (!is_new && first->second != block.physical) result.insert(block.entity);
  }
  return result;
}

/// Builds elements, element sets and properties block by block.
class SolidBuilder {
 public:
  SolidBuilder(MeshFile& file, const GmshData& data)
      : mesh_(file.mesh), names_(data), repeated_(entities_of_several_groups(data)) {}

  void add(const Block& block) {
    const int type = element_type(block.kind->row);
    const std::vector<std::string> sets = names_.of(block);
    property_ = sets.empty() ? "ungrouped" : sets.front();
    const bool may_repeat = repeated_.contains(block.entity);
    const auto count = static_cast<size_t>(block.kind->nodes);
    std::vector<int> members;
    for (size_t e = 0; e < block.labels.size(); ++e) {
      Element element{type, std::vector<int>(count), block.kind->order, 0};
      for (size_t i = 0; i < count; ++i) {
        const size_t place = block.kind->node_order.empty() ? i : static_cast<size_t>(block.kind->node_order[i]);
        element.nodes[place] = block.nodes[e * count + i];
      }
      members.push_back(may_repeat ? known_or_new(std::move(element), block.labels[e])
                                   : add_element(std::move(element), block.labels[e]));
    }
    for (const std::string& name : sets) {
      std::vector<int>& set = mesh_.element_sets[name];
      set.insert(set.end(), members.begin(), members.end());
    }
  }

 private:
  int property_of(const std::string& name) {
    for (size_t i = 0; i < mesh_.solid_properties.size(); ++i) {
      if (mesh_.solid_properties[i].name == name) return static_cast<int>(i);
    }
    mesh_.solid_properties.push_back({name, {}});
    return static_cast<int>(mesh_.solid_properties.size()) - 1;
  }

  int add_element(Element&& element, long label) {
    element.property = property_of(property_);
    mesh_.elements.push_back(std::move(element));
    mesh_.element_labels.push_back(label);
    return static_cast<int>(mesh_.elements.size()) - 1;
  }

  int known_or_new(Element&& element, long label) {
    const auto found = known_.find(element.nodes);
    if (found != known_.end()) return found->second;
    const std::vector<int> nodes = element.nodes;
    return known_[nodes] = add_element(std::move(element), label);
  }

  Mesh& mesh_;
  GroupNames names_;
  std::set<int> repeated_;
  std::string property_;                   // of the elements being added
  std::map<std::vector<int>, int> known_;  // of repeated entities only
};

void add_node_sets(MeshFile& file, const GmshData& data) {
  const GroupNames names(data);
  std::map<std::string, std::set<int>> dimensions;
  for (const Block& block : data.blocks) {
    if (block.kind->dimension == 3) continue;
    for (const std::string& name : names.of(block)) {
      std::vector<int>& set = file.mesh.node_sets[name];
      set.insert(set.end(), block.nodes.begin(), block.nodes.end());
      dimensions[name].insert(block.kind->dimension);
    }
  }
  for (auto& [name, nodes] : file.mesh.node_sets) {
    nodes = sorted_unique(std::move(nodes));
    if (dimensions[name].size() > 1)
      file.notes.push_back(
          fmt::format("groups of several dimensions are called \"{}\"; its node set unites them", name));
  }
}

void require_solids(const GmshData& data, const std::string& file) {
  int highest = -1;
  for (const Block& block : data.blocks) highest = std::max(highest, block.kind->dimension);
  if (highest == 3) return;
  const std::string_view found = highest < 0 ? "no" : dimension_names[static_cast<size_t>(highest)];
  throw InputError(
      fmt::format("{}: has no volume elements ({} elements at most); mesh the volume (gmsh -3) and, where the file has "
                  "physical groups, put the volume into one: Gmsh saves nothing else",
                  file, found));
}

}  // namespace

MeshFile mesh_of(const GmshData& data, const std::string& file) {
  require_solids(data, file);
  MeshFile result;
  result.notes = data.notes;
  Mesh& mesh = result.mesh;
  mesh.nodes = Eigen::Map<const Eigen::Matrix3Xd>(data.coordinates.data(), 3,
                                                  static_cast<Eigen::Index>(data.coordinates.size() / 3));
  mesh.node_labels = data.node_labels;
  SolidBuilder solids(result, data);
  for (const Block& block : data.blocks) {
    if (block.kind->dimension == 3) solids.add(block);
  }
  for (auto& [name, elements] : mesh.element_sets) elements = sorted_unique(std::move(elements));
  add_node_sets(result, data);
  drop_unused_nodes(mesh, result.notes);
  mesh.nodes = lobatto_from_equispaced(mesh, mesh.nodes);
  return result;
}

}  // namespace flexboom
