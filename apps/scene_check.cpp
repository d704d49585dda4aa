#include "apps/scene.hpp"
#include "apps/scene_checks.hpp"
#include "apps/scene_keys.hpp"
#include "dynamics/integrator.hpp"
#include "fem/check.hpp"
#include "fem/constraints.hpp"
#include "reduction/eigen_solver.hpp"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

// Comparisons are written so that NaN fails them where a value stands alone, and passes where two values are compared:
// then the fault is reported at the value that is NaN, once.

namespace flexboom {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using scene_keys::Dimension;
using toml_reader::Faults;

namespace scene_checks {

std::string join(const std::string& path, std::string_view key) {
  return path.empty() ? std::string(key) : fmt::format("{}.{}", path, key);
}

void check_positive(Faults& faults, const std::string& path, double value, std::string_view unit) {
  if (!(std::isfinite(value) && value > 0)) faults.add(path, fmt::format("is {}{}; it must be positive", value, unit));
}

void check_not_negative(Faults& faults, const std::string& path, double value, std::string_view unit) {
  if (!(std::isfinite(value) && value >= 0))
    faults.add(path, fmt::format("is {}{}; it must be zero or positive", value, unit));
}

void check_finite(Faults& faults, const std::string& path, double value) {
  if (!std::isfinite(value)) faults.add(path, fmt::format("is {}; it must be a finite number", value));
}

void check_finite(Faults& faults, const std::string& path, const Vector3d& v) {
  if (!v.allFinite())
    faults.add(path, fmt::format("is [{}, {}, {}]; every entry must be a finite number", v.x(), v.y(), v.z()));
}

void check_unit(Faults& faults, const std::string& path, const Vector3d& v) {
  if (!(std::abs(v.norm() - 1) <= round_off))
    faults.add(path,
               fmt::format("is [{}, {}, {}] of length {}; it must be a unit vector", v.x(), v.y(), v.z(), v.norm()));
}

void check_name(Faults& faults, const std::string& path, const std::string& name) {
  const auto allowed = [](unsigned char c) { return (c < 0x80 && std::isalnum(c)) || c == '_' || c == '-'; };
  if (name.empty() || !std::all_of(name.begin(), name.end(), allowed)) {
    faults.add(path, fmt::format("is {}; it must be one or more of the letters a-z, A-Z, digits, _ and -",
                                 toml_reader::quoted(name)));
  }
}

void check_inertia(Faults& faults, const std::string& path, const Matrix3d& inertia, bool may_vanish) {
  if (!inertia.allFinite()) return faults.add(path, "has an entry that is not finite; give 9 or 3 finite numbers");
  const double scale = inertia.cwiseAbs().maxCoeff();
  const double skew = (inertia - inertia.transpose()).cwiseAbs().maxCoeff();
  if (skew > round_off * scale) {
    return faults.add(
        path, fmt::format("is not symmetric: entries across the diagonal differ by up to {:g} kg m^2, {:.3g} % of "
                          "the largest entry; up to 2 % is repaired with a warning",
                          skew, 100 * skew / scale));
  }
  const Vector3d I = Eigen::SelfAdjointEigenSolver<Matrix3d>(inertia, Eigen::EigenvaluesOnly).eigenvalues();
  const std::string moments = fmt::format("principal moments {:g}, {:g}, {:g} kg m^2", I(0), I(1), I(2));
  if (may_vanish ? I(0) < -round_off * scale : I(0) <= 0) {
    return faults.add(path, fmt::format("is not positive definite: {}; {}", moments,
                                        may_vanish ? "none may be negative" : "all must be positive"));
  }
  if (I(2) > (I(0) + I(1)) * (1 + round_off)) {
    faults.add(path, fmt::format("breaks the triangle inequality: {}; none can exceed the sum of the others", moments));
  }
}

}  // namespace scene_checks

namespace {

using namespace scene_checks;

constexpr double max_rows = 1e6;      // of trajectory.csv
constexpr int max_modes = 10000;      // per body; more is a typing error
constexpr int max_elements = 100000;  // per segment; as make_mesh

template <class Table>
std::vector<std::string_view> names_of(const Table& table) {
  std::vector<std::string_view> names;
  for (const auto& row : table) names.push_back(row.name);
  return names;
}

std::vector<std::string_view> backend_names() {
  std::vector<std::string_view> names = names_of(eigen_backends());
  names.push_back("auto");
  return names;
}

// --- bodies ---

void check_shape(Faults& faults, const std::string& path, SectionShape shape) {
  for (const Dimension& d : scene_keys::dimensions(shape)) check_positive(faults, join(path, d.key), *d.value, "");
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

bool is_tapered(const BeamSegment& segment) {
  SectionShape start = segment.start, end = segment.end;
  const auto a = scene_keys::dimensions(start), b = scene_keys::dimensions(end);
  return !std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Dimension& x, const Dimension& y) {
    return x.key == y.key && (*x.value == *y.value || (std::isnan(*x.value) && std::isnan(*y.value)));
  });
}

void check_material(Faults& faults, const std::string& path, const Material& material) {
  check_positive(faults, join(path, "E"), material.E, " Pa");
  if (!(material.nu > -1 && material.nu < 0.5)) {
    faults.add(join(path, "nu"),
               fmt::format("is {}; Poisson's ratio must lie between -1 and 0.5, both excluded", material.nu));
  }
  check_not_negative(faults, join(path, "rho"), material.rho, " kg/m^3");
}

void check_segment(Faults& faults, const std::string& path, const BeamSegment& segment) {
  check_positive(faults, join(path, "length"), segment.length, " m");
  if (segment.elements < 0 || segment.elements > max_elements) {
    faults.add(join(path, "elements"), fmt::format("is {}; it must be 1 to {}, or 0 to let the program choose",
                                                   segment.elements, max_elements));
  }
  check_material(faults, join(path, "material"), segment.material);
  check_shape(faults, path, segment.start);
  if (is_tapered(segment)) check_shape(faults, join(path, "end"), segment.end);
}

void check_attachment(Faults& faults, const std::string& path, const RigidAttachment& attachment, double boom_length) {
  if (!attachment.name.empty()) check_name(faults, join(path, "name"), attachment.name);
  if (attachment.position < 0 || attachment.position > boom_length * (1 + round_off)) {
    faults.add(join(path, "position"),
               fmt::format("is {} m, which is not on the boom; it must be 0 to {} m, or \"tip\"", attachment.position,
                           boom_length));
  }
  check_finite(faults, join(path, "position"), attachment.position);
  check_not_negative(faults, join(path, "mass"), attachment.mass, " kg");
  check_finite(faults, join(path, "offset"), attachment.offset);
  check_inertia(faults, join(path, "inertia"), attachment.inertia, true);
  if (attachment.mass == 0 && !attachment.inertia.isZero(0)) {
    faults.add(join(path, "inertia"), "has no mass to carry it; give mass");
  }
  if (attachment.mass == 0 && !attachment.offset.isZero(0)) {
    faults.add(join(path, "offset"), "has no mass to move; give mass");
  }
}

void check_shear_name(Faults& faults, const std::string& path, const std::string& name) {
  const auto& rules = scene_keys::shear_rules;
  if (std::find(rules.begin(), rules.end(), name) != rules.end()) return;
  faults.add(path, toml_reader::not_among(name, rules) + ", or the shear coefficient itself, a number");
}

void check_geometry(Faults& faults, const std::string& path, const BeamGeometry& boom) {
  if (boom.segments.empty())
    faults.add(join(path, "segments"), "a boom needs at least one; give [[segments]] or a body file");
  if (boom.order < 1 || boom.order > 12)
    faults.add(join(path, "order"), fmt::format("is {}; it must be 1 to 12", boom.order));
  if (boom.shear.name == "value") {
    check_positive(faults, join(path, "shear"), boom.shear.value, "");
  } else {
    check_shear_name(faults, join(path, "shear"), boom.shear.name);
  }
  for (size_t i = 0; i < boom.segments.size(); ++i) {
    check_segment(faults, join(path, fmt::format("segments[{}]", i)), boom.segments[i]);
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
  check_name_among(faults, join(path, "rule"), damping.name, scene_keys::damping_rules);
  check_not_negative(faults, join(path, "value"), damping.value, "");
  check_not_negative(faults, join(path, "alpha"), damping.alpha, " 1/s");
  check_not_negative(faults, join(path, "beta"), damping.beta, " s");
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
  if (body.clamp != "root") fault = fmt::format("this one is clamped at {}", toml_reader::quoted(body.clamp));
  if (!fault.empty()) {
    faults.add(
        join(path, "structure"),
        fmt::format(
            "is \"eq14\", the closed form of one uniform segment with mass, clamped at \"root\"; {}; use \"beam\"",
            fault));
  }
  if (body.directions == "all" && !body.modes_auto && body.modes % 2 != 0)
    faults.add(join(path, "modes"),
               fmt::format("is {}; eq. 14 has equal modes in two planes, so with directions = \"all\" "
                           "it must be even",
                           body.modes));
}

/// Freedoms a clamped mesh has left: in all, and for bending along y. An element of order p has p internal freedoms of
/// extension and of torsion, and the rest in halves for the two bending planes.
struct Unknowns {
  int all = 0;
  int hinge_plane = 0;
};

Unknowns count_unknowns(const Mesh& mesh, const std::vector<int>& clamp) {
  Unknowns unknowns;
  unknowns.all = flexboom::unknowns(mesh, assemble(mesh).dofs, clamp).count;
  unknowns.hinge_plane = 2 * static_cast<int>(mesh.nodes.cols() - std::ssize(clamp));
  for (const Element& element : mesh.elements) {
    const int internal = element_types()[static_cast<size_t>(element.type)].internal_freedoms(mesh, element);
    unknowns.hinge_plane += (internal - 2 * element.order) / 2;
  }
  return unknowns;
}

void check_mode_count(Faults& faults, const std::string& path, const BodyScene& body) {
  const Mesh mesh = make_mesh(body.geometry);
  if (body.modes <= std::ssize(mesh.elements)) return;  // every element brings more than one; spares the assembly
  const Unknowns unknowns = count_unknowns(mesh, node_set(mesh, body.clamp));
  const bool all = body.directions == "all";
  const int limit = all ? unknowns.all : unknowns.hinge_plane;
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
    for (const BeamSegment& segment : body.geometry.segments) {
      const bool sheared = body.geometry.theory == BeamTheory::timoshenko;
      const ShearRule rule = sheared ? body.geometry.shear : ShearRule{"value", 1};
      section_of(segment.start, segment.material.nu, rule);
      section_of(segment.end, segment.material.nu, rule);
    }
    if (body.structure == "beam" && !body.modes_auto) check_mode_count(faults, path, body);
    if (body.structure == "solid") chosen(body.geometry, body.solid);
  } catch (const InputError& error) {
    faults.add(join(path, "segments"), error.what());
  }
}

void check_clamp(Faults& faults, const std::string& path, const BodyScene& body) {
  std::vector<std::string_view> sets = {"root", "tip"};
  for (const RigidAttachment& attachment : body.geometry.attachments) {
    if (!attachment.name.empty()) sets.push_back(attachment.name);
  }
  check_name_among(faults, join(path, "clamp"), body.clamp, sets);
}

// --- scene ---

// After a fault in a name, what refers to bodies by name is not looked at.
bool body_names_known(const Faults& faults, const Scene& scene) {
  if (scene.bodies.empty()) return faults.clean("bodies");
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    if (!faults.clean(fmt::format("bodies[{}].name", i))) return false;
  }
  return true;
}

