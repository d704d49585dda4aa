#pragma once

#include "fem/linear_algebra/sparse.hpp"

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace flexboom {

/// Signs of the eigenvalues of a symmetric matrix (Sylvester's law: those of its pivots).
struct Inertia {
  int negative = 0;
  std::string method;
  double seconds = 0;
};

/// A way to count: what it is for and what it does.
struct InertiaMethod {
  std::string_view name;
  double flops_per_second;  // of one core, roughly: to choose by
  Inertia (*count)(const SparseMatrix&);
  std::string (*release)();  // version of its library
};

/// "cholmod" (no pivoting, slow beyond small matrices) and, where the library is there, "mumps".
std::span<const InertiaMethod> inertia_methods();

/// Counts by the method that is the quickest for a factorisation of that many operations (Ordering::flops), or by the
/// next where a pivot makes that one impossible.
/// @throws NumericalError when no method can count.
Inertia inertia(const SparseMatrix& A, double flops);

/// Rough time of inertia() [s].
double inertia_seconds(double flops);

/// Below this the count is made without being asked for [s].
inline constexpr double cheap_inertia_seconds = 0.3;

/// Name and version of each library of linear algebra that is there: one pair per row of inertia_methods(), and the
/// BLAS.
std::vector<std::pair<std::string, std::string>> linear_algebra_versions();

}  // namespace flexboom
