#include "apps/scene/scene.hpp"

#include "apps/base/toml_reader.hpp"
#include "apps/scene/keys.hpp"
#include "apps/scene/scene_keys.hpp"
#include "fem/base/check.hpp"
#include "fem/base/text_reader.hpp"
#include "fem/formats/mesh_formats.hpp"
#include "reduction/body_file/body_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace flexboom {
namespace {

using Eigen::Vector3d;
using toml_reader::parse_format;
using toml_reader::read_format;
using toml_reader::read_text;
using toml_reader::TableReader;
using toml_reader::Value;

constexpr double repairable_direction = 1e-6;  // of a direction: rounding by hand

// Key paths of the body file become those of the entry that names it, each with its own place.
void read_body_file(const std::filesystem::path& path, const std::string& key_path, Reading& reading, BodyScene& body) {
  const Value root = parse_format(read_text(path.string()), path.string(), scene_keys::body_format);
  TableReader table(root, key_path, reading.faults);
  read_format(table, scene_keys::body_format);
  read_keys(table, reading, body, boom_keys);
}

void read_reduced_file(const std::filesystem::path& path, BodyScene& body) {
  body.modes = 0;
  body.reduced_file = std::filesystem::absolute(path).lexically_normal();
  const auto file = std::make_shared<const BodyFile>(read_whole_body_file(path));
  body.reduced = {file, &file->body}, body.richer = {file, &file->richer};
  body.structure = body.reduced->structure;
  body.name = body.reduced->name;
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

}  // namespace

void read_file_of_body(TableReader& entry, Reading& reading, BodyScene& body) {
  const auto fault = [&](const std::string& text) {
    reading.faults.add(entry.path(), entry.place("file"), "file: " + text);
  };
  if (!entry.is_text("file")) return fault("is not a string; it must be the name of a body file");
  const std::filesystem::path path = reading.folder / entry.text("file");
  const bool is_mesh = std::ranges::any_of(mesh_formats(), [&path](const MeshFormat& format) {
    return std::ranges::find(format.extensions, path.extension().string()) != format.extensions.end();
  });
  if (is_mesh)
    return fault(fmt::format("{0} is a mesh; a scene takes the body that `flexboom reduce {0} -o {1}.h5` makes of it",
                             entry.text("file"), path.stem().string()));
  try {
    path.extension() == ".h5" ? read_reduced_file(path, body) : read_body_file(path, entry.path(), reading, body);
  } catch (const std::runtime_error& error) {
    fault(error.what());
  }
  reading.faults.locate(entry.path(), entry.value().place);
}

void look_up(const Scene& scene, PlaceScene& place) {
  if (scene.hub.fixed && place.body == "hub") place.body.clear();
  const auto body = std::ranges::find(scene.bodies, place.body, &BodyScene::name);
  if (body == scene.bodies.end()) return;
  const std::vector<std::string> names = marker_names(*body);
  const bool at_root = place.marker.empty() && place.point.isZero(0) && body->root_moves();
  if (at_root && std::ranges::find(names, "root") != names.end()) place.marker = "root";
  if (place.marker.empty()) return;
  place.marker = spelled(place.marker, names);
}

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

namespace {

Scene scene_of_table(const Value& root, Reading& reading) {
  TableReader table(root, "", reading.faults);
  read_format(table, scene_keys::scene_format);
  const bool has_hub = table.has("hub") || table.has("hinges");
  Scene scene;
  read_keys(table, reading, scene, scene_keys_of_file);
  for (BodyScene& body : scene.bodies)
    if (body.stiffening.empty() && body.is_boom()) body.stiffening = "auto";
  for (JointScene& j : scene.joints) look_up(scene, j.a), look_up(scene, j.b);
  for (SpringScene& s : scene.springs) look_up(scene, s.a), look_up(scene, s.b);
  for (LoadScene& l : scene.loads) look_up(scene, l.at);
  take_hinges(scene);
  if (scene.is_tree && has_hub) {
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
  return scene_of_table(parse_format(text, file_name, scene_keys::scene_format), reading);
}

Scene read_scene(const Value& root, const std::filesystem::path& folder) {
  Reading reading;
  reading.folder = folder;
  return scene_of_table(root, reading);
}

std::set<std::string> keys_known(const std::string& scene, const std::filesystem::path& folder) {
  std::set<std::string> keys;
  Reading reading;
  reading.folder = folder;
  reading.faults.note_keys(keys);
  scene_of_table(parse_format(scene, "scene", scene_keys::scene_format), reading);
  return keys;
}

Scene read_scene(const std::filesystem::path& path) {
  return parse_scene(read_text(path.string()), path.string(), path.parent_path());
}

BodyScene read_body(const std::filesystem::path& path) {
  Reading reading;
  BodyScene body;
  read_body_file(path, "", reading, body);
  check_keys(reading.faults, "", body, boom_keys);
  check_body(body, "", reading.faults);
  reading.faults.throw_if_any();
  return body;
}

std::string to_toml(const Scene& scene) {
  KeyWriter writer;
  scene_keys_of_file(writer, const_cast<Scene&>(scene));  // a writer changes no value
  return fmt::format("format = \"{}\"\n{}", scene_keys::scene_format, std::move(writer).text());
}

std::string to_toml(const BodyScene& body) {
  KeyWriter writer("bodies");
  body_keys(writer, const_cast<BodyScene&>(body));
  return "\n[[bodies]]\n" + std::move(writer).text();
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
