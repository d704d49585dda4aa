#include "fem/booms/boom.hpp"

#include "fem/base/check.hpp"
#include "fem/mesh/element.hpp"
#include "fem/mesh/validation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

namespace flexboom {
namespace {

using Eigen::Vector3d;

constexpr int default_elements = 8;   // of a boom whose segments leave the choice to make_mesh
constexpr int max_elements = 100000;  // of a segment; more is a typing error

void validate_segment(const BeamSegment& segment, const BeamGeometry& boom) {
  require(std::isfinite(segment.length) && segment.length > 0,
          fmt::format("length is {} m; it must be positive", segment.length));
  require(segment.elements >= 0 && segment.elements <= max_elements,
          fmt::format("elements is {}; it must be 1 to {}, or 0 to let the program choose", segment.elements,
                      max_elements));
  segment.material.validate();
  validate_sections(segment.start, segment.end, segment.material, boom.theory, boom.shear);
}

void validate_attachment(const RigidAttachment& attachment, double boom_length) {
  const double x = attachment.position;
  require(std::isfinite(x) && x >= 0 && x <= boom_length * (1 + same_station),
          fmt::format("position is {} m; the boom reaches from 0 to {} m", x, boom_length));
  validate_rigid(attachment.mass, attachment.inertia, attachment.offset);
}

void validate_order(int order) {
  require(order >= 1 && order <= highest_beam_order,
          fmt::format("order is {}; it must be 1 to {}", order, highest_beam_order));
}

// Where nodes are needed, as fractions of a segment: 0, attachments inside, 1.
std::vector<double> cuts_of_segment(const BeamGeometry& boom, double start, double length) {
  std::vector<double> cuts = {0, 1};
  for (const RigidAttachment& attachment : boom.attachments) {
    const double s = (attachment.position - start) / length;
    const bool is_new = std::none_of(cuts.begin(), cuts.end(), [&](double cut) {
      return std::abs(s - cut) * length <= same_station * boom.length();
    });
    if (s > 0 && s < 1 && is_new) cuts.push_back(s);
  }
  std::sort(cuts.begin(), cuts.end());
  return cuts;
}

int share(double count, double fraction) { return std::max(1, static_cast<int>(std::lround(count * fraction))); }

// A boom mesh under construction: nodes along x and a chain of elements.
struct Chain {
  Mesh mesh;
  std::vector<double> x = {0};

  void append(const BeamGeometry& boom, const BeamSegment& segment, double start, double from, double to) {
    const BeamProperty property{interpolate(segment.start, segment.end, from),
                                interpolate(segment.start, segment.end, to),
                                segment.material,
                                boom.theory,
                                boom.shear,
                                boom.rotary_inertia,
                                Vector3d::UnitY()};
    const bool sheared = boom.theory == BeamTheory::timoshenko;
    const int node = static_cast<int>(x.size());
    const int type = element_type(sheared ? "beam-timoshenko" : "beam-euler-bernoulli");
    mesh.elements.push_back({type, {node - 1, node}, boom.order, static_cast<int>(mesh.beam_properties.size())});
    mesh.beam_properties.push_back(property);
    x.push_back(start + to * segment.length);
  }
};

void append_segment(Chain& chain, const BeamGeometry& boom, const BeamSegment& segment, double start) {
  const double wanted =
      segment.elements > 0 ? segment.elements : share(default_elements, segment.length / boom.length());
  const std::vector<double> cuts = cuts_of_segment(boom, start, segment.length);
  for (size_t i = 0; i + 1 < cuts.size(); ++i) {
    const int count = share(wanted, cuts[i + 1] - cuts[i]);
    for (int k = 0; k < count; ++k) {
      const double from = std::lerp(cuts[i], cuts[i + 1], static_cast<double>(k) / count);
      const double to = std::lerp(cuts[i], cuts[i + 1], static_cast<double>(k + 1) / count);
      chain.append(boom, segment, start, from, to);
    }
  }
}

int nearest_node(const std::vector<double>& x, double position) {
  const auto nearer = [&](double a, double b) { return std::abs(a - position) < std::abs(b - position); };
  return static_cast<int>(std::min_element(x.begin(), x.end(), nearer) - x.begin());
}

}  // namespace

double BeamGeometry::length() const {
  return std::accumulate(segments.begin(), segments.end(), 0.0,
                         [](double sum, const BeamSegment& segment) { return sum + segment.length; });
}

void BeamGeometry::validate() const {
  require(!segments.empty(), "segments: a boom needs at least one");
  validate_order(order);
  for (size_t i = 0; i < segments.size(); ++i) {
    within(fmt::format("segments[{}]", i), [&] { validate_segment(segments[i], *this); });
  }
  std::set<std::string> names = {"root", "tip"};
  double mass = 0;
  for (size_t i = 0; i < attachments.size(); ++i) {
    within(fmt::format("attachments[{}]", i), [&] {
      validate_attachment(attachments[i], length());
      const std::string& name = attachments[i].name;
      require(name.empty() || names.insert(name).second, fmt::format("name \"{}\" is taken; choose another", name));
    });
    mass += attachments[i].mass;
  }
  for (const BeamSegment& segment : segments) mass += segment.material.rho;
  require(mass > 0, "the boom has no mass: rho is zero in every segment and nothing with mass is attached");
}

void BeamGeometry::validate_stations() const {
  const double least = shortest_beam * length();
  double start = 0;
  for (const BeamSegment& segment : segments) {
    const std::vector<double> cuts = cuts_of_segment(*this, start, segment.length);
    for (size_t i = 1; i < cuts.size(); ++i) {
      const double from = start + cuts[i - 1] * segment.length, piece = (cuts[i] - cuts[i - 1]) * segment.length;
      require(piece >= least, fmt::format("what begins, ends or is attached at {:.9g} m and {:.3g} m behind it is too "
                                          "close for beams: put it at one place, or at least {:.3g} m apart",
                                          from, piece, least));
    }
    start += segment.length;
  }
}

Mesh make_mesh(const BeamGeometry& boom) {
  boom.validate();
  boom.validate_stations();
  Chain chain;
  double start = 0;
  for (const BeamSegment& segment : boom.segments) {
    append_segment(chain, boom, segment, start);
    start += segment.length;
  }
  Mesh mesh = std::move(chain.mesh);
  mesh.nodes.setZero(3, static_cast<Eigen::Index>(chain.x.size()));
  mesh.nodes.row(0) = Eigen::Map<const Eigen::RowVectorXd>(chain.x.data(), static_cast<Eigen::Index>(chain.x.size()));
  mesh.node_sets = {{"root", {0}}, {"tip", {static_cast<int>(chain.x.size()) - 1}}};
  for (const RigidAttachment& attachment : boom.attachments) {
    const int node = nearest_node(chain.x, attachment.position);
    mesh.bodies.push_back({node, attachment.mass, attachment.inertia, attachment.offset});
    if (!attachment.name.empty()) mesh.node_sets[attachment.name] = {node};
  }
  return mesh;
}

}  // namespace flexboom
