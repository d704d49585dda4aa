#include "fem/formats/abaqus/dialect.hpp"

#include "fem/formats/abaqus/keywords.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace flexboom::abaqus {
namespace {

using Fields = std::vector<std::string_view>;

struct Sign {
  std::string_view keyword, parameter;  // no parameter: the keyword itself
};

constexpr Sign of_calculix[] = {
    {"RIGIDBODY", "NSET"},
    {"RIGIDBODY", "ROTNODE"},
    {"FREQUENCY", "SOLVER"},
    {"FREQUENCY", "STORAGE"},
    {"FREQUENCY", "GLOBAL"},
    {"FREQUENCY", "CYCMPC"},
    {"FREQUENCY", "ALPHA"},
    {"STATIC", "SOLVER"},
    {"STEP", "INCF"},
    {"STEP", "THERMALNETWORK"},
    {"BEAMSECTION", "OFFSET1"},
    {"BEAMSECTION", "OFFSET2"},
    {"BEAMSECTION", "NODALTHICKNESS"},
    {"BEAMGENERALSECTION", "MATERIAL"},
    {"SOLIDSECTION", "NODALTHICKNESS"},
    {"BOUNDARY", "TIMEDELAY"},
    {"TIE", "MULTISTAGE"},
    {"ELEMENT", "PARENT"},
    {"NODEFILE", "OUTPUT"},
    {"ELFILE", "OUTPUT"},
    {"NODEOUTPUT", "OUTPUT"},
    {"ELEMENTOUTPUT", "OUTPUT"},
    {"NOANALYSIS", ""},
    {"VALUESATINFINITY", ""},
};

constexpr Sign of_abaqus[] = {
    {"PART", ""},
    {"INSTANCE", ""},
    {"ASSEMBLY", ""},
    {"PREPRINT", ""},
    {"MATRIXGENERATE", ""},
    {"MATRIXOUTPUT", ""},
    {"MODALOUTPUT", ""},
    {"ENERGYOUTPUT", ""},
    {"MONITOR", ""},
    {"SECTIONCONTROLS", ""},
    {"HOURGLASSSTIFFNESS", ""},
    {"CONTACTCONTROLS", ""},
    {"CONSTRAINTCONTROLS", ""},
    {"SOLVERCONTROLS", ""},
    {"OUTPUT", "FIELD"},
    {"OUTPUT", "HISTORY"},
    {"OUTPUT", "VARIABLE"},
    {"NODE", "SYSTEM"},
    {"NSET", "INTERNAL"},
    {"NSET", "INSTANCE"},
    {"NSET", "UNSORTED"},
    {"ELSET", "INTERNAL"},
    {"ELSET", "INSTANCE"},
    {"SURFACE", "INTERNAL"},
    {"ELASTIC", "MODULI"},
    {"ELASTIC", "DEPENDENCIES"},
    {"DENSITY", "DEPENDENCIES"},
    {"SOLIDSECTION", "CONTROLS"},
    {"SOLIDSECTION", "REFNODE"},
    {"SOLIDSECTION", "STACKDIRECTION"},
    {"BEAMSECTION", "TEMPERATURE"},
    {"BEAMSECTION", "POISSON"},
    {"BEAMSECTION", "ROTARYINERTIA"},
    {"BEAMSECTION", "LUMPED"},
    {"BEAMGENERALSECTION", "DENSITY"},
    {"BEAMGENERALSECTION", "POISSON"},
    {"BEAMGENERALSECTION", "ROTARYINERTIA"},
    {"RIGIDBODY", "TIENSET"},
    {"RIGIDBODY", "POSITION"},
    {"RIGIDBODY", "ISOTHERMAL"},
    {"DISTRIBUTING", "COUPLING"},
    {"DISTRIBUTING", "WEIGHTINGMETHOD"},
    {"TIE", "TYPE"},
    {"TIE", "NOROTATION"},
    {"TIE", "CONSTRAINTRATIO"},
    {"BOUNDARY", "TYPE"},
    {"STEP", "NAME"},
    {"STEP", "UNSYMM"},
    {"STEP", "EXTRAPOLATION"},
    {"STEP", "CONVERTSDI"},
    {"FREQUENCY", "EIGENSOLVER"},
    {"FREQUENCY", "NORMALIZATION"},
    {"FREQUENCY", "SIM"},
    {"FREQUENCY", "ACOUSTICCOUPLING"},
    {"FREQUENCY", "DAMPINGPROJECTION"},
    {"FREQUENCY", "NUMBERINTERVAL"},
    {"FREQUENCY", "BIAS"},
    {"FREQUENCY", "PROPERTYEVALUATION"},
    {"FREQUENCY", "RESIDUALMODES"},
};

struct NamedSupport {
  std::string_view name, components;
};
constexpr std::array<NamedSupport, 8> named_supports{{
    {"ENCASTRE", "123456"},
    {"PINNED", "123"},
    {"XSYMM", "156"},
    {"YSYMM", "246"},
    {"ZSYMM", "345"},
    {"XASYMM", "234"},
    {"YASYMM", "135"},
    {"ZASYMM", "126"},
}};

class Scan {
 public:
  Scan(std::string_view text, const std::string& file) : lines_(text, file) { lines_.comments = &comments_; }

