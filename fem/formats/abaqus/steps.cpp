#include "fem/formats/abaqus/deck.hpp"

#include <fmt/format.h>

// Steps, of which the first that asks for frequencies counts.
namespace flexboom::abaqus {

void read_step(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"PERTURBATION", "NLGEOM", "INC", "NAME", "INCF", "THERMALNONLINEAR", "UNSYMM", "AMPLITUDE",
                             "EXTRAPOLATION", "CONVERTSDI", "DIRECT", "SOLVER"});
  if (deck.in_step) deck.fail(keyword.at, "*STEP within a *STEP; *END STEP is missing");
  deck.in_step = true;
  deck.cleared = false;
  deck.perturbation = keyword.has("PERTURBATION");
  deck.nonlinear = keyword.has("NLGEOM") && upper_key(*keyword.find("NLGEOM")) != "NO";
}

void read_end_step(Deck& deck, const Keyword& keyword) {
  if (!deck.in_step) deck.fail(keyword.at, "*END STEP without a *STEP above");
  deck.in_step = false;
  deck.finished = deck.frequencies;
}

void read_static(Deck& deck, const Keyword& keyword) {
  if (!deck.in_step) deck.fail(keyword.at, "*STATIC outside of a *STEP");
  deck.notes.add("*STATIC steps are not computed; loads have no effect on the modes of the structure at rest");
  if (deck.nonlinear) deck.nonlinear_preload = keyword.at;
  deck.preload = keyword.at;
}

// Loads of an earlier static step stiffen the structure where the frequency step is a perturbation of it (CalculiX), or
// where that step was geometrically nonlinear (Abaqus).
void read_frequency(Deck& deck, const Keyword& keyword) {
  deck.lines.allow(keyword, {"SOLVER", "STORAGE", "GLOBAL", "CYCMPC", "ALPHA", "EIGENSOLVER", "NORMALIZATION", "SIM",
                             "ACOUSTICCOUPLING", "DAMPINGPROJECTION", "NUMBERINTERVAL", "BIAS", "PROPERTYEVALUATION",
                             "RESIDUALMODES"});
  if (!deck.in_step) deck.fail(keyword.at, "*FREQUENCY outside of a *STEP");
  const std::string_view preload = deck.perturbation ? deck.preload : deck.nonlinear_preload;
  if (!preload.empty())
    deck.fail(preload,
              fmt::format("the *FREQUENCY step ({}) starts from the loads of this step; modes of a preloaded "
                          "structure are not computed, take the step out to have those of the structure at rest",
                          deck.lines.text().line_location(keyword.at)));
  deck.frequencies = true;
  const auto* fields = deck.lines.next_data();
  if (fields == nullptr) deck.fail(keyword.at, "*FREQUENCY: the number of modes is missing");
  if ((*fields)[0].empty()) {
    deck.notes.add("*FREQUENCY gives no number of modes");
    return;
  }
  deck.modes = static_cast<int>(deck.lines.text().integer((*fields)[0], "number of modes", 1, 1'000'000));
  for (size_t i = 1; i < fields->size() && i < 4; ++i) {
    if (deck.real_or_zero(*fields, i, "frequency") == 0) continue;
    deck.notes.add(i < 3
                       ? "*FREQUENCY: limits of frequency are left out; the lowest modes are computed"
                       : "*FREQUENCY: the fourth field is left out; CalculiX adds mass by it (selective mass scaling), "
                         "Abaqus computes the modes near it (shift), here the lowest modes are computed as they are");
  }
}

// The start of materials that depend on temperature; it loads nothing.
void read_initial_temperatures(Deck& deck, const Keyword& keyword) {
  if (keyword.has("FILE")) deck.temperature_file = keyword.at;
  while (const auto* fields = deck.lines.next_data()) {
    deck.initial_temperatures.push_back(
        {deck.reference(unquoted((*fields)[0])), deck.real_or_zero(*fields, 1, "initial temperature")});
  }
  deck.notes.add("initial temperatures count where a material depends on temperature");
}

void read_temperature(Deck& deck, const Keyword& keyword) {
  deck.step_temperature = keyword.at;
  deck.notes.add("*TEMPERATURE: loads have no effect on the modes of the structure at rest");
}

void read_initial_conditions(Deck& deck, const Keyword& keyword) {
  const std::string type = upper_key(deck.lines.need(keyword, "TYPE"));
  if (type == "TEMPERATURE") return read_initial_temperatures(deck, keyword);
  for (const std::string_view harmless : {"VELOCITY", "FIELD", "TOTALTEMPERATURE"}) {
    if (type == harmless) {
      deck.notes.add(fmt::format("{}, TYPE={} has no effect on the modes", keyword.at, type));
      return;
    }
  }
  deck.fail(keyword.at, fmt::format("initial conditions of TYPE={} change the stiffness and are not understood", type));
}

}  // namespace flexboom::abaqus
