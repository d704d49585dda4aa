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

}  // namespace flexboom
