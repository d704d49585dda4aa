#pragma once

// Flights beside a run, which tell its errors. Internal to `apps`.

#include "apps/accuracy/output_errors.hpp"
#include "apps/simulate/simulate.hpp"

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom {

/// What a body from a file may have beside itself.
using Richer = std::optional<ReducedBody> RicherBodies::*;

bool has(const BodyScene&, Richer);

/// Does the model of any body leave elasticity or modes out? What is said to be rigid is. `structure`: of bodies of
/// that structure alone; empty: of all.
bool any_elastic(const Scene&, std::string_view structure = "");

/// @throws InputError where a body from a file has no such richer one, though its model has more to say; `what`: in
/// words.
void require_richer(const Scene&, Richer, std::string_view what);

/// Flies a scene again, and compares.
struct Repeats {
  RunHooks hooks;
  OutputFloors floors;

  /// Another flight at a bearable cost. @throws NumericalError where it was interrupted: a part of a run has no error.
  Run repeated(const Run&, const Scene& other, int refine = 0) const;

  std::vector<OutputDifference> difference(const OutputTable&, const OutputTable&, const Scene&) const;
  std::vector<OutputDifference> difference(const Run&, const Run& other, const Scene&) const;

  /// Differences of the outputs of another flight. Those that count must not be that flight's own errors of time, which
  /// contacts can make many tolerances. Where they are not far beyond the tolerance, the scene is flown again with a
  /// digit more. It is not where they are far larger than the error of time of the run, or borne as they are.
  /// `time_error` is that of the run; NaN: nobody knows.
  std::vector<OutputDifference> change(
      const Run&, const Scene& other, double time_error, int refine = 0,
      const std::function<bool(const std::vector<OutputDifference>&)>& borne = {}) const;

  /// May differences be errors of time?
  bool may_be_of_time(double differences, double time_error) const;
};

/// What a repeat has found.
struct Finding {
  std::vector<OutputDifference> differences{};
  double factor = 1;  // the error for each difference
};

/// Adds errors of the same outputs; the time is that of the larger one.
void add(std::vector<OutputDifference>& sum, const std::vector<OutputDifference>& more);

/// A budget that is filled part by part.
struct Measuring {
  Repeats repeats;
  std::vector<std::string>& plan;
  ErrorBudget budget{};

  /// What this tells of a part; unknown where it fails, or where there was no time for it. The run outlives a failure.
  double measured(std::string_view part, const std::function<double()>&);

  void missing(std::string_view part, std::string_view why);

  /// Enters what a repeat has changed in each output, and `more` of it, in its unit. Returns the largest.
  double enter(double OutputErrors::*part, const Finding&, const std::function<double(const OutputErrors&)>& more = {});
};

}  // namespace flexboom
