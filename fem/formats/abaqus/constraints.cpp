#include "fem/formats/abaqus/deck.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>

// Supports and connections.
namespace flexboom::abaqus {
namespace {

using Eigen::Vector3d;
using Fields = std::vector<std::string_view>;

constexpr int temperature_freedom = 11;

bool hold_named(Deck& deck, const Fields& fields) {
  const auto components = fields.size() < 2 ? std::nullopt : named_support(fields[1]);
  if (!components) return false;
  for (const char digit : *components) {
    const int component = digit - '0';
    deck.boundaries.push_back({deck.reference(unquoted(fields[0])), component, component, fields[0]});
  }
  return true;
}

/// Lines "first, last" of degrees of freedom. @returns false if there was none.
bool read_components(Deck& deck, Components& components, int highest) {
  bool any = false;
  while (const Fields* fields = deck.lines.next_data()) {
    const auto first = deck.lines.text().integer((*fields)[0], "degree of freedom", 1, highest);
    const bool range = fields->size() > 1 && !(*fields)[1].empty();
    const auto last = range ? deck.lines.text().integer((*fields)[1], "last degree of freedom", first, highest) : first;
    if (!any) components = {};
    for (long k = first; k <= last; ++k) components[static_cast<size_t>(k - 1)] = true;
    any = true;
  }
  return any;
}

Components translations() { return {true, true, true, false, false, false}; }

}  // namespace

void read_boundary(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"OP", "TYPE", "AMPLITUDE", "FIXED", "LOADCASE", "TIMEDELAY"});
  const std::string type = upper_key(keyword.find("TYPE").value_or("DISPLACEMENT"));
  if (type != "DISPLACEMENT") deck.fail(keyword.at, "*BOUNDARY is understood with TYPE=DISPLACEMENT only");
  if (keyword.find("LOADCASE").value_or("1") != "1")
    deck.fail(keyword.at,
              "*BOUNDARY, LOAD CASE=2 is of buckling modes and steady states, not of frequencies; leave it out");
  if (upper_key(keyword.find("OP").value_or("MOD")) == "NEW" && deck.in_step && !deck.cleared) {
    deck.boundaries.clear();
    deck.cleared = true;
  }
  while (const Fields* fields = deck.lines.next_data()) {
    if (hold_named(deck, *fields)) continue;
    if (fields->size() < 2) deck.fail(deck.lines.line(), "*BOUNDARY needs a node or set and a degree of freedom");
    const DeckText& text = deck.lines.text();
    const long first = text.integer((*fields)[1], "degree of freedom");
    const bool range = fields->size() > 2 && !(*fields)[2].empty();
    const long last = range ? text.integer((*fields)[2], "last degree of freedom") : first;
    if (first == temperature_freedom && last == first) {
      deck.notes.add("temperatures have no effect on the modes");
      continue;
    }
    if (first < 1 || last > 6 || last < first)
      deck.fail((*fields)[1], fmt::format("degrees of freedom {} to {} must lie in 1 to 6", first, last));
    if (deck.real_or_zero(*fields, 3, "prescribed value") != 0)
      deck.notes.add("prescribed displacements other than zero are held at zero in the modes");
    deck.boundaries.push_back(
        {deck.reference(unquoted((*fields)[0])), static_cast<int>(first), static_cast<int>(last), (*fields)[0]});
  }
}

void read_rigid_body(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"NSET", "ELSET", "REFNODE", "ROTNODE", "PINNSET", "TIENSET", "POSITION", "ISOTHERMAL"});
  if (upper_key(keyword.find("POSITION").value_or("INPUT")) != "INPUT")
    deck.fail(keyword.at, "*RIGID BODY, POSITION=CENTER OF MASS is not understood; give the reference node its place");
  Rigid rigid;
  rigid.reference = deck.reference(deck.lines.need(keyword, "REFNODE"));
  if (const auto rotation = keyword.find("ROTNODE")) rigid.rotation = deck.reference(*rotation);
  rigid.at = keyword.at;
  const size_t before = deck.rigids.size();
  const auto add = [&](std::string_view parameter, Reference Rigid::*where, const Components& components) {
    const auto name = keyword.find(parameter);
    if (!name) return;
    Rigid& copy = deck.rigids.emplace_back(rigid);
    copy.*where = deck.reference(*name);
    copy.components = components;
  };
  add("NSET", &Rigid::nodes, all_components);
  add("TIENSET", &Rigid::nodes, all_components);
  add("PINNSET", &Rigid::nodes, translations());
  add("ELSET", &Rigid::elements, all_components);
  if (deck.rigids.size() == before) deck.fail(keyword.at, "*RIGID BODY needs NSET or ELSET");
}

