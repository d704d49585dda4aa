#include "fem/formats/nastran/bulk.hpp"

#include <fmt/format.h>

#include <array>

// Supports, connections, and what asks for modes.
namespace flexboom::nastran {
namespace {

Components component_flags(const std::vector<int>& list) {
  Components flags{};
  for (const int k : list) flags[static_cast<size_t>(k)] = true;
  return flags;
}

void note_enforced(Bulk& bulk, const Card& card, size_t i) {
  if (bulk.cards.real_or(card, i, 0, "enforced displacement") != 0)
    bulk.notes.add("SPC: displacements other than zero are held at zero in the modes");
}

std::optional<int> number_of_modes(Bulk& bulk, const Card& card, size_t count, size_t low) {
  if (!card.blank(low) || !card.blank(low + 1))
    bulk.notes.add(fmt::format("{}: limits of frequency are left out; the lowest modes are computed", card.name));
  if (card.blank(count)) return {};
  return static_cast<int>(bulk.cards.id(card, count, "number of modes"));
}

}  // namespace

std::vector<IdRange> id_list(Bulk& bulk, const Card& card, size_t first) {
  std::vector<IdRange> list;
  for (size_t i = first; i < card.fields.size(); ++i) {
    const std::string_view field = card.field(i);
    if (field.empty()) continue;
    if (upper_key(field) == "THRU") {
      if (list.empty() || list.back().first != list.back().last)
        bulk.fail(field, fmt::format("{}: THRU without a first id", card.name));
      const long last = bulk.cards.id(card, ++i, "last id");
      if (last < list.back().first) bulk.fail(card.field(i), fmt::format("{}: THRU runs backwards", card.name));
      list.back().last = last;
      continue;
    }
    const long id = bulk.cards.id(card, i, "grid");
    list.push_back({id, id, field});
  }
  return list;
}

/// Without its nodes; the grid stands in field `at`, its components behind.
RigidLine rigid_line(Bulk& bulk, const Card& card, const char* kind, long label, size_t at, const char* grid) {
  return {fmt::format("{}_{}", kind, label),
          bulk.cards.id(card, at, grid),
          {},
          component_flags(bulk.cards.components(card, at + 1)),
          {},
          card.at};
}

void read_rbe2(Bulk& bulk, const Card& card) {
  const long label = bulk.cards.id(card, 0, "element id");
  RigidLine line = rigid_line(bulk, card, "RBE2", label, 1, "GN");
  Card nodes = card;  // thermal expansion, a real number, may be last
  if (!nodes.fields.empty() && !to_integer(nodes.fields.back()) && nastran_real(nodes.fields.back()))
    nodes.fields.pop_back();
  line.nodes = id_list(bulk, nodes, 3);
  if (line.nodes.empty()) bulk.fail(card.at, fmt::format("RBE2 {} has no dependent grids", label));
  bulk.rigids.push_back(std::move(line));
}

void read_rbar(Bulk& bulk, const Card& card) {
  const long label = bulk.cards.id(card, 0, "element id");
  const long a = bulk.cards.id(card, 1, "GA"), b = bulk.cards.id(card, 2, "GB");
  const auto all = [&](size_t i) { return card.field(i) == "123456"; };
  const bool from_a = all(3) && card.blank(4), from_b = all(4) && card.blank(3);
  if (!from_a && !from_b)
    bulk.fail(card.at, fmt::format("RBAR {}: understood if one end has all independent components (123456)", label));
  const size_t dependent = from_a ? 6 : 5;
  const Components components =
      card.blank(dependent) ? all_components : component_flags(bulk.cards.components(card, dependent));
  const long follower = from_a ? b : a;
  bulk.rigids.push_back(
      {fmt::format("RBAR_{}", label), from_a ? a : b, {{follower, follower, card.at}}, components, {}, card.at});
}

void read_rbe3(Bulk& bulk, const Card& card) {
  const long label = bulk.cards.id(card, 0, "element id");
  RigidLine line = rigid_line(bulk, card, "RBE3", label, 2, "REFGRID");
  double weight = 0;
  for (size_t i = 4; i < card.fields.size(); ++i) {
    const std::string_view field = card.field(i);
    const std::string word = upper_key(field);
    if (word.empty()) continue;
    if (word == "ALPHA") break;
    if (word == "UM") bulk.fail(field, fmt::format("RBE3 {}: UM is not understood", label));
    if (!to_integer(field)) {  // weight, then its components
      weight = bulk.cards.real(card, i, "weight");
      if (weight <= 0) bulk.fail(field, fmt::format("RBE3 {}: a weight must be positive", label));
      const std::string_view components = card.field(++i);
      if (components == "123456")
        bulk.notes.add("RBE3: the translations of its grids count, not their rotations");
      else if (components != "123")
        bulk.fail(components.empty() ? field : components,
                  fmt::format("RBE3 {}: the components of a weight must be 123", label));
      continue;
    }
    if (weight == 0) bulk.fail(field, fmt::format("RBE3 {}: a weight must come before the grids", label));
    const long id = bulk.cards.id(card, i, "grid");
    line.nodes.push_back({id, id, field});
    line.weights.push_back(weight);
  }
  if (line.nodes.empty()) bulk.fail(card.at, fmt::format("RBE3 {} has no grids", label));
  bulk.averages.push_back(std::move(line));
}

void read_spc(Bulk& bulk, const Card& card) {
  const long set = bulk.cards.id(card, 0, "set id");
  for (const size_t i : {size_t{1}, size_t{4}}) {
    if (i == 4 && card.blank(i)) continue;
    const long id = bulk.cards.id(card, i, "grid");
    bulk.supports[set].push_back({{{id, id, card.field(i)}}, bulk.cards.components(card, i + 1)});
    note_enforced(bulk, card, i + 2);
  }
}

void read_spc1(Bulk& bulk, const Card& card) {
  const long set = bulk.cards.id(card, 0, "set id");
  SupportLine line{id_list(bulk, card, 2), bulk.cards.components(card, 1)};
  if (line.nodes.empty()) bulk.fail(card.at, fmt::format("SPC1 {} has no grids", set));
  bulk.supports[set].push_back(std::move(line));
}

void read_sum(Bulk& bulk, const Card& card) {
  auto& sums = card.name == "SPCADD" ? bulk.support_sums : bulk.mpc_sums;
  const long set = bulk.cards.id(card, 0, "set id");
  if (!sums.try_emplace(set, id_list(bulk, card, 1)).second)
    bulk.fail(card.at, fmt::format("{} {} is defined twice", card.name, set));
}

// Each line has the fields G C A G C A and a blank one at either end.
void read_mpc(Bulk& bulk, const Card& card) {
  const long set = bulk.cards.id(card, 0, "set id");
  MpcLine line;
  for (size_t row = 0; row < card.fields.size(); row += 8) {
    for (const size_t i : {row + 1, row + 4}) {
      if (card.blank(i)) continue;
      const std::vector<int> component = bulk.cards.components(card, i + 1);
      if (component.size() != 1) bulk.fail(card.field(i + 1), "MPC: a term has one component");
      const double coefficient = bulk.cards.real(card, i + 2, "coefficient");
      if (coefficient == 0 && line.terms.empty())
        bulk.fail(card.field(i + 2), "MPC: the first coefficient must not be zero: its freedom follows the others");
      if (coefficient == 0)
        bulk.notes.add(fmt::format("{}: a term of the MPC has the coefficient zero and is left out",
                                   bulk.cards.text().line_location(card.at)));
      else
        line.terms.push_back({bulk.cards.id(card, i, "grid"), component[0], coefficient, card.field(i)});
    }
  }
  if (line.terms.empty()) bulk.fail(card.at, fmt::format("MPC {} has no term", set));
  bulk.mpcs[set].push_back(std::move(line));
}

void read_eigrl(Bulk& bulk, const Card& card) {
  bulk.methods[bulk.cards.id(card, 0, "set id")] = number_of_modes(bulk, card, 3, 1);
}

void read_eigr(Bulk& bulk, const Card& card) {
  bulk.methods[bulk.cards.id(card, 0, "set id")] = number_of_modes(bulk, card, 5, 2);
}

void read_param(Bulk& bulk, const Card& card) {
  const std::string name = upper_key(card.field(0));
  if (name == "WTMASS") {
    bulk.mass_factor = bulk.cards.real(card, 1, "WTMASS");
    if (bulk.mass_factor <= 0) bulk.fail(card.field(1), "PARAM,WTMASS must be positive");
    bulk.notes.add(fmt::format("PARAM,WTMASS multiplies every mass by {}", bulk.mass_factor));
  } else if (name == "CK1" || name == "CM1") {
    if (bulk.cards.real(card, 1, name) != 1)
      bulk.fail(card.field(1), fmt::format("PARAM,{} multiplies a whole matrix and is not understood", name));
  } else if (name == "COUPMASS") {
    bulk.notes.add("PARAM,COUPMASS: masses are consistent (coupled) in any case");
  } else if (name == "AUTOSPC") {
    bulk.notes.add("PARAM,AUTOSPC: freedoms without stiffness are left out in any case");
  } else if (name == "K6ROT" || name == "SNORM" || name == "GRDPNT" || name == "POST" || name == "PRGPNT") {
    return;
  } else {
    bulk.notes.add(fmt::format("PARAM,{} is left out", name));
  }
}

}  // namespace flexboom::nastran