void check_times(Faults& faults, const Scene& scene) {
  check_positive(faults, "duration", scene.duration, " s");
  check_positive(faults, "output_step", scene.output_step, " s");
  check_not_negative(faults, "vtu_step", scene.vtu_step, " s");
  const auto check_rows = [&](const char* key, double step) {
    if (step > 0 && scene.duration / step > max_rows) {
      faults.add(key, fmt::format("is {} s: {:.3g} rows in {} s; at most {:g} are written, so make it longer", step,
                                  scene.duration / step, scene.duration, max_rows));
    }
  };
  check_rows("output_step", scene.output_step);
  check_rows("vtu_step", scene.vtu_step);
}

void check_accuracy(Faults& faults, const Scene& scene) {
  if (!(scene.tolerance > 0 && scene.tolerance <= 0.1)) {
    faults.add("accuracy.tolerance", fmt::format("is {}; it must be above 0 and at most 0.1", scene.tolerance));
  }
  std::vector<std::string> known = {"hub.rotation", "hub.rate", "hub.position"};
  for (const BodyScene& body : scene.bodies) {
    for (const char* of_body : {".angle", ".rate", ".q", ".tip"}) known.push_back(body.name + of_body);
  }
  if (scene.is_tree) known = tree_outputs(scene);
  const std::vector<std::string_view> names(known.begin(), known.end());
  if (!body_names_known(faults, scene)) return;
  for (const std::string& output : scene.outputs) check_name_among(faults, "accuracy.outputs", output, names);
}

