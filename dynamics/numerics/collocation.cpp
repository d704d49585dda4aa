#include "dynamics/numerics/collocation.hpp"

#include <Eigen/LU>

#include <array>
#include <cmath>

namespace flexboom::collocation {
namespace {

constexpr int middle = degree / 2;

/// The ends and the extrema of the Legendre polynomial, by Newton from Chebyshev's points.
std::array<double, points> lobatto() {
  std::array<double, points> c{};
  for (int j = 0; j < points; ++j) {
    double x = -std::cos(3.14159265358979323846 * j / degree);
    for (int round = 0; round < 50 && j > 0 && j < degree; ++round) {
      double p0 = 1, p1 = x;  // P_(n-1), P_n
      for (int n = 2; n <= degree; ++n) {
        const double p2 = ((2 * n - 1) * x * p1 - (n - 1) * p0) / n;
        p0 = p1, p1 = p2;
      }
      // P'_n (1 - x^2) = n (P_(n-1) - x P_n), and (1 - x^2) P''_n = 2 x P'_n - n (n + 1) P_n
      const double slope = degree * (p0 - x * p1) / (1 - x * x);
      const double bend = (2 * x * slope - degree * (degree + 1) * p1) / (1 - x * x);
      x -= slope / bend;
    }
    c[static_cast<size_t>(j)] = 0.5 * (1 + x);
  }
  return c;
}

const std::array<double, points>& nodes() {
  static const std::array<double, points> c = lobatto();
  return c;
}

}  // namespace

double node(int j) { return nodes()[static_cast<size_t>(j)]; }

const Table& coefficients() {
  static const Table table = [] {
    Table V;
    for (int j = 0; j < points; ++j) V.row(j) = monomials(node(j)).transpose();
    return Table(V.inverse().transpose());
  }();
  return table;
}

Values monomials(double c) {
  Values v;
  v[0] = 1;
  for (int m = 1; m < points; ++m) v[m] = v[m - 1] * c;
  return v;
}

Values integrals(double c) {
  Values v = monomials(c) * c;
  for (int m = 0; m < points; ++m) v[m] /= m + 1;
  return v;
}

Values double_integrals(double c) {
  Values v = integrals(c) * c;
  for (int m = 0; m < points; ++m) v[m] /= m + 2;
  return v;
}

const Values& middle_difference() {
  static const Values weights = [] {
    Values w;
    for (int j = 0; j < points; ++j) {
      w[j] = j == middle ? 1 : -1;
      if (j == middle) continue;
      for (int k = 0; k < points; ++k)
        if (k != j && k != middle) w[j] *= (node(middle) - node(k)) / (node(j) - node(k));
    }
    return w;
  }();
  return weights;
}

Values middle_polynomial() { return coefficients().row(middle).transpose(); }

}  // namespace flexboom::collocation
