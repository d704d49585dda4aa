#include "fem/formats/abaqus/lookup.hpp"

#include "fem/base/at.hpp"
#include "fem/mesh/mesh_sets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

namespace flexboom::abaqus {
namespace {

constexpr long most_generated = 50'000'000;
constexpr size_t most_looked_up = 200'000'000;  // members of all sets that connections and sections name

/// Keeps a small deck that makes or names large sets again and again from filling the memory.
void count_members(Deck& deck, size_t members, std::string_view at) {
  deck.looked_up += members;
  if (deck.looked_up > most_looked_up)
    deck.fail(at, fmt::format("the sets named so far have more than {} members", most_looked_up));
}

const std::vector<int>& handed_out(Deck& deck, const Reference& reference, const std::vector<int>& members) {
  count_members(deck, members.size(), reference.text);
  return members;
}

std::string missing(std::string_view kind, long label) {
  return fmt::format("{} {} is not in the deck", kind, std::abs(label));
}

}  // namespace

Lookup::Lookup(Deck& deck) : deck_(deck) {
  deck.nodes.finish(deck.lines.text());
  number_elements();
  number_element_nodes();
  for (const auto& [key, set] : deck.element_sets) element_sets_[key] = members(set, element_index_, "element");
  const LabelIndex node_index(deck.nodes.labels());
  for (const auto& [key, set] : deck.node_sets) {
    std::vector<int> nodes = members(set, node_index, "node");
    for (const Reference& of : set.element_sets) {
      for (const int e : elements(of)) {
        const ElementLine& line = deck.elements[at(e)];
        nodes.insert(nodes.end(), nodes_of(line), nodes_of(line) + line.kind->nodes);
      }
      count_members(deck, nodes.size(), of.text);
    }
    node_sets_[key] = sorted_unique(std::move(nodes));
  }
}

void Lookup::number_elements() {
  for (const ElementLine& line : deck_.elements) element_labels_.push_back(line.label);
  element_index_ = LabelIndex(element_labels_);
  if (!element_index_.duplicate()) return;
  drop_repeated_elements();
  element_labels_.clear();
  for (const ElementLine& line : deck_.elements) element_labels_.push_back(line.label);
  element_index_ = LabelIndex(element_labels_);
}

void Lookup::drop_repeated_elements() {
  std::vector<ElementLine>& lines = deck_.elements;
  std::vector<int> order(lines.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&lines](int i) { return lines[at(i)].label; });
  std::vector<char> again(lines.size(), 0);
  for (size_t i = 1; i < order.size(); ++i) {
    const ElementLine &one = lines[at(order[i - 1])], &two = lines[at(order[i])];
    if (one.label != two.label) continue;
    const long* nodes = deck_.element_nodes.data();
    const bool same =
        one.kind == two.kind &&
        std::equal(nodes + one.first_node, nodes + one.first_node + one.kind->nodes, nodes + two.first_node);
    if (!same)
      deck_.fail(two.at, fmt::format("element {} is already defined otherwise ({})", two.at,
                                     deck_.lines.text().line_location(one.at)));
    again[at(order[i])] = 1;
  }
  size_t kept = 0;
  for (size_t i = 0; i < lines.size(); ++i) {
    if (!again[i]) lines[kept++] = lines[i];
  }
  lines.resize(kept);
}

void Lookup::number_element_nodes() {
  element_nodes_.reserve(deck_.element_nodes.size());
  for (const long label : deck_.element_nodes) element_nodes_.push_back(deck_.nodes.find(label));
  for (const ElementLine& line : deck_.elements) {
    for (int k = 0; k < line.kind->nodes; ++k) {
      if (nodes_of(line)[k] < 0)
        deck_.fail(line.at, fmt::format("element {}: {}", line.at,
                                        missing("node", deck_.element_nodes[line.first_node + at(k)])));
    }
  }
}

