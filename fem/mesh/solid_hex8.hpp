#pragma once

#include "fem/mesh/element.hpp"

namespace flexboom {

/// Stiffness of hexahedra of eight nodes with enhanced strains, condensed in the element: gradients of the incompatible
/// displacements 1 - xi^2, 1 - eta^2, 1 - zeta^2 (Taylor, Beresford, Wilson, Int. J. Numer. Meth. Eng. 10 (1976) 1211)
/// and the volumetric strains xi eta, eta zeta, zeta xi (Simo, Armero, Taylor, Comput. Meth. Appl. Mech. Eng. 110
/// (1993) 359: Q1/E12). Neither bending nor nearly incompressible material locks them, and they pass the patch test.
///
/// `full` takes 2 x 2 x 2 points of the isoparametric map. `reduced` takes the mean gradient of the element and, for
/// its hourglass motions alone, the map of its centre (Flanagan, Belytschko, Int. J. Numer. Meth. Eng. 17 (1981) 679;
/// Puso, ibid. 49 (2000) 1029): on a parallelepiped both are the same.
enum class Hex8Strain { full, reduced };

/// The functions of a row that concern strains; all others are those of Solid<SolidKind::hex8>.
template <Hex8Strain strain>
struct Hex8 {
  static Eigen::MatrixXd stiffness(const Mesh&, const Element&);
  static void strain_points(const Mesh&, const Element&, const StrainPointVisitor&);
  static Eigen::MatrixXd energy_strains(const Mesh&, const Element&, const Eigen::Ref<const Eigen::MatrixXd>& q);
  static void add_prestress_work(const Mesh&, const Element&, const Eigen::Ref<const Eigen::MatrixXd>& q0,
                                 const Eigen::Ref<const Eigen::MatrixXd>& q, Eigen::Ref<Eigen::MatrixXd> work);
};

}  // namespace flexboom
