#include "dynamics/numerics/secular.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <vector>

namespace flexboom {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

constexpr double epsilon = std::numeric_limits<double>::epsilon();

/// Complex numbers, real and imaginary parts apart.
struct Numbers {
  VectorXd re, im;

  explicit Numbers(Index n) : re(n), im(n) {}
  Index size() const { return re.size(); }
  Complex operator[](Index i) const { return {re[i], im[i]}; }
  void set(Index i, Complex a) { re[i] = a.real(), im[i] = a.imag(); }
};

/// With a for 1 / (lambda_i - mu): sums of p a, p a^2, a, and of |p a|.
struct Sums {
  Complex one, two, plain;
  double size = 0;
};

// Products and quotients by hand: those of std::complex look for infinities.

Sums sums_at(const Numbers& lambda, const Numbers& p, Complex origin, Complex delta) {
  const double *lr = lambda.re.data(), *li = lambda.im.data(), *pr = p.re.data(), *pi = p.im.data();
  const double o_re = origin.real(), o_im = origin.imag(), d_re = delta.real(), d_im = delta.imag();
  double one_re = 0, one_im = 0, two_re = 0, two_im = 0, plain_re = 0, plain_im = 0, size = 0;
  for (Index i = 0; i < lambda.size(); ++i) {
    const double x = (lr[i] - o_re) - d_re, y = (li[i] - o_im) - d_im, scale = 1 / (x * x + y * y);
    const double a_re = x * scale, a_im = -y * scale;
    const double t_re = pr[i] * a_re - pi[i] * a_im, t_im = pr[i] * a_im + pi[i] * a_re;
    one_re += t_re, one_im += t_im;
    two_re += t_re * a_re - t_im * a_im, two_im += t_re * a_im + t_im * a_re;
    plain_re += a_re, plain_im += a_im;
    size += std::abs(t_re) + std::abs(t_im);
  }
  return {{one_re, one_im}, {two_re, two_im}, {plain_re, plain_im}, size};
}

/// Sum of 1 / (mu_j - mu_k) over k that are not j, mu = lambda + delta.
Complex repulsion(const Numbers& lambda, const Numbers& delta, Index j) {
  const double *l_re = lambda.re.data(), *l_im = lambda.im.data(), *d_re = delta.re.data(), *d_im = delta.im.data();
  double re = 0, im = 0;
  for (const auto& [begin, end] : {std::pair(Index(0), j), std::pair(j + 1, lambda.size())})
    for (Index k = begin; k < end; ++k) {
      const double x = (l_re[j] - l_re[k]) + (d_re[j] - d_re[k]), y = (l_im[j] - l_im[k]) + (d_im[j] - d_im[k]);
      const double scale = 1 / (x * x + y * y);
      re += x * scale, im -= y * scale;
    }
  return {re, im};
}

/// Poles lambda_i and the roots of 1 + sum p_i / (lambda_i - mu). Each root is kept as its distance from the pole that
/// it came from: near that, it has the digits. Both come with their conjugates.
class Secular {
 public:
  /// Of each pair one; p alike.
  Secular(const VectorXcd& lambda, const VectorXcd& p)
      : mirror_(mirrors(lambda)), lambda_(count()), p_(count()), delta_(count()) {
    for (Index i = 0; i < count(); ++i) {
      const bool given = i < lambda.size();
      lambda_.set(i, given ? lambda[i] : std::conj(lambda_[mirror(i)]));
      p_.set(i, given ? p[i] : std::conj(p[mirror(i)]));
    }
    start();
    iterate();
    pair_roots();
  }

  Index count() const { return static_cast<Index>(mirror_.size()); }
  Index mirror(Index pole) const { return mirror_[static_cast<size_t>(pole)]; }

  /// Of each pair one, with its positive imaginary part.
  const std::vector<Index>& roots() const { return roots_; }
  bool is_real(Index root) const { return delta_.im[root] == -lambda_.im[root]; }
  Complex root(Index j) const { return lambda_[j] + delta_[j]; }

  /// Of a root from a pole: mu_j - lambda_i.
  Complex distance(Index j, Index i) const { return (lambda_[j] - lambda_[i]) + delta_[j]; }

 private:
  static std::vector<Index> mirrors(const VectorXcd& lambda) {
    std::vector<Index> mirror;
    for (Index i = 0; i < lambda.size(); ++i) mirror.push_back(i);
    for (Index i = 0; i < lambda.size(); ++i)
      if (lambda[i].imag() != 0) {
        mirror[static_cast<size_t>(i)] = std::ssize(mirror);
        mirror.push_back(i);
      }
    return mirror;
  }

  /// Each root from its pole: what that would give were the others as far as they are from the pole. Turned, for from a
  /// symmetric start real roots would not become a pair, nor a pair real.
  void start() {
    constexpr Complex turned(1, 0.1);
    for (Index i = 0; i < count(); ++i) {
      const Index twin = mirror(i);
      Complex shift;
      if (twin < i) {
        shift = std::conj(delta_[twin] / turned);
      } else {
        Complex others = 1;
        for (Index j = 0; j < count(); ++j)
          if (j != i) others += p_[j] / (lambda_[j] - lambda_[i]);
        shift = p_[i] / (std::norm(others) < 0.01 ? 0.1 : others);
      }
      delta_.set(i, shift * turned);
    }
  }

