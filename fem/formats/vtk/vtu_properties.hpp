#pragma once

#include "fem/formats/vtk/vtu_arrays.hpp"
#include "fem/mesh/mesh.hpp"

#include <vector>

namespace flexboom {

/// Properties of solids and beams, and orders, from the fields that write_vtu made; element e is cell cell_of[e] of
/// `cells`. @throws InputError with file:line:column.
void read_vtu_properties(const VtuArrays&, const std::vector<long>& cell_of, long cells, Mesh&);

/// Supports, bodies and labels, where the file has them.
void read_vtu_node_fields(const VtuArrays&, const std::vector<long>& cell_of, long cells, Mesh&);

}  // namespace flexboom
