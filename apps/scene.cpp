#include "apps/scene.hpp"

#include "apps/keys.hpp"
#include "apps/scene_keys.hpp"
#include "apps/scene_law.hpp"
#include "apps/toml_reader.hpp"
#include "fem/check.hpp"
#include "reduction/body_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using scene_keys::Dimension;
using toml_reader::Faults;
using toml_reader::parse_format;
using toml_reader::read_format;
using toml_reader::read_text;
using toml_reader::TableReader;
using toml_reader::Value;

constexpr double repairable_skew = 0.02;       // of the largest entry of an inertia; misprints, not other matrices
constexpr double repairable_direction = 1e-6;  // of a direction: rounding by hand

/// What reading fills besides the values.
struct Reading {
  Faults faults;
  std::vector<std::string> warnings;
  std::filesystem::path folder;  // that `file` of a body is relative to
};

Matrix3d read_inertia(TableReader& table, std::string_view key, const std::optional<Matrix3d>& otherwise,
                      Reading& reading) {
  const Matrix3d inertia = table.matrix(key, otherwise);
  const double scale = inertia.cwiseAbs().maxCoeff();
  const double skew = (inertia - inertia.transpose()).cwiseAbs().maxCoeff();
  if (!(skew > 0 && skew <= repairable_skew * scale)) return inertia;
  reading.warnings.push_back(
      fmt::format("{}: not symmetric (entries across the diagonal differ by up to {:g} kg m^2); "
                  "(I + I^T)/2 is used",
                  table.path(key), skew));
  return 0.5 * (inertia + inertia.transpose());
}

// --- bodies ---

SectionShape read_shape(TableReader& table, std::string_view name_of_shape, SectionShape shape, bool all_optional) {
  for (const Dimension& d : scene_keys::dimensions(shape)) {
    *d.value = table.number(d.key, d.optional || all_optional ? std::optional(*d.value) : std::nullopt);
  }
  if (all_optional) table.reject_unknown(fmt::format(" (the end of a {})", name_of_shape));
  return shape;
}

// Without a known shape it is not known either which other keys belong here; some faultless section then takes the
// place.
void read_sections(TableReader& table, BeamSegment& segment) {
  const size_t none = scene_keys::shapes.size();
  const size_t shape = table.choice("shape", scene_keys::shapes, none);
  if (!table.has("shape")) {
    table.fault("shape", fmt::format("is missing; it must be one of \"{}\"", fmt::join(scene_keys::shapes, "\", \"")));
  }
  if (shape == none) {
    segment.start = segment.end = GeneralSection{1, 1, 1, 1, 1, 1};
    return;
  }
  const std::string_view name = scene_keys::shapes[shape];
  segment.start = read_shape(table, name, scene_keys::blank_shape(shape), false);
  segment.end = segment.start;
  if (auto end = table.table("end")) segment.end = read_shape(*end, name, segment.start, true);
  table.reject_unknown(fmt::format(" (for shape \"{}\")", name));
}

BeamSegment read_segment(TableReader table) {
  BeamSegment segment;
  segment.length = table.number("length");
  segment.elements = table.integer("elements", segment.elements);
  if (auto material = table.table("material", true)) {
    segment.material = {material->number("E"), material->number("nu"), material->number("rho")};
    material->reject_unknown();
  }
  read_sections(table, segment);
  return segment;
}

RigidAttachment read_attachment(TableReader table, double boom_length, Reading& reading) {
  RigidAttachment attachment;
  attachment.name = table.text("name", attachment.name);
  if (table.is_text("position")) {
    if (table.text("position") != "tip") {
      table.fault("position", "is the string " + toml_reader::quoted(table.text("position")) +
                                  "; it must be a distance from the root [m], or \"tip\"");
    }
    attachment.position = boom_length > 0 ? boom_length : 0;  // a faulty length is reported where it stands
  } else {
    attachment.position = table.number("position");
  }
  attachment.mass = table.number("mass");
  attachment.inertia = read_inertia(table, "inertia", attachment.inertia, reading);
  attachment.offset = table.vector("offset", attachment.offset);
  table.reject_unknown();
  return attachment;
}