  Sums at(Index j) const { return sums_at(lambda_, p_, lambda_[j], delta_[j]); }

  /// Ehrlich, Aberth: Newton on the polynomial with these roots, divided by the other roots.
  void iterate() {
    std::vector<char> found(mirror_.size(), 0);
    for (int round = 0; round < 100; ++round) {
      for (Index j = 0; j < count(); ++j) {
        char& done = found[static_cast<size_t>(j)];
        if (done) continue;
        const Sums s = at(j);
        const Complex f = 1.0 + s.one;
        done = std::abs(f) <= 4 * epsilon * (1 + s.size);
        if (done) continue;
        const Complex next = delta_[j] - 1.0 / (s.two / f - s.plain - repulsion(lambda_, delta_, j));
        if (!std::isfinite(std::norm(next))) throw NumericalError("exponential: two modes have one eigenvalue");
        delta_.set(j, next);
      }
      if (std::ranges::all_of(found, [](char done) { return done; })) return;
    }
    throw NumericalError("exponential: the eigenvalues of a contact state did not converge");
  }

  /// Roots off the real axis come twice.
  void pair_roots() {
    Index below = 0, above = 0;
    for (Index j = 0; j < count(); ++j) {
      const Sums s = at(j);
      const double round_off = 1e3 * epsilon * (1 + s.size) / std::abs(s.two), im = root(j).imag();
      if (std::abs(im) <= std::max(round_off, 1e-12 * std::abs(root(j)))) delta_.im[j] = -lambda_.im[j];
      if (!is_real(j)) ++(im < 0 ? below : above);
      if (is_real(j) || im > 0) roots_.push_back(j);
    }
    if (below != above)
      throw NumericalError(fmt::format(
          "exponential: of the eigenvalues of a contact state {} are above the real axis, {} below", above, below));
  }

  std::vector<Index> mirror_;
  Numbers lambda_, p_, delta_;
  std::vector<Index> roots_;
};

}  // namespace

Spectrum rank_one_spectrum(const VectorXcd& lambda, const VectorXd& w, const VectorXd& v) {
  const Index m = lambda.size();
  VectorXcd v_full(m), p(m);  // e by the eigenvectors themselves; a pair has half of what `v` has for it
  for (Index i = 0; i < m; ++i) {
    v_full[i] = lambda[i].imag() != 0 ? 0.5 * Complex(v[i], -v[m + i]) : Complex(v[i]);
    p[i] = Complex(w[i], w[m + i]) * v_full[i];
  }
  const Secular secular(lambda, p);
  const Index n = secular.count(), all = std::ssize(secular.roots());
  VectorXcd left(n), right(n);
  for (Index i = 0; i < n; ++i) {
    left[i] = i < m ? v_full[i] : std::conj(left[secular.mirror(i)]);
    right[i] = i < m ? Complex(w[i], w[m + i]) : std::conj(right[secular.mirror(i)]);
  }
  Spectrum s{VectorXcd(all), MatrixXd::Zero(2 * m, 2 * all), MatrixXd::Zero(2 * all, 2 * m)};
  VectorXcd r(n), l(n);
  for (Index k = 0; k < all; ++k) {
    const Index j = secular.roots()[static_cast<size_t>(k)];
    const bool is_real = secular.is_real(j);
    for (Index i = 0; i < n; ++i) {
      const Complex inverse = 1.0 / secular.distance(j, i);
      r[i] = right[i] * inverse;
      l[i] = left[i] * inverse;
    }
    const double size = r.norm();
    const Complex product = (r.array() * l.array()).sum();
    r /= size;
    l *= size / product;
    s.lambda[k] = is_real ? Complex(secular.root(j).real()) : secular.root(j);
    const double twice = is_real ? 1 : 2;
    for (Index i = 0; i < m; ++i) {
      const bool pair = secular.mirror(i) != i;
      const Complex r_other = pair ? r[secular.mirror(i)] : 0, l_other = pair ? l[secular.mirror(i)] : 0;
      const double half = pair ? 0.5 : 1;  // of a pair s.from_modes has twice the eigenvector
      const Complex plus = twice * half * (r[i] + r_other), minus = twice * half * (r[i] - r_other);
      s.from_modes(i, k) = plus.real();
      s.to_modes(k, i) = (l[i] + l_other).real();
      if (!is_real) s.from_modes(i, all + k) = -plus.imag(), s.to_modes(all + k, i) = (l[i] + l_other).imag();
      if (!pair) continue;
      s.from_modes(m + i, k) = minus.imag();
      s.to_modes(k, m + i) = -(l[i] - l_other).imag();
      if (!is_real) s.from_modes(m + i, all + k) = minus.real(), s.to_modes(all + k, m + i) = (l[i] - l_other).real();
    }
  }
  VectorXd z = VectorXd::Ones(2 * m);
  for (Index i = 0; i < m; ++i)
    if (secular.mirror(i) == i) z[m + i] = 0;
  const double lost = (s.from_modes * (s.to_modes * z) - z).cwiseAbs().maxCoeff();
  if (!(lost < 1e-8))
    throw NumericalError(
        fmt::format("exponential: a contact state has no full set of eigenvectors (they lose {:.2g})", lost));
  return s;
}

}  // namespace flexboom
