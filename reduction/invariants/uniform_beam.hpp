#pragma once

#include "fem/assembly/constraints.hpp"
#include "reduction/basis/modal_basis.hpp"
#include "reduction/body/reduced_body.hpp"

#include <optional>
#include <string>
#include <vector>

namespace flexboom {

/// A uniform beam that bends in one plane, clamped at x = 0, free at x = L.
struct BendingBeam {
  double L = 0;           // [m]
  double rho_A = 0;       // [kg/m]
  double EI = 0;          // [N m^2]
  double rho_I = 0;       // rotary inertia [kg m]; 0: a line mass
  double compliance = 0;  // 1 / (kappa G A) [1/N]; 0: no shear strain (Euler-Bernoulli)
};

/// A mode of it, per unit deflection of the tip.
struct BendingMode {
  double omega = 0;  // [rad/s]
  double Ct = 0;     // int rho A w [kg]
  double Cr0 = 0;    // int rho A x w + rho I theta [kg m]
};

/// The exact mode (Timoshenko; Euler-Bernoulli with or without rotary inertia) whose frequency lies within 2 % of
/// `near` [rad/s]. Nothing where there is none, or above the cutoff sqrt(kappa G A / (rho I)).
std::optional<BendingMode> bending_mode(const BendingBeam&, double near);

/// Frequencies, Ct and Cr0 of modes of a uniform beam, clamped at one end, against closed forms. Bending is as
/// bending_mode, tension and torsion are by the wave equation. The errors are those of the mesh; above 1e-3 a check
/// fails. Of any other model one line that says why closed forms are not applicable.
std::vector<BodyCheck> check_uniform_beam(const ReducedBody&, const Mesh&, const DofMap&, const Clamp&,
                                          const ModalBasis&);

}  // namespace flexboom
