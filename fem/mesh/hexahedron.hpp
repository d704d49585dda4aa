#pragma once

#include "fem/mesh/element.hpp"

namespace flexboom {

/// Isoparametric hexahedron of order p = 1..8 on (p + 1)^3 Gauss-Lobatto-Legendre nodes, index i + (p + 1) (j + (p + 1)
/// k): the row "hex". Matrices by sum factorisation (Orszag, J. Comput. Phys. 37 (1980) 70), the last contraction as
/// one matrix product: some p^7 operations.
struct Hexahedron {
  static int node_count(int order) { return (order + 1) * (order + 1) * (order + 1); }
  static std::span<const int> orders();

  static Eigen::MatrixXd stiffness(const Mesh&, const Element&);
  static Eigen::MatrixXd mass(const Mesh&, const Element&);
  /// Exact for M and inertia of the isoparametric map: degree 5 p - 1 in each coordinate.
  static void mass_points(const Mesh&, const Element&, int extra, const MassPointVisitor&);
  static void strain_points(const Mesh&, const Element&, const StrainPointVisitor&);
  static Eigen::Matrix<double, 6, Eigen::Dynamic> interpolation(const Mesh&, const Element&, const Eigen::Vector3d&);
  static Eigen::Vector3d position(const Mesh&, const Element&, const Eigen::Vector3d&);
  static Eigen::MatrixXd energy_strains(const Mesh&, const Element&, const Eigen::Ref<const Eigen::MatrixXd>& q);
  static void add_prestress_work(const Mesh&, const Element&, const Eigen::Ref<const Eigen::MatrixXd>& q0,
                                 const Eigen::Ref<const Eigen::MatrixXd>& q, Eigen::Ref<Eigen::MatrixXd> work);
  /// @throws InputError for an order that does not exist and a Jacobian that is not positive at all integration points.
  static void validate(const Mesh&, const Element&);
  static int inverted_node(const Mesh&, const Element&);
};

}  // namespace flexboom
