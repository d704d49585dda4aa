#pragma once

#include "fem/booms/boom.hpp"

#include <limits>
#include <string>

namespace flexboom {

/// What beams leave out of a boom, by estimates that were measured against its solid (fem/README.md, "Limits of
/// beams"). A section that is given by its constants has none.
struct BeamLimits {
  /// Where a clamp holds all of the root's face, the solid's lowest frequencies are so much higher, relative to those
  /// of beams.
  double bending_y = 0, bending_z = 0, torsion = 0;
  /// From here on sections vibrate in themselves: walls, or the width of a strip [Hz].
  double section_frequency = std::numeric_limits<double>::infinity();
};

BeamLimits beam_limits(const BeamGeometry&);

/// What of it counts, in words; empty: nothing. `in_plane`: the boom bends along y alone.
std::string beam_doubt(const BeamGeometry&, bool in_plane = false);

/// Empty where none of these frequencies [Hz] is beyond that of a section.
std::string section_doubt(const BeamGeometry&, double highest_frequency);

}  // namespace flexboom
