#pragma once

#include <Eigen/Core>

namespace flexboom::collocation {

/// Gauss-Lobatto points on [0, 1], both ends among them, and the polynomials through values there.
inline constexpr int degree = 4;
inline constexpr int points = degree + 1;

using Values = Eigen::Matrix<double, points, 1>;
using Table = Eigen::Matrix<double, points, points>;

double node(int j);

/// Values at the points, as rows, times this: coefficients of 1, c, c^2, ...
const Table& coefficients();

/// 1, c, c^2, ...; their integrals from 0 to c; the integrals of those.
Values monomials(double c);
Values integrals(double c);
Values double_integrals(double c);

/// Weights of what the middle point says beyond the polynomial through the others.
const Values& middle_difference();

/// Coefficients of the polynomial that is 1 at the middle point and 0 at the others.
Values middle_polynomial();

}  // namespace flexboom::collocation
