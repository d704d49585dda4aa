#include "apps/scene/keys.hpp"
#include "apps/scene/scene.hpp"
#include "apps/scene/scene_checks.hpp"
#include "apps/scene/scene_keys.hpp"
#include "fem/assembly/constraints.hpp"
#include "fem/base/check.hpp"
#include "fem/base/text_reader.hpp"
#include "reduction/basis/basis.hpp"
#include "reduction/eigen/solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

// Comparisons of a value that stands alone are written so that NaN fails them. Comparisons of two values are written so
// that NaN passes them. So the fault is reported once, at the value that is NaN.

namespace flexboom {

using scene_keys::Dimension;
using toml_reader::Faults;

namespace {

using namespace scene_checks;

void check_shape(Faults& faults, const std::string& path, const SectionShape& shape) {
  if (const auto* tube = std::get_if<Tube>(&shape); tube && 2 * tube->thickness >= tube->diameter) {
    faults.add(join(path, "thickness"),
               fmt::format("is {} m, half of the diameter {} m or more; a tube needs less, a full bar is "
                           "shape \"round-bar\"",
                           tube->thickness, tube->diameter));
  }
  const auto* box = std::get_if<RectangularTube>(&shape);
  if (box && (2 * box->thickness >= box->height || 2 * box->thickness >= box->width)) {
    faults.add(join(path, "thickness"),
               fmt::format("is {} m, half of a side ({} m x {} m) or more; a tube needs less, a full bar "
                           "is shape \"rectangle\"",
                           box->thickness, box->height, box->width));
  }
}

void check_attachment(Faults& faults, const std::string& path, const RigidAttachment& attachment, double boom_length) {
  if (attachment.position < 0 || attachment.position > boom_length * (1 + round_off)) {
    faults.add(join(path, "position"),
               fmt::format("is {} m, which is not on the boom; it must be 0 to {} m, or \"tip\"", attachment.position,
                           boom_length));
  }
  finite(faults, join(path, "position"), attachment.position, "");
  if (attachment.mass == 0 && !attachment.inertia.isZero(0)) {
    faults.add(join(path, "inertia"), "has no mass to carry it; give mass");
  }
  if (attachment.mass == 0 && !attachment.offset.isZero(0)) {
    faults.add(join(path, "offset"), "has no mass to move; give mass");
  }
}

void check_geometry(Faults& faults, const std::string& path, const BeamGeometry& boom) {
  if (boom.segments.empty())
    faults.add(join(path, "segments"), "a boom needs at least one; give [[segments]] or a body file");
  for (size_t i = 0; i < boom.segments.size(); ++i) {
    const std::string at = join(path, fmt::format("segments[{}]", i));
    check_shape(faults, at, boom.segments[i].start);
    if (is_tapered(boom.segments[i])) check_shape(faults, at + ".end", boom.segments[i].end);
  }
  const double length = faults.clean(join(path, "segments")) ? boom.length() : std::numeric_limits<double>::quiet_NaN();
  std::set<std::string> names = {"root", "tip"};
  for (size_t i = 0; i < boom.attachments.size(); ++i) {
    const RigidAttachment& attachment = boom.attachments[i];
    const std::string at = join(path, fmt::format("attachments[{}]", i));
    check_attachment(faults, at, attachment, length);
    if (!attachment.name.empty() && !names.insert(attachment.name).second) {
      faults.add(join(at, "name"), fmt::format("\"{}\" is taken; choose another", attachment.name));
    }
  }
}

void check_damping(Faults& faults, const std::string& path, const DampingRule& damping) {
  const bool by_value = damping.name == "modal" || damping.name == "loss-factor";
  const bool rayleigh = damping.name == "rayleigh";
  const auto refuse = [&](std::string_view key, double value, bool used) {
    if (value == 0 || used) return;
    faults.add(join(path, key),
               fmt::format("is {} but is not used by rule \"{}\"; value belongs to \"modal\" and \"loss-factor\", "
                           "alpha and beta to \"rayleigh\"",
                           value, damping.name));
  };
  if (!faults.clean(join(path, "rule"))) return;
  refuse("value", damping.value, by_value);
  refuse("alpha", damping.alpha, rayleigh);
  refuse("beta", damping.beta, rayleigh);
}

// The closed form knows one uniform line mass, clamped at its root.
void check_eq14(Faults& faults, const std::string& path, const BodyScene& body) {
  const BeamGeometry& boom = body.geometry;
  std::string fault;
  if (boom.segments.size() > 1) fault = fmt::format("this one has {} segments", boom.segments.size());
  if (!boom.attachments.empty()) fault = fmt::format("this one has {} attachment(s)", boom.attachments.size());
  if (boom.segments.size() == 1 && is_tapered(boom.segments[0])) fault = "this one is tapered";
  if (boom.segments.size() == 1 && boom.segments[0].material.rho == 0) fault = "this one has rho = 0";
  if (body.clamp != "root") fault = fmt::format("this one is clamped at {}", toml_reader::in_quotes(body.clamp));
  if (!fault.empty()) {
    faults.add(
        join(path, "structure"),
        fmt::format(R"(is "eq14", the closed form of one uniform segment with mass, clamped at "root"; {}; use "beam")",
                    fault));
  }
  if (body.directions == "all" && !body.modes_auto && body.modes % 2 != 0)
    faults.add(join(path, "modes"),
               fmt::format("is {}; eq. 14 has equal modes in two planes, so with directions = \"all\" "
                           "it must be even",
                           body.modes));
}

/// Freedoms a clamped mesh has left for bending along y. An element of order p has p internal freedoms of extension and
/// of torsion, and the rest in halves for the two bending planes.
int unknowns_in_hinge_plane(const Mesh& mesh, const std::vector<int>& clamp) {
  int count = 2 * static_cast<int>(mesh.nodes.cols() - std::ssize(clamp));
  for (const Element& element : mesh.elements) {
    const int internal = element_types()[static_cast<size_t>(element.type)].internal_freedoms(mesh, element);
    count += (internal - 2 * element.order) / 2;
  }
  return count;
}

void check_shapes(Faults& faults, const std::string& path, const BodyScene& body) {
  if (body.shapes.empty()) return;
  if (body.modes_auto)
    return faults.add(join(path, "shapes"), "are some of the modes; their number must stand in \"modes\" beside it");
  if (body.basis.name != "clamped")
    return faults.add(join(path, "shapes"), R"(is for basis = "clamped"; other bases are whole)");
  if (body.shapes.back() > body.modes)
    faults.add(join(path, "shapes"), fmt::format("has {}, but modes = {}", body.shapes.back(), body.modes));
}

void check_mode_count(Faults& faults, const std::string& path, const BodyScene& body) {
  // Every element brings more than one unknown; that spares the mesh and the assembly.
  long elements = 0;
  for (const BeamSegment& segment : body.geometry.segments) elements += std::max(segment.elements, 1);
  if (body.modes <= elements) return;
  const Mesh mesh = make_mesh(body.geometry);
  const std::vector<int> clamp = node_set(mesh, body.clamp);
  const bool all = body.directions == "all";
  int limit = unknowns_in_hinge_plane(mesh, clamp);
  if (body.modes <= limit) return;  // which spares the assembly, too
  if (all) limit = unknowns(mesh, assemble(mesh).dofs, clamp).count;
  if (body.modes <= limit) return;
  faults.add(
      join(path, "modes"),
      fmt::format("is {}, but the mesh has only {} unknowns{}; ask for fewer modes, or give the segments more elements",
                  body.modes, limit, all ? "" : " for bending in the hinge plane"));
}

// What needs the body as a whole. The mesh's own checks are the net under the ones above.
void check_model(Faults& faults, const std::string& path, const BodyScene& body) {
  try {
    body.geometry.validate();
    const ShearRule given = body.geometry.shear, usual;
    if (body.geometry.theory == BeamTheory::euler_bernoulli && (given.name != usual.name || given.value != usual.value))
      faults.add(join(path, "shear"),
                 "is given beside theory = \"euler-bernoulli\", whose beams do not shear; drop one");
    for (const BeamSegment& segment : body.geometry.segments) {
      const bool sheared = body.geometry.theory == BeamTheory::timoshenko;
      const ShearRule rule = sheared ? body.geometry.shear : ShearRule{"value", 1};
      section_of(segment.start, segment.material.nu, rule);
      section_of(segment.end, segment.material.nu, rule);
    }
    check_shapes(faults, path, body);
    if (body.structure == "beam") body.geometry.validate_stations();
    if (body.structure == "beam" && body.basis.name == "clamped" && !body.modes_auto)
      check_mode_count(faults, path, body);
    if (body.structure == "solid") chosen(body.geometry, body.solid);
  } catch (const InputError& error) {
    faults.add(join(path, "segments"), error.what());
  }
}

/// Node sets of a boom.
std::vector<std::string_view> sets_of(const BodyScene& body) {
  std::vector<std::string_view> sets = {"root", "tip"};
  for (const RigidAttachment& attachment : body.geometry.attachments) {
    if (!attachment.name.empty()) sets.push_back(attachment.name);
  }
  return sets;
}

void check_clamp(Faults& faults, const std::string& path, const BodyScene& body) {
  check_name_among(faults, join(path, "clamp"), body.clamp, sets_of(body));
  if (body.clamp != "root" && body.basis.name != "clamped" && faults.clean(join(path, "basis")))
    faults.add(
        join(path, "clamp"),
        fmt::format("is {}, but the basis \"{}\" {}; drop it", toml_reader::in_quotes(body.clamp), body.basis.name,
                    body.basis.name == "hinge"         ? "is that of a hinge at the root"
                    : body.basis.name == "prestressed" ? "is that of a body held at its root"
                                                       : "is not held by a clamp, but by its interfaces or nowhere"));
}

void check_interfaces(Faults& faults, const std::string& path, const BodyScene& body) {
  const BasisOptions& basis = body.basis;
  std::vector<std::string> names;
  for (const std::string& text : basis.interfaces) {
    names.push_back(text.substr(0, text.find(':')));
    check_name_among(faults, join(path, "interfaces"), names.back(), sets_of(body));
    const std::string connection = text.substr(names.back().size());
    if (!connection.empty() && connection != ":rigid" && connection != ":distributing")
      faults.add(join(path, "interfaces"), fmt::format("has {}; behind the place stands nothing, \":rigid\" or "
                                                       "\":distributing\"",
                                                       toml_reader::in_quotes(text)));
  }
  if (basis.reference.empty())
    return faults.add(join(path, "reference"),
                      "is empty: the coordinates would hold the motion of the whole body, which its joint has, too; "
                      "name the interface that carries the frame");
  check_name_among(faults, join(path, "reference"), basis.reference,
                   std::vector<std::string_view>(names.begin(), names.end()));
}

/// Keys that belong to another basis, and what each basis needs.
void check_basis(Faults& faults, const std::string& path, const BodyScene& body) {
  const BasisOptions& basis = body.basis;
  if (!faults.clean(join(path, "basis"))) return;
  const auto belongs = [&](bool given, const char* key, std::string_view name) {
    if (given && basis.name != name)
      faults.add(join(path, key), fmt::format(R"(belongs to basis = "{}", this one is "{}")", name, basis.name));
  };
  belongs(!basis.interfaces.empty(), "interfaces", "craig-bampton");
  belongs(!basis.reference.empty(), "reference", "craig-bampton");
  belongs(basis.orthonormal, "orthonormal", "craig-bampton");
  belongs(!basis.hinge_stiffness.empty(), "hinge_stiffness", "hinge");
  belongs(basis.hinge_axis != BasisOptions{}.hinge_axis, "hinge_axis", "hinge");
  belongs(basis.motion.has_value(), "prestress", "prestressed");
  const bool elements = body.structure == "beam" || body.structure == "solid";
  if (basis.name != "clamped" && !elements)
    faults.add(join(path, "basis"), fmt::format("is \"{}\", which needs finite elements: structure \"beam\" or "
                                                "\"solid\", not \"{}\"",
                                                basis.name, body.structure));
  if (!basis.corrections.empty() && !elements)
    faults.add(join(path, "corrections"), R"(need finite elements: structure "beam" or "solid")");
  if (basis.name == "craig-bampton") check_interfaces(faults, path, body);
  for (const std::string& text : basis.corrections) try {
      const auto [set, direction] = place_and_direction("is not understood", text);
      check_name_among(faults, join(path, "corrections"), set, sets_of(body));
      if (!direction.starts_with('F') && !direction.starts_with('M'))
        throw InputError(fmt::format("has {}; a load is Fx, Fy, Fz, Mx, My or Mz", toml_reader::in_quotes(text)));
      component_of(direction);
    } catch (const InputError& error) {
      faults.add(join(path, "corrections"), error.what());
    }
}

void check_stiffening(Faults& faults, const std::string& path, const BodyScene& body) {
  if (body.stiffening != "on") return;
  const bool without = body.structure == "eq14" || (body.reduced && body.reduced->Kg.spin.empty());
  if (without)
    faults.add(join(path, "stiffening"), body.reduced
                                             ? "is \"on\", but the file has no geometric stiffness; make it anew with "
                                               "`flexboom reduce`, or say \"off\""
                                             : R"(is "on", but structure "eq14" has none; use "beam", or "off")");
}

}  // namespace

void spell_sets(BodyScene& body) {
  const std::vector<std::string_view> sets = sets_of(body);
  const auto spell = [&sets](std::string& text, size_t end) {  // the name ends there, or with the text
    const std::string name = text.substr(0, end);
    text.replace(0, name.size(), spelled(name, sets));
  };
  spell(body.clamp, std::string::npos);
  spell(body.basis.reference, std::string::npos);
  for (std::string& text : body.basis.interfaces) spell(text, text.find(':'));
  for (std::string& text : body.basis.corrections) spell(text, text.rfind('.'));
}

bool is_tapered(const BeamSegment& segment) {
  SectionShape start = segment.start, end = segment.end;
  const auto a = scene_keys::dimensions(start), b = scene_keys::dimensions(end);
  return !std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Dimension& x, const Dimension& y) {
    return x.key == y.key && (*x.value == *y.value || (std::isnan(*x.value) && std::isnan(*y.value)));
  });
}

void check_body(const BodyScene& body, const std::string& path, Faults& faults) {
  check_stiffening(faults, path, body);
  if (body.rigid) return;
  if (body.reduced && body.reduced->frame == "free")
    faults.add(join(path, "file"),
               "has coordinates that hold the motion of the whole body, which its joint has, too; reduce it with "
               "--reference");
  check_damping(faults, join(path, "damping"), body.other_damping.value_or(body.damping));
  if (body.reduced || !body.reduced_file.empty()) return;
  check_basis(faults, path, body);
  check_clamp(faults, path, body);
  check_geometry(faults, path, body.geometry);
  if (body.structure == "eq14") check_eq14(faults, path, body);
  if (faults.clean(path)) check_model(faults, path, body);
}

}  // namespace flexboom
