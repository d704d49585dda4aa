#pragma once

#include "fem/mesh/mesh.hpp"

#include <string>
#include <vector>

namespace flexboom {

/// Ascending, each once.
std::vector<int> sorted_unique(std::vector<int>);

/// Leaves out of the mesh, and of its node sets, every node that no element, body, support, connection or equation
/// uses. Sets that are then empty go as well. `notes` get how many.
void drop_unused_nodes(Mesh&, std::vector<std::string>& notes);

/// Labels for a file: those of the mesh if there are `count`, positive and different, else 1, 2, 3, ...
std::vector<long> file_labels(const std::vector<long>& labels, size_t count);

/// Exchanges the two triangles of wedges that are inside out because their file counts them the other way round (VTK
/// and others disagree). Returns their number.
int turn_wedges(Mesh&);

/// Name of a node set as the mesh spells it. Upper and lower case are alike where one set alone is meant; a name that
/// is none comes back as it is.
std::string node_set_name(const Mesh&, const std::string& name);

}  // namespace flexboom
