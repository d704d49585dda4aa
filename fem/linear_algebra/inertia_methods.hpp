#pragma once

#include "fem/linear_algebra/inertia.hpp"

namespace flexboom {

// The rows of inertia_methods(), each in the file that holds the door to its library.

/// L D L^T of CHOLMOD, columns one by one, no pivoting for size.
Inertia cholmod_inertia(const SparseMatrix&);
std::string cholmod_release();

/// L D L^T of MUMPS, dense blocks, pivots of order 1 and 2; the factors are dropped as they come.
Inertia mumps_inertia(const SparseMatrix&);
std::string mumps_release();

}  // namespace flexboom
