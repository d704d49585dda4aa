#pragma once

#include <Eigen/Core>

namespace flexboom {

/// e^(scale (x + i y)) of `count` finite numbers, to some units in the last place. result: 2 count values apart from x
/// and y, real parts, then imaginary parts. Its own file, for GCC compiles it so that several go through the functions
/// of the C library at once.
void complex_exp(Eigen::Index count, double scale, const double* x, const double* y, double* result);

}  // namespace flexboom