ShearRule read_shear(TableReader& table, const ShearRule& otherwise) {
  if (!table.has("shear")) return otherwise;
  if (!table.is_text("shear")) return {"value", table.number("shear")};
  return {table.text("shear"), 0};
}

BeamGeometry read_geometry(TableReader& table, Reading& reading) {
  BeamGeometry boom;
  const auto theory = static_cast<size_t>(boom.theory);
  boom.theory = static_cast<BeamTheory>(table.choice("theory", scene_keys::theories, theory));
  boom.shear = read_shear(table, boom.shear);
  boom.rotary_inertia = table.boolean("rotary_inertia", boom.rotary_inertia);
  boom.order = table.integer("order", boom.order);
  for (TableReader& segment : table.tables("segments")) boom.segments.push_back(read_segment(segment));
  for (TableReader& attachment : table.tables("attachments")) {
    boom.attachments.push_back(read_attachment(attachment, boom.length(), reading));
  }
  return boom;
}

SolidOptions read_solid(TableReader& table) {
  SolidOptions solid;
  auto keys = table.table("solid");
  if (!keys) return solid;
  if (auto grading = keys->table("grading")) read_keys(*grading, solid.grading, grading_keys);
  read_keys(*keys, solid, solid_keys);
  return solid;
}

DampingRule read_damping(TableReader& table, const DampingRule& otherwise) {
  auto damping = table.table("damping");
  if (!damping) return otherwise;
  DampingRule rule;
  rule.name = damping->text("rule");
  read_keys(*damping, rule, damping_keys);
  return rule;
}

/// The basis; interfaces are the ends of the boom unless they are named.
BasisOptions read_basis(TableReader& table, BasisOptions basis) {
  basis.name = table.text("basis", basis.name);
  const bool ends = basis.name == "craig-bampton" && basis.interfaces.empty();
  basis.interfaces = table.texts("interfaces", ends ? std::vector<std::string>{"root", "tip"} : basis.interfaces);
  basis.reference = table.text("reference", ends ? "root" : basis.reference);
  basis.orthonormal = table.boolean("orthonormal", basis.orthonormal);
  if (table.has("hinge_stiffness")) basis.hinge_stiffness = table.numbers("hinge_stiffness");
  basis.hinge_axis = table.vector("hinge_axis", basis.hinge_axis);
  basis.corrections = table.texts("corrections", basis.corrections);
  return basis;
}

/// What a scene may also say of a body whose geometry comes from a file.
void read_model(TableReader& table, BodyScene& body) {
  body.structure = table.text("structure", body.structure);
  body.clamp = table.text("clamp", body.clamp);
  body.modes_given = body.modes_given || table.has("modes");
  if (table.is_text("modes")) {
    body.modes_auto = table.text("modes") == "auto";
    if (!body.modes_auto) {
      table.fault("modes", "is the string " + toml_reader::quoted(table.text("modes")) +
                               "; it must be a whole number, or \"auto\"");
    }
  } else {
    body.modes_auto = body.modes_auto && !table.has("modes");
    body.modes = table.integer("modes", body.modes);
  }
  body.directions = table.text("directions", body.directions);
  body.basis = read_basis(table, body.basis);
  body.backend = table.text("backend", body.backend);
  body.damping = read_damping(table, body.damping);
}

BodyScene read_whole_body(TableReader& table, Reading& reading) {
  BodyScene body;
  body.name = table.text("name");
  read_model(table, body);
  body.geometry = read_geometry(table, reading);
  body.solid = read_solid(table);
  return body;
}

// Key paths of the body file become those of the entry that names it, each with its own place.
BodyScene read_body_file(const std::filesystem::path& path, const std::string& key_path, Reading& reading) {
  const Value root = parse_format(read_text(path.string()), path.string(), scene_keys::body_format);
  TableReader table(root, key_path, reading.faults);
  read_format(table, scene_keys::body_format);
  BodyScene body = read_whole_body(table, reading);
  table.reject_unknown();
  return body;
}

