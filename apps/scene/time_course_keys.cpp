// Functions of time as values of keys: a number, an expression of t, a table, or a turn from rest to rest.

#include "apps/base/toml_writer.hpp"
#include "apps/scene/keys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace flexboom {
namespace {

using toml_reader::Entry;
using toml_reader::TableReader;
using toml_reader::Value;

const Value* value_at(KeyReader& reader, std::string_view key) {
  if (!reader.has(key)) return nullptr;
  return &std::ranges::find(reader.table().value().entries, key, &Entry::first)->second;
}

bool is_number(const Value& v) { return v.kind == Value::Kind::number || v.kind == Value::Kind::integer; }

void read_table(TableReader table, Reading& reading, CourseScene& course) {
  if (table.has("angle"))
    read_keys(table, reading, course.manoeuvre.emplace(), timed_turn_keys);
  else
    read_keys(table, reading, course.table.emplace(), time_table_keys);
}

/// Of the value of `key`, or of entry i of it.
CourseScene course_at(KeyReader& reader, std::string_view key, std::optional<size_t> i = {}) {
  const Value& item = i ? value_at(reader, key)->items[*i] : *value_at(reader, key);
  CourseScene course;
  if (is_number(item)) {
    course.expression = fmt::format("{}", item.number);
  } else if (item.kind == Value::Kind::text) {
    course.expression = item.text;
    if (item.text.empty()) reader.table().fault(key, "is empty; it must be an expression of t");
  } else if (item.kind == Value::Kind::table) {
    read_table(i ? reader.table().table_in(key, *i) : *reader.table().table(key), reader.reading(), course);
  } else {
    reader.table().fault(key, "must be a number, an expression of t, or a table { time = [...], value = [...] }");
  }
  return course;
}

}  // namespace

void read_course(KeyReader& reader, std::string_view key, CourseScene& course) {
  if (value_at(reader, key)) course = course_at(reader, key);
}

void read_course(KeyReader& reader, std::string_view key, std::vector<CourseScene>& courses) {
  const Value* value = value_at(reader, key);
  if (!value) return;
  if (value->kind != Value::Kind::array) return courses.assign(1, course_at(reader, key));
  for (size_t i = 0; i < value->items.size(); ++i) courses.push_back(course_at(reader, key, i));
}

void read_course(KeyReader& reader, std::string_view key, std::array<CourseScene, 3>& three) {
  const Value* value = value_at(reader, key);
  if (!value) return;
  if (value->kind != Value::Kind::array || value->items.size() != 3)
    return reader.table().fault(key, "must be an array of 3 numbers, expressions of t or tables, one per axis");
  for (size_t i = 0; i < 3; ++i) {
    three[i] = course_at(reader, key, i);
    if (is_number(value->items[i]) && value->items[i].number == 0) three[i] = {};
  }
}

std::string toml(const CourseScene& c) {
  if (c.manoeuvre) return in_one_line(*c.manoeuvre, timed_turn_keys);
  if (c.table) return in_one_line(*c.table, time_table_keys);
  return toml_writer::toml(c.given() ? c.expression : std::string("0"));
}

}  // namespace flexboom
