#pragma once

#include "fem/assembly/assembly.hpp"
#include "fem/assembly/constraints.hpp"
#include "reduction/basis/static_shapes.hpp"
#include "reduction/body/reduced_body.hpp"

#include <array>
#include <string>
#include <vector>

namespace flexboom {

struct GeometricOptions {
  /// Node sets where forces and torques act: one node, or several whose weighted mean motion carries the load (as a
  /// distributing connection with equal weights).
  std::vector<std::string> markers;
  int threads = 1;
  /// Of K over the unknowns that the clamp leaves, nothing held beside it, where the caller has it: factorising anew is
  /// most of the work.
  const StaticSolver* statics = nullptr;
  /// Of the shapes, Phi^T K Phi, where the caller has it: with `statics` every load is then solved once and not twice.
  const Eigen::MatrixXd* Ke = nullptr;
};

/// Geometric stiffness of shapes Phi (freedoms x n) from the prestress of unit loads. Linear statics of the body held
/// by `clamp` give the stress. The stiffness is the second-order work of that stress on the shapes (README). Loads are
/// dead: they keep their direction in the BRF, and a torque does work on the linear rotation S_theta q.
///
/// A body that nothing holds (mean axes) is in inertia relief: each load is balanced by the rigid acceleration it
/// causes. So the loads of the frame's own accelerations are zero.
///
/// A marker of one node without rotations carries no torque: its `torque` is empty.
/// @throws InputError when K was released or Phi is not over the freedoms of the mesh. Also when a marker is no node
/// set or its nodes lie on a line, or the clamp leaves some rigid motions and not all six.
/// @throws NumericalError when K is not positive definite.
GeometricStiffness geometric_stiffness(const Mesh&, const Assembly&, const Clamp&, const Eigen::MatrixXd& Phi,
                                       const GeometricOptions& = {});

/// Geometric stiffness of a motion of the BRF (n x n): angular velocity [rad/s], acceleration of its origin [m/s^2]
/// (gravity subtracted), angular acceleration [rad/s^2], all in BRF axes. Zero where Kg was not computed.
Eigen::MatrixXd motion_stiffness(const ReducedBody&, const Eigen::Vector3d& omega,
                                 const Eigen::Vector3d& acceleration = Eigen::Vector3d::Zero(),
                                 const Eigen::Vector3d& angular_acceleration = Eigen::Vector3d::Zero());

/// The same of a force [N] and a torque [N m] on a marker, BRF axes.
Eigen::MatrixXd marker_stiffness(const ReducedBody&, const std::string& marker, const Eigen::Vector3d& force,
                                 const Eigen::Vector3d& torque);

/// A geometric stiffness against the body's own: its least and its largest eigenvalue in the metric of Ke. At -1 the
/// body has no stiffness left.
std::array<double, 2> relative_stiffness(const ReducedBody&, const Eigen::MatrixXd& Kg);

}  // namespace flexboom
