#include "apps/sweep/scene_source.hpp"

#include "apps/base/usage.hpp"
#include "apps/scene/scene_keys.hpp"
#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "reduction/body_file/sha256.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <optional>
#include <utility>

namespace flexboom {

using toml_reader::Value;

namespace {

/// Part of a path: a key, or an index in brackets.
struct PathStep {
  std::string key;              // empty: the index counts
  std::optional<size_t> index;  // none: all
};

[[noreturn]] void refuse_path(const std::string& path, const std::string& why) {
  throw InputError(fmt::format("--vary {}: {}", path, why));
}

PathStep bracket_step(const std::string& path, std::string_view inside) {
  PathStep step;
  if (inside == "*") return step;
  size_t index = 0;
  const auto [end, error] = std::from_chars(inside.data(), inside.data() + inside.size(), index);
  if (error != std::errc() || end != inside.data() + inside.size())
    refuse_path(path, fmt::format("[{}] is neither [number] nor [*]", inside));
  step.index = index;
  return step;
}

std::vector<PathStep> path_steps(const std::string& path) {
  std::vector<PathStep> steps;
  std::string_view rest = path;
  while (!rest.empty()) {
    if (rest.front() == '[') {
      const size_t end = rest.find(']');
      if (end == std::string_view::npos) refuse_path(path, "a bracket is not closed");
      steps.push_back(bracket_step(path, rest.substr(1, end - 1)));
      rest.remove_prefix(end + 1);
    } else {
      const size_t end = std::min(rest.find_first_of(".["), rest.size());
      if (end == 0) refuse_path(path, "a key between dots is empty");
      steps.push_back({std::string(rest.substr(0, end)), {}});
      rest.remove_prefix(end);
    }
    if (rest.empty() || rest.front() == '[') continue;
    if (rest.front() != '.' || rest.size() == 1) refuse_path(path, "is not a path of keys separated by dots");
    rest.remove_prefix(1);
  }
  if (steps.empty() || steps.front().key.empty()) refuse_path(path, "does not begin with a key");
  return steps;
}

const Value* entry_of(const Value& table, std::string_view key) {
  for (const toml_reader::Entry& entry : table.entries)
    if (entry.first == key) return &entry.second;
  return nullptr;
}

/// What an entry of an array of tables is called: by its name, or else by the body that a hinge or a joint carries.
std::string name_of_entry(const Value& entry) {
  for (const std::string_view key : {"name", "body"})
    if (const Value* name = entry_of(entry, key); name != nullptr && name->kind == Value::Kind::text) return name->text;
  const Value* place = entry_of(entry, "b");
  return place != nullptr && place->kind == Value::Kind::table ? name_of_entry(*place) : "";
}

size_t entry_named(const std::string& path, const Value& array, const std::string& name) {
  std::vector<std::string> names;
  for (size_t i = 0; i < array.items.size(); ++i) {
    if (name_of_entry(array.items[i]) == name) return i;
    if (std::string other = name_of_entry(array.items[i]); !other.empty()) names.push_back(std::move(other));
  }
  const std::vector<std::string_view> views(names.begin(), names.end());
  refuse_path(
      path, fmt::format("there is no entry \"{}\"; {}there {}", name, toml_reader::question(name, views),
                        names.empty() ? fmt::format("are {} without names: give [index] or [*]", array.items.size())
                                      : fmt::format("are \"{}\"; or give [index] or [*]", fmt::join(names, "\", \""))));
}

/// Tells of each value that a path stands for, with its place. Where the path leads to nothing, `absent` makes the
/// value of a key that a table lacks, or answers with nothing.
class PathWalk {
 public:
  using Absent = std::function<Value*(Value& table, const std::string& key, bool last)>;
  using Found = std::function<void(Value&, const std::string& place)>;
  PathWalk(const std::string& path, Absent absent, Found found)
      : path_(path), steps_(path_steps(path)), absent_(std::move(absent)), found_(std::move(found)) {}

  void walk(Value& root) { walk(root, 0, ""); }

 private:
  void walk(Value& value, size_t depth, const std::string& place) {
    if (depth == steps_.size()) return found_(value, place);
    const PathStep& step = steps_[depth];
    if (value.kind == Value::Kind::array) {
      if (!step.key.empty()) return enter(value, entry_named(path_, value, step.key), depth, place);
      if (step.index) return enter(value, *step.index, depth, place);
      for (size_t i = 0; i < value.items.size(); ++i) enter(value, i, depth, place);
      return;
    }
    const auto here = [&] { return place.empty() ? std::string("the scene") : "\"" + place + "\""; };
    if (step.key.empty()) refuse_path(path_, fmt::format("{} is no array", here()));
    if (value.kind != Value::Kind::table) refuse_path(path_, fmt::format("{} is no table", here()));
    auto* below = const_cast<Value*>(entry_of(value, step.key));  // of a table that may be changed
    if (below == nullptr) below = absent_(value, step.key, depth + 1 == steps_.size());
    if (below != nullptr) walk(*below, depth + 1, place.empty() ? step.key : place + "." + step.key);
  }

  void enter(Value& array, size_t index, size_t depth, const std::string& place) {
    if (index >= array.items.size())
      refuse_path(path_, fmt::format("there is no {}[{}]; it has {} entries", place, index, array.items.size()));
    walk(array.items[index], depth + 1, fmt::format("{}[{}]", place, index));
  }

