#include "fem/mesh.hpp"

#include "fem/check.hpp"
#include "fem/element.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

namespace flexboom {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int max_order = 12;
constexpr int default_elements = 8;   // of a boom whose segments leave the choice to make_mesh
constexpr int max_elements = 100000;  // of a segment; more is a typing error
constexpr double round_off = 1e-12;   // relative

// Runs a check and puts `where` in front of what it says.
template <class Check>
void within(const std::string& where, const Check& check) {
  try {
    check();
  } catch (const InputError& error) {
    throw InputError(where + ": " + error.what());
  }
}

void validate_rigid(double mass, const Matrix3d& inertia, const Vector3d& offset) {
  require(std::isfinite(mass) && mass >= 0, fmt::format("mass is {} kg; it must be zero or positive", mass));
  require(offset.allFinite(), "offset has a component that is not finite");
  require(inertia.allFinite(), "inertia has an entry that is not finite");
  const double scale = inertia.cwiseAbs().maxCoeff();
  require((inertia - inertia.transpose()).cwiseAbs().maxCoeff() <= round_off * scale, "inertia must be symmetric");
  require(mass > 0 || scale == 0, "inertia without mass; give the mass that carries it");
  require(mass > 0 || offset.isZero(0), "offset without mass; give the mass that it moves");
  const Vector3d I = Eigen::SelfAdjointEigenSolver<Matrix3d>(inertia, Eigen::EigenvaluesOnly).eigenvalues();
  require(I(0) >= -round_off * scale, fmt::format("inertia has the negative principal value {} kg m^2", I(0)));
  require(I(0) + I(1) >= I(2) - round_off * scale,
          fmt::format("inertia breaks the triangle inequality: principal values {}, {}, {} kg m^2; "
                      "none can exceed the sum of the others",
                      I(0), I(1), I(2)));
}

// The section constants exist at both ends and, the dimensions being linear, in between.
void validate_sections(const SectionShape& start, const SectionShape& end, const Material& material, BeamTheory theory,
                       const ShearRule& shear) {
  const ShearRule rule = theory == BeamTheory::timoshenko ? shear : ShearRule{"value", 1};
  within("start", [&] { section_of(start, material.nu, rule); });
  within("end", [&] { section_of(end, material.nu, rule); });
  interpolate(start, end, 0.5);
}

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
  require(std::isfinite(x) && x >= 0 && x <= boom_length * (1 + round_off),
          fmt::format("position is {} m; the boom reaches from 0 to {} m", x, boom_length));
  validate_rigid(attachment.mass, attachment.inertia, attachment.offset);
}

void validate_order(int order) {
  require(order >= 1 && order <= max_order, fmt::format("order is {}; it must be 1 to {}", order, max_order));
}

