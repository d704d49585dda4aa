#include "apps/reduction.hpp"

#include "apps/version.hpp"
#include "fem/check.hpp"
#include "fem/inertia.hpp"
#include "fem/mesh_sets.hpp"
#include "fem/stopwatch.hpp"
#include "fem/text_reader.hpp"
#include "reduction/attachment_modes.hpp"
#include "reduction/certificate.hpp"
#include "reduction/craig_bampton.hpp"
#include "reduction/geometric_stiffness.hpp"
#include "reduction/hinge_basis.hpp"
#include "reduction/inertia_invariants.hpp"
#include "reduction/mean_axis.hpp"
#include "reduction/mode_selection.hpp"
#include "reduction/root_loads.hpp"

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
  std::vector<double> result;
  std::string rest = text;
  do {
    const auto [head, tail] = split(rest, ',');
    const auto value = to_real(head);
    require(value.has_value(), fmt::format("{}: '{}' is not a number", option, head));
    result.push_back(*value);
    rest = tail;
  } while (!rest.empty());
  return result;
}

/// A node set and a component, "tip.uy".
std::pair<std::string, std::string> place_and_direction(const std::string& option, const std::string& text) {
  const size_t dot = text.rfind('.');
  require(dot != std::string::npos && dot > 0,
          fmt::format("{}: '{}' must be a node set and a direction, e.g. tip.Fy", option, text));
  return {text.substr(0, dot), text.substr(dot + 1)};
}

void check_options(const ReduceArguments& a) {
  const auto belongs = [&a](bool given, const char* option, const char* basis) {
    require(!given || a.basis == basis, fmt::format("{}: is for --basis {}", option, basis));
  };
  belongs(!a.interfaces.empty(), "--interface", "craig-bampton");
  belongs(!a.reference.empty(), "--reference", "craig-bampton");
  belongs(a.orthonormal, "--orthonormal", "craig-bampton");
  belongs(!a.hinge_stiffness.empty(), "--hinge-stiffness", "hinge");
  require(a.basis != "craig-bampton" || !a.interfaces.empty(),
          "--basis craig-bampton: name the places where the body is joined with --interface SET");
  require(a.basis != "hinge" || !a.hinge_stiffness.empty(),
          "--basis hinge: give the stiffness of the hinge with --hinge-stiffness K1,K2 [N m/rad]");
  require(a.basis != "mean-axis" || !a.options.clamp, "--clamp: a body under mean axes is not held anywhere");
  require(a.stiffening || a.loads_at.empty(), "--loads-at: loads stiffen nothing with --no-stiffening");
  require(std::set(a.loads_at.begin(), a.loads_at.end()).size() == a.loads_at.size(), "--loads-at: a set comes twice");
  require(!a.count || *a.count >= 0, fmt::format("--count: must not be negative, got {}", a.count.value_or(0)));
}

EigenOptions eigen_options(const Model& model, const ReduceArguments& a) {
  EigenOptions options;
  options.num_modes = a.count.value_or(model.modes.value_or(10));
  options.backend = a.backend.value_or(model.backend.value_or("auto"));
  options.keep_factor = a.basis == "clamped";  // for the stiffening and the certificate
  return options;
}

/// A model ready for its basis. Interfaces change the mesh, so they come before the assembly.
struct Assembled {
  std::vector<InterfaceNode> interfaces;
  Assembly assembly;
  Clamp clamp;  // what the basis is made with
};

Assembled assembled(Model& model, const ReduceArguments& a, int threads) {
  Assembled result;
  std::vector<InterfacePlan> plans;
  for (const std::string& text : a.interfaces) {
    const auto [set, connection] = split(text, ':');
    plans.push_back({.name = set, .node_set = set, .connection = connection.empty() ? "rigid" : connection});
  }
  result.interfaces = place_interfaces(model.mesh, plans);
  result.assembly = assemble(model.mesh, threads);
  result.clamp = model.clamp;
  // Interfaces and mean axes hold the body themselves; a clamp is then only what the user names.
  if (a.basis == "mean-axis") result.clamp = Clamp({}, false);
  if (a.basis == "craig-bampton" && !a.options.clamp) result.clamp.nodes.clear();
  return result;
}

/// Static solutions over the unknowns of a held body, by the factor of its modes where they were solved with this K.
StaticSolver statics_of(const Model& model, const Assembly& assembly, const Clamp& held, const ModalBasis& basis) {
  if (basis.factor) return StaticSolver(basis.factor, basis.K);
  return static_solver(model.mesh, assembly, unknowns(model.mesh, assembly.dofs, held));
}

ModalBasis basis_of(const Model& model, const Assembled& m, const ReduceArguments& a, int threads) {
  const EigenOptions options = eigen_options(model, a);
  const Mesh& mesh = model.mesh;
  if (a.basis == "mean-axis") return mean_axis_modes(mesh, m.assembly, options, threads);
  if (a.basis == "craig-bampton")
    return craig_bampton(mesh, m.assembly, m.interfaces, {options, a.reference, a.orthonormal}, m.clamp, threads);
  if (a.basis == "hinge") {
    HingeSpring hinge;
    hinge.axis = Eigen::Vector3d(a.hinge_axis[0], a.hinge_axis[1], a.hinge_axis[2]);
    hinge.stiffness = a.hinge_stiffness;
    return hinge_adapted_modes(mesh, m.assembly, m.clamp, hinge, a.count.value_or(1), options, threads);
  }
  return clamped_modes(mesh, m.assembly, m.clamp, options, threads);
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
      require(v == std::floor(v), fmt::format("--select list: {} is no number of a coordinate", v));
      list.push_back(static_cast<int>(v) - 1);
    }
    return listed_modes(body, list);
  }
  if (rule == "band" && values.size() == 2) return modes_in_band(body, values[0], values[1]);
  if (rule == "mass" && values.size() == 1) return modes_by_effective_mass(body, values[0], {0, 1, 2});
  if (rule == "completeness" && values.size() == 1) return modes_by_completeness(body, values[0]);
  throw InputError(
      fmt::format("--select: '{}' is not understood; there are list:1,3 band:LOW,HIGH mass:SHARE "
                  "completeness:SHARE output:SET.uy,SHARE",
                  text));
}