void check_integrator(Faults& faults, const Scene& scene) {
  check_name_among(faults, "integrator.formulation", scene.formulation, scene_keys::formulations);
  const bool redundant = scene.formulation == "multipliers";
  std::vector<std::string_view> methods = {"auto"};
  if (redundant) methods.push_back("ida");
  for (const IntegratorMethod& m : integrator_methods())
    if (!redundant && (!scene.is_tree || m.make != nullptr)) methods.push_back(m.name);
  check_name_among(faults, "integrator.method", scene.integrator, methods);
  if (redundant) check_multipliers(scene, faults);
  if (!(std::isfinite(scene.settle) && scene.settle < 1)) {
    faults.add("integrator.settle",
               fmt::format("is {}; it must be below 1 (0: never, negative: tolerance / 100)", scene.settle));
  }
}

void check_hub(Faults& faults, const Scene& scene) {
  const HubScene& hub = scene.hub;
  for (int i = 0; i < 3; ++i) check_not_negative(faults, "hub.size", hub.size(i), " m");
  check_finite(faults, "initial.rate", scene.start_rate);
  check_finite(faults, "initial.velocity", scene.start_velocity);
  if (!hub.fixed) {
    if (!(std::isfinite(hub.mass) && hub.mass > 0)) {
      faults.add("hub.mass", fmt::format("is {} kg; it must be positive, or hub.fixed = true", hub.mass));
    }
    check_inertia(faults, "hub.inertia", hub.inertia, false);
    return;
  }
  check_not_negative(faults, "hub.mass", hub.mass, " kg");
  check_inertia(faults, "hub.inertia", hub.inertia, true);
  const auto at_rest = [&](const char* path, const Vector3d& v) {
    if (v.allFinite() && !v.isZero(0)) faults.add(path, "is not zero but hub.fixed is true; drop one of them");
  };
  at_rest("initial.rate", scene.start_rate);
  at_rest("initial.velocity", scene.start_velocity);
}

