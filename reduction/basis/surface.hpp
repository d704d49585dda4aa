#pragma once

#include "fem/mesh/mesh.hpp"

#include <array>
#include <vector>

namespace flexboom {

/// The outside of the solids of a mesh in flat triangles over all nodes that lie there.
struct Surface {
  std::vector<int> nodes;                     // of the mesh, ascending
  std::vector<std::array<int, 3>> triangles;  // into `nodes`; outward normal by the right hand
};

/// Faces that one solid element has alone.
Surface surface_of(const Mesh&);

}  // namespace flexboom
