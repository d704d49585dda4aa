#include "fem/formats/abaqus/read.hpp"

#include "fem/formats/abaqus/deck.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexboom {
namespace abaqus {
namespace {

constexpr size_t calculix_number = 20;  // characters

struct Row {
  std::string_view name;
  Read read;
};

// Keywords that are understood.
constexpr std::array<Row, 35> table{{
    {"NODE", read_node},
    {"ELEMENT", read_element},
    {"NSET", read_node_set},
    {"ELSET", read_element_set},
    {"SURFACE", read_surface},
    {"PART", read_part},
    {"ENDPART", read_end_part},
    {"INSTANCE", read_instance},
    {"ENDINSTANCE", read_end_instance},
    {"MATERIAL", read_material},
    {"ELASTIC", read_elastic},
    {"DENSITY", read_density},
    {"SOLIDSECTION", read_solid_section},
    {"SHELLSECTION", read_shell_section},
    {"SHELLGENERALSECTION", read_shell_section},
    {"MEMBRANESECTION", read_shell_section},
    {"BEAMSECTION", read_beam_section},
    {"BEAMGENERALSECTION", read_beam_general_section},
    {"MASS", read_mass},
    {"BOUNDARY", read_boundary},
    {"RIGIDBODY", read_rigid_body},
    {"COUPLING", read_coupling},
    {"DISTRIBUTINGCOUPLING", read_distributing_coupling},
    {"EQUATION", read_equation},
    {"MPC", read_mpc},
    {"TIE", read_tie},
    {"TRANSFORM", read_transform},
    {"STEP", read_step},
    {"ENDSTEP", read_end_step},
    {"STATIC", read_static},
    {"FREQUENCY", read_frequency},
    {"INITIALCONDITIONS", read_initial_conditions},
    {"TEMPERATURE", read_temperature},
    {"ASSEMBLY", [](Deck&, const Keyword&) {}},
    {"ENDASSEMBLY", [](Deck&, const Keyword&) {}},
}};

// Keywords about which nothing needs to be said: text and output.
constexpr std::string_view silent[] = {
    "HEADING",      "PREPRINT",          "RESTART",          "OUTPUT",
    "NODEOUTPUT",   "ELEMENTOUTPUT",     "CONTACTOUTPUT",    "ENERGYOUTPUT",
    "MODALOUTPUT",  "NODEFILE",          "ELFILE",           "ELEMENTFILE",
    "NODEPRINT",    "ELPRINT",           "ELEMENTPRINT",     "CONTACTFILE",
    "CONTACTPRINT", "SECTIONPRINT",      "ENERGYPRINT",      "ENERGYFILE",
    "PRINT",        "MONITOR",           "FILEFORMAT",       "TIMEPOINTS",
    "NOANALYSIS",   "USERELEMENTOUTPUT", "INTEGRATEDOUTPUT", "MODALFILE",
    "MODALPRINT",   "FACEPRINT",         "FILEOUTPUT",       "SECTIONFILE",
};

// Output, matrices, and steps that follow from modes or start from rest and leave the structure as it is.
constexpr std::string_view passed_over[] = {
    "MATRIXGENERATE",
    "MATRIXOUTPUT",
    "ELEMENTMATRIXOUTPUT",
    "SUBSTRUCTUREGENERATE",
    "SUBSTRUCTUREOUTPUT",
    "SUBSTRUCTUREMATRIXOUTPUT",
    "SUBSTRUCTURELOADCASE",
    "ELEMENTRECOVERYMATRIX",
    "ELEMENTOPERATOROUTPUT",
    "FLEXIBLEBODY",
    "RETAINEDNODALDOFS",
    "SELECTEIGENMODES",
    "RADIATIONFILE",
    "RADIATIONPRINT",
    "RADIATIONOUTPUT",
    "INCREMENTATIONOUTPUT",
    "SURFACEOUTPUT",
    "INTEGRATEDOUTPUTSECTION",
    "POSTOUTPUT",
    "EXTREMEVALUE",
    "FILTER",
    "DIAGNOSTICS",
    "VIEWFACTOROUTPUT",
    "MODALDYNAMIC",
    "STEADYSTATEDYNAMICS",
    "COMPLEXFREQUENCY",
    "RANDOMRESPONSE",
    "RESPONSESPECTRUM",
    "GREEN",
    "SENSITIVITY",
    "DESIGNVARIABLES",
    "DESIGNRESPONSE",
    "OBJECTIVE",
};

// Keywords without effect on the frequencies of the unloaded structure.
constexpr std::string_view without_effect[] = {
    "AMPLITUDE",
    "PHYSICALCONSTANTS",
    "ORIENTATION",
    "EXPANSION",
    "CONDUCTIVITY",
    "SPECIFICHEAT",
    "PLASTIC",
    "CYCLICHARDENING",
    "CREEP",
    "DAMPING",
    "MODALDAMPING",
    "GLOBALDAMPING",
    "SURFACEINTERACTION",
    "SURFACEBEHAVIOR",
    "FRICTION",
    "CLOAD",
    "DLOAD",
    "DSLOAD",
    "CFLUX",
    "DFLUX",
    "FILM",
    "RADIATE",
    "CONTROLS",
    "SECTIONCONTROLS",
    "HOURGLASSSTIFFNESS",
    "SOLVERCONTROLS",
    "GAPCONDUCTANCE",
    "CONTACTDAMPING",
    "ELECTRICALCONDUCTIVITY",
    "FLUIDCONSTANTS",
    "SPECIFICGASCONSTANT",
    "VISCOSITY",
    "CONTACTCONTROLS",
    "CONSTRAINTCONTROLS",
    "MAGNETICPERMEABILITY",
    "BASEMOTION",
    "DISTRIBUTION",
    "DISTRIBUTIONTABLE",
    "FIELD",
};

struct Refusal {
  std::string_view name, reason;
};

constexpr Refusal refusals[] = {
    {"BUCKLE", "buckling is not computed; a step must be *FREQUENCY (or *STATIC, which is passed over)"},
    {"SPRING", "springs are not understood"},
    {"NGEN", "nodes are not generated; write them out"},
    {"ELGEN", "elements are not generated; write them out"},
    {"NORMAL", "normals of beams are not understood; give direction 1 in *BEAM SECTION"},
    {"CYCLICSYMMETRYMODEL", "cyclic symmetry is not understood; mesh the whole structure"},
    {"MODELCHANGE", "elements are not removed or added in a step"},
};

constexpr std::string_view procedures[] = {
    "DYNAMIC",
    "HEATTRANSFER",
    "COUPLEDTEMPERATURE-DISPLACEMENT",
    "UNCOUPLEDTEMPERATURE-DISPLACEMENT",
    "VISCO",
    "ELECTROMAGNETICS",
    "CRACKPROPAGATION",
};

bool among(std::string_view name, const auto& list) { return std::ranges::count(list, name) > 0; }

void read_keyword(Deck& deck, const Keyword& keyword) {
  const auto* const row = std::ranges::find(table, keyword.name, &Row::name);
  if (row != table.end()) return row->read(deck, keyword);
  if (among(keyword.name, silent)) return;
  if (among(keyword.name, passed_over)) {
    deck.notes.add(fmt::format("{} asks for output or another step and is passed over", keyword.at));
    return;
  }
  if (among(keyword.name, without_effect)) {
    deck.notes.add(fmt::format("{} has no effect on the modes", keyword.at));
    return;
  }
  for (const Refusal& refusal : refusals) {
    if (refusal.name == keyword.name) deck.fail(keyword.at, fmt::format("{}: {}", keyword.at, refusal.reason));
  }
  if (keyword.name.starts_with("CONTACT"))
    deck.fail(keyword.at, fmt::format("{}: contact is not understood; join parts with *TIE", keyword.at));
  if (among(keyword.name, procedures))
    deck.fail(keyword.at, fmt::format("{}: a step must be *FREQUENCY (or *STATIC, which is passed over)", keyword.at));
  deck.fail(keyword.at, fmt::format("keyword {} is not understood and may change the modes", quoted(keyword.at)));
}

}  // namespace

Dialect Deck::dialect(std::string_view at, std::string_view difference) {
  if (options.dialect) return *options.dialect;
  if (!signs_) signs_ = dialect_signs(text_, file_);
  const auto& [calculix, abaqus] = *signs_;
  if (calculix.empty() == abaqus.empty())
    fail(at,
         fmt::format("{}; {}; say --dialect calculix or --dialect abaqus", difference,
                     calculix.empty() ? "nothing in the deck tells which of the two it is for"
                                      : fmt::format("the deck has signs of both, of CalculiX ({}) and of Abaqus ({})",
                                                    calculix, abaqus)));
  const Dialect found = calculix.empty() ? Dialect::abaqus : Dialect::calculix;
  notes.add(fmt::format("{}; read as {} does, which the deck is for ({})", difference, name_of(found),
                        calculix.empty() ? abaqus : calculix));
  return found;
}

double Deck::real(std::string_view field, std::string_view what) {
  if (field.size() > calculix_number && !has_long_number) {
    has_long_number = true;
    notes.add(fmt::format("{}: CalculiX reads {} characters of a number and cuts off {}; here they all count",
                          lines.text().line_location(field), calculix_number, quoted(field)));
  }
  if (const std::optional<double> value = to_real(field, true)) return *value;
  if (field.empty()) fail(field, fmt::format("{} is missing", what));
  fail(field, fmt::format("{} is not a finite number: {}", what, quoted(field)));
}

double Deck::real_or_zero(const std::vector<std::string_view>& fields, size_t i, std::string_view what) {
  return i < fields.size() && !fields[i].empty() ? real(fields[i], what) : 0;
}

long Deck::label(std::string_view field, std::string_view what) const {
  const long label = lines.text().integer(field, what, 1, largest_label);
  return has_part && !in_part ? -label : label;
}

std::string Deck::key(std::string_view name, bool part) const {
  std::string key = upper_key(name);
  if (instance) {
    const std::string prefix = upper_key(instance->name) + ".";
    if (key.starts_with(prefix)) {
      key.erase(0, prefix.size());
      part = true;
    }
  }
  return (part ? "PART." : "") + key;
}

std::optional<long> Deck::number(const Reference& reference) const {
  std::string_view text = reference.text;
  bool part = reference.in_part;
  if (instance && text.size() > instance->name.size() && text[instance->name.size()] == '.' &&
      upper_key(text.substr(0, instance->name.size())) == upper_key(instance->name)) {
    text.remove_prefix(instance->name.size() + 1);
    part = true;
  }
  const std::optional<long> number = to_integer(text);
  if (!number) return {};
  if (*number < 1 || *number > largest_label)
    fail(reference.text, fmt::format("number {} must be 1 to {}", *number, largest_label));
  return has_part && !part ? -*number : *number;
}

}  // namespace abaqus

MeshFile read_abaqus(std::string_view text, const std::string& file, const ReadOptions& options) {
  abaqus::Deck deck(text, file, options);
  if (deck.lines.next_data() != nullptr)
    deck.fail(deck.lines.line(),
              fmt::format("a deck begins with a keyword such as *NODE, not with {}", quoted(deck.lines.line())));
  while (const auto keyword = deck.lines.next_keyword()) {
    abaqus::read_keyword(deck, *keyword);
    if (!deck.finished) continue;
    if (deck.lines.next_keyword()) deck.notes.add("what follows the first *FREQUENCY step is left out");
    break;
  }
  return abaqus::mesh_of(deck);
}

}  // namespace flexboom
