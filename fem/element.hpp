#pragma once

#include "fem/mesh.hpp"

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

/// A kind of element. Freedoms of an element: 6 per node (u, theta) in node order, then its internal freedoms.
/// Mass points are the contract: M = sum dm N^T N, and every inertia integral is a sum over the same points.
struct ElementType {
  std::string_view name;
  int node_count;
  int (*internal_freedoms)(const Mesh&, const Element&);
  Eigen::MatrixXd (*stiffness)(const Mesh&, const Element&);
  /// `extra` raises the quadrature by that many points per direction above the exact rule (for cross-checks).
  void (*mass_points)(const Mesh&, const Element&, int extra, const MassPointVisitor&);
  void (*strain_points)(const Mesh&, const Element&, const StrainPointVisitor&);
  /// Displacement and rotation rows (6 x freedoms) at parameter s in [0, 1] along the element.
  Eigen::Matrix<double, 6, Eigen::Dynamic> (*interpolation)(const Mesh&, const Element&, double s);
};

/// The table of elements: "beam-euler-bernoulli", "beam-timoshenko".
std::span<const ElementType> element_types();

/// Row of a name. @throws InputError listing the names that exist.
int element_type(std::string_view name);

/// Mass points of a rigid body on a node (6 points; exact mass, centre and inertia); N is 3 x 6.
void nodal_body_mass_points(const Mesh&, const NodalBody&, const MassPointVisitor&);

/// Nodes and weights of the n-point Gauss-Legendre rule on [-1, 1].
struct GaussRule {
  Eigen::VectorXd points;
  Eigen::VectorXd weights;
};
const GaussRule& gauss_rule(int n);

}  // namespace flexboom
