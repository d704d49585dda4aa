#pragma once

#include "fem/assembly/assembly.hpp"
#include "reduction/body/reduced_body.hpp"

#include <array>
#include <string>
#include <utility>
#include <vector>

// Unit loads of a body for its geometric stiffness: what they are, and their own second-order work.
namespace flexboom {

constexpr Eigen::Index inertial_loads = 12;  // 6 spin products, 3 accelerations, 3 angular accelerations

// The spin products in the order of GeometricStiffness::spin.
constexpr std::array<std::pair<int, int>, 6> spin_products = {{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}}};

/// Forces per mass b = b0 + A u0, one column per load: b0, then A column by column.
using LinearFields = Eigen::Matrix<double, 12, Eigen::Dynamic>;

/// Inertial forces per unit of spin products, accelerations and angular accelerations: -w x (w x u0), -a, -alpha x u0.
LinearFields inertial_fields();

/// Their nodal loads sum dm N^T b over the mass points, freedoms x 12. Solids follow a linear field exactly, so theirs
/// are M B with its nodal values B; beams and nodal bodies add dm N^T (b - N B).
Eigen::MatrixXd inertial_forces(const Mesh&, const Assembly&);

/// Unit forces and torques on a node set, freedoms x 6; x 3 of a lone node without rotations.
/// @throws InputError unless the set exists and its nodes do not lie on a line.
Eigen::MatrixXd marker_forces(const Mesh&, const DofMap&, const std::string& name);

/// Sections of beams and bodies on nodes turn, and S has the linear part of that: theta x r. Adds what their inertial
/// forces lack, their work on theta x (theta x r) / 2. work: pairs of shapes x columns of `fields`.
void add_inertia_of_arms(Eigen::MatrixXd& work, const Mesh&, const DofMap&, const LinearFields& fields,
                         const Eigen::MatrixXd& Phi);

/// The same of rigid connections, whose arms carry the forces of their nodes (loads F, static displacements U0).
void add_rigid_connections(Eigen::MatrixXd& work, const Mesh&, const Assembly&, const Eigen::MatrixXd& F,
                           const Eigen::MatrixXd& U0, const Eigen::MatrixXd& Phi);

}  // namespace flexboom
