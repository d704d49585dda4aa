#include "dynamics/numerics/phi.hpp"

#include "dynamics/numerics/complex_exp.hpp"
#include "fem/base/lanes.hpp"

namespace flexboom {

namespace {

using Eigen::Index;

// Products and quotients by hand: those of std::complex look for infinities.

/// phi_1 ... phi_last of every w from phi_0; where w is small they are of no use. phi: 2 m values a column.
FLEXBOOM_FOR_EACH_PROCESSOR
void upward(Index m, Index last, double scale, const double* x, const double* y, double* phi) {
  double* const inverse = phi + 2 * m * last;  // 1 / w, in the place of phi_last
#pragma GCC ivdep
  for (Index i = 0; i < m; ++i) {
    const double size = scale * (x[i] * x[i] + y[i] * y[i]);
    inverse[i] = x[i] / size;
    inverse[m + i] = -y[i] / size;
  }
  double inverse_factorial = 1;
  for (Index k = 0; k < last; ++k) {
    const double* const from = phi + 2 * m * k;
    double* const to = phi + 2 * m * (k + 1);
#pragma GCC ivdep
    for (Index i = 0; i < m; ++i) {
      const double re = from[i] - inverse_factorial, im = from[m + i], ix = inverse[i], iy = inverse[m + i];
      to[i] = re * ix - im * iy;
      to[m + i] = re * iy + im * ix;
    }
    inverse_factorial /= static_cast<double>(k + 1);
  }
}

/// A few small w, and where they stand.
struct SmallOnes {
  static constexpr int lanes = 8;
  double x[lanes] = {}, y[lanes] = {};
  Index at[lanes] = {};
  int count = 0;
};

/// phi_last ... phi_1 of small w.
FLEXBOOM_FOR_EACH_PROCESSOR
void downward(const SmallOnes& w, Index m, Index last, double* phi) {
  constexpr int lanes = SmallOnes::lanes, terms = 20;  // 2^20 / 28! 8! is round-off
  double re[lanes], im[lanes], inverse_factorial = 1;
  for (int l = 0; l < lanes; ++l) re[l] = 1, im[l] = 0;
  for (Index k = 1; k <= last; ++k) inverse_factorial /= static_cast<double>(k);
  // Horner: 1 + w / (last + 1) (1 + w / (last + 2) (...))
  for (Index j = last + terms; j > last; --j) {
    const double inverse = 1 / static_cast<double>(j);
    for (int l = 0; l < lanes; ++l) {
      const double next = 1 + (re[l] * w.x[l] - im[l] * w.y[l]) * inverse;
      im[l] = (re[l] * w.y[l] + im[l] * w.x[l]) * inverse;
      re[l] = next;
    }
  }
  for (int l = 0; l < lanes; ++l) re[l] *= inverse_factorial, im[l] *= inverse_factorial;
  for (Index k = last; k > 0; --k) {
    for (int l = 0; l < w.count; ++l) {
      phi[2 * m * k + w.at[l]] = re[l];
      phi[2 * m * k + m + w.at[l]] = im[l];
    }
    inverse_factorial *= static_cast<double>(k);
    for (int l = 0; l < lanes; ++l) {
      const double next = re[l] * w.x[l] - im[l] * w.y[l] + inverse_factorial;
      im[l] = re[l] * w.y[l] + im[l] * w.x[l];
      re[l] = next;
    }
  }
}

}  // namespace

void phi_functions(double scale, const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::Ref<const Eigen::VectorXd>& y,
                   Eigen::Ref<Eigen::MatrixXd> phi) {
  const Index m = x.size(), last = phi.cols() - 1;
  complex_exp(m, scale, x.data(), y.data(), phi.data());
  if (last < 1) return;
  upward(m, last, scale, x.data(), y.data(), phi.data());
  SmallOnes small;
  for (Index i = 0; i < m; ++i) {
    const double re = scale * x[i], im = scale * y[i];
    if (re * re + im * im <= 4) {
      small.x[small.count] = re;
      small.y[small.count] = im;
      small.at[small.count++] = i;
    }
    if (small.count == SmallOnes::lanes || (i + 1 == m && small.count > 0)) {
      downward(small, m, last, phi.data());
      small.count = 0;
    }
  }
}

}  // namespace flexboom
