#include "fem/base/check.hpp"
#include "fem/formats/abaqus/deck.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

// Materials, sections and masses.
namespace flexboom::abaqus {
namespace {

using Eigen::Vector3d;
using Fields = std::vector<std::string_view>;

MaterialLines& material_of(Deck& deck, const Keyword& keyword) {
  if (deck.material == nullptr) deck.fail(keyword.at, fmt::format("{} without a *MATERIAL above", keyword.at));
  return *deck.material;
}

const Fields& need_data(Deck& deck, const Keyword& keyword, std::string_view what) {
  const Fields* fields = deck.lines.next_data();
  if (fields == nullptr) deck.fail(keyword.at, fmt::format("{}: a line with {} is missing", keyword.at, what));
  return *fields;
}

/// The temperature of a row of a material, above that of the row before.
template <class Row>
double row_temperature(Deck& deck, const Keyword& keyword, const Fields& fields, size_t place,
                       const std::vector<Row>& before) {
  const double temperature = deck.real_or_zero(fields, place, "temperature");
  if (before.empty()) return temperature;
  if (keyword.has("DEPENDENCIES"))
    deck.fail(keyword.at, fmt::format("{}: DEPENDENCIES on field variables are not understood", keyword.at));
  if (temperature <= before.back().temperature)
    deck.fail(deck.lines.line(), fmt::format("{}: the temperatures must ascend from row to row", keyword.at));
  return temperature;
}

/// Dimensions of a line, all positive.
std::vector<double> dimensions(Deck& deck, const Keyword& keyword, const Fields& fields) {
  std::vector<double> values;
  for (const std::string_view field : fields) {
    if (field.empty()) continue;
    values.push_back(deck.real(field, "dimension of the section"));
    if (values.back() <= 0) deck.fail(field, "a dimension of the section must be positive");
  }
  if (values.empty()) deck.fail(keyword.at, "the dimensions of the section are missing");
  return values;
}

// CalculiX takes the two full axes of SECTION=CIRC, the second being the first where it is not given; Abaqus one
// radius.
SectionShape round_bar(Deck& deck, const std::vector<double>& d, std::string_view at) {
  if (d.size() == 1) {
    const Dialect dialect =
        deck.dialect(at, "SECTION=CIRC with one number is a diameter in CalculiX and a radius in Abaqus");
    return RoundBar{dialect == Dialect::calculix ? d[0] : 2 * d[0]};
  }
  if (deck.dialect(at, "SECTION=CIRC with two numbers has diameters in CalculiX and is no section of Abaqus") ==
      Dialect::abaqus)
    deck.fail(at, "SECTION=CIRC takes one number in Abaqus, the radius");
  if (d.size() != 2 || d[0] != d[1])
    deck.fail(at, "SECTION=CIRC needs two equal diameters (ellipses are not understood)");
  return RoundBar{d[0]};
}

// Local direction 1 of the section is our y: height is along it, width along direction 2.
SectionShape shape_of(Deck& deck, const std::string& type, const std::vector<double>& d, std::string_view at) {
  const auto need = [&](size_t count, std::string_view what) {
    if (d.size() != count) deck.fail(at, fmt::format("SECTION={} needs {}; here are {} numbers", type, what, d.size()));
  };
  if (type == "CIRC") return round_bar(deck, d, at);
  if (type == "RECT") {
    need(2, "the dimensions along directions 1 and 2");
    return Rectangle{d[0], d[1]};
  }
  if (type == "PIPE") {
    need(2, "outer radius and thickness");
    return Tube{2 * d[0], d[1]};
  }
  if (type != "BOX") deck.fail(at, fmt::format("SECTION={} is not understood; there are RECT, CIRC, PIPE, BOX", type));
  need(6, "two outer dimensions and four thicknesses");
  if (std::any_of(d.begin() + 3, d.end(), [&d](double t) { return t != d[2]; }))
    deck.fail(at, "SECTION=BOX: the four thicknesses must be equal");
  return RectangularTube{d[0], d[1], d[2]};
}

Vector3d direction_1(Deck& deck) {
  const Fields* fields = deck.lines.next_data();
  if (fields == nullptr) return -Vector3d::UnitZ();
  Vector3d n;
  for (size_t k = 0; k < 3; ++k) n(static_cast<int>(k)) = deck.real_or_zero(*fields, k, "direction 1");
  if (n.norm() == 0) deck.fail(deck.lines.line(), "direction 1 of the section has no length");
  return n.normalized();
}

void refuse_offset(Deck& deck, const Keyword& keyword, std::string_view parameter) {
  const auto value = keyword.find(parameter);
  if (value && deck.real(*value, parameter) != 0)
    deck.fail(*value, fmt::format("{} is not understood: the beam must run through the centroid", parameter));
}

void refuse_second(Deck& deck, const Keyword& keyword, const MaterialLines& material, bool is_second) {
  if (is_second)
    deck.fail(keyword.at, fmt::format("material {} has a second {}", flexboom::quoted(material.name), keyword.at));
}

SectionLine section_line(Deck& deck, const Keyword& keyword, Role role) {
  SectionLine section;
  section.role = role;
  section.elements = deck.reference(deck.lines.need(keyword, "ELSET"));
  section.at = keyword.at;
  return section;
}

}  // namespace

void read_material(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"NAME"});
  const std::string_view name = deck.lines.need(keyword, "NAME");
  const auto [place, is_new] = deck.materials.try_emplace(upper_key(name), MaterialLines{std::string(name), {}, {}});
  if (!is_new) deck.fail(keyword.at, fmt::format("material {} is defined twice", quoted(name)));
  deck.material = &place->second;
}

