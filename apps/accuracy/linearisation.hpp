#pragma once

// The part of an error budget of what the equations leave out. Internal to `apps`.

#include "apps/accuracy/repeats.hpp"

namespace flexboom {

/// What geometric stiffness changes where it is left out, and what is left out even with it. The latter is the square
/// of the deflection, and vibrations whose frequency depends on it. Where geometric stiffness changes too much and the
/// scene leaves it open, the scene has it from then on. A run with it then takes the place of `run`.
/// `flown`: the scene as `run` has it. @throws InputError, NumericalError as run_once.
double linearisation_error(Scene& scene, Scene& flown, Run& run, Measuring&);

}  // namespace flexboom