void check_orbit(Faults& faults, const OrbitScene& orbit) {
  check_positive(faults, "orbit.altitude", orbit.altitude, " m");
  if (!(std::abs(orbit.inclination) <= std::numbers::pi)) {
    faults.add("orbit.inclination", fmt::format("is {} rad; it must lie between -pi and pi", orbit.inclination));
  }
  if (orbit.gravity != "none" && orbit.gravity != "differential")
    faults.add("orbit.gravity", fmt::format("is \"{}\"; there are \"none\" and \"differential\"", orbit.gravity));
}

void check_directions(Faults& faults, const std::string& path, const Hinge& hinge) {
  check_unit(faults, join(path, "stowed"), hinge.stowed);
  check_unit(faults, join(path, "outward"), hinge.outward);
  const double cosine = hinge.stowed.dot(hinge.outward);
  if (std::abs(cosine) > round_off && faults.clean(join(path, "stowed"))) {
    faults.add(join(path, "outward"),
               fmt::format("is not normal to stowed: the angle between them is {:.6g} rad; it must be pi/2",
                           std::acos(cosine)));
  }
}

void check_hinge(Faults& faults, const std::string& path, const HingeScene& hinge) {
  const HingeMechanism& mechanism = hinge.hinge.mechanism;
  check_finite(faults, join(path, "point"), hinge.hinge.point);
  check_directions(faults, path, hinge.hinge);
  check_not_negative(faults, join(path, "stiffness"), mechanism.stiffness, " N m/rad");
  check_not_negative(faults, join(path, "P2"), mechanism.damping, " N m s/rad");
  check_not_negative(faults, join(path, "P3"), mechanism.stop_stiffness, " N m/rad");
  check_finite(faults, join(path, "rest"), mechanism.rest);
  check_finite(faults, join(path, "threshold"), mechanism.threshold);
  check_finite(faults, join(path, "start_angle"), hinge.start_angle);
  check_finite(faults, join(path, "start_rate"), hinge.start_rate);
}

