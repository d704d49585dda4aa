#pragma once

#include <complex>
#include <span>

namespace flexboom {

/// The functions of exponential integrators, phi[0] = e^w, phi[k](w) = integral over s in (0, 1) of e^((1 - s) w)
/// s^(k-1) / (k-1)!, for as many k as there is room. Recurrence upward for |w| > 2, else downward from a Taylor series:
/// k! phi[k] is good to 1e-13 for k < 10 (Hochbruck, Ostermann, Acta Numerica 19 (2010) 209).
void phi_functions(std::complex<double> w, std::span<std::complex<double>> phi);

}  // namespace flexboom
