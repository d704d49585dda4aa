#pragma once

#include <Eigen/Core>

namespace flexboom {

/// The functions of exponential integrators (Hochbruck, Ostermann, Acta Numerica 19 (2010) 209): phi_0(w) = e^w,
/// phi_k(w) = integral over s in (0, 1) of e^((1 - s) w) s^(k-1) / (k-1)!. They are computed of many
/// w = scale (x + i y). phi is 2 m x count: real parts above imaginary parts, column k for phi_k. k! phi_k is good to
/// 1e-13 for k < 10.
void phi_functions(double scale, const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::Ref<const Eigen::VectorXd>& y,
                   Eigen::Ref<Eigen::MatrixXd> phi);

}  // namespace flexboom
