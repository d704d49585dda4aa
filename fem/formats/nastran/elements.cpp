#include "fem/formats/nastran/bulk.hpp"

#include <fmt/format.h>

#include <array>
#include <span>

// Nodes, coordinate systems and elements.
namespace flexboom::nastran {
namespace {

using Eigen::Vector3d;

Vector3d vector(const Bulk& bulk, const Card& card, size_t first, std::string_view what) {
  return {bulk.cards.real_or(card, first, 0, what), bulk.cards.real_or(card, first + 1, 0, what),
          bulk.cards.real_or(card, first + 2, 0, what)};
}

// Place of our node k in the card. Nastran numbers the vertical edges before those of the top.
constexpr std::array<size_t, 20> hexahedron = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15};
constexpr std::array<size_t, 15> wedge = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14, 9, 10, 11};
constexpr std::array<size_t, 10> tetrahedron = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};

struct SolidCard {
  std::string_view name, linear, quadratic;
  size_t corners;
  std::span<const size_t> places;
};
constexpr std::array<SolidCard, 3> solid_cards{{
    {"CTETRA", "tet4", "tet10", 4, tetrahedron},
    {"CPENTA", "wedge6", "wedge15", 6, wedge},
    {"CHEXA", "hex8", "hex20", 8, hexahedron},
}};

void refuse_unless_zero(const Bulk& bulk, const Card& card, size_t first, size_t last, std::string_view what) {
  for (size_t i = first; i <= last; ++i) {
    if (bulk.cards.real_or(card, i, 0, what) != 0)
      bulk.fail(card.field(i), fmt::format("{}: {} are not understood", card.name, what));
  }
}

}  // namespace

void read_grid(Bulk& bulk, const Card& card) {
  const long label = bulk.cards.id(card, 0, "id");
  const long output = bulk.cards.id_or(card, 5, bulk.default_output, "CD");
  if (output != 0)
    bulk.fail(card.at, fmt::format("GRID {}: displacements in another system than the basic one (CD = {}) are not "
                                   "understood",
                                   label, output));
  bulk.nodes.add(label, vector(bulk, card, 2, "coordinate"), card.at);
  bulk.grids.push_back({card.field(1) == "0" ? 0 : bulk.cards.id_or(card, 1, bulk.default_system, "CP"), card.at});
  bulk.grid_labels.push_back(label);
  if (!card.blank(6) && card.field(6) != "0") {
    bulk.permanent[label] = bulk.cards.components(card, 6);
  } else if (!bulk.default_permanent.empty() && card.blank(6)) {
    bulk.permanent[label] = bulk.default_permanent;
  }
}

void read_grdset(Bulk& bulk, const Card& card) {
  if (!bulk.grids.empty()) bulk.fail(card.at, "GRDSET must come before every GRID here");
  bulk.default_system = bulk.cards.id_or(card, 1, 0, "CP");
  bulk.default_output = bulk.cards.id_or(card, 5, 0, "CD");
  if (!card.blank(6) && card.field(6) != "0") bulk.default_permanent = bulk.cards.components(card, 6);
}

void read_system(Bulk& bulk, const Card& card) {
  const bool by_points = card.name.size() == 6 && card.name[4] == '2';
  const char kind = by_points ? card.name[5] : '1';
  const auto add = [&](size_t place, const System& system) {
    if (!bulk.systems.try_emplace(bulk.cards.id(card, place, "id"), system).second)
      bulk.fail(card.at, fmt::format("coordinate system {} is defined twice", card.field(place)));
  };
  if (kind == '1') {  // by grid points: an error where one is used
    add(0, {kind, 0, Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), card.at});
    if (!card.blank(4)) add(4, {kind, 0, Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), card.at});
    return;
  }
  add(0, {kind, bulk.cards.id_or(card, 1, 0, "RID"), vector(bulk, card, 2, "point A"), vector(bulk, card, 5, "point B"),
          vector(bulk, card, 8, "point C"), card.at});
}

void read_solid(Bulk& bulk, const Card& card) {
  const SolidCard* kind = nullptr;
  for (const SolidCard& candidate : solid_cards) {
    if (candidate.name == card.name) kind = &candidate;
  }
  const size_t all = kind->places.size();
  SolidLine line{bulk.cards.id(card, 0, "element id"),
                 bulk.cards.id(card, 1, "property id"),
                 kind->linear,
                 bulk.element_nodes.size(),
                 static_cast<int>(kind->corners),
                 card.at};
  size_t middles = 0;
  for (size_t k = kind->corners; k < all; ++k) middles += !card.blank(2 + k);
  if (middles != 0 && middles != all - kind->corners)
    bulk.fail(card.at, fmt::format("{} {} has {} of {} nodes on its edges; it needs all or none", card.name, line.label,
                                   middles, all - kind->corners));
  if (card.fields.size() > 2 + all)
    bulk.fail(card.field(2 + all), fmt::format("{} {} has more than {} nodes", card.name, line.label, all));
  if (middles != 0) {
    line.row = kind->quadratic;
    line.nodes = static_cast<int>(all);
  }
  for (int k = 0; k < line.nodes; ++k)
    bulk.element_nodes.push_back(
        bulk.cards.id(card, 2 + kind->places[static_cast<size_t>(k)], "a node of the element"));
  const long twice = repeated(&bulk.element_nodes[line.first_node], static_cast<size_t>(line.nodes));
  if (twice != -1) bulk.fail(card.at, fmt::format("{} {} has node {} more than once", card.name, line.label, twice));
  bulk.solids.push_back(line);
}

void read_beam(Bulk& bulk, const Card& card) {
  BeamLine line;
  line.is_bar = card.name == "CBAR";
  line.label = bulk.cards.id(card, 0, "element id");
  line.property = bulk.cards.id_or(card, 1, line.label, "property id");
  line.nodes = {bulk.cards.id(card, 2, "GA"), bulk.cards.id(card, 3, "GB")};
  line.at = card.at;
  if (line.nodes[0] == line.nodes[1])
    bulk.fail(card.at, fmt::format("{} {} has one node twice", card.name, line.label));
  const bool by_node = card.blank(5) && card.blank(6) && to_integer(card.field(4));
  if (by_node) {
    line.direction_node = bulk.cards.id(card, 4, "G0");
  } else {
    line.direction = vector(bulk, card, 4, "orientation vector");
    if (line.direction.norm() == 0)
      bulk.fail(card.at, fmt::format("{} {}: the orientation vector is missing", card.name, line.label));
  }
  const std::string_view offset = card.field(7);
  const bool known = offset.empty() || std::string_view("GgBb").find(offset[0]) != std::string_view::npos;
  if (!known && nastran_real(offset).value_or(1) != 0)
    bulk.fail(offset, fmt::format("{}: OFFT {} is not understood; there is GGG", card.name, quoted(offset)));
  refuse_unless_zero(bulk, card, 8, 9, "pins (PA, PB)");
  refuse_unless_zero(bulk, card, 10, 15, "offsets (W1A ... W3B)");
  if (card.name == "CBEAM" && (!card.blank(16) || !card.blank(17)))
    bulk.fail(card.at, "CBEAM: warping (SA, SB) is not understood");
  bulk.beams.push_back(line);
}

}  // namespace flexboom::nastran
