#pragma once

#include "fem/booms/solid_boom.hpp"
#include "reduction/invariants/geometric_stiffness.hpp"
#include "tests/fem/solid_testing.hpp"

#include <string>
#include <utility>

// Bodies and loads of the tests of geometric stiffness.
namespace flexboom::testing {

struct Model {
  Mesh mesh;
  Assembly assembly;
  Clamp clamp;
};

inline Model clamped(Mesh mesh) {
  Assembly assembly = assemble(mesh);
  Clamp clamp(node_set(mesh, "root"));
  return {std::move(mesh), std::move(assembly), std::move(clamp)};
}

/// Few elements of even length, no refinement.
inline SolidOptions coarse(const std::string& element, int order = 0) {
  SolidOptions options;
  options.element = element;
  options.order = order;
  options.grading = {.sectors = 1, .rings = 1, .long_elements = 8, .end_layers = 0, .corner_levels = 0};
  return options;
}

inline const Material soft{1e9, 0, 1000};  // nu = 0: the clamp does not stiffen

// A strip that bends easily along y.
inline constexpr double length = 1.2;
inline const Rectangle strip{0.01, 0.04};
inline const double EIz = aluminium.E * 0.04 * std::pow(0.01, 3) / 12;
inline const double GJ = aluminium.shear_modulus() * section_of(strip, aluminium.nu, {}).J;

inline Model beam(const SectionShape& section, double L, BeamTheory theory, int elements, int order) {
  return clamped(make_mesh(uniform_boom(section, L, theory, elements, order)));
}

}  // namespace flexboom::testing
