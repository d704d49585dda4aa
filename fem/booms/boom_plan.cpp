#include "fem/booms/boom_plan.hpp"

#include "fem/base/check.hpp"
#include "fem/base/round_off.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexboom {
namespace {

// A quarter of a circle in one element of degree p. Quadratic fields (the contraction across in bending) are sines of
// twice the angle. Polynomials follow those better when nodes lie slightly nearer the middle. The bending frequencies
// of a bar of order 4 are wrong by 3e-6 instead of 1.6e-5.
double uneven_quarter(int order) { return order <= 4 ? 0.05 : 0.022; }
constexpr int most_sectors = 6;  // of a side: a plate bends in waves much longer than it is thick

bool same(double a, double b) { return std::abs(a - b) <= relative_round_off * std::max(std::abs(a), std::abs(b)); }

bool same(const SectionShape& a, const SectionShape& b) {
  if (a.index() != b.index()) return false;
  return extent(a).isApprox(extent(b), relative_round_off) && same(end_depth(a), end_depth(b));
}

double start_of(const BeamGeometry& boom, int segment) {
  double x = 0;
  for (int i = 0; i < segment; ++i) x += boom.segments[static_cast<size_t>(i)].length;
  return x;
}

/// Is the face of the tip rigid, or held?
bool is_tip_stiff(const BeamGeometry& boom, const SolidOptions& options) {
  if (options.holds_tip) return true;
  const double length = boom.length();
  return std::any_of(boom.attachments.begin(), boom.attachments.end(),
                     [&](const RigidAttachment& a) { return a.position >= length * (1 - same_station); });
}

// ---- runs and their ring lines

std::vector<BoomRun> split_into_runs(const BeamGeometry& boom) {
  std::vector<BoomRun> runs;
  double x = 0;
  for (int i = 0; i < static_cast<int>(boom.segments.size()); ++i) {
    const BeamSegment& segment = boom.segments[static_cast<size_t>(i)];
    const SectionShape* before = i == 0 ? nullptr : &boom.segments[static_cast<size_t>(i) - 1].end;
    if (before == nullptr || !same(*before, segment.start)) {
      require(before == nullptr ||
                  (std::holds_alternative<RoundBar>(*before) && std::holds_alternative<RoundBar>(segment.start)),
              fmt::format("segments[{}]: its section differs from the end of segments[{}]; solid meshes have steps "
                          "between round bars only: use a taper, or beams",
                          i, i - 1));
      runs.push_back({i, i, 1, x, x, {}, {}});
    }
    x += segment.length;
    runs.back().last = i;
    runs.back().to = x;
  }
  return runs;
}

double depth_at_start(const BeamGeometry& boom, const BoomRun& run) {
  return half_depth(boom.segments[static_cast<size_t>(run.first)].start);
}
double depth_at_end(const BeamGeometry& boom, const BoomRun& run) {
  return half_depth(boom.segments[static_cast<size_t>(run.last)].end);
}

// A wide run has at least one ring more than the narrow one beside it: 1 + the longest stair that leads down from it.
void count_rings(const BeamGeometry& boom, std::vector<BoomRun>& runs) {
  for (size_t i = 1; i < runs.size(); ++i) {
    if (depth_at_start(boom, runs[i]) > depth_at_end(boom, runs[i - 1])) runs[i].rings = runs[i - 1].rings + 1;
  }
  for (size_t i = runs.size() - 1; i-- > 0;) {
    if (depth_at_end(boom, runs[i]) > depth_at_start(boom, runs[i + 1])) {
      runs[i].rings = std::max(runs[i].rings, runs[i + 1].rings + 1);
    }
  }
}

// Lines of the wide side of a step: those of the narrow side, then evenly to the outline.
std::vector<double> lines_over(const std::vector<double>& narrow, double ratio, int rings) {
  std::vector<double> lines;
  lines.reserve(narrow.size());
  for (const double f : narrow) lines.push_back(f * ratio);
  const auto more = rings - static_cast<int>(narrow.size());
  for (int k = 1; k <= more; ++k) lines.push_back(std::lerp(ratio, 1.0, static_cast<double>(k) / more));
  return lines;
}

// From the narrow runs to the wide ones: a run takes lines from narrower neighbours, and is free at its other ends.
void place_lines(const BeamGeometry& boom, std::vector<BoomRun>& runs) {
  std::vector<size_t> sequence(runs.size());
  for (size_t i = 0; i < runs.size(); ++i) sequence[i] = i;
  std::stable_sort(sequence.begin(), sequence.end(), [&](size_t a, size_t b) { return runs[a].rings < runs[b].rings; });
  for (const size_t i : sequence) {
    BoomRun& run = runs[i];
    const double start = depth_at_start(boom, run), end = depth_at_end(boom, run);
    if (i > 0 && depth_at_end(boom, runs[i - 1]) < start) {
      run.start_lines = lines_over(runs[i - 1].end_lines, depth_at_end(boom, runs[i - 1]) / start, run.rings);
    }
    if (i + 1 < runs.size() && depth_at_start(boom, runs[i + 1]) < end) {
      run.end_lines = lines_over(runs[i + 1].start_lines, depth_at_start(boom, runs[i + 1]) / end, run.rings);
    }
    if (run.start_lines.empty() && run.end_lines.empty()) run.start_lines = lines_over({}, 0, run.rings);
    if (run.start_lines.empty()) run.start_lines = run.end_lines;
    if (run.end_lines.empty()) run.end_lines = run.start_lines;
  }
}

// ---- planes

// Cuts of [0, length]: layers that grow away from graded ends, then even elements.
std::vector<double> cuts_of_piece(double length, bool start_graded, bool end_graded, double first, double long_size,
                                  const SolidGrading& grading) {
  std::vector<double> layers;
  const double share = length / (start_graded && end_graded ? 2 : 1);
  double reach = 0, size = first;
  while (static_cast<int>(layers.size()) < grading.end_layers && size < long_size && reach + size < 0.7 * share) {
    layers.push_back(reach += size);
    size *= grading.growth;
  }
  if (!start_graded && !end_graded) layers.clear();
  const double from = start_graded && !layers.empty() ? layers.back() : 0;
  const double to = length - (end_graded && !layers.empty() ? layers.back() : 0);
  const bool two_corners = start_graded && end_graded && layers.empty() && grading.corner_levels > 0;
  const int count = std::max(two_corners ? 2 : 1, static_cast<int>(std::lround((to - from) / long_size)));
  std::vector<double> cuts = {0};
  if (start_graded) cuts.insert(cuts.end(), layers.begin(), layers.end());
  for (int k = 1; k <= count; ++k) cuts.push_back(std::lerp(from, to, static_cast<double>(k) / count));
  if (end_graded) {
    for (size_t k = layers.size(); k-- > 0;) cuts.push_back(length - (k > 0 ? layers[k - 1] : 0));
  }
  cuts.back() = length;
  return cuts;
}

// Ends of pieces of a segment, relative to its start: attachments inside and its end.
std::vector<double> piece_ends(const BeamGeometry& boom, double start, double length) {
  std::vector<double> ends;
  const double tolerance = same_station * boom.length();
  for (const RigidAttachment& attachment : boom.attachments) {
    const double x = attachment.position - start;
    if (x > tolerance && x < length - tolerance) ends.push_back(x);
  }
  ends.push_back(length);
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end(), [&](double a, double b) { return b - a <= tolerance; }), ends.end());
  return ends;
}

