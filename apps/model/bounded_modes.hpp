#pragma once

#include "apps/model/model.hpp"
#include "fem/assembly/assembly.hpp"
#include "reduction/basis/modal_basis.hpp"

#include <Eigen/Core>

#include <optional>
#include <string>

namespace flexboom {

/// What the elements of a model change in its frequencies.
struct FrequencyBounds {
  Eigen::VectorXd relative;  // of each frequency; unknown (NaN) of rigid motions and of what the mesh does not resolve
  std::string how;           // they were found; or why there are none

  /// The largest, of the elastic modes; unknown where one of them is.
  double worst(int rigid_freedoms) const;
};

/// Modes of a model whose frequencies have bounds.
struct BoundedModes {
  Model model;  // whose modes these are
  Assembly assembly;
  ModalBasis basis;
  FrequencyBounds bounds;
  double mesh_seconds = 0, assemble_seconds = 0, modes_seconds = 0;  // of this model
  double bound_seconds = 0;                                          // of all other meshes
  std::optional<double> accuracy;  // that is asked of the mesh; none but of solid booms

  /// Is every bound within the accuracy? Not known where no accuracy is asked.
  std::optional<bool> met() const;
};

/// Does a boom of beams taper to a third of its depth, or less, within one element?
bool tapers_steeply(const BeamGeometry&);

/// The largest part of a boom's discretisation errors that is left on the next finer mesh. It is 0.5, or 0.7 where
/// edges along the boom are singular (slits, rectangular tubes). Meshes of the program's choice have 0.25 for round
/// bars, 0.4 for tubes, 0.35 for rectangles of less than one to four. Meshes of which the file gives sizes have 0.8.
/// Measured on 25 booms were 0.23, 0.32 and 0.28 at most. Beams that taper steeply have 0.95; measured were 0.91 at
/// most.
double slowest_fall(const BodyScene&);

/// Modes of a model, each frequency with a bound from a mesh of the same boom that is finer (`refined`).
///
/// From one mesh to the next, errors are assumed to fall by a factor f or more (`slowest_fall`). The change of a
/// frequency is then at least 1 - f of the coarser mesh's error, and at least (1 - f) / f of the finer one's. A bound
/// of a solid is never less than a fiftieth of the largest. Beams are compared three steps finer, as far as their order
/// goes: errors fall by f^3. Where the change is a tenth of the frequency or more, the coarser mesh resolves neither
/// this mode nor those above it, whose order may change.
///
/// What the round-off of K changes (ModalBasis::round_off) is part of a bound. Where that alone is a tenth or more,
/// neither this mode nor those above it have one.
///
/// A solid boom of which no more than the accuracy is given (SolidOptions) goes on to finer meshes until the accuracy
/// is met. It takes one step. It then takes a mesh of its own (`tuned`), and three steps from there at most. No mesh
/// has more than 140 000 unknowns.
/// @throws InputError, NumericalError as clamped_modes.
BoundedModes bounded_modes(Model, const EigenOptions&, int threads);

}  // namespace flexboom
