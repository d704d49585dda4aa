#pragma once

#include "fem/assembly/assembly.hpp"
#include "fem/booms/boom.hpp"

namespace flexboom::test {

struct Boom {
  Mesh mesh;
  Assembly assembly;
};

/// Boom 4 of SPORT: solid round bar, L = 302 mm, d = 10 mm (boom_properties.json).
inline BeamGeometry boom4(BeamTheory theory, bool rotary_inertia, int elements = 4, int order = 8) {
  BeamGeometry g;
  g.segments.push_back({RoundBar{0.01}, RoundBar{0.01}, 0.302, Material{67e9, 0.33, 2840}, elements});
  g.theory = theory;
  g.rotary_inertia = rotary_inertia;
  g.order = order;
  return g;
}

inline Boom make_boom(const BeamGeometry& geometry) {
  Mesh mesh = make_mesh(geometry);
  Assembly assembly = assemble(mesh);
  return {std::move(mesh), std::move(assembly)};
}

}  // namespace flexboom::test