void place_planes(const BeamGeometry& boom, BoomPlan& plan) {
  const SolidGrading& grading = plan.options.grading;
  const double long_size = boom.length() / grading.long_elements;
  for (size_t r = 0; r < plan.runs.size(); ++r) {
    const BoomRun& run = plan.runs[r];
    const bool last_graded = r + 1 < plan.runs.size() || is_tip_stiff(boom, plan.options);
    for (int i = run.first; i <= run.last; ++i) {
      const BeamSegment& segment = boom.segments[static_cast<size_t>(i)];
      const double start = start_of(boom, i);
      const std::vector<double> ends = piece_ends(boom, start, segment.length);
      double from = 0;
      for (const double to : ends) {
        const double first = grading.first_layer * end_depth(segment.start);
        const bool at_start = i == run.first && from == 0, at_end = i == run.last && to == ends.back() && last_graded;
        const std::vector<double> cuts = cuts_of_piece(to - from, at_start, at_end, first, long_size, grading);
        for (size_t k = 0; k + 1 < cuts.size(); ++k) {
          plan.layers.push_back({start + from + cuts[k], start + from + cuts[k + 1], i, static_cast<int>(r), 0});
        }
        from = to;
      }
    }
  }
  for (size_t l = 1; l < plan.layers.size(); ++l) plan.layers[l].from = plan.layers[l - 1].to;
}

