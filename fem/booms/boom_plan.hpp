#pragma once

#include "fem/booms/boom_profile.hpp"
#include "fem/booms/solid_boom.hpp"
#include "fem/mesh/section_grid.hpp"

#include <array>
#include <vector>

// Where the planes and ring lines of a solid boom mesh are.
namespace flexboom {

/// Segments that follow one another without a step.
struct BoomRun {
  int first = 0;  // segments
  int last = 0;
  int rings = 1;
  double from = 0;  // [m]
  double to = 0;
  std::vector<double> start_lines;  // SectionGrid::lines at both ends; linear in between
  std::vector<double> end_lines;
};

struct BoomPlan {
  SolidOptions options;  // nothing left open
  std::vector<BoomRun> runs;
  std::vector<BoomLayer> layers;
  std::vector<ProfileCorner> corners;        // singular
  std::array<std::vector<double>, 4> sides;  // where sectors of each side end, in [0, 1], the ends included
  std::vector<double> ring_cuts;             // where quadrilaterals of a ring end, in (0, 1]
  bool core = false;
};

/// An element of order 4 or more may be so many of its widths long.
inline constexpr int longest_element = 4;

/// Is it solid or hollow, with flat sides?
bool is_rectangle(const SectionShape&);

/// Where quadrilaterals of a ring end, in (0, 1]. Walls of rectangular tubes are cut toward their inner edges.
std::vector<double> cuts_of_ring(const BeamGeometry&, const SolidGrading&);

/// @throws InputError as make_solid_mesh.
BoomPlan plan_of(const BeamGeometry&, const SolidOptions&);

/// Section of a run at x [m].
SectionGrid section_at(const BeamGeometry&, const BoomPlan&, int run, double x);

}  // namespace flexboom
