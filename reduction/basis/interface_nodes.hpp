#pragma once

#include "fem/assembly/assembly.hpp"

#include <string>
#include <vector>

namespace flexboom {

/// Where a body shall be joined to others.
struct InterfacePlan {
  std::string name;                        // of the interface and its marker
  std::string node_set;                    // one node, or several that a reference node at their centre stands for
  std::string connection = "rigid";        // of several: "rigid" (RBE2) or "distributing" (RBE3)
  Components components = all_components;  // whose motion is kept
};

/// An interface and the node that carries it.
struct InterfaceNode {
  std::string name;
  int node = 0;
  Components components = all_components;
};

/// Gives every interface its node; the mesh gets reference nodes and connections, and must be assembled afterwards.
/// @throws InputError for a node set that does not exist, an unknown connection, a name given twice.
std::vector<InterfaceNode> place_interfaces(Mesh&, const std::vector<InterfacePlan>&);

/// Freedoms of the components that are kept, in order. Components that the node does not have, or that no mass can
/// reach, are taken out of `components`. @throws InputError when none is left.
std::vector<int> kept_freedoms(const DofMap&, InterfaceNode&);

/// "ux" .. "rz".
std::string motion_name(int component);
/// "Fx" .. "Mz".
std::string load_name(int component);
/// Component of a name of either kind. @throws InputError listing the names.
int component_of(const std::string& name);

}  // namespace flexboom
