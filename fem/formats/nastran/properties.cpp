#include "fem/base/check.hpp"
#include "fem/formats/nastran/bulk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

// Materials, sections and masses.
namespace flexboom::nastran {
namespace {

constexpr double consistent = 0.01;  // how far E may be from 2 (1 + nu) G, as in Nastran's own warning

void add_section(Bulk& bulk, const Card& card, const BeamPropertyLine& line) {
  if (!bulk.beam_properties.try_emplace(bulk.cards.id(card, 0, "property id"), line).second)
    bulk.fail(card.at, fmt::format("{} {} is defined twice", card.name, card.field(0)));
}

double positive(const Bulk& bulk, const Card& card, size_t i, std::string_view what) {
  const double value = bulk.cards.real(card, i, what);
  if (value <= 0) bulk.fail(card.field(i), fmt::format("{}: {} must be positive", card.name, what));
  return value;
}

void refuse_unless_zero(const Bulk& bulk, const Card& card, size_t i, std::string_view what) {
  if (bulk.cards.real_or(card, i, 0, what) != 0)
    bulk.fail(card.field(i), fmt::format("{}: {} other than zero is not understood", card.name, what));
}

// Plane 1 holds the beam and the orientation vector, our y: I1 is the integral of y^2.
GeneralSection constants(const Bulk& bulk, const Card& card) {
  GeneralSection section;
  section.A = positive(bulk, card, 2, "A");
  section.Iz = positive(bulk, card, 3, "I1");
  section.Iy = positive(bulk, card, 4, "I2");
  return section;
}

/// Shear factors K1, K2 of a section. @returns false where both are zero: rigid in shear.
bool set_shear(Bulk& bulk, const Card& card, size_t first, double otherwise, GeneralSection& section) {
  const double k1 = bulk.cards.real_or(card, first, otherwise, "K1");
  const double k2 = bulk.cards.real_or(card, first + 1, otherwise, "K2");
  if (k1 == 0 && k2 == 0) return false;
  if (k1 <= 0 || k2 <= 0)
    bulk.fail(card.at, fmt::format("{}: K1 and K2 must both be positive, or both zero (rigid in shear)", card.name));
  section.kappa_y = k1;
  section.kappa_z = k2;
  return true;
}

SectionShape shape_of(Bulk& bulk, const Card& card, const std::string& type, size_t& dimensions) {
  const auto d = [&](size_t k) { return positive(bulk, card, 7 + k, fmt::format("DIM{}", k)); };
  if (type == "ROD") {
    dimensions = 1;
    return RoundBar{2 * d(1)};
  }
  dimensions = 2;
  if (type == "TUBE") {
    const double inner = bulk.cards.real_or(card, 9, 0, "DIM2");
    if (inner < 0 || inner >= d(1)) bulk.fail(card.at, fmt::format("{}: TUBE: 0 <= DIM2 < DIM1 must hold", card.name));
    return inner == 0 ? SectionShape(RoundBar{2 * d(1)}) : Tube{2 * d(1), d(1) - inner};
  }
  if (type == "TUBE2") return Tube{2 * d(1), d(2)};
  if (type == "BAR") return Rectangle{d(2), d(1)};
  dimensions = 4;
  if (type != "BOX")
    bulk.fail(card.at, fmt::format("{}: section {} is not understood; there are ROD, TUBE, TUBE2, BAR, BOX (or give "
                                   "constants with PBAR)",
                                   card.name, flexboom::quoted(type)));
  if (d(3) != d(4)) bulk.fail(card.at, fmt::format("{}: BOX: DIM3 and DIM4 (thickness) must be equal", card.name));
  return RectangularTube{d(2), d(1), d(3)};
}

/// Skips the stations of a PBEAM, all of which must be as end A. @returns the field of K1.
size_t after_stations(const Bulk& bulk, const Card& card) {
  const auto is_station = [&card](size_t i) {
    const std::string so = upper_key(card.field(i));
    return so == "YES" || so == "YESA" || so == "NO";
  };
  size_t i = is_station(8) ? 8 : 16;  // points of stress recovery may be left out before a station
  for (;;) {
    if (!is_station(i)) return i;
    for (size_t k = 2; k < 8; ++k) {  // A I1 I2 I12 J NSM
      if (card.blank(i + k)) continue;
      if (bulk.cards.real(card, i + k, "a constant of the section") != bulk.cards.real_or(card, k, 0, "a constant"))
        bulk.fail(card.field(i + k), "PBEAM: sections that change along the beam are not understood");
    }
    i += upper_key(card.field(i)) == "YES" ? 16 : 8;
  }
}

}  // namespace

void read_psolid(Bulk& bulk, const Card& card) {
  const std::string type = upper_key(card.field(6));
  if (!type.empty() && type != "SMECH")
    bulk.fail(card.field(6), fmt::format("PSOLID: FCTN {} is not understood; there is SMECH", flexboom::quoted(type)));
  if (!card.blank(3) || !card.blank(5))
    bulk.notes.add(
        "PSOLID: IN and ISOP are passed over; linear hexahedra have incompatible modes, quadratic ones full "
        "integration");
  const SolidPropertyLine line{bulk.cards.id(card, 1, "material id"), card.at};
  if (!bulk.solid_properties.try_emplace(bulk.cards.id(card, 0, "property id"), line).second)
    bulk.fail(card.at, fmt::format("PSOLID {} is defined twice", card.field(0)));
}

void read_pbar(Bulk& bulk, const Card& card) {
  BeamPropertyLine line{true, bulk.cards.id(card, 1, "material id"), {}, false, 0, card.at};
  GeneralSection section = constants(bulk, card);
  section.J = positive(bulk, card, 5, "J");
  line.line_mass = bulk.cards.real_or(card, 6, 0, "NSM");
  line.shear = set_shear(bulk, card, 16, 0, section);
  refuse_unless_zero(bulk, card, 18, "I12");
  line.shape = section;
  add_section(bulk, card, line);
}

void read_pbarl(Bulk& bulk, const Card& card) {
  BeamPropertyLine line{card.name == "PBARL", bulk.cards.id(card, 1, "material id"), {}, true, 0, card.at};
  size_t dimensions = 0;
  line.shape = shape_of(bulk, card, upper_key(card.field(3)), dimensions);
  try {
    section_of(line.shape, 0, {"value", 1});
  } catch (const InputError& error) {
    bulk.fail(card.at, fmt::format("{}: {}", card.name, error.what()));
  }
  const size_t mass = 8 + dimensions;
  line.line_mass = bulk.cards.real_or(card, mass, 0, "NSM");
  if (card.fields.size() > mass + 1)
    bulk.fail(card.field(mass + 1),
              fmt::format("{}: sections that change along the beam are not understood", card.name));
  bulk.notes.add(fmt::format("{}: shear coefficients are those of Cowper", card.name));
  add_section(bulk, card, line);
}

void read_pbeam(Bulk& bulk, const Card& card) {
  BeamPropertyLine line{false, bulk.cards.id(card, 1, "material id"), {}, false, 0, card.at};
  GeneralSection section = constants(bulk, card);
  refuse_unless_zero(bulk, card, 5, "I12");
  section.J = positive(bulk, card, 6, "J");
  line.line_mass = bulk.cards.real_or(card, 7, 0, "NSM");
  const size_t k = after_stations(bulk, card);
  line.shear = set_shear(bulk, card, k, 1, section);
  for (const size_t i : {k + 4, k + 5}) refuse_unless_zero(bulk, card, i, "NSI");
  for (size_t i = k + 8; i < k + 16; ++i) refuse_unless_zero(bulk, card, i, "an offset of mass or neutral axis");
  for (const size_t i : {k + 2, k + 3, k + 6, k + 7}) {
    if (bulk.cards.real_or(card, i, 0, "S1, S2, CW") != 0)
      bulk.notes.add("PBEAM: shear relief and warping are left out");
  }
  line.shape = section;
  add_section(bulk, card, line);
}

void read_mat1(Bulk& bulk, const Card& card) {
  if (bulk.material) return;
  const auto read = [&](size_t i, std::string_view what) -> std::optional<double> {
    if (card.blank(i)) return {};
    return bulk.cards.real(card, i, what);
  };
  const auto E = read(1, "E"), G = read(2, "G"), nu = read(3, "NU");
  if (E.has_value() + G.has_value() + nu.has_value() < 2)
    bulk.fail(card.at, fmt::format("MAT1 {}: two of E, G and NU are needed", card.field(0)));
  if (G && !(*G > 0)) bulk.fail(card.field(2), "MAT1: G must be positive");
  Material m;
  m.E = E ? *E : 2 * (1 + *nu) * *G;
  m.nu = nu ? *nu : *E / (2 * *G) - 1;
  m.rho = bulk.cards.real_or(card, 4, 0, "RHO");
  if (m.E <= 0) bulk.fail(card.at, fmt::format("MAT1 {}: E must be positive", card.field(0)));
  if (nu && (*nu <= -1 || *nu >= 0.5))
    bulk.fail(card.field(3),
              fmt::format("MAT1 {}: Poisson's ratio is {}; it must lie between -1 and 0.5", card.field(0), *nu));
  if (m.rho < 0) bulk.fail(card.field(4), "MAT1: RHO must not be negative");
  Material of_bars = m;
  if (E && G) of_bars.nu = *E / (2 * *G) - 1;
  if (E && G && nu && std::abs(1 - *E / (2 * (1 + *nu) * *G)) > consistent)
    bulk.notes.add(
        fmt::format("MAT1 {}: E, G and NU disagree; bars have E and G, solids E and NU, as in Nastran", card.field(0)));
  if (!bulk.materials.try_emplace(bulk.cards.id(card, 0, "material id"), MaterialLine{m, of_bars, {}, card.at}).second)
    bulk.fail(card.at, fmt::format("material {} is defined twice", card.field(0)));
}

void read_other_material(Bulk& bulk, const Card& card) {
  const MaterialLine line{
      {}, {}, fmt::format("{}: only isotropic materials (MAT1) are understood", card.name), card.at};
  bulk.materials.try_emplace(bulk.cards.id(card, 0, "material id"), line);
}

void read_conm2(Bulk& bulk, const Card& card) {
  if (!bulk.mass_ids.insert(bulk.cards.id(card, 0, "element id")).second)
    bulk.fail(card.at, fmt::format("CONM2 {} is defined twice", card.field(0)));
  MassLine line{bulk.cards.id(card, 1, "grid"), {}, false, card.at};
  if (!card.blank(2) && card.field(2) != "0") {
    if (card.field(2) != "-1") bulk.fail(card.field(2), "CONM2: CID is understood if it is 0 or -1");
    line.absolute = true;
  }
  line.body.mass = bulk.cards.real_or(card, 3, 0, "M");
  if (line.body.mass < 0) bulk.fail(card.field(3), "CONM2: the mass must not be negative");
  for (size_t k = 0; k < 3; ++k) line.body.offset(static_cast<int>(k)) = bulk.cards.real_or(card, 4 + k, 0, "offset");
  std::array<double, 6> I{};  // read before the matrix is filled: Eigen does not like to be left in the middle of one
  for (size_t k = 0; k < I.size(); ++k) I[k] = bulk.cards.real_or(card, 8 + k, 0, "inertia");
  // I21 = integral of x y dm, which enters the tensor with a minus: I11; I21 I22; I31 I32 I33.
  line.body.inertia << I[0], -I[1], -I[3], -I[1], I[2], -I[4], -I[3], -I[4], I[5];
  bulk.masses.push_back(line);
}

}  // namespace flexboom::nastran
