#pragma once

#include "reduction/exports/exports.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace flexboom {

/// The body as EXUDYN's `ObjectFFRFreducedOrderInterface.LoadFromFile` reads it (HDF5, file version 1), SI, BRF axes.
/// Mesh nodes are the points of the display, then six around each marker. On those six, `MarkerSuperElementRigid` with
/// equal weights moves and turns as the marker does; `markerNames` and `markerNodes` tell which.
/// @throws InputError when the name does not end in .hdf5 (EXUDYN goes by that), for a body without coordinates,
/// without points, or whose coordinates hold rigid motions.
void write_exudyn(const ReducedBody&, const ExportOptions&, const std::filesystem::path&);

/// What of this body EXUDYN does not take from the file, one sentence each.
std::vector<std::string> exudyn_cannot_hold(const ReducedBody&);

/// A body from such a file, ours or EXUDYN's own: invariants, Ke, De, markers, points and triangles.
/// @throws InputError naming the entry that is missing or of the wrong size.
ReducedBody read_exudyn(const std::filesystem::path&);
ReadBack exudyn_read_back(const ExportOptions&, const std::filesystem::path&);

}  // namespace flexboom
