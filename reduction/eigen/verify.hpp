#pragma once

#include "reduction/eigen/shift.hpp"

namespace flexboom {

/// Checks what a backend returned for the shift that is in place, and makes it what solve_modes promises. The modes are
/// sorted, M-orthonormal and cut to options.num_modes. Groups are listed, completeness is counted or probed, the
/// summary is filled. `complete`: there are no more eigenvalues than those found. Returns false when no gap was found
/// above the modes wanted: more of them must be computed.
/// @throws NumericalError when the answer is wrong.
bool verify(const EigenProblem&, ShiftedFactor&, const EigenOptions&, bool complete, EigenPairs&);

/// Residuals up to this are believed: a frequency is then wrong by at most half of it.
constexpr double max_residual = 1e-6;

}  // namespace flexboom