/// Where the basis holds the static response exactly.
std::vector<std::string> exact_markers(const ReduceArguments& a) {
  std::vector<std::string> markers;
  if (a.select) return markers;
  for (const std::string& text : a.interfaces) markers.push_back(split(text, ':').first);
  return markers;
}

std::string libraries() {
  std::string text;
  for (const auto& [name, release] : linear_algebra_versions())
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, release);
  return text;
}

std::string options_text(const ReduceArguments& a, const EigenOptions& options) {
  std::string text = fmt::format("basis {}, count {}", a.basis, options.num_modes);
  if (!a.interfaces.empty()) text += fmt::format(", interfaces {}", fmt::join(a.interfaces, " "));
  if (!a.reference.empty()) text += ", reference " + a.reference;
  if (a.orthonormal) text += ", orthonormal";
  if (!a.attachments.empty()) text += fmt::format(", attachments {}", fmt::join(a.attachments, " "));
  if (!a.hinge_stiffness.empty())
    text += fmt::format(", hinge {} N m/rad about {}", fmt::join(a.hinge_stiffness, " "), fmt::join(a.hinge_axis, " "));
  if (a.select) text += ", select " + *a.select;
  if (a.damping) text += ", damping " + *a.damping;
  if (!a.stiffening) text += ", no stiffening";
  if (!a.loads_at.empty()) text += fmt::format(", loads at {}", fmt::join(a.loads_at, " "));
  return text;
}

/// The options with the names of node sets as the mesh spells them.
ReduceArguments with_names_of(const Mesh& mesh, ReduceArguments a) {
  const auto spell = [&mesh](std::string& text, size_t end) {  // the name ends there, or with the text
    text = node_set_name(mesh, text.substr(0, end)) + (end < text.size() ? text.substr(end) : "");
  };
  for (std::string& text : a.interfaces) spell(text, text.find(':'));
  for (std::string& text : a.attachments) spell(text, text.rfind('.'));
  for (std::string& text : a.loads_at) spell(text, std::string::npos);
  if (!a.reference.empty()) spell(a.reference, std::string::npos);
  if (a.select && a.select->starts_with("output:")) {
    std::string place = a.select->substr(std::string("output:").size());
    spell(place, place.rfind('.', place.find(',')));
    a.select = "output:" + place;
  }
  return a;
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
  throw InputError(fmt::format(
      "--damping: '{}' is not understood; there are none, modal:ZETA, loss-factor:ETA, rayleigh:ALPHA,BETA", text));
}

ReducedBody make_reduced_body(Model& model, const ReduceArguments& arguments, int threads, ReductionSeconds& seconds) {
  check_options(arguments);
  const ReduceArguments a = with_names_of(model.mesh, arguments);
  for (const std::string& name : a.loads_at) node_set(model.mesh, name);  // before the long work
  Stopwatch clock;
  const DampingRule damping = a.damping ? parse_damping(*a.damping) : model.damping;
  const Assembled m = assembled(model, a, threads);
  seconds.assemble += clock.lap();
  ModalBasis basis = basis_of(model, m, a, threads);
  std::vector<AttachmentLoad> loads;
  for (const std::string& text : a.attachments) {
    const auto [marker, direction] = place_and_direction("--attach", text);
    loads.push_back({marker, direction});
  }
  if (!loads.empty()) basis = with_attachment_modes(std::move(basis), model.mesh, m.assembly, m.clamp, loads, threads);
  seconds.modes += clock.lap();
  ReducedBody body = reduce(model.mesh, m.assembly, basis, model.name, threads);
  seconds.invariants += clock.lap();
  if (a.select) {
    const std::vector<int> list = selection(body, *a.select);
    basis = selected(basis, list);
    body = selected(body, list);
  }
  if (!basis.summary.note.empty()) model.notes.push_back(basis.summary.note);
  if (!basis.summary.proof.empty()) model.notes.push_back(basis.summary.proof);

  // What holds the body when it is loaded: its clamp, and the interface that carries its frame.
  Clamp held = m.clamp;
  for (const InterfaceNode& i : m.interfaces) {
    if (i.name == a.reference) held.nodes.push_back(i.node);
  }
  const bool flies = body.frame == "clamped" || body.frame == "mean-axis";
  std::optional<StaticSolver> statics;  // one factorisation for the stiffening and the certificate
  if (body.frame == "clamped" && body.n() > 0) statics = statics_of(model, m.assembly, held, basis);
  const StaticSolver* held_statics = statics ? &*statics : nullptr;
  if (a.stiffening && flies && body.n() > 0) {
    body.Kg = geometric_stiffness(model.mesh, m.assembly, held, basis.Phi,
                                  {.markers = loaded_markers(body, model.mesh, a.loads_at),
                                   .threads = threads,
                                   .statics = held_statics,
                                   .Ke = &body.Ke});
  }
  seconds.stiffening += clock.lap();
  apply_damping(body, damping);
  body.certificate = certificate(body, model.mesh, m.assembly, held, basis, exact_markers(a), threads, held_statics);
  seconds.certificate += clock.lap();
  body.provenance = {fmt::format("flexboom {}", version), libraries(), a.model, mesh_hash(model.mesh),
                     options_text(a, eigen_options(model, a))};
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
