#pragma once

#include "reduction/body/reduced_body.hpp"

namespace flexboom::eq14 {

/// Root alpha_k of cos(a) cosh(a) = -1, k = 1, 2, ... (eq. 15 gives the boundary condition). Full double precision.
double alpha(int k);

/// sigma_k of eq. 15, corrected: (sinh a - sin a) / (cosh a + cos a); and 1 - sigma_k without cancellation.
double sigma(int k);
double one_minus_sigma(int k);

/// Clamped-free Euler-Bernoulli shape of eq. 14 with A_k = 1 at x = z / L in [0, 1], and its derivatives with respect
/// to x. The form keeps its digits for every k. |phi(k, 1)| = 2, sign as printed.
double phi(int k, double x);
double dphi(int k, double x);
double ddphi(int k, double x);

/// Eq. 14 as printed: loses every digit near k = 12. Kept to show why it is not used.
double phi_as_printed(int k, double x);

/// Integrals over x in [0, 1]: of phi (2 sigma / alpha) and of x phi (2 / alpha^2).
double integral_phi(int k);
double integral_x_phi(int k);

/// A uniform line-mass boom along +x, clamped at the BRF origin.
struct Boom {
  double length = 0;             // [m]
  double mass_per_length = 0;    // rho A [kg/m]
  double bending_stiffness = 0;  // E I [N m^2]
};

/// omega_k = alpha_k^2 sqrt(EI / (rho A L^4)) [rad/s].
double omega(const Boom&, int k);

/// Which planes a reduced body of eq. 14 bends in.
enum class Planes { xy, xy_and_xz };

/// Reduced body with n shapes per plane, tip value +2 (y first, then z), in closed form where one exists, else by
/// quadrature to round-off. Marker "tip". Damping is zero. @throws InputError for non-positive data or n < 0.
ReducedBody reduced_body(const Boom&, int n, Planes, std::string name);

}  // namespace flexboom::eq14
