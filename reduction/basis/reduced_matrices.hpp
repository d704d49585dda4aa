#pragma once

#include "fem/assembly/assembly.hpp"

#include <Eigen/Core>

namespace flexboom {

/// Sum of dm z z^T over the mass points, with z = (1, u0, S_1, ..., S_n): every invariant is a linear function of this
/// matrix. The result does not depend on the number of threads.
Eigen::MatrixXd gram_matrix(const Mesh&, const Assembly&, const Eigen::MatrixXd& Phi, int threads = 1);

/// The same, point by point: for beams, and the check of the other route.
Eigen::MatrixXd gram_matrix_by_points(const Mesh&, const DofMap&, const Eigen::MatrixXd& Phi, int threads = 1);

/// Ke = sum w (B Phi)^T D (B Phi) over the strain points (energy_strains of the elements): Phi^T K Phi, but without the
/// cancellation in K Phi.
Eigen::MatrixXd reduced_stiffness(const Mesh&, const DofMap&, const Eigen::MatrixXd& Phi, int threads = 1);

}  // namespace flexboom
