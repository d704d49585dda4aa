#include "dynamics/phi.hpp"

#include <cmath>

namespace flexboom {

void phi_functions(std::complex<double> w, std::span<std::complex<double>> phi) {
  // Products and quotients by hand: those of std::complex look for infinities.
  const double x = w.real(), y = w.imag(), e = std::exp(x);
  phi[0] = {e * std::cos(y), e * std::sin(y)};
  if (phi.size() == 1) return;
  const size_t last = phi.size() - 1;
  const double size = x * x + y * y;
  double inverse_factorial = 1;
  if (size > 4) {
    const double ix = x / size, iy = -y / size;
    for (size_t k = 0; k < last; ++k) {
      const double re = phi[k].real() - inverse_factorial, im = phi[k].imag();
      phi[k + 1] = {re * ix - im * iy, re * iy + im * ix};
      inverse_factorial /= static_cast<double>(k + 1);
    }
    return;
  }
  for (size_t k = 1; k <= last; ++k) inverse_factorial /= static_cast<double>(k);
  constexpr int terms = 20;  // 2^20 / 28! 8! is round-off
  double re = 1, im = 0;     // Horner: 1 + w / (last + 1) (1 + w / (last + 2) (...))
  for (size_t j = last + terms; j > last; --j) {
    const double inverse = 1 / static_cast<double>(j), next = 1 + (re * x - im * y) * inverse;
    im = (re * y + im * x) * inverse;
    re = next;
  }
  re *= inverse_factorial, im *= inverse_factorial;
  phi[last] = {re, im};
  for (size_t k = last - 1; k > 0; --k) {
    inverse_factorial *= static_cast<double>(k + 1);
    const double next = re * x - im * y + inverse_factorial;
    im = re * y + im * x;
    re = next;
    phi[k] = {re, im};
  }
}

}  // namespace flexboom
