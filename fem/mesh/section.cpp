#include "fem/mesh/section.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <type_traits>
#include <utility>

namespace flexboom {
namespace {

using std::numbers::pi;

double square(double x) { return x * x; }
double fourth(double x) { return square(square(x)); }

void require_positive(double value, const char* what) {
  require(std::isfinite(value) && value > 0, fmt::format("{}: is {}; it must be positive", what, value));
}

bool is_number(const ShearRule& rule) { return rule.name == "value"; }
bool is_nu_squared(const ShearRule& rule) { return rule.name == "nu-squared"; }

void validate(const ShearRule& rule) {
  require(rule.name == "cowper" || is_nu_squared(rule) || is_number(rule),
          fmt::format(R"(shear rule: "{}" is not known; there are "cowper", "nu-squared", "value")", rule.name));
  if (is_number(rule)) require_positive(rule.value, "shear coefficient");
}

// sum over odd n of tanh(n pi r / 2) / n^5. The tail where tanh is 1 is summed exactly: 31/32 zeta(5).
double odd_tanh_series(double r) {
  constexpr double zeta5 = 1.036927755143369926331;
  double sum = 31 * zeta5 / 32;
  for (int n = 1; n < 2000; n += 2) {
    const double term = 2 / (std::exp(n * pi * r) + 1) / (n * fourth(n));  // 1 - tanh(x) = 2 / (e^2x + 1)
    sum -= term;
    if (term < 1e-18) break;
  }
  return sum;
}

// St-Venant torsion constant of a rectangle (Timoshenko & Goodier 1970, art. 109).
double rectangle_torsion(double side_1, double side_2) {
  const double a = std::max(side_1, side_2);
  const double b = std::min(side_1, side_2);
  return a * b * b * b * (1.0 / 3 - 64 / std::pow(pi, 5) * (b / a) * odd_tanh_series(a / b));
}

// Hutchinson 2001, rectangle: depth 2a along the force, width 2b across it.
//   kappa = -2 (1 + nu) / (9 C4 / (4 a^5 b) + nu (1 - b^2 / a^2)),
//   C4 = 4/45 a^3 b (-12 a^2 - 15 nu a^2 + 5 nu b^2) + sum 16 nu^2 b^5 (n pi a - b tanh(n pi a / b)) / ((n pi)^5 (1 +
//   nu)).
// The sum splits into zeta(4) and zeta(5) minus a remainder that converges like exp(-2 pi n a / b). With r = b / a:
double rectangle_nu_squared(double depth, double width, double nu) {
  constexpr double zeta5 = 1.036927755143369926331;
  const double r = width / depth;
  double tanh_sum = zeta5;
  for (int n = 1; n < 4000; ++n) {
    const double term = 2 / (std::exp(2 * n * pi / r) + 1) / (n * fourth(n));
    tanh_sum -= term;
    if (term < 1e-18) break;
  }
  const double series = 16 * nu * nu * fourth(r) / (1 + nu) * (1.0 / 90 - r * tanh_sum / std::pow(pi, 5));
  const double C4 = 4.0 / 45 * (-12 - 15 * nu + 5 * nu * r * r) + series;  // of a^5 b
  const double kappa = -2 * (1 + nu) / (9.0 / 4 * C4 + nu * (1 - r * r));
  require(
      std::isfinite(kappa) && kappa > 0,
      fmt::format(
          "shear rule \"nu-squared\": has no positive value for a rectangle {:.3g} times as wide as deep with nu = {}; "
          "use \"cowper\" or a number",
          r, nu));
  return kappa;
}

// Cowper 1966, thin-walled box; depth and width of the midline, one thickness all around.
double box_cowper(double depth, double width, double nu) {
  const double m = width / depth;  // area of flanges over area of webs
  const double n2 = square(width / depth);
  const double denominator = 12 + m * (72 + m * (150 + m * 90)) + nu * (11 + m * (66 + m * (135 + m * 90))) +
                             10 * n2 * ((3 + nu) * m + 3 * m * m);
  return 10 * (1 + nu) * square(1 + 3 * m) / denominator;
}

Section section(const RoundBar& bar, double nu, const ShearRule& rule) {
  require_positive(bar.diameter, "round bar: diameter [m]");
  Section s;
  s.A = pi * square(bar.diameter) / 4;
  s.Iy = s.Iz = pi * fourth(bar.diameter) / 64;
  s.J = 2 * s.Iy;
  s.kappa_y = s.kappa_z = is_nu_squared(rule) ? 6 * square(1 + nu) / (7 + nu * (12 + nu * 4))  // Kaneko 1975
                                              : 6 * (1 + nu) / (7 + 6 * nu);                   // Cowper 1966
  return s;
}

// Cowper 1966, hollow circle.
double tube_cowper(double a, double b, double nu) {
  const double c = square(1 + square(b / a));
  return 6 * (1 + nu) * c / ((7 + 6 * nu) * c + (20 + 12 * nu) * square(b / a));
}

// Hutchinson 2001, hollow circle.
double tube_nu_squared(double a, double b, double nu) {
  const double a4 = fourth(a), b4 = fourth(b), ab = square(a * b);
  const double denominator =
      7 * a4 + 34 * ab + 7 * b4 + nu * (12 * a4 + 48 * ab + 12 * b4) + nu * nu * (4 * a4 + 16 * ab + 4 * b4);
  return 6 * square(a * a + b * b) * square(1 + nu) / denominator;
}

Section section(const Tube& tube, double nu, const ShearRule& rule) {
  require_positive(tube.diameter, "tube: diameter [m]");
  require_positive(tube.thickness, "tube: thickness [m]");
  require(2 * tube.thickness <= tube.diameter,
          fmt::format("tube: thickness {} m is more than half the diameter {} m", tube.thickness, tube.diameter));
  const double a = tube.diameter / 2;
  const double b = a - tube.thickness;
  Section s;
  s.A = pi * tube.thickness * (a + b);  // pi (a^2 - b^2) without cancellation
  s.Iy = s.Iz = s.A * (a * a + b * b) / 4;
  s.J = 2 * s.Iy;
  s.kappa_y = s.kappa_z = is_nu_squared(rule) ? tube_nu_squared(a, b, nu) : tube_cowper(a, b, nu);
  return s;
}

Section section(const Rectangle& shape, double nu, const ShearRule& rule) {
  require_positive(shape.height, "rectangle: height [m]");
  require_positive(shape.width, "rectangle: width [m]");
  Section s;
  s.A = shape.height * shape.width;
  s.Iy = s.A * square(shape.width) / 12;
  s.Iz = s.A * square(shape.height) / 12;
  s.J = rectangle_torsion(shape.height, shape.width);
  if (is_nu_squared(rule)) {
    s.kappa_y = rectangle_nu_squared(shape.height, shape.width, nu);
    s.kappa_z = rectangle_nu_squared(shape.width, shape.height, nu);
  } else {
    s.kappa_y = s.kappa_z = 10 * (1 + nu) / (12 + 11 * nu);  // Cowper 1966
  }
  return s;
}

Section section(const RectangularTube& tube, double nu, const ShearRule& rule) {
  require_positive(tube.height, "rectangular tube: height [m]");
  require_positive(tube.width, "rectangular tube: width [m]");
  require_positive(tube.thickness, "rectangular tube: thickness [m]");
  require(2 * tube.thickness < std::min(tube.height, tube.width),
          fmt::format("rectangular tube: thickness {} m leaves no hole in {} m x {} m", tube.thickness, tube.height,
                      tube.width));
  require(!is_nu_squared(rule),
          R"(shear rule "nu-squared": not known for a rectangular tube; use "cowper" (thin walls) or a number)");
  const double h = tube.height, w = tube.width, t = tube.thickness;
  const double hi = h - 2 * t, wi = w - 2 * t;  // hole
  const double hm = h - t, wm = w - t;          // midline
  Section s;
  s.A = 2 * t * (hm + wm);
  s.Iy = (h * w * square(w) - hi * wi * square(wi)) / 12;
  s.Iz = (w * h * square(h) - wi * hi * square(hi)) / 12;
  s.J = 2 * t * square(hm * wm) / (hm + wm);  // Bredt, thin walls
  s.kappa_y = box_cowper(hm, wm, nu);
  s.kappa_z = box_cowper(wm, hm, nu);
  return s;
}

Section section(const GeneralSection& s, double, const ShearRule&) {
  require_positive(s.A, "general section: A [m^2]");
  require_positive(s.Iy, "general section: Iy [m^4]");
  require_positive(s.Iz, "general section: Iz [m^4]");
  require_positive(s.J, "general section: J [m^4]");
  require_positive(s.kappa_y, "general section: kappa_y");
  require_positive(s.kappa_z, "general section: kappa_z");
  constexpr double thinnest = 1e-20;  // a strip a million times as wide as thick has 1e-7
  for (const auto& [I, name] : {std::pair{s.Iy, "Iy"}, std::pair{s.Iz, "Iz"}, std::pair{s.J, "J"}})
    require(I >= thinnest * square(s.A),
            fmt::format("general section: {} is {} m^4, and no section of {} m^2 has so little", name, I, s.A));
  return s;
}

using std::lerp;

SectionShape between(const RoundBar& a, const RoundBar& b, double s) {
  return RoundBar{lerp(a.diameter, b.diameter, s)};
}
SectionShape between(const Tube& a, const Tube& b, double s) {
  return Tube{lerp(a.diameter, b.diameter, s), lerp(a.thickness, b.thickness, s)};
}
SectionShape between(const Rectangle& a, const Rectangle& b, double s) {
  return Rectangle{lerp(a.height, b.height, s), lerp(a.width, b.width, s)};
}
SectionShape between(const RectangularTube& a, const RectangularTube& b, double s) {
  return RectangularTube{lerp(a.height, b.height, s), lerp(a.width, b.width, s), lerp(a.thickness, b.thickness, s)};
}
SectionShape between(const GeneralSection& a, const GeneralSection& b, double s) {
  return GeneralSection{lerp(a.A, b.A, s), lerp(a.Iy, b.Iy, s),           lerp(a.Iz, b.Iz, s),
                        lerp(a.J, b.J, s), lerp(a.kappa_y, b.kappa_y, s), lerp(a.kappa_z, b.kappa_z, s)};
}

}  // namespace

void Material::validate() const {
  validate_of_beam();
  require(nu < 0.5, fmt::format("material: nu is {}; it must lie between -1 and 0.5", nu));
}

void Material::validate_of_beam() const {
  require_positive(E, "material: E [Pa]");
  require(nu > -1 && std::isfinite(nu), fmt::format("material: nu is {}; it must lie between -1 and 0.5", nu));
  require(std::isfinite(rho) && rho >= 0, fmt::format("material: rho is {} kg/m^3; it must be zero or positive", rho));
}

Section section_of(const SectionShape& shape, double nu, const ShearRule& rule) {
  validate(rule);
  Section result = std::visit([&](const auto& s) { return section(s, nu, rule); }, shape);
  if (is_number(rule) && !std::holds_alternative<GeneralSection>(shape)) result.kappa_y = result.kappa_z = rule.value;
  return result;
}

SectionShape interpolate(const SectionShape& a, const SectionShape& b, double s) {
  require(a.index() == b.index(), "taper: the start and the end must be sections of one kind");
  return std::visit([&](const auto& start) { return between(start, std::get<std::decay_t<decltype(start)>>(b), s); },
                    a);
}

}  // namespace flexboom