// The entry's own keys come after those of its file. A file that cannot be read is a fault of the whole entry.
BodyScene read_body_from_file(TableReader& entry, Reading& reading) {
  BodyScene body;
  if (!entry.is_text("file")) {
    reading.faults.add(entry.path(), entry.place("file"), "file: is not a string; it must be the name of a body file");
    return body;
  }
  try {
    body = read_body_file(reading.folder / entry.text("file"), entry.path(), reading);
  } catch (const InputError& error) {
    reading.faults.add(entry.path(), entry.place("file"), fmt::format("file: {}", error.what()));
  }
  reading.faults.locate(entry.path(), entry.value().place);
  body.name = entry.text("name", body.name);
  read_model(entry, body);
  entry.reject_unknown(" (its geometry comes from the body file)");
  return body;
}

BodyScene read_rigid_body(TableReader& table, Reading& reading) {
  BodyScene body;
  body.name = table.text("name");
  body.structure = "rigid";
  body.modes = 0;
  RigidScene rigid;
  KeyReader reader(table, &reading.warnings);
  rigid_keys(reader, rigid);
  body.rigid = rigid;
  table.reject_unknown(" (of a rigid body)");
  return body;
}

// A file that cannot be read is a fault of the whole entry.
BodyScene read_reduced_body(TableReader& table, Reading& reading) {
  BodyScene body;
  body.modes = 0;
  const std::filesystem::path file = reading.folder / table.text("file");
  body.reduced_file = std::filesystem::absolute(file).lexically_normal();
  try {
    body.reduced = std::make_shared<const ReducedBody>(flexboom::read_body_file(file));
  } catch (const std::runtime_error& error) {
    reading.faults.add(table.path(), table.place("file"), fmt::format("file: {}", error.what()));
    return body;
  }
  body.structure = body.reduced->structure;
  body.name = table.text("name", body.reduced->name);
  body.damping = read_damping(table, body.damping);
  body.stiffening = table.text("stiffening", "auto");
  table.reject_unknown(" (of a reduced body)");
  return body;
}

BodyScene read_body_entry(TableReader table, Reading& reading) {
  if (table.has("mass")) return read_rigid_body(table, reading);
  if (table.is_text("file") && table.text("file").ends_with(".h5")) return read_reduced_body(table, reading);
  const std::string stiffening = table.text("stiffening", "");
  BodyScene body;
  if (table.has("file")) {
    body = read_body_from_file(table, reading);
  } else {
    body = read_whole_body(table, reading);
    table.reject_unknown();
  }
  body.stiffening = stiffening;
  return body;
}

void warn_of_rigid(const BodyScene& body, const std::string& path, bool modes_given,
                   std::vector<std::string>& warnings) {
  if (body.structure == "rigid" && modes_given) warnings.push_back(path + ": has no effect with structure = \"rigid\"");
}

// --- hinges ---

/// P1 stands for stiffness * threshold.
void read_P1(TableReader& table, HingeMechanism& m) {
  const bool has_P1 = table.has("P1"), has_stiffness = table.has("stiffness");
  if (!has_P1 && !has_stiffness)
    table.fault("P1", "is missing; give P1 [N m] or stiffness = P1 / threshold [N m/rad], 0 for no spring");
  if (has_P1 && has_stiffness)
    table.fault("stiffness", "is given beside P1; stiffness = P1 / threshold, so give one of them");
  if (!has_P1) return;
  const double P1 = table.number("P1"), threshold = m.threshold;
  if (!(std::isfinite(P1) && P1 >= 0)) table.fault("P1", fmt::format("is {} N m; it must be zero or positive", P1));
  if (threshold <= 0) table.fault("threshold", fmt::format("is {} rad; with P1 it must be positive", threshold));
  m.stiffness = threshold > 0 && P1 >= 0 ? P1 / threshold : 0;
}

HingeScene read_hinge(TableReader table) {
  HingeScene hinge;
  table.has("P1");  // a key that is known
  hinge.law = read_law(table);
  read_keys(table, hinge, hinge_keys);
  read_P1(table, hinge.hinge.mechanism);
  hinge.hinge.name = hinge.body;
  hinge.hinge.stowed = unit_direction(hinge.hinge.stowed);
  hinge.hinge.outward = normal_to(unit_direction(hinge.hinge.outward), hinge.hinge.stowed);
  return hinge;
}

