#pragma once

#include "apps/model/model.hpp"
#include "reduction/eigen/solver.hpp"

#include <optional>

namespace flexboom {

/// Thin walls and long elements are dear with less.
inline constexpr int least_order_of_tuning = 4;

/// The same solid boom by elements of that order.
Model with_order(Model, int order);

/// A solid boom whose mesh is finer in the directions that its frequencies ask for. Each size of the grading is tried
/// by itself. The sizes are sectors, elements through the section, along the boom, layers at its
/// ends, levels toward rims and toward edges. Those that move a frequency by more than a third of the accuracy are
/// kept, the most effective first. One is kept only if the mesh one order higher has no more than 140 000 unknowns.
/// What was kept is tried again, in four rounds at most. Empty: no size is worth it.
/// @param omega of the boom as it is [rad/s]
/// @param rigid_freedoms of the frequencies, the lowest, are of rigid motions.
/// @throws InputError, NumericalError as clamped_modes.
std::optional<Model> tuned(Model, Eigen::VectorXd omega, int rigid_freedoms, double accuracy, const EigenOptions&,
                           int threads);

}  // namespace flexboom
