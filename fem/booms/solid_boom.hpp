#pragma once

#include "fem/booms/boom.hpp"

#include <optional>
#include <string>

namespace flexboom {

/// Sizes of a solid mesh of a boom. What is 0 (or negative, where 0 means none) is chosen from SolidOptions::accuracy.
struct SolidGrading {
  int sectors = 0;         // elements per quarter of a circle; per shorter side of a rectangle
  int rings = 0;           // elements from the core to the surface, or through a wall
  int long_elements = 0;   // along the whole boom, beside the graded ends
  int end_layers = -1;     // layers that grow away from clamps and steps
  double first_layer = 0;  // thickness of the first of them, in half depths (thin walls: sqrt(half depth * wall))
  double growth = 0;       // of one layer to the next, above 1
  int corner_levels = -1;  // refinements toward the rims of clamps and steps
  double factor = 0;       // of each of them, in (0, 1)
  int edge_levels = -1;    // cuts toward edges along the boom: re-entrant ones, those of slits and of long sides
};

/// The best that is known of a mesh: that of the finest which SolidOptions choose.
constexpr double best_mesh_accuracy = 1e-8;

/// How make_solid_mesh meshes a boom.
struct SolidOptions {
  std::string element = "hex";  // or hex8, hex8-reduced, hex20, hex20-reduced, hex27, tet4, tet10
  double accuracy = 1e-4;       // wanted relative error of the first ten frequencies; chooses what is left open
  int order = 0;                // of "hex": 1 to 8, 0: chosen
  double slit = 0;              // width of a slit along every tube, at +y, measured on the midline [m]; 0: closed
  SolidGrading grading{};
  bool holds_tip = false;  // the face of the tip is held, so that elements are small there as at the root
};

/// Order and sizes that make_solid_mesh takes, nothing left open.
/// @throws InputError as make_solid_mesh.
SolidOptions chosen(const BeamGeometry&, const SolidOptions&);

/// A mesh of hexahedra "hex" that is `steps` steps finer than a complete one (`chosen`), coarser where negative. A step
/// raises the order and the refinement of singular rims by one; beyond the highest order it halves all elements.
/// "hex8", "hex20", "tet10" and their like have no finer mesh of their own kind: their step leads to "hex" on the same
/// grading. Empty: there is none so coarse.
std::optional<SolidOptions> refined(const SolidOptions& complete, int steps);

/// Hexahedra (or tetrahedra from cutting them) on the exact geometry of a boom, in the axes of BeamGeometry. Inside an
/// element the geometry is the polynomial through its nodes. Nodes of flat surfaces lie on them. Those of round
/// surfaces are a little off, all by one factor. The polynomials enclose the area of the circle, so mass is exact for
/// any order.
///
/// Where a clamped face ends at a free surface the stress is infinite (for nu = 0.33 it grows like distance^-0.29),
/// which limits any order; `grading` makes elements small there, at the re-entrant rims of steps and along the inner
/// edges of rectangular tubes. Steps are meshed between round bars; other sections may change by taper only.
///
/// Node sets: "root", "tip" (their faces), "side" (the outer surface), "tip_center" where a node is there, and one per
/// named attachment (its reference node). Element sets "segment_1", ... . One SolidProperty per different material.
///
/// An attachment at the tip is bolted to the face: its reference node holds the nodes of the face as one rigid body
/// (RigidConnection). Elsewhere it rides on the mean motion of its section (DistributingConnection). A rigid section
/// inside the boom would add stiffness that a lumped mass does not have.
///
/// @throws InputError naming the first fault: as BeamGeometry::validate, a section without outline, a step that cannot
/// be meshed, an element, order or size that does not exist.
Mesh make_solid_mesh(const BeamGeometry&, const SolidOptions& = {});

}  // namespace flexboom