void check_body_names(Faults& faults, const Scene& scene) {
  std::set<std::string> taken = {"hub", "lvlh", "energy"};  // first words of other columns
  if (scene.is_tree) taken = {"energy", std::string(scene_keys::ground)};
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    const std::string& name = scene.bodies[i].name;
    if (!taken.insert(name).second) {
      faults.add(fmt::format("bodies[{}].name", i),
                 fmt::format("{} is taken; choose another", toml_reader::quoted(name)));
    }
  }
}

// Hinges name bodies that exist, each once.
void check_hinge_bodies(Faults& faults, const Scene& scene) {
  std::vector<std::string_view> names;
  for (const BodyScene& body : scene.bodies) names.push_back(body.name);
  std::set<std::string> hinged;
  for (size_t i = 0; i < scene.hinges.size(); ++i) {
    const std::string path = fmt::format("hinges[{}].body", i);
    const std::string& body = scene.hinges[i].body;
    if (names.empty()) {
      faults.add(path, fmt::format("is {}, but the scene has no bodies; give [[bodies]]", toml_reader::quoted(body)));
    } else {
      check_name_among(faults, path, body, names);
    }
    if (!hinged.insert(body).second) {
      faults.add(path, fmt::format("{} has a hinge already; each body takes one", toml_reader::quoted(body)));
    }
  }
}

// Each body hangs on a hinge by its root. Silent after a fault in what a hinge says of its body, which would be
// repeated here.
void check_connections(Faults& faults, const Scene& scene) {
  if (!body_names_known(faults, scene)) return;
  check_hinge_bodies(faults, scene);
  if (scene.hinges.empty() && !faults.clean("hinges")) return;
  std::set<std::string> hinged;
  for (size_t i = 0; i < scene.hinges.size(); ++i) {
    if (!faults.clean(fmt::format("hinges[{}].body", i))) return;
    hinged.insert(scene.hinges[i].body);
  }
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    const BodyScene& body = scene.bodies[i];
    const std::string path = fmt::format("bodies[{}]", i);
    if (!hinged.contains(body.name)) {
      faults.add(path, fmt::format("\"{0}\" has no hinge; give [[hinges]] with body = \"{0}\"", body.name));
    }
    if (body.clamp != "root") {
      faults.add(path + ".clamp",
                 fmt::format("is {}; on a hinge it must be \"root\"", toml_reader::quoted(body.clamp)));
    }
  }
}