// ---- what is singular: rims of the root, of a tip that is held or holds a body, and re-entrant rims of steps

void place_corners(const BeamGeometry& boom, BoomPlan& plan) {
  if (plan.options.grading.corner_levels == 0) return;
  const int rim = plan.layers.front().columns, end = static_cast<int>(plan.layers.size());
  plan.corners.push_back({rim, 0});
  if (!plan.core) plan.corners.push_back({0, 0});
  if (is_tip_stiff(boom, plan.options)) {
    plan.corners.push_back({plan.layers.back().columns, end});
    if (!plan.core) plan.corners.push_back({0, end});
  }
  for (int l = 1; l < end; ++l) {
    const int before = plan.layers[static_cast<size_t>(l) - 1].columns;
    const int after = plan.layers[static_cast<size_t>(l)].columns;
    if (before != after) plan.corners.push_back({std::min(before, after), l});
  }
}

// ---- cuts of sides and rings

// Of a side, in lengths of the side, to which an edge at its end disturbs the stresses: the thickness. 0: none does.
double edge_zone(const BeamGeometry& boom, const SolidOptions& options, size_t side) {
  constexpr double largest = 0.25;
  const SectionShape& shape = boom.segments.front().start;
  const auto of_rectangle = [&](double height, double width) { return side % 2 == 0 ? width : height; };
  if (const auto* box = std::get_if<RectangularTube>(&shape)) {
    const double hollow = of_rectangle(box->height, box->width) - 2 * box->thickness;
    return std::min(largest, box->thickness / hollow);
  }
  if (const auto* r = std::get_if<Rectangle>(&shape)) {
    const double zone = std::min(r->height, r->width) / of_rectangle(r->height, r->width);
    return zone <= largest ? zone : 0;
  }
  const auto* tube = std::get_if<Tube>(&shape);
  if (tube == nullptr || options.slit == 0) return 0;
  const double midline = std::numbers::pi * (tube->diameter - tube->thickness) - options.slit;
  return std::min(largest, tube->thickness / (midline / 4));
}

constexpr double edge_factor = 0.15;  // of a cut toward an edge to the next

// Cuts of [0, 1]: `count` even ones, and in the zone at an end `levels` that shrink toward it.
std::vector<double> cuts_toward_ends(int count, double zone, int levels, bool at_start, bool at_end) {
  std::vector<double> shrinking;
  for (int k = levels; k-- > 0;) shrinking.push_back(zone * std::pow(edge_factor, k));
  const double from = at_start && levels > 0 ? zone : 0, to = at_end && levels > 0 ? 1 - zone : 1;
  std::vector<double> cuts = {0};
  if (at_start) cuts.insert(cuts.end(), shrinking.begin(), shrinking.end());
  for (int k = 1; k <= count; ++k) cuts.push_back(std::lerp(from, to, static_cast<double>(k) / count));
  if (!at_end || levels == 0) return cuts;
  for (auto k = shrinking.rbegin() + 1; k != shrinking.rend(); ++k) cuts.push_back(1 - *k);
  cuts.push_back(1);
  return cuts;
}

