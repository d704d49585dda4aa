#include "fem/mesh/section_grid.hpp"

#include "fem/base/check.hpp"
#include "fem/mesh/shape_functions.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Vector2d;
using std::numbers::pi;

constexpr double core_size = 0.5;       // corner of the core from the centre, as a fraction of the first ring line
constexpr double core_bulge = 0.2;      // of the sides of the core, as a fraction of their distance from the centre
constexpr double rectangle_ring = 0.4;  // thickness of ring 0 of a rectangle, as a fraction of half its smaller side

int side_of(double u) { return std::clamp(static_cast<int>(u), 0, 3); }

// Quarter turns of a point of side 0.
Vector2d turned(const Vector2d& p, int side) {
  switch (side) {
    case 1:
      return {-p.y(), p.x()};
    case 2:
      return {-p.x(), -p.y()};
    case 3:
      return {p.y(), -p.x()};
    default:
      return p;
  }
}

Vector2d circle(double radius, double u, const SectionGrid& grid) {
  const int side = side_of(u);
  const double s = 2 * (u - side) - 1;
  const double even = side + (1 + s * (1 - grid.uneven * (1 - s * s))) / 2;
  const double angle = grid.slit > 0 ? std::lerp(grid.slit, 2 * pi - grid.slit, u / 4) : pi / 2 * (even - 0.5);
  return radius * Vector2d(std::cos(angle), std::sin(angle));
}

// Outline of the core of a round bar: each side a parabola.
Vector2d bulged_square(double corner, double u) {
  const int side = side_of(u);
  const double s = 2 * (u - side) - 1;
  return turned(corner / std::numbers::sqrt2 * Vector2d(1 + core_bulge * (1 - s * s), s), side);
}

Vector2d rectangle(double height, double width, double u) {
  const int side = side_of(u);
  const Vector2d unit = turned({1, 2 * (u - side) - 1}, side);
  return {unit.x() * height / 2, unit.y() * width / 2};
}

Vector2d between(const Vector2d& a, const Vector2d& b, double s) { return a + s * (b - a); }

double line(const SectionGrid& grid, int k) { return grid.lines[static_cast<size_t>(k)]; }

// The line tau = k (k = 0: outline of the core or of the hole).
Vector2d line_point(const RoundBar& bar, const SectionGrid& grid, double u, int k) {
  const double radius = bar.diameter / 2;
  return k == 0 ? bulged_square(core_size * radius * line(grid, 0), u) : circle(radius * line(grid, k - 1), u, grid);
}
Vector2d line_point(const Tube& tube, const SectionGrid& grid, double u, int k) {
  return circle(tube.diameter / 2 - (k == 0 ? tube.thickness : 0), u, grid);
}
Vector2d line_point(const Rectangle& shape, const SectionGrid& grid, double u, int k) {
  const double off = k == 0 && !grid.lines.empty() ? rectangle_ring * std::min(shape.height, shape.width) : 0;
  return rectangle(shape.height - off, shape.width - off, u);
}
Vector2d line_point(const RectangularTube& tube, const SectionGrid&, double u, int k) {
  const double off = k == 0 ? 2 * tube.thickness : 0;
  return rectangle(tube.height - off, tube.width - off, u);
}
Vector2d line_point(const GeneralSection&, const SectionGrid&, double, int) { return Vector2d::Zero(); }

/// P_n(x) by Bonnet's recursion.
double legendre(int n, double x) {
  double previous = 1, value = x;
  for (int k = 2; k <= n; ++k) {
    const double next = ((2 * k - 1) * x * value - (k - 1) * previous) / k;
    previous = value;
    value = next;
  }
  return n == 0 ? 1 : value;
}

}  // namespace

void require_grid(const SectionShape& shape) {
  require(!std::holds_alternative<GeneralSection>(shape),
          "a general section has no outline to mesh; give a round bar, tube, rectangle or rectangular tube");
}

bool has_core(const SectionShape& shape) {
  return std::holds_alternative<RoundBar>(shape) || std::holds_alternative<Rectangle>(shape);
}

Vector2d extent(const SectionShape& shape) {
  if (const auto* bar = std::get_if<RoundBar>(&shape)) return Vector2d::Constant(bar->diameter);
  if (const auto* tube = std::get_if<Tube>(&shape)) return Vector2d::Constant(tube->diameter);
  if (const auto* box = std::get_if<RectangularTube>(&shape)) return {box->height, box->width};
  const auto& rectangle = std::get<Rectangle>(shape);
  return {rectangle.height, rectangle.width};
}

double half_depth(const SectionShape& shape) { return extent(shape).minCoeff() / 2; }

double end_depth(const SectionShape& shape) {
  if (const auto* tube = std::get_if<Tube>(&shape)) return std::sqrt(half_depth(shape) * tube->thickness);
  if (const auto* box = std::get_if<RectangularTube>(&shape)) return std::sqrt(half_depth(shape) * box->thickness);
  return half_depth(shape);
}

Vector2d ring_point(const SectionGrid& grid, double u, double tau) {
  const int ring = std::clamp(static_cast<int>(tau), 0, std::max(0, static_cast<int>(grid.lines.size()) - 1));
  const auto on_line = [&](int k) {
    return std::visit([&](const auto& shape) { return line_point(shape, grid, u, k); }, grid.shape);
  };
  const double across = tau - ring;
  return across == 0 ? on_line(ring) : between(on_line(ring), on_line(ring + 1), across);
}

// Coons patch of the four sides.
Vector2d core_point(const SectionGrid& grid, double a, double b) {
  const auto outline = [&](double u) { return ring_point(grid, u, 0); };
  const Vector2d corners = between(between(outline(3), outline(0), a), between(outline(2), outline(1), a), b);
  return between(outline(3 - b), outline(b), a) + between(outline(3 + a), outline(2 - a), b) - corners;
}

Eigen::VectorXd lobatto_weights(int order) {
  Eigen::VectorXd weights = lobatto_basis(order).nodes();
  for (double& w : weights) {
    const double p = legendre(order, w);
    w = 2 / (order * (order + 1) * p * p);
  }
  return weights;
}

}  // namespace flexboom
