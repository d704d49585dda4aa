#include "apps/model/reduction.hpp"

#include "apps/base/version.hpp"
#include "apps/model/reduce_arguments.hpp"
#include "fem/base/check.hpp"
#include "fem/base/stopwatch.hpp"
#include "fem/base/text_reader.hpp"
#include "fem/booms/beam_limits.hpp"
#include "fem/linear_algebra/inertia.hpp"
#include "fem/mesh/mesh_sets.hpp"
#include "reduction/basis/mode_selection.hpp"
#include "reduction/invariants/certificate.hpp"
#include "reduction/invariants/geometric_stiffness.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "reduction/invariants/prestressed.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

namespace flexboom {
namespace {

/// Static solutions over the unknowns of a held body, by the factor of its modes where they were solved with this K.
StaticSolver statics_of(const Mesh& mesh, const BasisModel& m, const ModalBasis& basis) {
  if (basis.factor) return {basis.factor, basis.K};
  return static_solver(mesh, m.assembly, unknowns(mesh, m.assembly.dofs, m.held));
}

/// Where the basis holds the static response exactly.
std::vector<std::string> exact_markers(const ReductionOptions& o) {
  std::vector<std::string> markers;
  if (o.select || o.basis.in_plane) return markers;
  for (const std::string& text : o.basis.interfaces) markers.push_back(text.substr(0, text.find(':')));
  return markers;
}

std::string libraries() {
  std::string text;
  for (const auto& [name, release] : linear_algebra_versions())
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, release);
  return text;
}

std::string options_text(const ReductionOptions& o) {
  const BasisOptions& b = o.basis;
  std::string text = fmt::format("basis {}, count {}", b.name, b.modes);
  if (!b.interfaces.empty()) text += fmt::format(", interfaces {}", fmt::join(b.interfaces, " "));
  if (!b.reference.empty()) text += ", reference " + b.reference;
  if (b.orthonormal) text += ", orthonormal";
  if (!b.corrections.empty()) text += fmt::format(", attachments {}", fmt::join(b.corrections, " "));
  if (b.name == "hinge")
    text += fmt::format(", hinge {} N m/rad about {} {} {}", fmt::join(b.hinge_stiffness, " "), b.hinge_axis.x(),
                        b.hinge_axis.y(), b.hinge_axis.z());
  if (b.name == "prestressed" && b.motion) {
    const auto three = [](const Eigen::Vector3d& v) { return fmt::format("{} {} {}", v.x(), v.y(), v.z()); };
    text += fmt::format(", spin {} rad/s, acceleration {} m/s^2", three(b.motion->spin), three(b.motion->acceleration));
    for (const Eigen::Vector3d& axis : b.motion->turns) text += ", turns about " + three(axis);
  }
  if (o.select) text += ", select " + *o.select;
  if (o.damping.name != "none") text += ", damping " + o.damping.name;
  if (!o.stiffening) text += ", no stiffening";
  if (!o.loads_at.empty()) text += fmt::format(", loads at {}", fmt::join(o.loads_at, " "));
  return text;
}

/// The options with the names of node sets as the mesh spells them.
ReductionOptions with_names_of(const Mesh& mesh, ReductionOptions o) {
  const auto spell = [&mesh](std::string& text, size_t end) {  // the name ends there, or with the text
    text = node_set_name(mesh, text.substr(0, end)) + (end < text.size() ? text.substr(end) : "");
  };
  for (std::string& text : o.basis.interfaces) spell(text, text.find(':'));
  for (std::string& text : o.basis.corrections) spell(text, text.rfind('.'));
  for (std::string& text : o.loads_at) spell(text, std::string::npos);
  if (!o.basis.reference.empty()) spell(o.basis.reference, std::string::npos);
  if (o.select && o.select->starts_with("output:")) {
    std::string place = o.select->substr(std::string("output:").size());
    spell(place, place.rfind('.', place.find(',')));
    o.select = "output:" + place;
  }
  return o;
}

/// Node sets that the body keeps as markers and where loads act for geometric stiffness: all that move, or those asked
/// for.
std::vector<std::string> loaded_markers(const ReducedBody& body, const Mesh& mesh,
                                        const std::vector<std::string>& asked) {
  std::vector<std::string> names;
  for (const Marker& marker : body.markers) {
    if (mesh.node_sets.contains(marker.name) && marker.S.norm() > 0) names.push_back(marker.name);
  }
  for (const std::string& name : asked)
    require(std::ranges::find(names, name) != names.end(),
            fmt::format("--loads-at: '{}' is no node set that moves; there are {}", name, fmt::join(names, ", ")));
  return asked.empty() ? names : asked;
}

PrestressedBasis prestressed_basis(const Mesh& mesh, const BasisModel& m, const BasisOptions& o, int threads) {
  require(o.motion.has_value(), "prestressed: the motion that stiffens the body is not known");
  const auto clamped = [&](int count) {
    BasisOptions plenty = o;
    plenty.modes = count, plenty.corrections.clear();
    return make_basis(mesh, m, plenty, threads);
  };
  const int all = unknowns(mesh, m.assembly.dofs, m.clamp).count;
  PrestressedBasis made = prestressed_modes(mesh, m.assembly, m.clamp, *o.motion, clamped, all, o.modes, threads);
  made.basis = with_corrections(std::move(made.basis), mesh, m, o, threads);
  return made;
}

/// What becomes of supports that a file brings; empty where they are the frame, or there are none.
std::string note_of_supports(const Model& model, const BasisModel& m, const BasisOptions& o) {
  if (model.mesh.supports.empty() || !model.clamp.with_supports) return "";
  if (o.name == "mean-axis") return "basis mean-axis: the body flies free, and the supports of its mesh are left out";
  if (o.name != "craig-bampton" || o.reference.empty()) return "";
  const std::vector<int>& held = m.held.nodes;
  const bool beside = std::ranges::any_of(
      model.mesh.supports, [&](const Support& s) { return std::ranges::find(held, s.node) == held.end(); });
  return !beside ? ""
                 : fmt::format(
                       "craig-bampton: supports of the mesh hold it to the frame of \"{}\", too, wherever that "
                       "flies; a file without supports leaves them out",
                       o.reference);
}

/// Rules by modes mean those of the body at rest: the damping of the clamped modes, of which the shapes are combined.
bool damps_modes_at_rest(const ReductionOptions& o) {
  return o.damping.name != "rayleigh" && o.basis.corrections.empty();
}

}  // namespace