void read_elastic(Deck& deck, const Keyword& keyword) {
  if (deck.options.material) return;
  deck.lines.allow(keyword, {"TYPE", "DEPENDENCIES", "MODULI"});
  MaterialLines& material = material_of(deck, keyword);
  const std::string type = upper_key(keyword.find("TYPE").value_or("ISO"));
  if (type != "ISO" && type != "ISOTROPIC")
    deck.fail(keyword.at, fmt::format("*ELASTIC, TYPE={} is not understood; materials are isotropic (TYPE=ISO)", type));
  refuse_second(deck, keyword, material, !material.elastic.empty());
  for (const Fields* fields = &need_data(deck, keyword, "Young's modulus and Poisson's ratio"); fields != nullptr;
       fields = deck.lines.next_data()) {
    ElasticRow row{};
    row.E = deck.real((*fields)[0], "Young's modulus");
    row.nu = deck.real_or_zero(*fields, 1, "Poisson's ratio");
    if (fields->size() < 2)
      deck.notes.add(fmt::format("*ELASTIC of {}: Poisson's ratio is left out and 0", material.name));
    row.temperature = row_temperature(deck, keyword, *fields, 2, material.elastic);
    if (row.E <= 0) deck.fail((*fields)[0], "Young's modulus must be positive");
    if (row.nu <= -1 || row.nu >= 0.5)
      deck.fail((*fields)[1], fmt::format("Poisson's ratio is {}; it must lie between -1 and 0.5", row.nu));
    material.elastic.push_back(row);
  }
}

void read_density(Deck& deck, const Keyword& keyword) {
  if (deck.options.material) return;
  deck.lines.allow(keyword, {"DEPENDENCIES"});
  MaterialLines& material = material_of(deck, keyword);
  refuse_second(deck, keyword, material, !material.density.empty());
  for (const Fields* fields = &need_data(deck, keyword, "the density"); fields != nullptr;
       fields = deck.lines.next_data()) {
    DensityRow row{};
    row.rho = deck.real((*fields)[0], "density");
    row.temperature = row_temperature(deck, keyword, *fields, 1, material.density);
    if (row.rho < 0) deck.fail((*fields)[0], "the density must not be negative");
    material.density.push_back(row);
  }
}

void read_solid_section(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"ELSET", "MATERIAL", "ORIENTATION", "CONTROLS", "REFNODE", "STACKDIRECTION"});
  SectionLine section = section_line(deck, keyword, Role::solid);
  section.material = upper_key(deck.lines.need(keyword, "MATERIAL"));
  if (keyword.has("ORIENTATION")) deck.notes.add("orientations do not matter to isotropic materials");
  if (keyword.has("CONTROLS")) deck.notes.add("section controls (hourglass stiffness) are our own");
  deck.sections.push_back(std::move(section));
}

