#pragma once

#include "apps/accuracy/output_errors.hpp"
#include "apps/simulate/simulate.hpp"

#include <limits>
#include <string>
#include <vector>

namespace flexboom {

/// Of energy and momenta, with a tolerance of the outputs: ten times that, the factor that a run without a budget
/// promises.
double bearable_balance(double tolerance);

/// What settle_time_error is content with.
struct Settling {
  double bearable;  // the largest difference of the outputs
  int digits;       // more of the integrator, at most; those that take four fifths of the difference away do not count
  double balance = std::numeric_limits<double>::infinity();  // the largest energy balance
};

/// Repeats a run ten times tighter until its outputs change no more than is bearable, and its energies balance. Steps
/// that are right for the outputs may leave powers out. `run` is then the last but one. `flown` has the tolerance of
/// its integrator, and `plan` says so. Returns the last differences. `reference`: a run of the same model that is more
/// precise. It takes the place of the tighter ones, and `run` is the last.
/// @throws InputError, NumericalError as run_once.
std::vector<OutputDifference> settle_time_error(Scene& flown, Run& run, const OutputFloors&, Settling, const RunHooks&,
                                                std::vector<std::string>& plan, const Run* reference = nullptr);

/// Those wanted that are a pointing (is_pointing), as they are wanted.
std::vector<std::string> wanted_pointings(const Scene&);

/// Without a budget an output keeps the tolerance within a factor of ten. A pointing does not by itself: it is a small
/// difference of large angles, and steps know the angles alone. Settles its error where digits are cheap, and measures
/// it by others. Returns what is to be warned about; empty: nothing.
std::string settle_pointing(Scene&, Run& run, const RunHooks&, std::vector<std::string>& plan);

}  // namespace flexboom
