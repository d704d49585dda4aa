#pragma once

#include "fem/mesh/element.hpp"

namespace flexboom {

/// Isoparametric solids of fixed order, named as their rows of element_types(); freedoms are u of each node. The
/// strains of the row "hex8" are those of Hex8.
enum class SolidKind { hex8, hex20, hex20_reduced, hex27, tet4, tet10, wedge6, wedge15 };

/// The functions of a row.
template <SolidKind kind>
struct Solid {
  static Eigen::MatrixXd stiffness(const Mesh&, const Element&);
  static Eigen::MatrixXd mass(const Mesh&, const Element&);
  static void mass_points(const Mesh&, const Element&, int extra, const MassPointVisitor&);
  static void strain_points(const Mesh&, const Element&, const StrainPointVisitor&);
  static Eigen::Matrix<double, 6, Eigen::Dynamic> interpolation(const Mesh&, const Element&, const Eigen::Vector3d&);
  static Eigen::Vector3d position(const Mesh&, const Element&, const Eigen::Vector3d&);
  static Eigen::MatrixXd energy_strains(const Mesh&, const Element&, const Eigen::Ref<const Eigen::MatrixXd>& q);
  static void add_prestress_work(const Mesh&, const Element&, const Eigen::Ref<const Eigen::MatrixXd>& q0,
                                 const Eigen::Ref<const Eigen::MatrixXd>& q, Eigen::Ref<Eigen::MatrixXd> work);
  /// @throws InputError unless the Jacobian is positive at all integration points.
  static void validate(const Mesh&, const Element&);
  static int inverted_node(const Mesh&, const Element&);
};

}  // namespace flexboom