void read_shell_section(Deck& deck, const Keyword& keyword) {
  deck.fail(keyword.at,
            fmt::format("{}: shells, membranes and trusses are out of scope; there are solids and beams", keyword.at));
}

void read_beam_section(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"ELSET", "MATERIAL", "SECTION", "ORIENTATION", "OFFSET1", "OFFSET2", "TEMPERATURE",
                             "POISSON", "ROTARYINERTIA"});
  SectionLine section = section_line(deck, keyword, Role::beam);
  section.material = upper_key(deck.lines.need(keyword, "MATERIAL"));
  const std::string type = upper_key(deck.lines.need(keyword, "SECTION"));
  refuse_offset(deck, keyword, "OFFSET1");
  refuse_offset(deck, keyword, "OFFSET2");
  const std::vector<double> d = dimensions(deck, keyword, need_data(deck, keyword, "the dimensions of the section"));
  section.beam.start = section.beam.end = shape_of(deck, type, d, keyword.at);
  try {
    section_of(section.beam.start, 0, {"value", 1});
  } catch (const InputError& error) {
    deck.fail(keyword.at, error.what());
  }
  section.beam.y_axis = direction_1(deck);
  deck.sections.push_back(std::move(section));
}

void read_beam_general_section(Deck& deck, const Keyword& keyword) {
  if (keyword.has("MATERIAL")) return read_beam_section(deck, keyword);  // CalculiX: PIPE and BOX are called so as well
  deck.lines.allow(keyword, {"ELSET", "SECTION", "DENSITY", "POISSON", "ROTARYINERTIA"});
  if (upper_key(keyword.find("SECTION").value_or("GENERAL")) != "GENERAL")
    deck.fail(keyword.at, "*BEAM GENERAL SECTION is understood with SECTION=GENERAL only; use *BEAM SECTION");
  SectionLine section = section_line(deck, keyword, Role::beam);
  const Fields& fields = need_data(deck, keyword, "A, I11, I12, I22, J");
  GeneralSection general;
  const auto positive = [&](size_t i, std::string_view what) {
    const double value = deck.real_or_zero(fields, i, what);
    if (value <= 0) deck.fail(deck.lines.line(), fmt::format("{} must be positive", what));
    return value;
  };
  general.A = positive(0, "A");
  general.Iy = positive(1, "I11");
  if (deck.real_or_zero(fields, 2, "I12") != 0) deck.fail(fields[2], "I12 must be zero: give principal directions");
  general.Iz = positive(3, "I22");
  general.J = positive(4, "J");
  for (const size_t i : {5U, 6U})
    if (deck.real_or_zero(fields, i, "sectorial moment or warping constant") != 0)
      deck.notes.add("*BEAM GENERAL SECTION: the sectorial moment and the warping constant are left out");
  section.beam.start = section.beam.end = general;
  section.beam.y_axis = direction_1(deck);
  const Fields& moduli = need_data(deck, keyword, "E and G (after the line of direction 1)");
  Material& material = section.beam.material;
  material.E = deck.real(moduli[0], "Young's modulus");
  const double G = deck.real_or_zero(moduli, 1, "shear modulus");
  if (material.E <= 0 || G <= 0) deck.fail(moduli[0], "Young's modulus and the shear modulus must be positive");
  material.nu = material.E / (2 * G) - 1;
  if (const auto rho = keyword.find("DENSITY")) material.rho = deck.real(*rho, "DENSITY");
  if (material.rho < 0) deck.fail(keyword.at, "the density must not be negative");
  deck.notes.add("*BEAM GENERAL SECTION: the shear coefficients are taken to be 1");
  deck.sections.push_back(std::move(section));
}

void read_mass(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"ELSET"});
  const Reference elements = deck.reference(deck.lines.need(keyword, "ELSET"));
  const Fields& fields = need_data(deck, keyword, "the mass");
  const double mass = deck.real(fields[0], "mass");
  if (mass < 0) deck.fail(fields[0], "the mass must not be negative");
  if (fields.size() > 1 && !fields[1].empty()) deck.fail(fields[1], "*MASS has one mass, the same in all directions");
  deck.masses.emplace_back(elements, mass);
}

}  // namespace flexboom::abaqus
