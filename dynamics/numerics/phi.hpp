#pragma once

#include <Eigen/Core>

namespace flexboom {

/// The functions of exponential integrators, phi_0 = e^w, phi_k(w) = integral over s in (0, 1) of e^((1 - s) w)
/// s^(k-1) / (k-1)!, of many w = scale (x + i y): phi is 2 m x count, real parts above imaginary parts, column k for
/// phi_k. Recurrence upward for |w| > 2, else downward from a Taylor series: k! phi_k is good to 1e-13 for k < 10
/// (Hochbruck, Ostermann, Acta Numerica 19 (2010) 209).
void phi_functions(double scale, const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::Ref<const Eigen::VectorXd>& y,
                   Eigen::Ref<Eigen::MatrixXd> phi);

}  // namespace flexboom
