#pragma once

#include "fem/mesh/element.hpp"

/// Straight beam with two nodes and order p = 1..12, Euler-Bernoulli or Timoshenko as its BeamProperty says (README).
/// Freedoms: (u, theta) of both nodes in mesh axes, then internal amplitudes [m; torsion rad] in element axes:
/// axial (p), torsion (p), deflection along y, deflection along z (p - 1 each, Timoshenko p + 2 more).
namespace flexboom::beam {

int internal_freedoms(const Mesh&, const Element&);

/// Consistent strain points: rows of B are the axial strain, (Timoshenko: shear strains y, z,) twist [1/m], curvatures
/// about y, z [1/m].
void strain_points(const Mesh&, const Element&, const StrainPointVisitor&);

/// As ElementType has it.
Eigen::MatrixXd energy_strains(const Mesh&, const Element&, const Eigen::Ref<const Eigen::MatrixXd>& q);

/// Four points in every section that carry its A, Iy, Iz exactly, or one on the axis without rotary inertia.
void mass_points(const Mesh&, const Element&, int extra, const MassPointVisitor&);

/// Kg of the stress resultants of q0 (README): N (v'^2 + w'^2 + Ip/A twist^2), - M . (theta x theta'), and shear forces
/// with torsion. Terms that change Ke by a factor of the order of the prestrain are left out.
void add_prestress_work(const Mesh&, const Element&, const Eigen::Ref<const Eigen::MatrixXd>& q0,
                        const Eigen::Ref<const Eigen::MatrixXd>& q, Eigen::Ref<Eigen::MatrixXd> work);

/// Displacement [m] and rotation [rad] rows in mesh axes at (s, -, -), s in [0, 1].
Eigen::Matrix<double, 6, Eigen::Dynamic> interpolation(const Mesh&, const Element&, const Eigen::Vector3d& at);

/// Point of the axis at (s, -, -).
Eigen::Vector3d position(const Mesh&, const Element&, const Eigen::Vector3d& at);

/// @throws InputError for a zero length, a theory that is not the table entry's, or a section axis along the beam. Also
/// for a line mass that does not run along an axis of the mesh.
void validate(const Mesh&, const Element&);

}  // namespace flexboom::beam