void check_rigid(Faults& faults, const std::string& path, const RigidScene& body) {
  check_positive(faults, join(path, "mass"), body.mass, " kg");
  check_inertia(faults, join(path, "inertia"), body.inertia, true);
  check_finite(faults, join(path, "centre"), body.centre);
  for (int i = 0; i < 3; ++i) check_not_negative(faults, join(path, "size"), body.size(i), " m");
}

void check_stiffening(Faults& faults, const std::string& path, const BodyScene& body) {
  check_name_among(faults, join(path, "stiffening"), body.stiffening, scene_keys::stiffenings);
  if (body.stiffening != "on") return;
  const bool without = body.structure == "eq14" || (body.reduced && body.reduced->Kg.spin.empty());
  if (without)
    faults.add(join(path, "stiffening"), body.reduced
                                             ? "is \"on\", but the file has no geometric stiffness; make it anew with "
                                               "`flexboom reduce`, or say \"off\""
                                             : "is \"on\", but structure \"eq14\" has none; use \"beam\", or \"off\"");
}

}  // namespace

void check_body(const BodyScene& body, const std::string& path, Faults& faults) {
  check_name(faults, join(path, "name"), body.name);
  if (!body.stiffening.empty()) check_stiffening(faults, path, body);
  if (body.rigid) return check_rigid(faults, path, *body.rigid);
  if (body.reduced || !body.reduced_file.empty()) return check_damping(faults, join(path, "damping"), body.damping);
  if (body.structure == "solid" && !path.empty()) {
    faults.add(
        join(path, "structure"),
        "\"solid\" has modes and a mesh but does not fly in this version; in a scene it must be \"beam\", \"eq14\" or "
        "\"rigid\"");
  }
  check_name_among(faults, join(path, "structure"), body.structure, scene_keys::structures);
  check_name_among(faults, join(path, "directions"), body.directions, scene_keys::directions);
  check_name_among(faults, join(path, "backend"), body.backend, backend_names());
  check_clamp(faults, path, body);
  if (body.modes < 0 || body.modes > max_modes) {
    faults.add(join(path, "modes"), fmt::format("is {}; it must be 0 to {}, or \"auto\"", body.modes, max_modes));
  }
  check_damping(faults, join(path, "damping"), body.damping);
  check_geometry(faults, path, body.geometry);
  if (body.structure == "eq14") check_eq14(faults, path, body);
  if (faults.clean(path)) check_model(faults, path, body);
}

void check_scene(const Scene& scene, Faults& faults) {
  check_name(faults, "name", scene.name);  // the results folder is called so
  check_times(faults, scene);
  check_integrator(faults, scene);
  if (!scene.is_tree) check_hub(faults, scene);
  if (scene.orbit) check_orbit(faults, *scene.orbit);
  if (scene.orbit && scene.orbit->gravity != "none" && scene.hub.fixed)
    faults.add("orbit.gravity", "acts on bodies that fly, but hub.fixed is true; drop one of them");
  for (size_t i = 0; i < scene.bodies.size(); ++i) check_body(scene.bodies[i], fmt::format("bodies[{}]", i), faults);
  for (size_t i = 0; i < scene.hinges.size(); ++i) check_hinge(faults, fmt::format("hinges[{}]", i), scene.hinges[i]);
  check_body_names(faults, scene);
  check_accuracy(faults, scene);
  scene.is_tree ? check_tree(scene, faults) : check_connections(faults, scene);
}

void validate(const Scene& scene) {
  Faults faults;
  check_scene(scene, faults);
  faults.throw_if_any();
}

}  // namespace flexboom