ReducedBody make_reduced_body(Model& model, const ReductionOptions& options, int threads, ReductionSeconds& seconds) {
  ReductionOptions o = with_names_of(model.mesh, options);
  for (const std::string& name : o.loads_at) node_set(model.mesh, name);  // before the long work
  const bool held_is_solved = o.stiffening || o.certified;
  o.basis.keep_factor = o.basis.name == "clamped" && held_is_solved;
  Stopwatch clock;
  const BasisModel m = basis_model(model.mesh, o.basis, model.clamp, o.clamp_beside, threads);
  seconds.assemble += clock.lap();
  if (std::string note = note_of_supports(model, m, o.basis); !note.empty()) model.notes.push_back(std::move(note));
  std::optional<PrestressedBasis> prestressed;
  if (o.basis.name == "prestressed" && o.basis.modes > 0)
    prestressed = prestressed_basis(model.mesh, m, o.basis, threads);
  ModalBasis basis = prestressed ? prestressed->basis : make_basis(model.mesh, m, o.basis, threads);
  seconds.modes += clock.lap();
  ReducedBody body = reduce(model.mesh, m.assembly, basis, model.name, threads);
  seconds.invariants += clock.lap();
  if (o.select) {
    const std::vector<int> list = selection(body, *o.select);
    if (std::string note = note_of_selection(body, *o.select); !note.empty()) model.notes.push_back(std::move(note));
    basis = selected(basis, list);
    body = selected(body, list);
  }
  if (!basis.summary.note.empty()) model.notes.push_back(basis.summary.note);
  if (o.certified && !basis.summary.proof.empty()) model.notes.push_back(basis.summary.proof);

  const bool flies = body.frame == "clamped" || body.frame == "mean-axis";
  std::optional<StaticSolver> statics;  // one factorisation for the stiffening and the certificate
  if (body.frame == "clamped" && body.n() > 0 && held_is_solved) statics = statics_of(model.mesh, m, basis);
  const StaticSolver* held_statics = statics ? &*statics : nullptr;
  if (o.stiffening && flies && body.n() > 0) {
    body.Kg = geometric_stiffness(model.mesh, m.assembly, m.held, basis.Phi,
                                  {.markers = loaded_markers(body, model.mesh, o.loads_at),
                                   .threads = threads,
                                   // Digits that one solve loses are restored in the lowest modes only.
                                   .statics = prestressed ? nullptr : held_statics,
                                   .Ke = &body.Ke});
  }
  seconds.stiffening += clock.lap();
  apply_damping(body, o.damping);
  if (prestressed && damps_modes_at_rest(o)) {
    apply_damping(prestressed->clamped, o.damping);
    const Eigen::MatrixXd parts = clamped_parts(*prestressed, m.assembly, basis.Phi);
    body.De = parts.transpose() * prestressed->clamped.De * parts;
  }
  body.certificate =
      o.certified ? certificate(body, model.mesh, m.assembly, m.held, basis, exact_markers(o), threads, held_statics)
                  : check_invariants(body, model.mesh, m.assembly, basis);
  seconds.certificate += clock.lap();
  body.provenance = {fmt::format("flexboom {}", version),
                     libraries(),
                     o.source,
                     mesh_hash(model.mesh),
                     options_text(o),
                     fmt::format("{}", fmt::join(material_suspicions(model.mesh), "; "))};
  body.validate();
  return body;
}

std::string doubt_of_modes(const BeamGeometry& boom, const ReducedBody& body) {
  double highest = 0;
  for (const Coordinate& c : body.coordinates)
    if (c.kind.starts_with("bending") || c.kind == "torsion") highest = std::max(highest, c.frequency_hz);
  const std::string doubt = section_doubt(boom, highest);
  return doubt.empty() ? "" : fmt::format("its modes reach {:.3g} Hz; {}", highest, doubt);
}

}  // namespace flexboom
