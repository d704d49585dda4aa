#pragma once

#include <Eigen/Core>

namespace flexboom {

/// Equal mass points that have the integrals of a body: m sum_i z_i z_i^T = gram, z = (1, u0, S_1, ..., S_n).
struct MassPoints {
  double m = 0;       // of each point [kg]
  Eigen::MatrixXd z;  // 4 + 3n rows, the first of ones; one column per point, 4 + 3n or fewer
};

/// Points for a gram matrix (`ReducedBody::gram`), as many as its rank. They are no points of the body: they lie where
/// the sums want them. Each entry of the sum is right to round-off of sqrt(gram_ii gram_jj).
/// @throws InputError when the gram is empty or its mass is not positive.
MassPoints mass_points(const Eigen::MatrixXd& gram);

}  // namespace flexboom
