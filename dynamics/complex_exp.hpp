#pragma once

#include <Eigen/Core>

namespace flexboom {

/// e^(scale (x + i y)) of many, to some units in the last place: real parts, then imaginary parts. Its own file, for it
/// is compiled so that several go through the functions of the C library at once.
void complex_exp(Eigen::Index count, double scale, const double* x, const double* y, double* result);

}  // namespace flexboom
