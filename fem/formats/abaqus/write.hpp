#pragma once

#include "fem/mesh/mesh.hpp"

#include <filesystem>
#include <optional>

namespace flexboom {

/// Writes an input deck for CalculiX and Abaqus, with a *FREQUENCY step when a number of modes is given: nodes, solids
/// as C3D4 ... C3D20R (hex8 as C3D8I), Timoshenko beams as B31, sets, materials, sections, supports, point masses,
/// equations, rigid connections as *RIGID BODY. Numbers have 13 digits, since CalculiX reads 20 characters of each. Set
/// names lose characters that a deck cannot have; a name that begins with a digit gets "S_" in front.
/// @throws InputError naming what a deck cannot hold. Of elements these are hex27, "hex" of order 2 and above, tapered
/// or Euler-Bernoulli beams, and general sections. Of the rest they are bodies with inertia, distributing and partial
/// rigid connections, and missing materials.
void write_abaqus(const std::filesystem::path&, const Mesh&, std::optional<int> modes);

}  // namespace flexboom
