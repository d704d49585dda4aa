#include "fem/linear_algebra/inertia.hpp"

#include "fem/base/blas_threads.hpp"
#include "fem/base/check.hpp"
#include "fem/base/stopwatch.hpp"
#include "fem/linear_algebra/inertia_methods.hpp"
#include "fem/linear_algebra/sparse_factor.hpp"

#include <algorithm>

namespace flexboom {
namespace {

double seconds(const InertiaMethod& method, double flops) {
  constexpr double start = 0.01;  // a fixed part, of the larger machine
  return flops / method.flops_per_second + (method.name == "cholmod" ? 0 : start);
}

/// The methods, quickest first.
std::vector<const InertiaMethod*> by_time(double flops) {
  std::vector<const InertiaMethod*> methods;
  for (const InertiaMethod& method : inertia_methods()) methods.push_back(&method);
  std::ranges::sort(methods, {}, [&](const InertiaMethod* method) { return seconds(*method, flops); });
  return methods;
}

/// The count of the quickest method that can: without pivoting a zero on the diagonal is the end.
Inertia first_count(const SparseMatrix& A, const std::vector<const InertiaMethod*>& methods) {
  for (const InertiaMethod* method : methods) {
    try {
      return method->count(A);
    } catch (const NumericalError&) {
      if (method == methods.back()) throw;
    }
  }
  throw NumericalError("inertia: no method is there");
}

}  // namespace

Inertia cholmod_inertia(const SparseMatrix& A) {
  SparseFactor factor(A, FactorKind::indefinite);
  factor.factorise(A);
  return {.negative = factor.negative_pivots(), .method = "CHOLMOD"};
}

Inertia inertia(const SparseMatrix& A, double flops) {
  const Stopwatch start;
  Inertia result = first_count(A, by_time(flops));
  result.seconds = start.seconds();
  return result;
}

std::string cholmod_release() { return SparseFactor::library_release(); }

std::vector<std::pair<std::string, std::string>> linear_algebra_versions() {
  std::vector<std::pair<std::string, std::string>> versions;
  for (const InertiaMethod& method : inertia_methods()) versions.emplace_back(method.name, method.release());
  versions.emplace_back("blas", blas_release());
  return versions;
}

double inertia_seconds(double flops) { return flops / by_time(flops).front()->flops_per_second; }

}  // namespace flexboom
