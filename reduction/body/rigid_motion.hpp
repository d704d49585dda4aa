#pragma once

#include "reduction/body/reduced_body.hpp"

namespace flexboom {

/// Mass matrix of the rigid motions about the BRF origin, and L = [Ct; Cr0] (6 x n) that couples the coordinates with
/// them.
Eigen::Matrix<double, 6, 6> rigid_mass(const ReducedBody&);
Eigen::MatrixXd rigid_coupling(const ReducedBody&);

}  // namespace flexboom
