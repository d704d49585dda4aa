// [[joints]], [[springs]], [[loads]], [[wheels]], [[turns]]: from the file to a Scene.

#include "apps/keys.hpp"
#include "apps/scene.hpp"
#include "apps/scene_keys.hpp"
#include "apps/scene_law.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <string_view>

namespace flexboom {
namespace {

using Eigen::Vector3d;
using toml_reader::TableReader;
using toml_reader::Value;

const Value* value_at(TableReader& table, std::string_view key) {
  if (!table.has(key)) return nullptr;
  for (const auto& [name, value] : table.value().entries)
    if (name == key) return &value;
  return nullptr;
}

bool is_number(const Value& v) { return v.kind == Value::Kind::number || v.kind == Value::Kind::integer; }

/// Without its start.
Manoeuvre read_manoeuvre(TableReader& table) {
  Manoeuvre m;
  m.profile = table.text("profile", m.profile);
  m.angle = table.number("angle");
  m.peak_rate = table.number("peak_rate");
  m.peak_acceleration = table.number("peak_acceleration");
  return m;
}

CourseScene read_course_table(TableReader table) {
  CourseScene course;
  if (table.has("angle")) {
    course.manoeuvre = read_manoeuvre(table);
    course.manoeuvre->start = table.number("start", course.manoeuvre->start);
    table.reject_unknown(" (of a turn from rest to rest)");
    return course;
  }
  TimeTable t;
  t.interpolation = table.text("interpolation", t.interpolation);
  t.outside = table.text("outside", t.outside);
  t.time = table.numbers("time");
  t.value = table.numbers("value");
  for (const char* key : {"time", "value"})
    if (!table.has(key))
      table.fault(key,
                  "is missing; a function of time is an expression, { time, value } or { angle, "
                  "peak_rate, peak_acceleration }");
  course.table = t;
  table.reject_unknown(" (of a table over time)");
  return course;
}

constexpr const char* what_a_course_is =
    "must be a number, an expression of t or a table { time = [...], value = [...] }";

/// `item` is the value of `key`, or an entry of it.
CourseScene read_course(TableReader& table, std::string_view key, const Value& item) {
  CourseScene course;
  if (is_number(item)) {
    course.expression = fmt::format("{}", item.number);
  } else if (item.kind == Value::Kind::text) {
    course.expression = item.text;
    if (item.text.empty()) table.fault(key, "is empty; it must be an expression of t");
  } else if (item.kind == Value::Kind::table && &item == value_at(table, key)) {
    return read_course_table(*table.table(key));
  } else {
    table.fault(key, what_a_course_is);
  }
  return course;
}

}  // namespace

CourseScene read_course(TableReader& table, std::string_view key) {
  const Value* value = value_at(table, key);
  return value ? read_course(table, key, *value) : CourseScene{};
}

std::vector<CourseScene> read_courses(TableReader& table, std::string_view key) {
  const Value* value = value_at(table, key);
  if (!value) return {};
  if (value->kind != Value::Kind::array) return {read_course(table, key, *value)};
  std::vector<CourseScene> courses;
  for (const Value& item : value->items) courses.push_back(read_course(table, key, item));
  return courses;
}

std::array<CourseScene, 3> read_three_courses(TableReader& table, std::string_view key) {
  std::array<CourseScene, 3> three;
  const Value* value = value_at(table, key);
  if (!value) return three;
  if (value->kind != Value::Kind::array || value->items.size() != 3) {
    table.fault(key, "must be an array of 3 numbers or expressions of t, one per axis");
    return three;
  }
  for (size_t i = 0; i < 3; ++i) {
    three[i] = read_course(table, key, value->items[i]);
    if (is_number(value->items[i]) && value->items[i].number == 0) three[i] = {};
  }
  return three;
}

PlaceScene read_place(TableReader& parent, std::string_view key) {
  PlaceScene place;
  auto table = parent.table(key, true);
  if (!table) return place;
  place.body = table->text("body", "");
  if (place.body == scene_keys::ground) place.body.clear();
  place.marker = table->text("marker", "");
  place.point = table->vector("point", place.point);
  if (table->has("marker") && table->has("point"))
    table->fault("point", "is given beside marker, which has its own; give one of them");
  if (table->has("x")) place.x = table->vector("x");
  if (table->has("z")) place.z = table->vector("z");
  place.z = unit_direction(place.z);
  place.x = normal_to(unit_direction(place.x), place.z);
  table->reject_unknown();
  return place;
}

namespace {

JointScene read_joint(TableReader table) {
  JointScene joint;
  std::array<std::string_view, joint_types.size()> kinds;
  for (size_t i = 0; i < kinds.size(); ++i) kinds[i] = joint_types[i].name;
  if (!table.has("kind"))
    table.fault(
        "kind",
        "is missing; it must be one of \"fixed\", \"hinge\", \"slider\", \"universal\", \"spherical\", \"free\"");
  joint.kind = joint_types[table.choice("kind", kinds, static_cast<size_t>(joint.kind))].kind;
  joint.law = read_law(table);
  read_keys(table, joint, joint_keys);
  if (!table.has("name")) joint.name = joint.b.body;
  return joint;
}

LoadScene read_load(TableReader table) {
  LoadScene load;
  load.inertial_axes = table.choice("axes", scene_keys::load_axes, 0) == 1;
  read_keys(table, load, load_keys);
  return load;
}

/// Whole tables that need nothing else.
template <class T>
std::vector<T> read_all(TableReader& table, const char* name, Keys<T> keys) {
  std::vector<T> all;
  for (TableReader& one : table.tables(name)) read_keys(one, all.emplace_back(), keys);
  return all;
}

bool same_but_case(std::string_view a, std::string_view b) {
  return std::ranges::equal(
      a, b, {}, [](unsigned char c) { return std::tolower(c); }, [](unsigned char c) { return std::tolower(c); });
}

}  // namespace

void look_up(const Scene& scene, PlaceScene& place) {
  if (scene.hub.fixed && place.body == "hub") place.body.clear();
  const auto body = std::ranges::find(scene.bodies, place.body, &BodyScene::name);
  if (body == scene.bodies.end()) return;
  if (place.marker.empty() && place.point.isZero(0) && body->is_boom() && body->root_moves()) place.marker = "root";
  if (place.marker.empty()) return;
  const std::vector<std::string> names = marker_names(*body);
  if (std::ranges::find(names, place.marker) != names.end()) return;
  const auto like = [&](const std::string& name) { return same_but_case(name, place.marker); };
  if (std::ranges::count_if(names, like) == 1) place.marker = *std::ranges::find_if(names, like);
}

void read_tree(TableReader& table, Scene& scene) {
  scene.is_tree = true;
  scene.gravity = table.vector("gravity", scene.gravity);
  for (TableReader& joint : table.tables("joints")) scene.joints.push_back(read_joint(joint));
  for (TableReader& load : table.tables("loads")) scene.loads.push_back(read_load(load));
  scene.springs = read_all<SpringScene>(table, "springs", spring_keys);
  scene.wheels = read_all<WheelScene>(table, "wheels", wheel_keys);
  scene.turns = read_all<TurnScene>(table, "turns", turn_keys);
  for (WheelScene& wheel : scene.wheels) wheel.axis = unit_direction(wheel.axis);
  for (TurnScene& turn : scene.turns) turn.axis = unit_direction(turn.axis);
  for (JointScene& j : scene.joints) look_up(scene, j.a), look_up(scene, j.b);
  for (SpringScene& s : scene.springs) look_up(scene, s.a), look_up(scene, s.b);
  for (LoadScene& l : scene.loads) look_up(scene, l.at);
}

}  // namespace flexboom
