#pragma once

#include "apps/simulate/modes_beyond.hpp"
#include "apps/simulate/simulate.hpp"

#include <limits>
#include <string>
#include <vector>

namespace flexboom {

/// Steps that a flight in comparison with another may take; beyond, it costs too much.
long bearable_steps(const Run&);

/// What settle_time_error is content with.
struct Settling {
  double bearable;  // the largest difference of the outputs
  int digits;       // more of the integrator, at most; those that take four fifths of the difference away do not count
  double balance = std::numeric_limits<double>::infinity();  // the largest energy balance
};

/// Repeats a run ten times tighter until its outputs change no more than is bearable, and its energies balance: steps
/// that are right for the outputs may leave powers out. `run` is then the last but one. `flown` has the tolerance of
/// its integrator, and `plan` says so. Returns the last differences.
/// @throws InputError, NumericalError as run_scene.
std::vector<OutputDifference> settle_time_error(Scene& flown, Run& run, const OutputFloors&, Settling, const RunHooks&,
                                                std::vector<std::string>& plan);

/// Those wanted that are a pointing (is_pointing), as they are wanted.
std::vector<std::string> wanted_pointings(const Scene&);

/// Without a budget an output keeps the tolerance within a factor of ten. A pointing does not by itself: it is a small
/// difference of large angles, and steps know the angles alone. Settles its error where digits are cheap, and measures
/// it by others. Returns what is to be warned about; empty: nothing.
std::string settle_pointing(Scene&, Run& run, const RunHooks&, std::vector<std::string>& plan);

/// Repeats a run with a tighter integrator, more modes in and out of the hinge plane, and a finer mesh, and compares
/// the outputs wanted. Where the integrator has to be tighter, or geometric stiffness to be on, that run takes the
/// place of `run`, and the scene says so. What is known not to move is no part of more modes, unless geometric
/// stiffness is switched on: it couples kinds of modes that are independent without.
/// @throws InputError, NumericalError as run_scene.
ErrorBudget measure_budget(Scene&, Run& run, const RunHooks&, std::vector<std::string>& plan,
                           const StillKinds& still = {});

/// The scene with the geometric stiffness that its run had: a repeat changes one thing alone.
Scene as_flown(Scene, const Run&);

/// Of the integrator of a flight in comparison: below is round-off.
inline constexpr double least_tolerance = 1e-13;

/// A digit more from its integrator: a number that people can read in the scene that is written.
Scene with_a_digit_more(Scene);

/// All geometric stiffness.
Scene with_stiffening(Scene);

/// Without the columns of elastic coordinates: those of another basis have other meanings.
OutputTable without_coordinates(const OutputTable&);

/// What the outputs of a scene with these bodies must bear.
OutputFloors floors_of(const Scene&, const std::vector<PreparedBody>&);

}  // namespace flexboom
