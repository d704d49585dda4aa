#pragma once

// Owners of what SUNDIALS makes. Internal to `dynamics`.

#include "fem/base/check.hpp"

#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>
#include <sundials/sundials_nonlinearsolver.h>
#include <sundials/sundials_nvector.h>

#include <fmt/format.h>

#include <cstdlib>
#include <memory>

namespace flexboom::sundials {

template <class T, auto Free>
struct Deleter {
  void operator()(T* p) const { Free(p); }
};
using Vector = std::unique_ptr<_generic_N_Vector, Deleter<_generic_N_Vector, N_VDestroy>>;
using Matrix = std::unique_ptr<_generic_SUNMatrix, Deleter<_generic_SUNMatrix, SUNMatDestroy>>;
using LinearSolver = std::unique_ptr<_generic_SUNLinearSolver, Deleter<_generic_SUNLinearSolver, SUNLinSolFree>>;
using NonlinearSolver =
    std::unique_ptr<_generic_SUNNonlinearSolver, Deleter<_generic_SUNNonlinearSolver, SUNNonlinSolFree>>;

/// What a solver of SUNDIALS allocates.
template <auto Free>
struct FreeMemory {
  void operator()(void* memory) const { Free(&memory); }
};
template <auto Free>
using Memory = std::unique_ptr<void, FreeMemory<Free>>;

struct Context {
  SUNContext context = nullptr;
  /// @throws NumericalError when there is none.
  Context() {
    if (SUNContext_Create(nullptr, &context) != 0) throw NumericalError("SUNDIALS: no context");
  }
  ~Context() { SUNContext_Free(&context); }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
};

/// @throws NumericalError always. `flag_name` is what a library calls its flag: from malloc, freed here.
[[noreturn]] inline void fail(const char* library, const char* function, char* flag_name, double t, double h) {
  const std::unique_ptr<char, decltype(&std::free)> name(flag_name, &std::free);
  throw NumericalError(
      fmt::format("{}: {} returned {} at t = {:.9g} s, last step {:.3g} s", library, function, name.get(), t, h));
}

/// An error handler that says nothing: what fails is thrown.
inline void quiet(int, const char*, const char*, char*, void*) noexcept {}

}  // namespace flexboom::sundials
