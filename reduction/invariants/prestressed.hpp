#pragma once

#include "fem/assembly/assembly.hpp"
#include "fem/assembly/constraints.hpp"
#include "reduction/basis/modal_basis.hpp"
#include "reduction/body/reduced_body.hpp"
#include "reduction/body/steady_motion.hpp"

#include <Eigen/Core>

#include <functional>

namespace flexboom {

/// Shapes of a body that its steady motion stiffens or softens, as combinations of the coordinates of `clamped`.
struct PrestressedShapes {
  Eigen::MatrixXd X;       // n x modes, Me-orthonormal
  Eigen::VectorXd lambda;  // squared frequencies of the modes that they are from, ascending [rad^2/s^2]
};

/// The elastic parts of the first modes of Ke + Kg + Kc in the frame that moves with the body. Kg is the geometric
/// stiffness of the motion. Kc is what the spin does to mass that leaves its place. The root turns freely about
/// `motion.turns`. An elastic part is the mode less the rotation of the root, so that shapes and joint together hold
/// the modes exactly. Coriolis terms are left out, and the body that carries the root does not give way.
///
/// A mode that is a rigid rotation brings no shape, nor does one that depends on those before it: the next one does.
/// `clamped`: the body in many clamped modes, with `gram` and `Kg`. See Likins, "Mathematical modeling of spinning
/// elastic bodies for modal analysis", AIAA J. 11 (1973).
/// @throws InputError without gram or Kg, for axes that are none, and when the body has fewer shapes.
PrestressedShapes prestressed_shapes(const ReducedBody& clamped, const SteadyMotion& motion, int modes);

/// A basis of them, and the clamped modes that they are combined of.
struct PrestressedBasis {
  ModalBasis basis;
  ReducedBody clamped;
  Eigen::MatrixXd clamped_Phi;  // freedoms x clamped.n()
};

/// `clamped_modes(count)` gives the first modes of the held body, of the directions wanted; `most` of them there are.
/// Twice as many are taken until they change the squared frequencies of prestressed_shapes by less than 1e-6; where
/// that takes more than 400, or more than 4e6 by the number of unknowns, `basis.summary.note` has the change. Me and Ke
/// of the basis are diagonal, as by ritz_modes.
/// @throws InputError, NumericalError as prestressed_shapes, geometric_stiffness and ritz_modes.
PrestressedBasis prestressed_modes(const Mesh&, const Assembly&, const Clamp&, const SteadyMotion&,
                                   const std::function<ModalBasis(int count)>& clamped_modes, int most, int modes,
                                   int threads = 1);

/// Shapes of the same mesh as combinations of those clamped modes, clamped.n() x columns of Phi.
Eigen::MatrixXd clamped_parts(const PrestressedBasis&, const Assembly&, const Eigen::MatrixXd& Phi);

}  // namespace flexboom
