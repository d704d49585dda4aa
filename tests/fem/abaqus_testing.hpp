#pragma once

// Decks that the tests of Abaqus and CalculiX share.

#include "deck_testing.hpp"
#include "fem/formats/abaqus/read.hpp"

#include <optional>
#include <string>
#include <string_view>

namespace flexboom::testing {

inline MeshFile read(const std::string& text, std::optional<Dialect> dialect = {}) {
  ReadOptions options;
  options.dialect = dialect;
  return read_abaqus(text, "deck.inp", options);
}

inline bool says(const std::string& message, std::string_view part) { return message.find(part) != std::string::npos; }

// A cube of steel, 8000 kg, in every way of writing that both programs know.
inline const std::string cube_nodes = R"(** a comment
*Heading
 any text, *even this
*NODE , nset = Nall
1, 0, 0, 0
 2, 1., 0, 0.
3, 1.0E0, 1.D0, 0
4, , 1
5, 0, 0, 1
6, 1, 0, 1
7, 1, 1, 1
8, 0, 1, 1
*Element, type=c3d8i, ELSET=EALL
1, 1, 2, 3, 4, 5, 6, 7, 8
)";
inline const std::string steel = "*MATERIAL, NAME=Steel\n*ELASTIC\n210e9, 0.3\n*DENSITY\n8000\n";
inline const std::string cube = cube_nodes + steel + "*SOLIDSECTION, elset=eall, material=STEEL\n";

/// A cantilever of one element with that section, to which lines may be added.
inline std::string mast(const std::string& section) {
  return "*NODE\n1, 0, 0, 0\n2, 0, 0, 1\n3, 0, 0, 2\n*ELEMENT, TYPE=B32, ELSET=Mast\n5, 1, 2, 3\n" + steel +
         "*BEAM SECTION, ELSET=Mast, MATERIAL=Steel, " + section;
}

}  // namespace flexboom::testing