// --- scene ---

void read_around_hub(TableReader& table, Scene& scene, Reading& reading) {
  if (auto hub = table.table("hub", true)) read_keys(*hub, scene.hub, hub_keys, &reading.warnings);
  if (auto initial = table.table("initial")) read_keys(*initial, scene, initial_keys);
  for (TableReader& hinge : table.tables("hinges")) scene.hinges.push_back(read_hinge(hinge));
}

/// Is there anything that a scene of [hub] and [[hinges]] alone cannot have? They are shorthand then.
bool beyond_a_hub(TableReader& table, const std::vector<BodyScene>& bodies) {
  const auto has_law = [](const Value& hinge) {
    return std::ranges::any_of(hinge.entries, [](const auto& entry) { return is_law_key(entry.first); });
  };
  const auto hinges_have_laws = [&](const auto& entry) {
    return entry.first == "hinges" && std::ranges::any_of(entry.second.items, has_law);
  };
  return std::ranges::any_of(table.value().entries, hinges_have_laws) ||
         std::ranges::any_of(std::array{"joints", "springs", "loads", "wheels", "turns", "gravity"},
                             [&](const char* key) { return table.has(key); }) ||
         std::ranges::any_of(bodies, [](const BodyScene& b) {
           return b.rigid || !b.reduced_file.empty() || !b.stiffening.empty() || b.root_moves();
         });
}

/// The regimes of the hinge that a body hangs on are those its basis is made for, unless it names others.
void take_hinge(BodyScene& body, const HingeMechanism& m, const Vector3d& axis) {
  if (body.basis.name != "hinge" || !body.basis.hinge_stiffness.empty()) return;
  body.basis.hinge_stiffness = {m.stiffness};
  if (m.stop_stiffness > 0) body.basis.hinge_stiffness.push_back(m.stiffness + m.stop_stiffness);
  body.basis.hinge_axis = axis;
}

void take_hinges(Scene& scene) {
  for (BodyScene& body : scene.bodies) {
    for (const HingeScene& h : scene.hinges)
      if (h.body == body.name) take_hinge(body, h.hinge.mechanism, Vector3d::UnitZ());
    for (const JointScene& j : scene.joints)
      if (j.b.body == body.name && j.kind == JointKind::hinge && !j.closes_loop) take_hinge(body, j.mechanism, j.b.z);
  }
}

/// Writes [hub] and [[hinges]] out: a rigid body that flies, or the inertial frame where it is fixed, and joints.
void write_out_shorthand(Scene& scene) {
  const std::string hub = scene.hub.fixed ? "" : "hub";
  if (!hub.empty()) {
    BodyScene body;
    body.name = hub, body.structure = "rigid", body.modes = 0;
    body.rigid = RigidScene{.mass = scene.hub.mass, .inertia = scene.hub.inertia, .size = scene.hub.size};
    scene.bodies.push_back(std::move(body));
    JointScene flight;
    flight.name = hub, flight.kind = JointKind::free, flight.b.body = hub;
    flight.start_omega = scene.start_rate, flight.start_velocity = scene.start_velocity;
    scene.joints.push_back(std::move(flight));
  }
  for (const HingeScene& h : scene.hinges) {
    JointScene joint;
    joint.name = h.body;
    joint.a = {.body = hub, .marker = {}, .point = h.hinge.point, .x = h.hinge.stowed};
    joint.a.z = h.hinge.stowed.cross(h.hinge.outward).normalized();
    joint.b.body = h.body;
    look_up(scene, joint.b);
    joint.mechanism = h.hinge.mechanism, joint.law = h.law;
    joint.start = {h.start_angle}, joint.start_rate = {h.start_rate};
    joint.loads = h.loads;
    scene.joints.push_back(std::move(joint));
  }
  scene.hub = {}, scene.hinges.clear();
  scene.start_rate.setZero(), scene.start_velocity.setZero();
}

