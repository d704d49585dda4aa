#pragma once

#include "fem/assembly/assembly.hpp"

#include <Eigen/Core>

#include <string_view>
#include <vector>

namespace flexboom {

/// What a mode does mostly: deflects a slender body along x, y or z, twists it, stretches it, moves it as a whole.
enum class ModeKind { bending_x, bending_y, bending_z, torsion, axial, rigid, other };
std::string_view name_of(ModeKind);

/// Coordinate axis (0, 1, 2) along which a body runs: from its node set "root" to "tip", as booms do however short they
/// are. Without these it is the one along which the mesh is longest.
int long_axis(const Mesh&);

/// Kinds of shapes (freedoms x n) by their kinetic energy. A kind is named when more than half of the energy is the
/// mean motion of the sections in that direction, or their twist. `weights` is the diagonal of M. No mode is called
/// rigid here.
std::vector<ModeKind> mode_kinds(const Mesh&, const DofMap&, const Eigen::VectorXd& weights,
                                 const Eigen::Ref<const Eigen::MatrixXd>& Phi);

}  // namespace flexboom
