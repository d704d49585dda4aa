#include "reduction/invariants/eq14.hpp"

#include "fem/base/check.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>
#include <utility>

namespace flexboom::eq14 {
namespace {

/// A number as the unevaluated sum hi + lo of two doubles.
/// At k = 50 one unit in the last place of alpha is 2.8e-14 rad, so one double would spend a third of the error allowed
/// in phi.
struct Pair {
  double hi = 0;
  double lo = 0;
};

/// pi / 2 to 33 digits.
constexpr Pair half_pi = {std::numbers::pi / 2, 6.123233995736766e-17};

/// Everything about a shape that does not depend on x.
struct Eq14Shape {
  Pair alpha;
  double sigma = 0;
  double one_minus_sigma = 0;
  double half_beta = 0;  // (1 - sigma) e^alpha / 2, of the order of 1 for every k
};

/// alpha = (2k - 1) pi/2 + delta turns cos a cosh a = -1 into sin delta = -(-1)^k / cosh a: delta is small, and Newton
/// gives it with its own relative precision however large alpha is.
Pair root(int k) {
  const double odd = 2.0 * k - 1;
  const double sign = k % 2 == 1 ? 1 : -1;
  const double c = odd * half_pi.hi;
  const double c_lo = std::fma(odd, half_pi.hi, -c) + odd * half_pi.lo;
  double delta = 0;
  for (int i = 0; i < 30; ++i) {
    const double sech = 1 / std::cosh(c + delta);
    const double residual = std::sin(delta) - sign * sech;
    const double step = residual / (std::cos(delta) + sign * sech * std::tanh(c + delta));
    delta -= step;
    if (std::abs(step) <= 1e-17 * std::abs(delta)) break;
  }
  const double hi = c + (c_lo + delta);
  return {hi, (c - hi) + (c_lo + delta)};
}

Eq14Shape make_shape(int k) {
  require(k >= 1, "eq14: the mode number must be 1 or more, got " + std::to_string(k));
  const Pair a = root(k);
  const double e = std::exp(-a.hi) * (1 - a.lo);
  const double sine = std::sin(a.hi) + a.lo * std::cos(a.hi);
  const double cosine = -2 * e / (1 + e * e);  // cos a = -1 / cosh a, with all its digits
  // sigma and 1 - sigma with numerator and denominator multiplied by 2 e^-a, so that nothing overflows.
  const double denominator = 1 + e * e + 2 * e * cosine;
  const double sigma = (1 - e * e - 2 * e * sine) / denominator;
  const double beta = 2 * (e + cosine + sine) / denominator;
  return {a, sigma, beta * e, beta / 2};
}

/// The four functions of eq. 14 in their stable form, at y = alpha x.
struct Terms {
  double decay;      // e^-y
  double cosh_part;  // (1 - sigma) cosh y
  double sinh_part;  // (1 - sigma) sinh y
  double cosine;
  double sine;
};

Terms terms(const Eq14Shape& s, double x) {
  const double y = s.alpha.hi * x;
  const double y_lo = std::fma(s.alpha.hi, x, -y) + s.alpha.lo * x;
  // (1 - sigma) e^y = beta e^-(alpha - y): the growing exponential is measured from the tip and never exceeds 1.
  const double from_tip = std::exp(-s.alpha.hi * (1 - x));
  const double mirrored = std::exp(-s.alpha.hi * (1 + x));
  return {std::exp(-y), s.half_beta * (from_tip + mirrored), s.half_beta * (from_tip - mirrored),
          std::cos(y) - y_lo * std::sin(y), std::sin(y) + y_lo * std::cos(y)};
}

double tip_sign(int k) { return k % 2 == 1 ? 1 : -1; }

/// What a coordinate of the reduced body is: shape k in the plane of `direction` (1: y, 2: z).
struct Column {
  int k;
  int direction;
};

std::vector<Column> make_columns(int n, Planes planes) {
  std::vector<Column> columns;
  for (int direction = 1; direction <= (planes == Planes::xy ? 1 : 2); ++direction) {
    for (int k = 1; k <= n; ++k) columns.push_back({k, direction});
  }
  return columns;
}

/// Displacement along the direction of a column and the rotation that goes with the slope, tip value +2, at x in [0,
/// 1]. The slope dw_y/dx turns the section about +z, dw_z/dx about -y.
Eigen::Vector3d displacement(const Column& c, double x) {
  return tip_sign(c.k) * phi(c.k, x) * Eigen::Vector3d::Unit(c.direction);
}
Eigen::Vector3d rotation(const Column& c, double x, double length) {
  return Eigen::Vector3d::UnitX().cross(tip_sign(c.k) * dphi(c.k, x) / length * Eigen::Vector3d::Unit(c.direction));
}

Eigen::Matrix3Xd shape_matrix(const std::vector<Column>& columns, double x) {
  Eigen::Matrix3Xd S(3, columns.size());
  for (Eigen::Index i = 0; i < S.cols(); ++i) S.col(i) = displacement(columns[static_cast<size_t>(i)], x);
  return S;
}

/// sum dm z z^T with z = (1, u0, S_1, ..., S_n). Shapes are s_k phi_k e with s_k = +-1: int phi = 2 sigma / alpha, int
/// x phi = 2 / alpha^2 and int phi_k phi_l = delta_kl make every entry exact, and exactly zero where it is zero.
Eigen::MatrixXd gram_matrix(const Boom& boom, const std::vector<Column>& columns) {
  const double m = boom.mass_per_length * boom.length;
  const auto row_of = [](size_t i) { return 4 + 3 * static_cast<Eigen::Index>(i); };
  const Eigen::Index size = row_of(columns.size());
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(size, size);
  gram(0, 0) = m;
  gram(0, 1) = gram(1, 0) = m * boom.length / 2;
  gram(1, 1) = m * boom.length * boom.length / 3;
  for (size_t i = 0; i < columns.size(); ++i) {
    const Column& c = columns[i];
    const Eigen::Index row = row_of(i) + c.direction;
    gram(0, row) = gram(row, 0) = m * tip_sign(c.k) * integral_phi(c.k);
    gram(1, row) = gram(row, 1) = m * boom.length * tip_sign(c.k) * integral_x_phi(c.k);
    for (size_t j = 0; j < columns.size(); ++j) {
      if (columns[j].k == c.k) gram(row, row_of(j) + columns[j].direction) = m;
    }
  }
  return gram;
}

DisplayShape make_display(const Boom& boom, const std::vector<Column>& columns) {
  constexpr int points = 21;
  DisplayShape display;
  display.points = Eigen::Matrix3Xd::Zero(3, points);
  display.lines.resize(1);
  for (int i = 0; i < points; ++i) {
    const double x = i / (points - 1.0);
    display.points(0, i) = x * boom.length;
    display.S.push_back(shape_matrix(columns, x));
    display.lines[0].push_back(i);
  }
  return display;
}

Marker tip_marker(const Boom& boom, const std::vector<Column>& columns) {
  Marker tip{"tip", boom.length * Eigen::Vector3d::UnitX(), shape_matrix(columns, 1), {}};
  tip.S_theta.resize(3, tip.S.cols());
  for (Eigen::Index i = 0; i < tip.S.cols(); ++i) {
    tip.S_theta.col(i) = rotation(columns[static_cast<size_t>(i)], 1, boom.length);
  }
  return tip;
}

void require_positive(double value, const char* name) {
  require(std::isfinite(value) && value > 0,
          std::string("eq14 boom: ") + name + " must be positive, got " + std::to_string(value));
}

}  // namespace

double alpha(int k) { return make_shape(k).alpha.hi; }

double sigma(int k) { return make_shape(k).sigma; }

double one_minus_sigma(int k) { return make_shape(k).one_minus_sigma; }

double phi(int k, double x) {
  const Eq14Shape s = make_shape(k);
  const Terms t = terms(s, x);
  return t.decay + t.sinh_part - t.cosine + s.sigma * t.sine;
}

double dphi(int k, double x) {
  const Eq14Shape s = make_shape(k);
  const Terms t = terms(s, x);
  return s.alpha.hi * (-t.decay + t.cosh_part + t.sine + s.sigma * t.cosine);
}

double ddphi(int k, double x) {
  const Eq14Shape s = make_shape(k);
  const Terms t = terms(s, x);
  return s.alpha.hi * s.alpha.hi * (t.decay + t.sinh_part + t.cosine - s.sigma * t.sine);
}

double phi_as_printed(int k, double x) {
  const double a = alpha(k);
  const double printed_sigma = (std::sinh(a) - std::sin(a)) / (std::cosh(a) + std::cos(a));
  const double y = a * x;
  return std::cosh(y) - std::cos(y) - printed_sigma * (std::sinh(y) - std::sin(y));
}

double integral_phi(int k) {
  const Eq14Shape s = make_shape(k);
  return 2 * s.sigma / s.alpha.hi;
}

double integral_x_phi(int k) {
  const double a = alpha(k);
  return 2 / (a * a);
}

double omega(const Boom& boom, int k) {
  const double a = alpha(k) / boom.length;
  return a * a * std::sqrt(boom.bending_stiffness / boom.mass_per_length);
}

ReducedBody reduced_body(const Boom& boom, int n, Planes planes, std::string name) {
  require_positive(boom.length, "length");
  require_positive(boom.mass_per_length, "mass_per_length");
  require_positive(boom.bending_stiffness, "bending_stiffness");
  require(n >= 0, "eq14 boom: the number of shapes must not be negative, got " + std::to_string(n));

  const std::vector<Column> columns = make_columns(n, planes);
  ReducedBody body = blank_body(std::move(name), static_cast<int>(columns.size()));
  body.structure = "eq14";
  set_invariants(body, gram_matrix(boom, columns));
  for (Eigen::Index i = 0; i < body.n(); ++i) {
    const Column& c = columns[static_cast<size_t>(i)];
    const double omega_k = omega(boom, c.k);
    body.Ke(i, i) = body.m * (omega_k * omega_k);
    body.coordinates.push_back({c.direction == 1 ? "bending_y" : "bending_z", omega_k / (2 * std::numbers::pi)});
  }
  body.markers.push_back(tip_marker(boom, columns));
  body.display = make_display(boom, columns);
  body.validate();
  return body;
}

}  // namespace flexboom::eq14
