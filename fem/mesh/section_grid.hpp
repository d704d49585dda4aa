#pragma once

#include "fem/mesh/section.hpp"

#include <Eigen/Core>

#include <array>
#include <vector>

// Cross-sections in logical coordinates, for structured meshes of booms.
//
// A section is a core and rings around it. A point of ring k has tau in [k, k + 1] across the ring and u in [0, 4]
// around it. Side 0 faces +y, side 1 faces +z. u is an integer at the corners of a rectangle and at +-45 degrees of a
// circle. A point of the core has a, b in [0, 1], along y and z; its outline is tau = 0. Tubes have rings only. The
// shape of the core is free: its sides are arcs of parabolas, so that the angles of the quadrilaterals stay away from
// 180 degrees.
namespace flexboom {

/// A section with its ring lines.
struct SectionGrid {
  SectionShape shape;  // RoundBar, Tube, Rectangle or RectangularTube
  std::vector<double>
      lines;          // where rings end as fractions of the outline, ascending, the last is 1; empty: a core alone
  double uneven = 0;  // angles of a side are pi/4 s (1 - uneven (1 - s^2)), s in [-1, 1]
  double slit = 0;    // half the angle of the slit of a Tube at +y [rad]; 0: closed
};

/// @throws InputError unless the shape is one that a grid exists for.
void require_grid(const SectionShape&);

/// Whether the inside of ring 0 is material.
bool has_core(const SectionShape&);

/// Half of the smaller outer dimension [m].
double half_depth(const SectionShape&);

/// Depth to which a clamp disturbs the stresses of a beam [m]: half the smaller side, in walls sqrt(that * thickness).
double end_depth(const SectionShape&);

/// Outer dimensions along y and z [m].
Eigen::Vector2d extent(const SectionShape&);

/// Position (y, z) [m] of a point of the rings.
Eigen::Vector2d ring_point(const SectionGrid&, double u, double tau);

/// Position (y, z) [m] of a point of the core.
Eigen::Vector2d core_point(const SectionGrid&, double a, double b);

/// Weights of the order + 1 Gauss-Lobatto-Legendre points of [-1, 1] (sum 2).
Eigen::VectorXd lobatto_weights(int order);

}  // namespace flexboom