Scene read_whole_scene(TableReader& table, Reading& reading) {
  Scene scene;
  read_format(table, scene_keys::scene_format);
  KeyReader settings(table, &reading.warnings);
  settings_keys(settings, scene);
  if (auto accuracy = table.table("accuracy")) read_keys(*accuracy, scene, accuracy_keys);
  if (auto integrator = table.table("integrator")) read_keys(*integrator, scene, integrator_keys);
  if (auto orbit = table.table("orbit")) read_keys(*orbit, scene.orbit.emplace(), orbit_keys);
  for (TableReader& body : table.tables("bodies")) {
    scene.bodies.push_back(read_body_entry(body, reading));
    warn_of_rigid(scene.bodies.back(), body.path("modes"), body.has("modes"), reading.warnings);
  }
  const bool in_tree = beyond_a_hub(table, scene.bodies);
  for (BodyScene& body : scene.bodies)
    if (in_tree && body.stiffening.empty() && !body.rigid) body.stiffening = "auto";
  if (!in_tree || table.has("hub") || table.has("hinges")) read_around_hub(table, scene, reading);
  if (in_tree) read_tree(table, scene);
  take_hinges(scene);
  table.reject_unknown();
  return scene;
}

}  // namespace

Vector3d unit_direction(const Vector3d& v) {
  const double error = std::abs(v.norm() - 1);
  constexpr double round_off = 4 * std::numeric_limits<double>::epsilon();
  return error > round_off && error <= repairable_direction ? v.normalized() : v;
}

Vector3d normal_to(const Vector3d& direction, const Vector3d& unit) {
  const double cosine = std::abs(direction.dot(unit));
  constexpr double round_off = 8 * std::numeric_limits<double>::epsilon();
  if (!(cosine > round_off && cosine <= repairable_direction)) return direction;
  return (direction - direction.dot(unit) * unit).normalized();
}

Scene with_joints(Scene scene) {
  if (!std::exchange(scene.is_tree, true)) write_out_shorthand(scene);
  return scene;
}

double OrbitScene::rate() const {
  constexpr double mu = 3.986004418e14;     // [m^3/s^2], WGS 84
  constexpr double equatorial = 6378137.0;  // [m], WGS 84
  const double radius = (equatorial + altitude) / (1 - eccentricity);
  return std::sqrt(mu / (radius * radius * radius));
}

namespace {

Scene parse_scene(const std::string& text, const std::string& file_name, Reading& reading) {
  const Value root = parse_format(text, file_name, scene_keys::scene_format);
  TableReader table(root, "", reading.faults);
  Scene scene = read_whole_scene(table, reading);
  if (scene.is_tree && (table.has("hub") || table.has("hinges"))) {
    check_shorthand(scene, reading.faults);
    reading.faults.throw_if_any();
    write_out_shorthand(scene);
  }
  check_scene(scene, reading.faults);
  reading.faults.throw_if_any();
  warn_of_oddities(scene, reading.warnings);
  scene.warnings = std::move(reading.warnings);
  return scene;
}

}  // namespace

Scene parse_scene(const std::string& text, const std::string& file_name, const std::filesystem::path& folder) {
  Reading reading;
  reading.folder = folder;
  return parse_scene(text, file_name, reading);
}

std::set<std::string> keys_known(const std::string& scene, const std::filesystem::path& folder) {
  std::set<std::string> keys;
  Reading reading;
  reading.folder = folder;
  reading.faults.note_keys(keys);
  parse_scene(scene, "scene", reading);
  return keys;
}

Scene read_scene(const std::filesystem::path& path) {
  return parse_scene(read_text(path.string()), path.string(), path.parent_path());
}

BodyScene read_body(const std::filesystem::path& path) {
  Reading reading;
  BodyScene body = read_body_file(path, "", reading);
  check_body(body, "", reading.faults);
  reading.faults.throw_if_any();
  return body;
}

Scene load_scene(const std::string& path_or_name) {
  if (const char* text = builtin_scene(path_or_name)) return parse_scene(text, path_or_name);
  std::error_code error;
  const bool exists = std::filesystem::exists(path_or_name, error);
  require(exists, fmt::format("{}: there is no such file, and no built-in scene of that name; built-in: \"{}\"",
                              path_or_name, fmt::join(builtin_scene_names(), "\", \"")));
  return read_scene(path_or_name);
}

}  // namespace flexboom
