#include "dynamics/numerics/complex_exp.hpp"

#include "fem/base/lanes.hpp"

#include <algorithm>
#include <cmath>

namespace flexboom {

// Sine and cosine in loops of their own: a common one keeps the compiler from taking several at once.
FLEXBOOM_FOR_EACH_PROCESSOR
void complex_exp(Eigen::Index count, double scale, const double* x, const double* y, double* result) {
  constexpr double gone = -700;  // e^gone is 1e-304; what is below would take a slow path
  double* const re = result;
  double* const im = result + count;
#pragma GCC ivdep
  for (Eigen::Index i = 0; i < count; ++i) im[i] = std::sin(scale * y[i]);
#pragma GCC ivdep
  for (Eigen::Index i = 0; i < count; ++i) re[i] = std::cos(scale * y[i]);
#pragma GCC ivdep
  for (Eigen::Index i = 0; i < count; ++i) {
    const double decay = scale * x[i], e = std::exp(std::max(gone, decay)), size = decay > gone ? e : 0;
    re[i] *= size;
    im[i] *= size;
  }
}

}  // namespace flexboom