void read_coupling(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"REFNODE", "SURFACE", "CONSTRAINTNAME", "ORIENTATION"});
  Rigid coupling;
  coupling.reference = deck.reference(deck.lines.need(keyword, "REFNODE"));
  coupling.surface = deck.reference(deck.lines.need(keyword, "SURFACE"));
  coupling.at = keyword.at;
  const auto kind = deck.lines.next_keyword();
  if (!kind || (kind->name != "KINEMATIC" && kind->name != "DISTRIBUTING"))
    deck.fail(kind ? kind->at : keyword.at, "*COUPLING must be followed by *KINEMATIC or *DISTRIBUTING");
  coupling.distributing = kind->name == "DISTRIBUTING";
  const bool turned = keyword.has("ORIENTATION");
  if (coupling.distributing) {
    deck.lines.allow(*kind, {"COUPLING", "WEIGHTINGMETHOD"});
    if (upper_key(kind->find("WEIGHTINGMETHOD").value_or("UNIFORM")) != "UNIFORM")
      deck.fail(kind->at, "*DISTRIBUTING is understood with WEIGHTING METHOD=UNIFORM only");
    deck.notes.add("*DISTRIBUTING makes the reference node follow the surface (as RBE3), with a mass on it as well");
  } else {
    deck.lines.allow(*kind, {});
  }
  const bool listed = read_components(deck, coupling.components, 6);
  if (!listed) {
    const Dialect dialect = deck.dialect(
        kind->at, coupling.distributing
                      ? "*DISTRIBUTING without degrees of freedom couples all six in Abaqus and 1 to 3 in CalculiX"
                      : "*KINEMATIC without degrees of freedom couples all six in Abaqus and none in CalculiX");
    if (dialect == Dialect::calculix) coupling.components = translations();
    if (dialect == Dialect::calculix && !coupling.distributing)
      deck.fail(kind->at, "*KINEMATIC: the degrees of freedom are missing; CalculiX couples nothing");
  }
  if (coupling.distributing) {
    // Translations always follow, and rotations together or not at all.
    const Components& c = coupling.components;
    if (turned && listed && (c[3] || c[4] || c[5]) && !(c[3] && c[4] && c[5]))
      deck.fail(keyword.at, "*COUPLING with ORIENTATION must take all rotations or none");
    coupling.components[0] = coupling.components[1] = coupling.components[2] = true;
  } else {
    const Components& c = coupling.components;
    if (deck.options.dialect == Dialect::calculix && (c[3] || c[4] || c[5]))
      deck.fail(kind->at, "*KINEMATIC takes degrees of freedom 1 to 3 in CalculiX");
    if (turned && !(c[0] && c[1] && c[2]))
      deck.fail(keyword.at, "*COUPLING with ORIENTATION is understood if it takes degrees of freedom 1 to 3");
  }
  deck.rigids.push_back(coupling);
}

void read_distributing_coupling(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"ELSET"});
  const Dialect dialect = deck.dialect(
      keyword.at,
      "the reference node of *DISTRIBUTING COUPLING follows the rigid motion that fits in Abaqus, and the mean "
      "displacement alone in CalculiX");
  DistributingElements coupling{deck.reference(deck.lines.need(keyword, "ELSET")), dialect, {}, keyword.at};
  while (const Fields* fields = deck.lines.next_data()) {
    const double weight = fields->size() > 1 ? deck.real((*fields)[1], "weight") : 1;
    if (weight <= 0) deck.fail((*fields)[1], "a weight must be positive");
    coupling.weights.emplace_back(deck.reference(unquoted((*fields)[0])), weight);
  }
  if (coupling.weights.empty()) deck.fail(keyword.at, "*DISTRIBUTING COUPLING: the nodes are missing");
  deck.distributing.push_back(std::move(coupling));
}

