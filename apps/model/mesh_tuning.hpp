#pragma once

#include "apps/model/model.hpp"
#include "reduction/eigen/solver.hpp"

namespace flexboom {

/// A solid boom whose mesh is finer in the directions that its frequencies ask for, of order 4 at least. Each size of
/// the grading is tried by itself. The sizes are sectors, elements through the section, along the boom, layers at its
/// ends, levels toward rims and toward edges. Those that move a frequency by more than a third of the accuracy are
/// kept, the most effective first. One is kept only if the mesh one order higher has no more than 140 000 unknowns.
/// What was kept is tried again, in four rounds at most.
/// @param rigid_freedoms of the frequencies, the lowest, are of rigid motions.
/// @throws InputError, NumericalError as clamped_modes.
Model tuned(Model, int rigid_freedoms, double accuracy, const EigenOptions&, int threads);

}  // namespace flexboom
