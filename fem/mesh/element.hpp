#pragma once

#include "fem/mesh/mesh.hpp"

#include <Eigen/Core>

#include <functional>
#include <span>
#include <string_view>

namespace flexboom {

/// Receives one mass point: mass dm [kg], undeformed position u0 [m], and N (3 x element freedoms) with u(u0) = N q_e.
using MassPointVisitor =
    std::function<void(double dm, const Eigen::Vector3d& u0, const Eigen::Ref<const Eigen::Matrix3Xd>& N)>;

/// Receives one strain point: energy = 1/2 sum w (B q_e)^T D (B q_e), with D symmetric.
using StrainPointVisitor = std::function<void(double weight, const Eigen::MatrixXd& B, const Eigen::MatrixXd& D)>;

enum class Shape { line, hexahedron, tetrahedron, wedge };

/// A kind of element. Freedoms of an element: those of its nodes in node order (3: u, 6: u and theta), then its
/// internal freedoms. Mass points are the contract: M = sum dm N^T N, and every inertia integral is a sum over the same
/// points.
struct ElementType {
  std::string_view name;
  Shape shape;
  int node_freedoms;                 // per node: 3 or 6
  int (*node_count)(int order);      // of beams and "hex" the order counts
  std::span<const int> (*orders)();  // the orders that exist, for tests over the table
  int (*internal_freedoms)(const Mesh&, const Element&);
  Eigen::MatrixXd (*stiffness)(const Mesh&, const Element&);  // lower triangle
  Eigen::MatrixXd (*mass)(const Mesh&, const Element&);       // lower triangle, the sum over mass_points
  /// `extra` raises the quadrature by that many points per direction above the element's rule (for cross-checks).
  void (*mass_points)(const Mesh&, const Element&, int extra, const MassPointVisitor&);
  void (*strain_points)(const Mesh&, const Element&, const StrainPointVisitor&);
  /// Displacement and rotation rows (6 x freedoms) at a point of the reference element: (s, -, -) with s in [0, 1]
  /// along a beam; [-1, 1]^3 of a hexahedron; (r, s, t) of a tetrahedron with r, s, t >= 0 and r + s + t <= 1; (r, s,
  /// t) of a wedge with r, s >= 0, r + s <= 1 and t in [-1, 1]. Rotation of a solid is half the curl of its
  /// displacement.
  Eigen::Matrix<double, 6, Eigen::Dynamic> (*interpolation)(const Mesh&, const Element&, const Eigen::Vector3d&);
  /// Undeformed position of a point of the reference element.
  Eigen::Vector3d (*position)(const Mesh&, const Element&, const Eigen::Vector3d&);
  /// Strains at all strain points of each column of q (freedoms x k), scaled such that q_i^T K q_j [J] is the product
  /// of the rows i and j: k x strains.
  Eigen::MatrixXd (*energy_strains)(const Mesh&, const Element&, const Eigen::Ref<const Eigen::MatrixXd>& q);
  /// Adds the second-order work of prestress [N m], of each static displacement q0 (freedoms x loads) and each pair of
  /// columns of q (freedoms x k). The work is the integral of the stress of q0 times the second-order strain of the
  /// pair. Rows are the lower triangle of the k x k matrix column by column, columns the loads: k (k + 1) / 2 x loads.
  void (*add_prestress_work)(const Mesh&, const Element&, const Eigen::Ref<const Eigen::MatrixXd>& q0,
                             const Eigen::Ref<const Eigen::MatrixXd>& q, Eigen::Ref<Eigen::MatrixXd> work);
  /// @throws InputError on what makes the element impossible (zero length, inverted, property missing or in conflict).
  void (*validate)(const Mesh&, const Element&);
  /// The first of the element's own nodes at which the Jacobian is not positive, -1 if there is none. Such an element
  /// is bad and not impossible: nothing is integrated there.
  int (*inverted_node)(const Mesh&, const Element&);
};

/// The table of elements, one row each: beams, hexahedra of any order, and the shapes that decks carry.
std::span<const ElementType> element_types();

/// Row of a name. @throws InputError listing the names that exist.
int element_type(std::string_view name);

/// Row of an element.
const ElementType& type_of(const Element&);

/// Mass points of a rigid body on a node (6 points; exact mass, centre and inertia); N is 3 x 6.
void nodal_body_mass_points(const Mesh&, const NodalBody&, const MassPointVisitor&);

/// Nodes and weights of the n-point Gauss-Legendre rule on [-1, 1].
struct GaussRule {
  Eigen::VectorXd points;
  Eigen::VectorXd weights;
};
const GaussRule& gauss_rule(int n);

}  // namespace flexboom
