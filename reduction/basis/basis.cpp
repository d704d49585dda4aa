#include "reduction/basis/basis.hpp"

#include "fem/base/check.hpp"
#include "fem/mesh/mesh_sets.hpp"
#include "reduction/basis/attachment_modes.hpp"
#include "reduction/basis/craig_bampton.hpp"
#include "reduction/basis/hinge_basis.hpp"
#include "reduction/basis/mean_axis.hpp"
#include "reduction/eigen/orthogonal_basis.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

namespace flexboom {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<ModeKind> kinds_of(const BasisOptions& o) {
  return o.in_plane ? std::vector{ModeKind::bending_y} : std::vector<ModeKind>{};
}

EigenOptions eigen_options(const BasisOptions& o) {
  EigenOptions options;
  options.num_modes = o.modes;
  options.backend = o.backend;
  options.keep_factor = o.keep_factor;
  return options;
}

ModalBasis no_shapes(const BasisModel& m, const char* frame) {
  ModalBasis basis;
  basis.Phi = MatrixXd::Zero(m.assembly.dofs.count, 0);
  basis.omega = VectorXd::Zero(0);
  basis.frame = frame;
  return basis;
}

ModalBasis clamped_basis(const Mesh& mesh, const BasisModel& m, const BasisOptions& o, int threads) {
  if (o.modes == 0) return no_shapes(m, "clamped");
  const int loose = rigid_freedoms(mesh, m.assembly.dofs, m.clamp);
  require(loose == 0, fmt::format("basis clamped: {} rigid motions of the body are not held, and its frame cannot have "
                                  "them twice; clamp it (--clamp SET), or take the basis mean-axis",
                                  loose));
  if (!o.in_plane) return clamped_modes(mesh, m.assembly, m.clamp, eigen_options(o), threads);
  return clamped_modes_of_kind(mesh, m.assembly, m.clamp, o.modes, kinds_of(o), eigen_options(o));
}

ModalBasis mean_axis_basis(const Mesh& mesh, const BasisModel& m, const BasisOptions& o, int threads) {
  if (o.modes == 0) return no_shapes(m, "mean-axis");
  const auto modes = [&](const EigenOptions& options) { return mean_axis_modes(mesh, m.assembly, options, threads); };
  if (!o.in_plane) return modes(eigen_options(o));
  const DofMap& dofs = m.assembly.dofs;
  const int all = unknowns(mesh, dofs, m.clamp).count - rigid_freedoms(mesh, dofs, m.clamp);
  return modes_of_kind(modes, all, o.modes, kinds_of(o), eigen_options(o));
}

/// What does not bend in the plane of a hinge. @throws InputError for a hinge that is oblique to the sections.
std::vector<ModeKind> kinds_beside(const Eigen::Vector3d& hinge_axis) {
  using enum ModeKind;
  constexpr double oblique = 1e-6;
  const Eigen::Vector3d axis = hinge_axis.normalized().cwiseAbs();
  require(axis.x() < oblique && axis.minCoeff() < oblique && std::min(axis.y(), axis.z()) < oblique,
          "basis: the hinge turns about neither y nor z of the body, so all directions cannot be told from its own; "
          "give directions = \"hinge-plane\"");
  return {axis.z() > axis.y() ? bending_z : bending_y, torsion, axial, other};
}

/// The modes that turn the root, and where all directions count those of a clamped root in the other ones.
ModalBasis hinge_basis(const Mesh& mesh, const BasisModel& m, const BasisOptions& o, int threads) {
  if (o.modes == 0) return no_shapes(m, "clamped");
  const HingeSpring hinge = {.axis = o.hinge_axis, .stiffness = o.hinge_stiffness};
  ModalBasis turning = hinge_adapted_modes(mesh, m.assembly, m.clamp, hinge, o.modes, eigen_options(o), threads);
  if (o.in_plane) return turning;
  // Where directions are coupled, modes that turn the root are modes beside them, too.
  constexpr double told_apart = 1e-5;
  MassBasis shapes(m.assembly.M, turning.Phi.cols() + o.modes);
  shapes.append(turning.Phi, told_apart);
  const std::vector<ModeKind> kinds = kinds_beside(o.hinge_axis);
  for (int first = 0, wanted = o.modes; first < wanted;) {
    const ModalBasis beside = clamped_modes_of_kind(mesh, m.assembly, m.clamp, wanted, kinds, eigen_options(o));
    shapes.append(beside.Phi.rightCols(wanted - first), told_apart);
    first = std::exchange(wanted, wanted + static_cast<int>(shapes.capacity() - shapes.size()));
  }
  ModalBasis all = ritz_modes(mesh, m.assembly, m.clamp, shapes.vectors(), 0, threads);
  all.unknowns = turning.unknowns;
  all.summary.note = turning.summary.note;
  return all;
}

ModalBasis interface_basis(const Mesh& mesh, const BasisModel& m, const BasisOptions& o, int threads) {
  return craig_bampton(mesh, m.assembly, m.interfaces, {eigen_options(o), o.reference, o.orthonormal, kinds_of(o)},
                       m.clamp, threads);
}

/// Rows in the order of basis_names.
constexpr std::array makers = {clamped_basis, hinge_basis, mean_axis_basis, interface_basis, clamped_basis};

size_t row_of(const BasisOptions& o) {
  const auto* const name = std::ranges::find(basis_names, o.name);
  require(name != basis_names.end(),
          fmt::format(R"(basis: "{}" is unknown; there are "{}")", o.name, fmt::join(basis_names, "\", \"")));
  return static_cast<size_t>(name - basis_names.begin());
}

}  // namespace

