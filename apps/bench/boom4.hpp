#pragma once

#include "fem/booms/solid_boom.hpp"

#include <array>
#include <string>

namespace flexboom {

/// Boom 4 of SPORT (Mantovani et al. 2020, Table 1): solid round bar of aluminium. No elements: as many as are usual.
inline BeamGeometry boom4(int elements = 0, int order = 8) {
  BeamGeometry boom;
  boom.segments = {{RoundBar{0.01}, RoundBar{0.01}, 0.302, Material{67e9, 0.33, 2840}, elements}};
  boom.order = order;
  return boom;
}

/// A uniform mesh of solids: sectors and rings of the section, elements along the boom.
struct Rung {
  int sectors, rings, along;
};
/// Of elements with 20 nodes, each with about three times the unknowns of the one before.
inline constexpr std::array<Rung, 5> hex20_rungs = {{{1, 1, 38}, {2, 1, 76}, {3, 2, 76}, {4, 2, 100}, {6, 3, 84}}};

inline Mesh uniform_mesh(const std::string& element, const Rung& rung) {
  SolidOptions options;
  options.element = element;
  options.grading.sectors = rung.sectors, options.grading.rings = rung.rings;
  options.grading.long_elements = rung.along;
  options.grading.end_layers = options.grading.corner_levels = 0;
  return make_solid_mesh(boom4(), options);
}

}  // namespace flexboom
