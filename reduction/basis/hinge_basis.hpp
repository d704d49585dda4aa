#pragma once

#include "reduction/basis/modal_basis.hpp"

#include <Eigen/Core>

#include <vector>

namespace flexboom {

/// A rotational spring between the root of a body and what does not move.
struct HingeSpring {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  // on the hinge axis, BRF [m]
  Eigen::Vector3d axis = Eigen::Vector3d::UnitY();  // BRF, any length
  std::vector<double> stiffness;                    // of each regime (free side, stop closed) [N m/rad]; 0: free hinge
};

/// Modes of the body on its hinge spring, less the rotation of the root. They are clamped shapes, which together with
/// the hinge angle of the joint hold the sprung modes exactly. For each stiffness the first `modes` that turn the root;
/// modes with a root at rest are those of clamped_modes. Where shapes of different stiffness cannot be told apart,
/// higher modes of the first take their place. Coordinates are the modes in the span of the shapes (Me and Ke
/// diagonal), with the frequencies of the clamped body in it. `clamp`: the root, which the hinge carries.
/// @throws InputError for no stiffness, one below zero, an axis of length zero, a root that is not held.
ModalBasis hinge_adapted_modes(const Mesh&, const Assembly&, const Clamp&, const HingeSpring&, int modes,
                               const EigenOptions& = {}, int threads = 1);

}  // namespace flexboom