  const std::string& path_;
  std::vector<PathStep> steps_;
  Absent absent_;
  Found found_;
};

Value* nothing_there(Value&, const std::string&, bool) { return nullptr; }

/// A key that the scene lacks stands where its table does.
Value* made_there(Value& table, const std::string& key, bool) {
  Value value;
  value.place = table.place;
  table.entries.push_back({key, std::move(value)});
  return &table.entries.back().second;
}

/// Whole numbers are written as such: keys of numbers take them as well.
void put_number(Value& value, double number) {
  constexpr double exact = 0x1p53;
  const bool whole = std::abs(number) < exact && number == std::trunc(number);
  value.kind = whole ? Value::Kind::integer : Value::Kind::number;
  value.number = number;
  value.integer = whole ? static_cast<std::int64_t>(number) : 0;
}

void move_to(const toml_reader::Place& place, Value& value) {
  value.place = place;
  for (Value& item : value.items) move_to(place, item);
  for (toml_reader::Entry& entry : value.entries) move_to(place, entry.second);
}

void put_variant(Value& value, const KeyVariant& variant) {
  const toml_reader::Place place = value.place;
  value = Value();
  value.place = place;
  if (variant.word.empty()) return put_number(value, variant.number);
  if (std::string_view("[{\"").find(variant.word.front()) != std::string_view::npos) {  // as a file writes it
    value = toml_reader::parse("value = " + variant.word, "--vary").entries.front().second;
    return move_to(place, value);
  }
  value.boolean = variant.word == "true";
  value.kind = value.boolean || variant.word == "false" ? Value::Kind::boolean : Value::Kind::text;
  value.text = variant.word;
}

/// How many numbers there were.
size_t multiply_numbers(Value& value, double factor) {
  size_t count = 0;
  for (Value& item : value.items) count += multiply_numbers(item, factor);
  if (value.kind != Value::Kind::number && value.kind != Value::Kind::integer) return count;
  put_number(value, value.number * factor);
  return count + 1;
}

/// The entry of a body with the keys of its body file, those of the entry before those of the file.
void take_body_file(Value& body, const std::filesystem::path& folder, Sha256& digest) {
  const Value* file = entry_of(body, "file");
  if (file == nullptr || file->kind != Value::Kind::text) return;
  const std::filesystem::path path = folder / file->text;
  const std::string text = file_bytes(path);
  digest.add(text);
  if (path.extension() == ".h5") return;
  const Value root = toml_reader::parse_format(text, path.string(), scene_keys::body_format);
  std::erase_if(body.entries, [](const toml_reader::Entry& e) { return e.first == "file"; });
  for (const toml_reader::Entry& entry : root.entries)
    if (entry.first != "format" && entry_of(body, entry.first) == nullptr) body.entries.push_back(entry);
}

}  // namespace

KeyVariant key_variant(std::string_view text) {
  require_usage(!text.empty(), "--vary: a value is empty");
  KeyVariant variant;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), variant.number);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(variant.number))
    variant.number = 0, variant.word = text;
  return variant;
}

std::string text_of(const KeyVariant& v) { return v.word.empty() ? fmt::format("{:.17g}", v.number) : v.word; }

SceneSource::SceneSource(const std::string& path_or_name) {
  const char* built_in = builtin_scene(path_or_name);
  const std::filesystem::path file = path_or_name;
  std::error_code error;
  // The error of a file that is not there lists the built-in scenes.
  if (built_in == nullptr && !std::filesystem::exists(file, error)) load_scene(path_or_name);
  folder_ = built_in != nullptr ? std::filesystem::path(".") : file.parent_path();
  bodies_kept_in_ = built_in != nullptr ? std::filesystem::path("results") / "bodies"
                                        : file.parent_path() / (file.stem().string() + "-bodies");
  const std::string text = built_in != nullptr ? built_in : toml_reader::read_text(path_or_name);
  root_ = toml_reader::parse_format(text, path_or_name, scene_keys::scene_format);
  Sha256 digest;
  digest.add(text);
  const Value* bodies = entry_of(root_, "bodies");
  if (bodies != nullptr)
    for (Value& body : const_cast<Value*>(bodies)->items) take_body_file(body, folder_, digest);
  digest_ = digest.digest();
}

void SceneSource::set(const std::string& path, const KeyVariant& variant) {
  size_t count = 0;
  PathWalk(path, made_there, [&](Value& value, const std::string& place) {
    if (place.starts_with("bodies[") && place.ends_with("].file") && !variant.word.ends_with(".h5"))
      refuse_path(path, fmt::format("{} is no .h5 file; of a body file its keys can be varied", text_of(variant)));
    put_variant(value, variant);
    ++count;
  }).walk(root_);
  if (count == 0) refuse_path(path, "stands for nothing in this scene");
}

void SceneSource::multiply(const std::string& path, double factor) {
  size_t count = 0;
  PathWalk(path, nothing_there, [&](Value& value, const std::string&) {
    count += multiply_numbers(value, factor);
  }).walk(root_);
  if (count == 0) refuse_path(path, "the scene gives no number there that a factor could multiply");
}

bool SceneSource::has(const std::string& path) const { return !places(path).empty(); }

std::vector<std::string> SceneSource::places(const std::string& path) const {
  std::vector<std::string> found;
  PathWalk walk(path, nothing_there, [&](Value&, const std::string& place) { found.push_back(place); });
  walk.walk(const_cast<Value&>(root_));  // neither of the two above changes anything
  return found;
}

Scene SceneSource::read() const { return read_scene(root_, folder_); }

}  // namespace flexboom
