#pragma once

#include "reduction/body/reduced_body.hpp"

#include <vector>

namespace flexboom {

/// A body whose points move by S q + u2(q) (README, "Geometric stiffness in the equations"). u2 is quadratic in q. It
/// is the displacement that the geometric stiffness stands for: a load f does the work -1/2 q^T (sum f Kg) q on it. It
/// is written as r shapes whose coordinates follow q.
struct SecondOrderShapes {
  /// Integrals of n + r shapes: those of the body, then r affine fields, orthogonal in the mass. Without Ke, De, Kg and
  /// markers.
  ReducedBody body;
  /// r of n x n, symmetric: coordinate n + a is 1/2 q^T follow[a] q.
  std::vector<Eigen::MatrixXd> follow;
};

/// @throws InputError when the body has no geometric stiffness.
SecondOrderShapes with_second_order_shapes(const ReducedBody&);

/// Geometric stiffness (n x n) by accelerations q_ddot of the coordinates: u2 feels the part of S q_ddot that is affine
/// in the place. Beside `motion_stiffness`: where few things hold the root, its acceleration and those of many modes
/// nearly cancel. Zero where Kg was not computed.
Eigen::MatrixXd modal_stiffness(const ReducedBody&, const Eigen::VectorXd& q_ddot);

}  // namespace flexboom