// Where nodes are needed, as fractions of a segment: 0, attachments inside, 1.
std::vector<double> cuts_of_segment(const BeamGeometry& boom, double start, double length) {
  std::vector<double> cuts = {0, 1};
  for (const RigidAttachment& attachment : boom.attachments) {
    const double s = (attachment.position - start) / length;
    const bool is_new = std::none_of(
        cuts.begin(), cuts.end(), [&](double cut) { return std::abs(s - cut) * length <= round_off * boom.length(); });
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

void validate_indices(const Mesh& mesh, const Element& element) {
  const auto types = element_types();
  require(element.type >= 0 && element.type < static_cast<int>(types.size()),
          fmt::format("type {} is not a row of the table of {} elements", element.type, types.size()));
  const ElementType& type = types[static_cast<size_t>(element.type)];
  require(static_cast<int>(element.nodes.size()) == type.node_count,
          fmt::format("has {} nodes; \"{}\" has {}", element.nodes.size(), type.name, type.node_count));
  for (int node : element.nodes) {
    require(node >= 0 && node < mesh.nodes.cols(),
            fmt::format("node {} is missing; the mesh has nodes 0 to {}", node, mesh.nodes.cols() - 1));
  }
  require(element.property >= 0 && element.property < static_cast<int>(mesh.beam_properties.size()),
          fmt::format("beam property {} is missing; the mesh has {}", element.property, mesh.beam_properties.size()));
}

void validate_element(const Mesh& mesh, const Element& element) {
  validate_indices(mesh, element);
  validate_order(element.order);
  const BeamProperty& property = mesh.beam_properties[static_cast<size_t>(element.property)];
  const bool sheared = property.theory == BeamTheory::timoshenko;
  require(element.type == element_type(sheared ? "beam-timoshenko" : "beam-euler-bernoulli"),
          fmt::format("type \"{}\" does not agree with the theory of its property",
                      element_types()[static_cast<size_t>(element.type)].name));
  const Vector3d axis = mesh.nodes.col(element.nodes[1]) - mesh.nodes.col(element.nodes[0]);
  require(axis.norm() > 0, "beam of zero length");
  require(axis.normalized().cross(property.y_axis.normalized()).norm() > 1e-6,
          "the y axis of the section is parallel to the beam");
  require(property.rotary_inertia || (axis.array() != 0).count() == 1,
          "a beam without rotary inertia must run along an axis of the mesh (its torsion has no mass)");
}

// Union of nodes through elements: every node is used, and all hang together.
void validate_connections(const Mesh& mesh) {
  std::vector<int> parent(static_cast<size_t>(mesh.nodes.cols()));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int node) {
    while (parent[static_cast<size_t>(node)] != node) node = parent[static_cast<size_t>(node)];
    return node;
  };
  std::set<int> used;
  for (const Element& element : mesh.elements) {
    used.insert(element.nodes.begin(), element.nodes.end());
    for (int node : element.nodes) parent[static_cast<size_t>(root(node))] = root(element.nodes[0]);
  }
  for (int node = 0; node < mesh.nodes.cols(); ++node) {
    require(used.contains(node), fmt::format("node {} belongs to no element", node));
    require(root(node) == root(0),
            fmt::format("node {} is not connected with node 0: the mesh has several parts", node));
  }
}

void validate_set(const Mesh& mesh, const std::vector<int>& nodes) {
  require(!nodes.empty(), "has no node");
  for (int node : nodes) require(node >= 0 && node < mesh.nodes.cols(), fmt::format("node {} is missing", node));
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

Mesh make_mesh(const BeamGeometry& boom) {
  boom.validate();
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

void Mesh::validate() const {
  require(nodes.cols() > 0 && !elements.empty(), "mesh: has no elements");
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    require(nodes.col(i).allFinite(), fmt::format("mesh: nodes[{}] has a coordinate that is not finite", i));
  }
  for (size_t i = 0; i < beam_properties.size(); ++i) {
    within(fmt::format("mesh: beam_properties[{}]", i), [&] {
      const BeamProperty& property = beam_properties[i];
      property.material.validate();
      validate_sections(property.start, property.end, property.material, property.theory, property.shear);
    });
  }
  for (size_t i = 0; i < elements.size(); ++i) {
    within(fmt::format("mesh: elements[{}]", i), [&] { validate_element(*this, elements[i]); });
  }
  within("mesh", [&] { validate_connections(*this); });
  for (size_t i = 0; i < bodies.size(); ++i) {
    within(fmt::format("mesh: bodies[{}]", i), [&] {
      validate_set(*this, {bodies[i].node});
      validate_rigid(bodies[i].mass, bodies[i].inertia, bodies[i].offset);
    });
  }
  for (const auto& set : node_sets) {
    within(fmt::format("mesh: node set \"{}\"", set.first), [&] { validate_set(*this, set.second); });
  }
}

const std::vector<int>& node_set(const Mesh& mesh, const std::string& name) {
  const auto found = mesh.node_sets.find(name);
  if (found != mesh.node_sets.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [known, nodes] : mesh.node_sets) names.push_back(fmt::format("\"{}\"", known));
  throw InputError(fmt::format("node set \"{}\" not found; the mesh has {}", name, fmt::join(names, ", ")));
}

}  // namespace flexboom
