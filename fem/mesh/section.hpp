#pragma once

#include <string>
#include <variant>

namespace flexboom {

/// Isotropic elastic material.
struct Material {
  double E = 0;    // Young's modulus [Pa]
  double nu = 0;   // Poisson's ratio [-]; of a beam E / (2 G) - 1, which may be any its fibres give
  double rho = 0;  // density [kg/m^3]

  double shear_modulus() const { return E / (2 * (1 + nu)); }

  /// @throws InputError unless E > 0, -1 < nu < 0.5, rho >= 0, all finite.
  void validate() const;
  /// @throws InputError unless the same holds but nu < 0.5: of a beam with its own G.
  void validate_of_beam() const;
};

/// Cross-section constants about the centroid, in principal axes y, z of the beam [m^2, m^4, -].
struct Section {
  double A = 0;
  double Iy = 0;       // integral of z^2: bending about y, deflection along z
  double Iz = 0;       // integral of y^2: bending about z, deflection along y
  double J = 0;        // St-Venant torsion constant
  double kappa_y = 1;  // shear coefficient for a shear force along y
  double kappa_z = 1;  // shear coefficient for a shear force along z
};

// Shapes of cross-sections; `height` is along y, `width` along z [m].
struct RoundBar {
  double diameter = 0;
};
struct Tube {
  double diameter = 0;  // outer
  double thickness = 0;
};
struct Rectangle {
  double height = 0;
  double width = 0;
};
struct RectangularTube {
  double height = 0;
  double width = 0;
  double thickness = 0;
};
using GeneralSection = Section;

using SectionShape = std::variant<RoundBar, Tube, Rectangle, RectangularTube, GeneralSection>;

/// Rule for the shear coefficient: "cowper" (Cowper 1966), "nu-squared" (Kaneko 1975, Hutchinson 2001) or a number.
struct ShearRule {
  std::string name = "cowper";
  double value = 0;  // used when name == "value"
};

/// Constants of a shape. A GeneralSection keeps its own coefficients.
/// @throws InputError for non-positive or inconsistent dimensions, and where no formula of that name is known.
Section section_of(const SectionShape&, double nu, const ShearRule&);

/// The shape a fraction s in [0, 1] of the way from a to b, each dimension linear.
/// @throws InputError unless both are of one kind.
SectionShape interpolate(const SectionShape& a, const SectionShape& b, double s);

}  // namespace flexboom
