// What a solid mesh of a boom leaves open, chosen.

#include "fem/base/check.hpp"
#include "fem/base/round_off.hpp"
#include "fem/booms/boom_plan.hpp"
#include "fem/booms/solid_cells.hpp"
#include "fem/mesh/validation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace flexboom {
namespace {

constexpr int max_solid_order = 8;
constexpr double slender_ratio = 62;   // length over half depth
constexpr int max_divisions = 100000;  // of anything; more is a typing error

void require_at_least(int value, int least, int most, const char* what) {
  require(value >= least && value <= most, fmt::format("{} is {}; it must be {} to {}", what, value, least, most));
}

void validate_slit(const BeamGeometry& boom, double slit) {
  require(std::isfinite(slit) && slit >= 0, fmt::format("slit is {} m; it must be positive, or 0 for none", slit));
  if (slit == 0) return;
  for (const BeamSegment& segment : boom.segments) {
    for (const SectionShape& shape : {segment.start, segment.end}) {
      const auto* tube = std::get_if<Tube>(&shape);
      require(tube != nullptr, "slit: only tubes can be slit; this boom has another section");
      const double midline = std::numbers::pi * (tube->diameter - tube->thickness);
      require(slit < 0.9 * midline,
              fmt::format("slit is {} m, of a midline of {:.4g} m; nothing is left", slit, midline));
    }
  }
}

void validate(const BeamGeometry& boom, const SolidOptions& options) {
  BeamGeometry outline = boom;  // what concerns beams alone is not asked
  outline.order = 1;
  outline.theory = BeamTheory::timoshenko;
  outline.shear = {};
  outline.validate();
  for (size_t i = 0; i < boom.segments.size(); ++i) {
    within(fmt::format("segments[{}]", i), [&] {
      for (const SectionShape& shape : {boom.segments[i].start, boom.segments[i].end}) {
        require_grid(shape);
        const auto* tube = std::get_if<Tube>(&shape);
        require(tube == nullptr || 2 * tube->thickness < tube->diameter,
                "tube: a wall as thick as the radius leaves no hole; use a round bar");
      }
    });
  }
  validate_slit(boom, options.slit);
  require(options.accuracy >= best_mesh_accuracy && options.accuracy < 1,
          fmt::format("accuracy is {}; it must be {:g} or more, the best that is known of a mesh, and less than 1",
                      options.accuracy, best_mesh_accuracy));
  require_at_least(options.order, 0, max_solid_order, "order");
  const SolidGrading& g = options.grading;
  require_at_least(g.sectors, 0, max_divisions, "grading: sectors");
  require_at_least(g.rings, 0, max_divisions, "grading: rings");
  require_at_least(g.long_elements, 0, max_divisions, "grading: long_elements");
  require_at_least(g.end_layers, -1, 100, "grading: end_layers");
  require_at_least(g.corner_levels, -1, 20, "grading: corner_levels");
  require_at_least(g.edge_levels, -1, 20, "grading: edge_levels");
  require(g.first_layer == 0 || (std::isfinite(g.first_layer) && g.first_layer > 0),
          fmt::format("grading: first_layer is {}; it must be positive", g.first_layer));
  require(g.growth == 0 || (std::isfinite(g.growth) && g.growth > 1),
          fmt::format("grading: growth is {}; it must be above 1", g.growth));
  require(g.factor == 0 || (g.factor > 0 && g.factor < 1),
          fmt::format("grading: factor is {}; it must lie between 0 and 1", g.factor));
}

// What reaches an accuracy with the least work, found on a clamped round bar 30 diameters long (nu = 0.33), modes 1-10.
// The reference is good to 4e-8; what lies below is extrapolated. Orders 1 and 2 are for comparisons and reach no
// accuracy by themselves.
struct Choice {
  double reached;
  int order;
  SolidGrading grading;
};
constexpr std::array<Choice, 9> choices = {{{1, 1, {4, 3, 120, 0, 1, 3, 0, 0.15}},
                                            {1, 2, {2, 2, 30, 1, 1, 3, 0, 0.15}},
                                            {1e-3, 3, {1, 1, 9, 2, 0.5, 3, 1, 0.1}},
                                            {1e-4, 4, {1, 1, 6, 2, 0.5, 3, 1, 0.1}},
                                            {1e-5, 4, {1, 1, 9, 2, 0.5, 3, 1, 0.1}},
                                            {1e-6, 5, {1, 1, 6, 2, 0.5, 3, 2, 0.1}},
                                            {1e-7, 6, {1, 1, 5, 2, 0.5, 3, 3, 0.1}},
                                            {1e-8, 7, {1, 1, 5, 2, 0.5, 3, 4, 0.1}},
                                            {1e-8, 8, {1, 1, 4, 2, 0.5, 3, 4, 0.1}}}};

// The first that is good enough, of the order asked for if one is; failing that the best.
const Choice& choice_for(const SolidOptions& options) {
  const Choice* best = nullptr;
  for (const Choice& choice : choices) {
    if (options.order != 0 ? choice.order != options.order : choice.reached == 1 || choice.order == max_solid_order)
      continue;
    best = &choice;
    if (choice.reached <= options.accuracy * (1 + relative_round_off)) break;
  }
  return *best;
}

// A field that is even about the middle of an element gains nothing from an odd order: two meshes would seem to agree.
// So no side that bends has one element. The short sides of a slender solid rectangle hardly bend.
int fewest_sectors(const BeamGeometry& boom, const SolidGrading& grading) {
  const SectionShape& shape = boom.segments.front().start;
  if (std::holds_alternative<RectangularTube>(shape)) return grading.edge_levels > 0 ? 1 : 2;
  const Eigen::Vector2d size = extent(shape);
  return std::holds_alternative<Rectangle>(shape) && size.maxCoeff() <= longest_element * size.minCoeff() ? 2 : 1;
}

// A clamp disturbs the stresses of a flat section over its width: so many layers reach that far.
int layers_over_the_width(const BeamGeometry& boom, const SolidGrading& g) {
  const SectionShape& shape = boom.segments.front().start;
  if (!is_rectangle(shape)) return 0;
  const double first = g.first_layer * end_depth(shape);
  return static_cast<int>(
      std::lround(std::log1p((g.growth - 1) * extent(shape).maxCoeff() / first) / std::log(g.growth)));
}

void choose(const BeamGeometry& boom, SolidOptions& options) {
  const Choice& choice = choice_for(options);
  SolidGrading& g = options.grading;
  const SolidGrading& best = choice.grading;
  options.order = choice.order;
  if (g.edge_levels < 0) g.edge_levels = 1;
  if (g.sectors == 0) g.sectors = std::max(best.sectors, fewest_sectors(boom, g));
  if (g.rings == 0) g.rings = best.rings;
  if (g.long_elements == 0) {
    // More slender booms have the fifth pair of bending modes (wave number 14.14 / L after 11.00 / L) among the first
    // ten.
    const bool slender = boom.length() > slender_ratio * half_depth(boom.segments.front().start);
    g.long_elements = slender ? static_cast<int>(std::ceil(best.long_elements * 14.14 / 11.0)) : best.long_elements;
  }
  if (g.first_layer == 0) g.first_layer = best.first_layer;
  if (g.growth == 0) g.growth = best.growth;
  if (g.end_layers < 0) g.end_layers = std::max(best.end_layers, layers_over_the_width(boom, g));
  if (g.corner_levels < 0) g.corner_levels = best.corner_levels;
  if (g.factor == 0) g.factor = best.factor;
}

}  // namespace

