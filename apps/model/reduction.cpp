#include "apps/model/reduction.hpp"

#include "apps/base/axis.hpp"
#include "apps/base/usage.hpp"
#include "apps/base/version.hpp"
#include "fem/base/check.hpp"
#include "fem/base/stopwatch.hpp"
#include "fem/base/text_reader.hpp"
#include "fem/linear_algebra/inertia.hpp"
#include "fem/mesh/mesh_sets.hpp"
#include "reduction/basis/mode_selection.hpp"
#include "reduction/invariants/certificate.hpp"
#include "reduction/invariants/geometric_stiffness.hpp"
#include "reduction/invariants/inertia_invariants.hpp"
#include "reduction/invariants/prestressed.hpp"
#include "reduction/invariants/root_loads.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

namespace flexboom {
namespace {

/// "head:tail", or the whole and nothing.
std::pair<std::string, std::string> split(const std::string& text, char at) {
  const size_t place = text.find(at);
  return place == std::string::npos ? std::pair{text, std::string()}
                                    : std::pair{text.substr(0, place), text.substr(place + 1)};
}

/// Numbers between commas. @throws InputError naming the option.
std::vector<double> numbers(const std::string& option, const std::string& text) {
  const std::optional<std::vector<double>> values = to_reals(text);
  require_usage(values.has_value(), fmt::format("{}: '{}' is not a number, or numbers between commas", option, text));
  return *values;
}

void check_options(const ReduceArguments& a, const BasisOptions& basis) {
  const auto belongs = [&basis](bool given, const char* option, const char* name) {
    require(!given || basis.name == name, fmt::format("{}: is for --basis {}", option, name));
  };
  belongs(!a.interfaces.empty(), "--interface", "craig-bampton");
  belongs(!a.reference.empty(), "--reference", "craig-bampton");
  belongs(a.orthonormal, "--orthonormal", "craig-bampton");
  belongs(!a.hinge_stiffness.empty(), "--hinge-stiffness", "hinge");
  belongs(!a.spin.empty(), "--spin", "prestressed");
  belongs(!a.acceleration.empty(), "--acceleration", "prestressed");
  belongs(!a.turns.empty(), "--turns", "prestressed");
  require(basis.name != "prestressed" || basis.motion,
          "--basis prestressed: give the motion that stiffens the body with --spin X,Y,Z [rad/s] or "
          "--acceleration X,Y,Z [m/s^2]");
  require(basis.name != "craig-bampton" || !basis.interfaces.empty(),
          "--basis craig-bampton: name the places where the body is joined with --interface SET");
  require(basis.name != "hinge" || !basis.hinge_stiffness.empty(),
          "--basis hinge: give the stiffness of the hinge with --hinge-stiffness K1,K2 [N m/rad]");
  require(basis.name != "mean-axis" || !a.options.clamp, "--clamp: a body under mean axes is not held anywhere");
  require(a.stiffening || a.loads_at.empty(), "--loads-at: loads stiffen nothing with --no-stiffening");
  require(std::set(a.loads_at.begin(), a.loads_at.end()).size() == a.loads_at.size(), "--loads-at: a set comes twice");
  require(!a.count || *a.count >= 0, fmt::format("--count: must not be negative, got {}", a.count.value_or(0)));
}

Eigen::Vector3d vector_of(const std::vector<double>& three) {
  return three.empty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(three[0], three[1], three[2]);
}

/// The motion of the command line; what it leaves open is that of the body file, or none.
SteadyMotion steady_motion(const ReduceArguments& a, const std::optional<SteadyMotion>& of_file) {
  SteadyMotion motion = of_file.value_or(SteadyMotion{});
  if (!a.spin.empty()) motion.spin = vector_of(a.spin);
  if (!a.acceleration.empty()) motion.acceleration = vector_of(a.acceleration);
  if (!a.turns.empty()) motion.turns.clear();
  for (const std::string& text : a.turns) {
    const auto axis = axis_of(text);
    require_usage(axis.has_value(),
                  fmt::format("--turns: '{}' is no axis; there are x, y, z, and X,Y,Z of a direction", text));
    motion.turns.push_back(*axis);
  }
  return motion;
}

/// The basis of the command line; what it leaves open is that of the body file.
BasisOptions basis_options(const ReduceArguments& a, const Model& model) {
  BasisOptions o;
  if (!a.basis || *a.basis == model.basis.name) o = model.basis;
  if (a.basis) o.name = *a.basis;
  if (!a.interfaces.empty()) o.interfaces = a.interfaces, o.reference = a.reference;
  if (!a.reference.empty()) o.reference = a.reference;
  o.orthonormal = o.orthonormal || a.orthonormal;
  if (!a.attachments.empty()) o.corrections = a.attachments;
  if (!a.hinge_stiffness.empty()) o.hinge_stiffness = a.hinge_stiffness;
  if (!a.hinge_axis.empty()) o.hinge_axis = vector_of(a.hinge_axis);
  if (!a.spin.empty() || !a.acceleration.empty() || !a.turns.empty()) o.motion = steady_motion(a, o.motion);
  const bool all = model.body && model.body->directions == "all";
  const bool is_asked_for_plane = model.body && model.body->directions_given;  // else all count, but those of a hinge
  o.in_plane = !all && (o.name == "hinge" || is_asked_for_plane);
  o.modes = a.count.value_or(o.name == "hinge" ? 1 : model.modes.value_or(10));
  o.backend = a.backend.value_or(model.backend.value_or("auto"));
  return o;
}

/// Static solutions over the unknowns of a held body, by the factor of its modes where they were solved with this K.
StaticSolver statics_of(const Mesh& mesh, const BasisModel& m, const ModalBasis& basis) {
  if (basis.factor) return {basis.factor, basis.K};
  return static_solver(mesh, m.assembly, unknowns(mesh, m.assembly.dofs, m.held));
}

/// Coordinates that --select keeps, counted from 0.
std::vector<int> selection(const ReducedBody& body, const std::string& text) {
  const auto [rule, rest] = split(text, ':');
  if (rule == "output") {
    const auto [place, share] = split(rest, ',');
    const auto [marker, direction] = place_and_direction("--select output", place);
    return modes_by_observability(body, {{marker, direction}}, numbers("--select output", share).front());
  }
  const std::vector<double> values = numbers("--select", rest);
  if (rule == "list") {
    std::vector<int> list;
    for (const double v : values) {
      require(v == std::floor(v) && v >= 1 && v <= body.n(),
              fmt::format("--select list: {} is not the number of a coordinate; they are 1 to {}", v, body.n()));
      list.push_back(static_cast<int>(v) - 1);
    }
    return listed_modes(body, list);
  }
  if (rule == "band" && values.size() == 2) return modes_in_band(body, values[0], values[1]);
  if (rule == "mass" && values.size() == 1) return modes_by_effective_mass(body, values[0], {0, 1, 2});
  if (rule == "completeness" && values.size() == 1) return modes_by_completeness(body, values[0]);
  throw UsageError(
      fmt::format("--select: '{}' is not understood; there are list:1,3 band:LOW,HIGH mass:SHARE "
                  "completeness:SHARE output:SET.uy,SHARE",
                  text));
}

/// Where the basis holds the static response exactly.
std::vector<std::string> exact_markers(const ReductionOptions& o) {
  std::vector<std::string> markers;
  if (o.select || o.basis.in_plane) return markers;
  for (const std::string& text : o.basis.interfaces) markers.push_back(split(text, ':').first);
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

}  // namespace

DampingRule parse_damping(const std::string& text) {
  const auto [rule, rest] = split(text, ':');
  if (rule == "none" && rest.empty()) return {};
  const std::vector<double> values = rest.empty() ? std::vector<double>{} : numbers("--damping", rest);
  if ((rule == "modal" || rule == "loss-factor") && values.size() == 1) return {rule, values[0], 0, 0};
  if (rule == "rayleigh" && values.size() == 2) return {rule, 0, values[0], values[1]};
  throw UsageError(fmt::format(
      "--damping: '{}' is not understood; there are none, modal:ZETA, loss-factor:ETA, rayleigh:ALPHA,BETA", text));
}

ReductionOptions reduction_options(const ReduceArguments& a, const Model& model) {
  ReductionOptions o;
  o.basis = basis_options(a, model);
  check_options(a, o.basis);
  o.clamp_beside = a.options.clamp.has_value();
  o.select = a.select;
  if (const bool of_file = !a.select && !a.count && !a.basis; of_file && model.body && !model.body->shapes.empty())
    o.select = fmt::format("list:{}", fmt::join(model.body->shapes, ","));
  o.damping = a.damping ? parse_damping(*a.damping) : model.damping;
  o.stiffening = a.stiffening;
  o.loads_at = a.loads_at;
  o.source = a.model;
  return o;
}

namespace {

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
  std::optional<PrestressedBasis> prestressed;
  if (o.basis.name == "prestressed" && o.basis.modes > 0)
    prestressed = prestressed_basis(model.mesh, m, o.basis, threads);
  ModalBasis basis = prestressed ? prestressed->basis : make_basis(model.mesh, m, o.basis, threads);
  seconds.modes += clock.lap();
  ReducedBody body = reduce(model.mesh, m.assembly, basis, model.name, threads);
  seconds.invariants += clock.lap();
  if (o.select) {
    const std::vector<int> list = selection(body, *o.select);
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
  body.provenance = {fmt::format("flexboom {}", version), libraries(), o.source, mesh_hash(model.mesh),
                     options_text(o)};
  body.validate();
  return body;
}

namespace {

/// omega_k^2 (Ct_k; Cr0_k): what each coordinate brings to the root when it vibrates. Empty without frequencies.
std::string root_load_table(const ReducedBody& body) {
  const Eigen::MatrixXd L = root_load_participation(body);
  if (L.size() == 0 || L.isZero(0)) return "";
  std::string text = fmt::format("root loads per unit of a coordinate that vibrates, omega^2 (Ct; Cr0)\n{:>4}", "q");
  for (const char* name : {"Fx N", "Fy N", "Fz N", "Mx N m", "My N m", "Mz N m"}) text += fmt::format(" {:>12}", name);
  text += "\n";
  for (int k = 0; k < body.n(); ++k) {
    text += fmt::format("{:4}", k + 1);
    for (int i = 0; i < 6; ++i) text += fmt::format(" {:12.4e}", L(i, k));
    text += "\n";
  }
  return text;
}

}  // namespace

std::string description(const ReducedBody& body, const std::vector<BodyCheck>& checks) {
  const Eigen::Vector3d centre = body.mc0 / body.m;
  std::string text = fmt::format("{}: {}, {} coordinates of {} freedoms, frame {}\n", body.name, body.structure,
                                 body.n(), body.full_freedoms, body.frame);
  text += fmt::format("mass {:.12g} kg, centre {:.9g} {:.9g} {:.9g} m\n", body.m, centre.x(), centre.y(), centre.z());
  text += fmt::format("inertia about the origin: xx {:.9g} yy {:.9g} zz {:.9g} xy {:.9g} yz {:.9g} zx {:.9g} kg m^2\n",
                      body.J0(0, 0), body.J0(1, 1), body.J0(2, 2), body.J0(0, 1), body.J0(1, 2), body.J0(2, 0));
  text += fmt::format(
      "geometric stiffness: {}\n",
      body.Kg.spin.empty() ? "none" : fmt::format("spin, acceleration, {} marker(s)", body.Kg.markers.size()));
  for (const Marker& m : body.markers)
    text +=
        fmt::format("marker {} at {:.9g} {:.9g} {:.9g} m\n", m.name, m.position.x(), m.position.y(), m.position.z());
  text += fmt::format("{:>4} {:<12} {:>16} {:<12} {:<4} {:>12} {:>12} {:>12}\n", "q", "kind", "Hz", "interface", "",
                      "Ct x", "Ct y", "Ct z");
  for (int k = 0; k < body.n(); ++k) {
    const Coordinate& c = body.coordinates[static_cast<size_t>(k)];
    text += fmt::format("{:4} {:<12} {:16.8f} {:<12} {:<4} {:12.4e} {:12.4e} {:12.4e}\n", k + 1, c.kind, c.frequency_hz,
                        c.interface, c.direction, body.Ct(0, k), body.Ct(1, k), body.Ct(2, k));
  }
  text += root_load_table(body);
  text += fmt::format("{:<58} {:>22} {:>22} {:>10}\n", "check", "value", "reference", "error");
  return text + checks_text(checks);
}

std::string checks_text(const std::vector<BodyCheck>& checks) {
  std::string text;
  for (const BodyCheck& c : checks)
    text += fmt::format("{:<58} {:22.14g} {:22.14g} {:10.1e}{}\n", c.name, c.value, c.reference, c.relative_error,
                        c.passed ? "" : "  FAILED");
  return text;
}

nlohmann::ordered_json checks_json(const std::vector<BodyCheck>& checks) {
  auto list = nlohmann::ordered_json::array();
  for (const BodyCheck& c : checks)
    list.push_back({{"name", c.name},
                    {"value", c.value},
                    {"reference", c.reference},
                    {"relative_error", c.relative_error},
                    {"passed", c.passed}});
  return list;
}

nlohmann::ordered_json seconds_json(const ReductionSeconds& s) {
  return {{"mesh", s.mesh},
          {"assemble", s.assemble},
          {"modes", s.modes},
          {"invariants", s.invariants},
          {"stiffening", s.stiffening},
          {"certificate", s.certificate},
          {"richer", s.richer},
          {"total", s.total}};
}

nlohmann::ordered_json body_json(const ReducedBody& body, const std::vector<BodyCheck>& checks,
                                 const std::vector<std::string>& notes) {
  const Eigen::MatrixXd L = root_load_participation(body);  // 6 x n
  auto coordinates = nlohmann::ordered_json::array();
  for (int k = 0; k < body.n(); ++k) {
    const Coordinate& c = body.coordinates[static_cast<size_t>(k)];
    coordinates.push_back({{"kind", c.kind},
                           {"frequency_hz", c.frequency_hz},
                           {"interface", c.interface},
                           {"direction", c.direction},
                           {"root_loads", std::vector<double>(L.col(k).begin(), L.col(k).end())}});
  }
  auto markers = nlohmann::ordered_json::array();
  for (const Marker& m : body.markers)
    markers.push_back({{"name", m.name}, {"position", std::vector<double>(m.position.begin(), m.position.end())}});
  const Eigen::Vector3d centre = body.mc0 / body.m;
  auto inertia = nlohmann::ordered_json::array();
  for (int i = 0; i < 3; ++i) inertia.push_back({body.J0(i, 0), body.J0(i, 1), body.J0(i, 2)});
  const Provenance& p = body.provenance;
  return {{"name", body.name},
          {"structure", body.structure},
          {"frame", body.frame},
          {"mass", body.m},
          {"centre", std::vector<double>(centre.begin(), centre.end())},
          {"inertia", inertia},
          {"dofs", body.full_freedoms},
          {"coordinates", coordinates},
          {"markers", markers},
          {"stiffening", !body.Kg.spin.empty()},
          {"checks", checks_json(checks)},
          {"provenance",
           {{"program", p.program},
            {"libraries", p.libraries},
            {"source", p.source},
            {"mesh_hash", p.mesh_hash},
            {"options", p.options}}},
          {"notes", notes}};
}

}  // namespace flexboom
