#pragma once

#include "fem/mesh/mesh.hpp"

#include <vector>

namespace flexboom {

/// Which nodes elements, connections and equations use, one flag each.
std::vector<char> nodes_in_use(const Mesh&);

/// Which nodes have rotations: those of beams and the references of connections.
std::vector<char> nodes_that_rotate(const Mesh&);

}  // namespace flexboom
