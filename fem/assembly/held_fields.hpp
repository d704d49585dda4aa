#pragma once

#include "fem/assembly/assembly.hpp"

#include <vector>

namespace flexboom {

/// Internal freedoms of beams that belong to a field (extension, torsion, bending in a plane) which is held at every
/// node of their structure. Such a model is planar, or one of part of the motions: the field is meant to be zero
/// everywhere, not at the nodes alone. @param held one flag per freedom.
std::vector<int> internal_freedoms_of_held_fields(const Mesh&, const DofMap&, const std::vector<char>& held);

}  // namespace flexboom