void read_equation(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {});
  while (const Fields* header = deck.lines.next_data()) {
    const std::string_view at = (*header)[0];
    const long count = deck.lines.text().integer(at, "number of terms", 1, 1'000'000);
    Equation equation;
    equation.at = at;
    while (std::ssize(equation.terms) < count) {
      const Fields* fields = deck.lines.next_data();
      if (fields == nullptr)
        deck.fail(at, fmt::format("the equation ends after {} of {} terms", equation.terms.size(), count));
      if (fields->size() % 3 != 0)
        deck.fail(deck.lines.line(), "an equation has three fields per term: node, degree of freedom, coefficient");
      for (size_t i = 0; i < fields->size(); i += 3) {
        const long component = deck.lines.text().integer((*fields)[i + 1], "degree of freedom", 1, 6);
        const double coefficient = deck.real((*fields)[i + 2], "coefficient");
        if (coefficient == 0 && equation.terms.empty())
          deck.fail((*fields)[i + 2],
                    "the first coefficient of an equation must not be zero: its freedom follows the others");
        if (coefficient == 0)
          deck.notes.add(fmt::format("{}: a term of the equation has the coefficient zero and is left out",
                                     deck.lines.text().line_location((*fields)[i + 2])));
        equation.terms.push_back({deck.reference(unquoted((*fields)[i])), static_cast<int>(component), coefficient});
      }
    }
    if (std::ssize(equation.terms) > count)
      deck.fail(at, fmt::format("{} terms follow where {} were announced", equation.terms.size(), count));
    deck.equations.push_back(std::move(equation));
  }
}

void read_mpc(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {});
  while (const Fields* fields = deck.lines.next_data()) {
    const std::string type = upper_key((*fields)[0]);
    if (type != "BEAM" && type != "TIE" && type != "PIN" && type != "LINK")
      deck.fail((*fields)[0],
                fmt::format("*MPC {} is not understood; there are BEAM, TIE, PIN, LINK", quoted((*fields)[0])));
    if (fields->size() != 3) deck.fail(deck.lines.line(), fmt::format("*MPC {} needs two nodes or sets", type));
    const bool keeps_distance =
        type == "BEAM" &&
        deck.dialect((*fields)[0], "*MPC BEAM is a rigid beam in Abaqus and keeps a distance alone in CalculiX") ==
            Dialect::calculix;
    if (type != "BEAM" && deck.options.dialect == Dialect::calculix)
      deck.fail((*fields)[0], fmt::format("*MPC {} is not known to CalculiX", type));
    deck.mpcs.push_back({keeps_distance ? "LINK" : type, deck.reference(unquoted((*fields)[1])),
                         deck.reference(unquoted((*fields)[2])), (*fields)[0]});
  }
}

void read_tie(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"NAME", "POSITIONTOLERANCE", "ADJUST", "TYPE", "NOROTATION", "CONSTRAINTRATIO"});
  std::optional<double> tolerance;
  if (const auto value = keyword.find("POSITIONTOLERANCE")) tolerance = deck.real(*value, "POSITION TOLERANCE");
  const bool adjust = upper_key(keyword.find("ADJUST").value_or("YES")) != "NO";
  while (const Fields* fields = deck.lines.next_data()) {
    if (fields->size() < 2) deck.fail(deck.lines.line(), "*TIE needs a slave and a master surface");
    deck.ties.push_back({deck.reference(unquoted((*fields)[0])), deck.reference(unquoted((*fields)[1])), tolerance,
                         adjust, (*fields)[0]});
  }
}

void read_transform(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"NSET", "TYPE"});
  const std::string type = upper_key(keyword.find("TYPE").value_or("R"));
  if (type != "R" && type != "C") deck.fail(keyword.at, "*TRANSFORM is understood with TYPE=R or C");
  const Fields* fields = deck.lines.next_data();
  if (fields == nullptr || fields->size() < 6) deck.fail(keyword.at, "*TRANSFORM needs six coordinates of two points");
  Vector3d a, b;
  for (size_t k = 0; k < 3; ++k) {
    a(static_cast<int>(k)) = deck.real_or_zero(*fields, k, "coordinate");
    b(static_cast<int>(k)) = deck.real_or_zero(*fields, k + 3, "coordinate");
  }
  const bool flat = type == "C" ? (b - a).norm() == 0 : a.cross(b).norm() <= 1e-10 * a.norm() * b.norm();
  if (flat) deck.fail((*fields)[0], "the two points of *TRANSFORM define no axes");
  deck.transforms.push_back({deck.reference(deck.lines.need(keyword, "NSET")), type == "C", a, b, keyword.at});
}

}  // namespace flexboom::abaqus