std::vector<int> Lookup::members(const Set& set, const LabelIndex& index, std::string_view kind) const {
  const std::vector<long>& labels = kind == "node" ? deck_.nodes.labels() : element_labels_;
  std::vector<int> result;
  if (set.ranges.empty()) return result;
  const auto [lowest, highest] = labels.empty() ? std::pair(0L, -1L) : [&labels] {
    const auto ends = std::ranges::minmax(labels);
    return std::pair(ends.min, ends.max);
  }();
  for (const LabelRange& range : set.ranges) {
    if (!range.generated) {
      const int found = index.find(range.first);
      if (found < 0)
        deck_.fail(range.at, fmt::format("set {}: {}", flexboom::quoted(set.name), missing(kind, range.first)));
      result.push_back(found);
      continue;
    }
    long first = range.first;
    if (first < lowest) first += (lowest - first + range.step - 1) / range.step * range.step;
    const long last = std::min(range.last, highest);
    if (first <= last) deck_.generated += (last - first) / range.step;
    if (deck_.generated > most_generated)
      deck_.fail(range.at, fmt::format("set {}: more than {} numbers are generated up to here",
                                       flexboom::quoted(set.name), most_generated));
    for (long label = first; label <= last; label += range.step) {
      if (const int found = index.find(label); found >= 0) result.push_back(found);
    }
  }
  count_members(deck_, result.size(), set.ranges.front().at);
  return sorted_unique(std::move(result));
}

std::vector<int> Lookup::nodes(const Reference& reference) const {
  if (const auto number = deck_.number(reference)) {
    const int node = deck_.nodes.find(*number);
    if (node < 0) deck_.fail(reference.text, missing("node", *number));
    return {node};
  }
  const auto set = node_sets_.find(deck_.key(reference));
  if (set == node_sets_.end())
    deck_.fail(reference.text, fmt::format("node set {} is not defined", quoted(reference.text)));
  return handed_out(deck_, reference, set->second);
}

std::vector<int> Lookup::nodes_for_pairs(const Reference& reference) const {
  std::vector<int> found = nodes(reference);
  if (found.size() == 1 || deck_.number(reference)) return found;
  const Set& set = deck_.node_sets.at(deck_.key(reference));
  const bool is_ascending = set.element_sets.empty() && std::ranges::is_sorted(set.ranges, {}, &LabelRange::first);
  if (set.is_unsorted && !is_ascending)
    deck_.fail(reference.text, fmt::format("node set {} is UNSORTED, and pairs of nodes in another order than that of "
                                           "their numbers are not read; name them one by one",
                                           quoted(reference.text)));
  std::ranges::sort(found, {}, [this](int i) { return std::abs(deck_.nodes.labels()[at(i)]); });
  return found;
}

int Lookup::node(const Reference& reference) const {
  const std::vector<int> found = nodes(reference);
  if (found.size() != 1)
    deck_.fail(reference.text,
               fmt::format("one node is needed here; set {} has {}", quoted(reference.text), found.size()));
  return found.front();
}

std::vector<int> Lookup::elements(const Reference& reference) const {
  if (const auto number = deck_.number(reference)) {
    const int element = element_index_.find(*number);
    if (element < 0) deck_.fail(reference.text, missing("element", *number));
    return {element};
  }
  const auto set = element_sets_.find(deck_.key(reference));
  if (set == element_sets_.end())
    deck_.fail(reference.text, fmt::format("element set {} is not defined", quoted(reference.text)));
  return handed_out(deck_, reference, set->second);
}

const Surface& Lookup::surface(const Reference& reference) const {
  const auto surface = deck_.surfaces.find(deck_.key(reference));
  if (surface == deck_.surfaces.end())
    deck_.fail(reference.text, fmt::format("surface {} is not defined", quoted(reference.text)));
  return surface->second;
}

SurfaceParts surface_parts(const Lookup& lookup, const Mesh& mesh, const Surface& surface) {
  SurfaceParts parts;
  for (const Surface::Part& part : surface.parts) {
    if (part.face == 0) {
      const std::vector<int> nodes = lookup.nodes(part.where);
      parts.nodes.insert(parts.nodes.end(), nodes.begin(), nodes.end());
      continue;
    }
    for (const int e : lookup.elements(part.where)) {
      const int element = lookup.mesh_element[at(e)];
      const Face face = element < 0 ? Face{} : face_of(mesh.elements[at(element)], part.face);
      if (face.count == 0)
        lookup.deck().fail(part.at,
                           fmt::format("surface {}: element {} has no face S{}", flexboom::quoted(surface.name),
                                       lookup.deck().elements[at(e)].at, part.face));
      parts.faces.push_back(face);
      parts.nodes.insert(parts.nodes.end(), face.nodes.begin(), face.nodes.begin() + face.count);
    }
  }
  parts.nodes = sorted_unique(std::move(parts.nodes));
  return parts;
}

}  // namespace flexboom::abaqus
