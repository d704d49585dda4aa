#pragma once

#include "dynamics/numerics/spectrum.hpp"

namespace flexboom {

/// Of diag(lambda) + w v^T, in the coordinates of z (spectrum.hpp), its pairs and real eigenvalues in no order:
/// `lambda` as in a Spectrum, w = to_modes d, v = from_modes^T e. The eigenvalues are the roots of 1 + sum w_i v_i /
/// (lambda_i - mu), found by the iteration of Ehrlich and Aberth; eigenvectors are w_i / (mu - lambda_i). No w_i v_i
/// may be zero. Work of order n^2 for n eigenvalues.
/// @throws NumericalError when it does not converge, or the eigenvectors are no full set.
Spectrum rank_one_spectrum(const Eigen::VectorXcd& lambda, const Eigen::VectorXd& w, const Eigen::VectorXd& v);

}  // namespace flexboom