  DialectSigns result() {
    while (const auto keyword = lines_.next_keyword()) read(*keyword);
    for (const std::string_view comment : comments_) read_words(comment);
    return std::move(signs_);
  }

 private:
  void add(Dialect dialect, std::string_view at) {
    std::string& sign = dialect == Dialect::calculix ? signs_.calculix : signs_.abaqus;
    if (sign.empty()) sign = fmt::format("{}: {}", lines_.text().line_location(at), flexboom::quoted(at));
  }

  void read(const Keyword& keyword) {
    for (const Sign& sign : of_calculix) add_if(keyword, sign, Dialect::calculix);
    for (const Sign& sign : of_abaqus) add_if(keyword, sign, Dialect::abaqus);
    if (keyword.name == "ELEMENT") {
      const std::string type = upper_key(keyword.find("TYPE").value_or(""));
      if (type == "B31R" || type == "B32R") add(Dialect::calculix, *keyword.find("TYPE"));
    } else if (keyword.name == "HEADING") {
      while (lines_.next_data() != nullptr) read_words(lines_.line());
    } else if (keyword.name == "BOUNDARY") {
      read_data(Dialect::abaqus, [](const Fields& f) { return f.size() > 1 && named_support(f[1]); });
    } else if (keyword.name == "KINEMATIC") {
      read_data(Dialect::abaqus, [](const Fields& f) { return to_integer(f.back()).value_or(0) > 3; });
    } else if (keyword.name == "MPC") {
      read_data(Dialect::abaqus, [](const Fields& f) {
        const std::string type = upper_key(f[0]);
        return type == "TIE" || type == "PIN" || type == "LINK";
      });
    } else if (keyword.name == "BEAMSECTION" && upper_key(keyword.find("SECTION").value_or("")) == "CIRC") {
      const Fields* fields = lines_.next_data();
      if (fields != nullptr && fields->size() == 2) add(Dialect::calculix, lines_.line());
    }
  }

  void add_if(const Keyword& keyword, const Sign& sign, Dialect dialect) {
    if (keyword.name != sign.keyword) return;
    if (sign.parameter.empty()) return add(dialect, keyword.at);
    for (const Keyword::Parameter& parameter : keyword.parameters) {
      if (parameter.key == sign.parameter) add(dialect, parameter.at);
    }
  }

  template <class Condition>
  void read_data(Dialect dialect, const Condition& tells) {
    while (const Fields* fields = lines_.next_data()) {
      if (!fields->empty() && tells(*fields)) add(dialect, lines_.line());
    }
  }

  // FreeCAD and PrePoMax drive CalculiX alone.
  void read_words(std::string_view text) {
    const std::string words = upper_key(text);
    for (const std::string_view name : {"FREECAD", "PREPOMAX", "WRITTENBYFLEXBOOM"}) {
      if (words.find(name) != std::string::npos) add(Dialect::calculix, text);
    }
    if (words.find("GENERATEDBY:ABAQUS") != std::string::npos) add(Dialect::abaqus, text);
  }

  Lines lines_;
  std::vector<std::string_view> comments_;
  DialectSigns signs_;
};

}  // namespace

DialectSigns dialect_signs(std::string_view text, const std::string& file) { return Scan(text, file).result(); }

std::optional<std::string_view> named_support(std::string_view name) {
  const auto* found = std::ranges::find(named_supports, upper_key(name), &NamedSupport::name);
  if (found == named_supports.end()) return {};
  return found->components;
}

}  // namespace flexboom::abaqus
