// How far beams may be from the solid that they stand for.

#include "fem/booms/beam_limits.hpp"

#include "fem/mesh/section_grid.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <variant>
#include <vector>

namespace flexboom {
namespace {

constexpr double none = std::numeric_limits<double>::infinity();

/// A clamp keeps the root's section from curving across, as Poisson's ratio wants it to. Strain energy in so much of
/// the length then grows by 1 / (1 - nu^2); of a cantilever in its first mode the rest of the length has (1 - part)^4.6
/// of the energy. `depth` is in the direction of the deflection, `across` the other, `thickness` that of walls: half of
/// a side where there are none.
double by_clamped_face(double depth, double across, double thickness, double length, double nu) {
  const double small = std::min(depth, across), ratio = small / std::max(depth, across);
  const double of_walls = std::sqrt(std::min(1.0, 2 * thickness / small));
  const double shallow = across * (0.67 + 0.33 * (1 - ratio) * (1 - ratio)), deep = depth * (0.17 + 0.5 * ratio);
  const double part = std::min(1.0, 0.28 * of_walls * (across >= depth ? shallow : deep) / length);
  return 0.5 * nu * nu / (1 - nu * nu) * (1 - std::pow(1 - part, 4.6));
}

/// A clamp keeps the root's section from warping, as if the boom were shorter (Vlasov); `share` of what a thin strip
/// does.
double by_warping(double width, double share, double length, double nu) {
  const double shorter = 0.27 * width * std::sqrt((1 + nu) / 1.3) * share;
  return shorter / std::max(length - shorter, 0.1 * length);
}

/// Of a section of one material in a boom of this length.
struct Estimate {
  double length;
  const Material& material;

  /// Where fibres give G, E / (2 G) - 1 tells nothing of how a section curves across.
  double poisson() const { return std::abs(material.nu) < 0.5 ? material.nu : 0; }
  /// Angular frequency of a plate of this thickness that is bent in waves of 1 / k: k^2 times this [m^2/s].
  double plate(double thickness) const {
    const double nu = poisson();
    return material.rho > 0 ? thickness * std::sqrt(material.E / (12 * material.rho * (1 - nu * nu))) : none;
  }
  static double hertz(double omega) { return omega / (2 * std::numbers::pi); }

  BeamLimits bent(double height, double width, double thickness) const {
    BeamLimits r;
    r.bending_y = by_clamped_face(height, width, thickness, length, poisson());
    r.bending_z = by_clamped_face(width, height, thickness, length, poisson());
    return r;
  }

  BeamLimits operator()(const RoundBar& s) const { return bent(s.diameter, s.diameter, s.diameter / 2); }
  BeamLimits operator()(const Tube& s) const {
    BeamLimits r = bent(s.diameter, s.diameter, s.thickness);
    const double radius = 0.5 * (s.diameter - s.thickness);
    r.section_frequency = hertz(std::sqrt(7.2) * plate(s.thickness) / (radius * radius));  // a ring gets oval
    return r;
  }
  BeamLimits operator()(const Rectangle& s) const {
    const double thin = std::min(s.height, s.width), wide = std::max(s.height, s.width);
    BeamLimits r = bent(s.height, s.width, thin / 2);
    r.torsion = by_warping(wide, 1 - 0.93 * thin / wide, length, material.nu);
    r.section_frequency = hertz(22.37 * plate(thin) / (wide * wide));  // its width bends as a beam with free ends
    return r;
  }
  BeamLimits operator()(const RectangularTube& s) const {
    const double wide = std::max(s.height, s.width);
    BeamLimits r = bent(s.height, s.width, s.thickness);
    r.section_frequency = hertz(5.68 * plate(s.thickness) / (wide * wide));  // a square frame leans over
    return r;
  }
  BeamLimits operator()(const GeneralSection&) const { return {}; }
};

}  // namespace

BeamLimits beam_limits(const BeamGeometry& boom) {
  const double length = boom.length();
  BeamLimits r = std::visit(Estimate{length, boom.segments.front().material}, boom.segments.front().start);
  for (const BeamSegment& segment : boom.segments)
    for (const SectionShape& shape : {segment.start, segment.end})
      r.section_frequency =
          std::min(r.section_frequency, std::visit(Estimate{length, segment.material}, shape).section_frequency);
  return r;
}

std::string beam_doubt(const BeamGeometry& boom, bool in_plane) {
  constexpr double counts = 1e-2;
  const BeamLimits limits = beam_limits(boom);
  std::vector<std::string> of;
  const auto look = [&of](double higher, const char* where) {
    if (higher > counts) of.push_back(fmt::format("{:.0f} % in {}", 100 * higher, where));
  };
  look(limits.bending_y, "bending along y");
  if (!in_plane) look(limits.bending_z, "bending along z"), look(limits.torsion, "torsion");
  if (of.empty()) return {};
  return fmt::format(
      "it is short or wide for beams: where the whole face of its root is clamped, the lowest frequencies of its solid "
      "are higher, by about {}; structure = \"solid\" has them",
      fmt::join(of, ", "));
}

std::string section_doubt(const BeamGeometry& boom, double highest_frequency) {
  const double limit = beam_limits(boom).section_frequency;
  if (!(highest_frequency > limit)) return {};
  return fmt::format(
      "from about {:.3g} Hz on its section vibrates in itself, which beams do not; structure = \"solid\" does", limit);
}

}  // namespace flexboom
