#pragma once

#include "fem/formats/common/mesh_file.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom {

/// A kind of element of Gmsh, by its number.
struct GmshKind {
  int type = 0;
  int dimension = 0;
  int nodes = 0;
  std::string_view row;         // of our table; empty: not a solid, or one that we do not have
  int order = 1;                // Element::order
  std::vector<int> node_order;  // node k of Gmsh is our node node_order[k]; empty: alike
};

/// Kind of a number, nothing for one that is neither read nor carries sets.
const GmshKind* gmsh_kind(int type);

/// Kind that holds an element, nothing when Gmsh has none.
const GmshKind* gmsh_kind_of(const Element&);

/// What a number that gmsh_kind does not know is called.
std::string gmsh_kind_name(int type);

/// A .msh file as it stands: all elements of any dimension.
struct GmshData {
  struct Group {
    int dimension = 0;
    int tag = 0;
    std::string name;
  };
  /// Elements of one kind, one entity and the same physical groups.
  struct Block {
    const GmshKind* kind = nullptr;
    int entity = 0;
    std::vector<int> physical;  // tags of groups
    std::vector<long> labels;   // one per element
    std::vector<int> nodes;     // kind->nodes per element, indices
  };
  std::vector<Group> names;
  std::vector<long> node_labels;
  std::vector<double> coordinates;  // three per node
  std::vector<Block> blocks;
  std::vector<std::string> notes;
};

/// Sections of a .msh file of version 2.2 or 4.1. @throws InputError with file:line:column or file: byte.
GmshData parse_gmsh(std::string_view text, const std::string& file);

/// Elements and sets from what a .msh file holds. @throws InputError when there is no volume element.
MeshFile mesh_of(const GmshData&, const std::string& file);

}  // namespace flexboom