// Longer sides of rectangles are cut more often; an element of order p may be p times as long as an element of order 1.
std::array<int, 2> sectors_of(const BeamGeometry& boom, const SolidOptions& options) {
  const int n = options.grading.sectors;
  std::array<int, 2> sectors = {n, n};
  const SectionShape& shape = boom.segments.front().start;
  if (!is_rectangle(shape)) return sectors;
  const Eigen::Vector2d size = extent(shape);
  const double stretch = std::min(options.order, longest_element);
  for (size_t k = 0; k < 2; ++k) {
    const double along = size(k == 0 ? 1 : 0);  // the sides that face y run along z
    const double wanted = n * along / size.minCoeff() / stretch;
    sectors[k] = std::max(n, static_cast<int>(std::ceil(std::min<double>(wanted, most_sectors) - 1e-9)));
  }
  return sectors;
}

std::array<std::vector<double>, 4> cuts_of_sides(const BeamGeometry& boom, const SolidOptions& options) {
  const std::array<int, 2> sectors = sectors_of(boom, options);
  const bool closed = options.slit == 0;
  std::array<std::vector<double>, 4> cuts;
  for (size_t side = 0; side < cuts.size(); ++side) {
    const double zone = edge_zone(boom, options, side);
    cuts[side] = cuts_toward_ends(sectors[side % 2], zone, zone > 0 ? options.grading.edge_levels : 0,
                                  closed || side == 0, closed || side == 3);
  }
  return cuts;
}

}  // namespace

bool is_rectangle(const SectionShape& shape) {
  return std::holds_alternative<Rectangle>(shape) || std::holds_alternative<RectangularTube>(shape);
}

std::vector<double> cuts_of_ring(const BeamGeometry& boom, const SolidGrading& grading) {
  std::vector<double> cuts;
  const bool re_entrant = std::holds_alternative<RectangularTube>(boom.segments.front().start);
  for (int k = re_entrant ? grading.edge_levels : 1; k-- > 1;) cuts.push_back(std::pow(edge_factor, k) / grading.rings);
  for (int k = 1; k <= grading.rings; ++k) cuts.push_back(static_cast<double>(k) / grading.rings);
  return cuts;
}

BoomPlan plan_of(const BeamGeometry& boom, const SolidOptions& options) {
  BoomPlan plan;
  plan.options = chosen(boom, options);
  plan.runs = split_into_runs(boom);
  count_rings(boom, plan.runs);
  place_lines(boom, plan.runs);
  const SectionShape& shape = boom.segments.front().start;
  plan.core = has_core(shape);
  plan.sides = cuts_of_sides(boom, plan.options);
  plan.ring_cuts = cuts_of_ring(boom, plan.options.grading);
  place_planes(boom, plan);
  const SolidGrading& grading = plan.options.grading;
  // A rectangle without refined rims needs no rings around its core.
  const bool rings = !std::holds_alternative<Rectangle>(shape) || grading.corner_levels > 0;
  for (BoomLayer& layer : plan.layers) {
    layer.columns =
        rings ? plan.runs[static_cast<size_t>(layer.run)].rings * static_cast<int>(plan.ring_cuts.size()) : 0;
  }
  place_corners(boom, plan);
  return plan;
}

SectionGrid section_at(const BeamGeometry& boom, const BoomPlan& plan, int run_index, double x) {
  const BoomRun& run = plan.runs[static_cast<size_t>(run_index)];
  int i = run.first;
  double from = run.from;
  while (i < run.last && x > from + boom.segments[static_cast<size_t>(i)].length) {
    from += boom.segments[static_cast<size_t>(i++)].length;
  }
  const BeamSegment& segment = boom.segments[static_cast<size_t>(i)];
  SectionGrid grid{interpolate(segment.start, segment.end, std::clamp((x - from) / segment.length, 0.0, 1.0)), {}};
  grid.uneven = plan.sides[0].size() == 2 ? uneven_quarter(plan.options.order) : 0;
  const double s = std::clamp((x - run.from) / (run.to - run.from), 0.0, 1.0);
  const bool rings = plan.layers.front().columns > 0;
  for (size_t k = 0; rings && k < run.start_lines.size(); ++k) {
    grid.lines.push_back(std::lerp(run.start_lines[k], run.end_lines[k], s));
  }
  if (const auto* tube = std::get_if<Tube>(&grid.shape)) {
    grid.slit = plan.options.slit / (tube->diameter - tube->thickness);
  }
  return grid;
}

}  // namespace flexboom