std::pair<std::string, std::string> place_and_direction(const std::string& of, const std::string& text) {
  const size_t dot = text.rfind('.');
  require(dot != std::string::npos && dot > 0,
          fmt::format("{}: '{}' must be a node set and a direction, e.g. tip.Fy", of, text));
  return {text.substr(0, dot), text.substr(dot + 1)};
}

BasisModel basis_model(Mesh& mesh, const BasisOptions& o, const Clamp& clamp, bool beside, int threads) {
  row_of(o);
  BasisModel m;
  std::vector<InterfacePlan> plans;
  for (const std::string& text : o.interfaces) {
    const size_t colon = std::min(text.find(':'), text.size());
    const std::string set = text.substr(0, colon);
    plans.push_back({.name = set, .node_set = set});
    if (colon < text.size()) plans.back().connection = text.substr(colon + 1);
    if (o.in_plane && set != o.reference) plans.back().components = {false, true, false, false, false, true};
  }
  m.interfaces = place_interfaces(mesh, plans);
  m.assembly = assemble(mesh, threads);
  m.clamp = clamp;
  if (o.name == "mean-axis") m.clamp = Clamp({}, false);
  if (o.name == "craig-bampton" && !beside) m.clamp.nodes.clear();
  m.held = m.clamp;
  for (const InterfaceNode& i : m.interfaces)
    if (i.name == o.reference) m.held.nodes.push_back(i.node);
  return m;
}

ModalBasis with_corrections(ModalBasis basis, const Mesh& mesh, const BasisModel& m, const BasisOptions& o,
                            int threads) {
  std::vector<AttachmentLoad> loads;
  for (const std::string& text : o.corrections) {
    const auto [marker, direction] = place_and_direction("static correction", text);
    loads.push_back({marker, direction});
  }
  if (loads.empty()) return basis;
  return with_attachment_modes(std::move(basis), mesh, m.assembly, m.held, loads, threads);
}

ModalBasis make_basis(const Mesh& mesh, const BasisModel& m, const BasisOptions& o, int threads) {
  return with_corrections(makers[row_of(o)](mesh, m, o, threads), mesh, m, o, threads);
}

}  // namespace flexboom