SolidOptions chosen(const BeamGeometry& boom, const SolidOptions& options) {
  SolidOptions result = options;
  if (const CellKind& kind = cell_kind(options.element); kind.order > 0) {
    require(options.order == 0 || options.order == kind.order,
            fmt::format("order is {}; \"{}\" has order {}, leave it out", options.order, kind.name, kind.order));
    result.order = kind.order;
  }
  validate(boom, result);
  choose(boom, result);
  // A wall has a singular rim on both faces, which one quadrilateral cannot be refined toward.
  const bool thin = !has_core(boom.segments.front().start);
  if (thin && result.grading.corner_levels > 0 && cuts_of_ring(boom, result.grading).size() < 2)
    result.grading.rings = 2;
  return result;
}

std::optional<SolidOptions> refined(const SolidOptions& complete, int steps) {
  SolidOptions r = complete;
  if (steps == 0) return r;
  if (r.element != "hex") {
    if (steps < 0) return {};
    r.order = cell_kind(r.element).order;
    r.element = "hex";
  }
  r.order += steps;
  if (r.order < 1) return {};
  SolidGrading& g = r.grading;
  for (; r.order > max_solid_order; --r.order) g.sectors *= 2, g.rings *= 2, g.long_elements *= 2;
  constexpr int most_levels = 20;
  g.corner_levels = std::clamp(g.corner_levels + steps, std::min(g.corner_levels, 1), most_levels);
  return r;
}

}  // namespace flexboom
