#pragma once

#include <vector>

// The rings of a boom in the (tau, x) plane: quadrilaterals that are swept around the axis to hexahedra.
namespace flexboom {

/// A stretch of a boom between two planes of nodes.
struct BoomLayer {
  double from = 0;  // [m]
  double to = 0;
  int segment = 0;
  int run = 0;      // segments that follow one another without a step
  int columns = 0;  // of quadrilaterals across the rings, 0: a core alone
};

/// A corner of the profile where the stress is infinite: column line and plane (both counted from 0).
struct ProfileCorner {
  int column = 0;
  int plane = 0;
};

struct ProfileOptions {
  int order = 1;
  std::vector<double> ring_cuts = {1};  // where the columns of a ring end, in (0, 1]
  int levels = 0;                       // refinements toward the corners
  double factor = 0.15;                 // of each refinement
  std::vector<ProfileCorner> corners;
};

struct ProfileNode {
  double tau = 0;
  double x = 0;  // [m]
  int run = 0;
};

struct ProfileQuad {
  std::vector<int> nodes;  // (order + 1)^2 Lobatto nodes: first index along one edge (fastest), then along the next
  int layer = 0;
};

/// Nodes are the corner points first, then those on edges and inside.
struct Profile {
  std::vector<ProfileNode> nodes;
  std::vector<ProfileQuad> quads;
  std::vector<int> axis;  // nodes on tau = 0 by ascending x, order per layer and one more
  std::vector<int> side;  // nodes on the outer line of every run, ascending
};

/// Quadrilaterals between column lines and planes. A quadrilateral ABCD with a singular corner A is cut `levels` times
/// along the diagonal through A. The points at `factor` on AB, AD and AC make a small quadrilateral at A and two
/// trapezoids. BC and CD stay whole, and whatever shares AB or AD has its corner at A as well. So the mesh conforms
/// without rings along the whole boom. Such meshes are the geometric meshes of hp-FEM (Schwab, p- and hp-Finite Element
/// Methods, 1998, ch. 4).
Profile make_profile(const std::vector<BoomLayer>&, const ProfileOptions&);

}  // namespace flexboom
