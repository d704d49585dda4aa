#include "fem/formats/nastran/read.hpp"

#include "fem/formats/nastran/bulk.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace flexboom {
namespace nastran {
namespace {

// Of model parameters those for output only.
void read_mdlprm(Bulk& bulk, const Card& card) {
  const std::string name = upper_key(card.field(0));
  if (name != "HDF5") bulk.fail(card.at, fmt::format("MDLPRM,{} is not understood and may change the modes", name));
}

struct Row {
  std::string_view name;
  Read read;
};

// Cards that are understood.
constexpr std::array<Row, 42> table{{
    {"GRID", read_grid},
    {"GRDSET", read_grdset},
    {"CORD1R", read_system},
    {"CORD1C", read_system},
    {"CORD1S", read_system},
    {"CORD2R", read_system},
    {"CORD2C", read_system},
    {"CORD2S", read_system},
    {"CTETRA", read_solid},
    {"CPENTA", read_solid},
    {"CHEXA", read_solid},
    {"CBAR", read_beam},
    {"CBEAM", read_beam},
    {"PSOLID", read_psolid},
    {"PBAR", read_pbar},
    {"PBARL", read_pbarl},
    {"PBEAM", read_pbeam},
    {"PBEAML", read_pbarl},
    {"MAT1", read_mat1},
    {"MAT2", read_other_material},
    {"MAT3", read_other_material},
    {"MAT8", read_other_material},
    {"MAT9", read_other_material},
    {"MAT10", read_other_material},
    {"MAT11", read_other_material},
    {"MATHE", read_other_material},
    {"CONM2", read_conm2},
    {"RBE2", read_rbe2},
    {"RBE3", read_rbe3},
    {"RBAR", read_rbar},
    {"SPC", read_spc},
    {"SPC1", read_spc1},
    {"SPCADD", read_sum},
    {"MPCADD", read_sum},
    {"MPC", read_mpc},
    {"EIGRL", read_eigrl},
    {"EIGR", read_eigr},
    {"PARAM", read_param},
    {"PLOTEL", [](Bulk&, const Card&) {}},
    {"SET1", [](Bulk&, const Card&) {}},
    {"CBARAO", [](Bulk&, const Card&) {}},
    {"MDLPRM", read_mdlprm},
}};

// Loads, damping, output, and properties of elements that would be refused themselves.
constexpr std::string_view without_effect[] = {
    "ECHOON",  "ECHOOFF", "FORCE",   "FORCE1",  "FORCE2",  "MOMENT",  "MOMENT1", "MOMENT2", "PLOAD",   "PLOAD1",
    "PLOAD2",  "PLOAD4",  "GRAV",    "LOAD",    "LSEQ",    "RFORCE",  "ACCEL",   "ACCEL1",  "TEMP",    "TEMPD",
    "TEMPRB",  "DEFORM",  "SPCD",    "DLOAD",   "RLOAD1",  "RLOAD2",  "TLOAD1",  "TLOAD2",  "DAREA",   "DELAY",
    "DPHASE",  "TABLED1", "TABLED2", "TABLED3", "TABLED4", "TABLEM1", "TABDMP1", "TABRND1", "FREQ",    "FREQ1",
    "FREQ2",   "FREQ3",   "FREQ4",   "TSTEP",   "EIGB",    "EIGC",    "EIGP",    "NLPARM",  "DESVAR",  "DVPREL1",
    "DCONSTR", "DRESP1",  "DOPTPRM", "SUPORT",  "SUPORT1", "PSHELL",  "PROD",    "PCOMP",   "PELAS",   "PBUSH",
    "PGAP",    "PDAMP",   "PSHEAR",  "PVISC",   "PMASS",   "PTUBE",   "PWELD",   "PFAST",   "SET3",    "BOUTPUT",
    "DTI",     "TICD",    "TIC",     "RANDPS",  "MONPNT1", "MONPNT3", "PLOTEL3", "PLOTEL4", "USET",    "USET1",
    "TSTEPNL", "NLSTEP",  "NLPCI",   "RANDT1",  "DMI",     "AERO",    "AEROS",   "AESURF",  "AESTAT",  "AELIST",
    "AELINK",  "AEFACT",  "CAERO1",  "CAERO2",  "PAERO1",  "PAERO2",  "SPLINE1", "SPLINE2", "SPLINE4", "SPLINE5",
    "MKAERO1", "MKAERO2", "FLFACT",  "FLUTTER", "TRIM",    "GUST",    "DIVERG",
};

struct Refusal {
  std::string_view name, reason;
};

constexpr Refusal refusals[] = {
    {"CQUAD4", "shells are out of scope; there are solids and beams"},
    {"CQUAD8", "shells are out of scope; there are solids and beams"},
    {"CQUADR", "shells are out of scope; there are solids and beams"},
    {"CTRIA3", "shells are out of scope; there are solids and beams"},
    {"CTRIA6", "shells are out of scope; there are solids and beams"},
    {"CTRIAR", "shells are out of scope; there are solids and beams"},
    {"CROD", "rods are not understood; use CBAR"},
    {"CONROD", "rods are not understood; use CBAR"},
    {"CTUBE", "rods are not understood; use CBAR"},
    {"CPYRAM", "pyramids are not understood; there are CTETRA, CPENTA, CHEXA"},
    {"CELAS1", "springs are not understood"},
    {"CELAS2", "springs are not understood"},
    {"CBUSH", "springs are not understood"},
    {"CONM1", "mass matrices are not understood; use CONM2"},
    {"BAROR", "defaults of CBAR are not understood; write them out"},
    {"BEAMOR", "defaults of CBEAM are not understood; write them out"},
    {"ASET", "reductions (ASET, OMIT) change the modes and are not made"},
    {"ASET1", "reductions (ASET, OMIT) change the modes and are not made"},
    {"OMIT", "reductions (ASET, OMIT) change the modes and are not made"},
    {"OMIT1", "reductions (ASET, OMIT) change the modes and are not made"},
};

void read_card(Bulk& bulk, const Card& card) {
  const auto* const row = std::ranges::find(table, card.name, &Row::name);
  if (row != table.end()) return row->read(bulk, card);
  if (std::ranges::count(without_effect, card.name) > 0) {
    bulk.notes.add(fmt::format("{} has no effect on the modes", card.name));
    return;
  }
  for (const Refusal& refusal : refusals) {
    if (refusal.name == card.name) bulk.fail(card.at, fmt::format("{}: {}", card.name, refusal.reason));
  }
  bulk.fail(card.at, fmt::format("card {} is not understood and may change the modes", flexboom::quoted(card.name)));
}

}  // namespace
}  // namespace nastran

MeshFile read_nastran(std::string_view text, const std::string& file, const ReadOptions& options) {
  nastran::Bulk bulk(text, file, options.material);
  while (const nastran::Card* card = bulk.cards.next()) nastran::read_card(bulk, *card);
  if (bulk.cards.case_control().other_spc) bulk.notes.add("subcases select different SPC sets; the first is used");
  return nastran::mesh_of(bulk);
}

}  // namespace flexboom
