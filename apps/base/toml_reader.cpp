#include "apps/base/toml_reader.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <numeric>
#include <tuple>

namespace flexboom::toml_reader {
namespace {

using Kind = Value::Kind;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr size_t max_tables = 2000;  // of one array; names are compared in pairs
constexpr size_t max_line =
    4096;  // bounds the depth of a dotted key, which the parser and its destructors recurse over

Place place_at(const std::string& file, const toml::source_position& position) {
  return {file, static_cast<int>(position.line), static_cast<int>(position.column)};
}

std::string where(const Place& place) {
  if (place.file.empty()) return "";
  if (place.line == 0) return place.file + ": ";
  return fmt::format("{}:{}:{}: ", place.file, place.line, place.column);
}

Value convert(const toml::node& node, const Place& place);

Value convert_array(const toml::array& array, const Place& place) {
  Value value;
  value.kind = Kind::array;
  for (const toml::node& item : array) value.items.push_back(convert(item, place_at(place.file, item.source().begin)));
  return value;
}

// toml++ sorts keys by name; people think in the order of the file.
Value convert_table(const toml::table& table, const Place& place) {
  Value value;
  for (auto&& [key, item] : table) {
    value.entries.push_back({std::string(key.str()), convert(item, place_at(place.file, key.source().begin))});
  }
  std::stable_sort(value.entries.begin(), value.entries.end(), [](const auto& a, const auto& b) {
    return std::pair(a.second.place.line, a.second.place.column) <
           std::pair(b.second.place.line, b.second.place.column);
  });
  return value;
}

Value convert_scalar(const toml::node& node) {
  Value value;
  value.kind = Kind::date;
  if (const auto* text = node.as_string()) {
    value.kind = Kind::text;
    value.text = text->get();
  } else if (const auto* integer = node.as_integer()) {
    value.kind = Kind::integer;
    value.integer = integer->get();
    value.number = static_cast<double>(integer->get());
  } else if (const auto* number = node.as_floating_point()) {
    value.kind = Kind::number;
    value.number = number->get();
  } else if (const auto* boolean = node.as_boolean()) {
    value.kind = Kind::boolean;
    value.boolean = boolean->get();
  }
  return value;
}

Value convert(const toml::node& node, const Place& place) {
  Value value = node.is_table()   ? convert_table(*node.as_table(), place)
                : node.is_array() ? convert_array(*node.as_array(), place)
                                  : convert_scalar(node);
  value.place = place;
  return value;
}

void check_lines(const std::string& text, const std::string& file) {
  require(!text.starts_with("\x89HDF"),
          fmt::format(
              "{}:1:1: is an HDF5 file, not text; a reduced body is `file` of one of the [[bodies]] of a scene with "
              "[[joints]], and `flexboom inspect` reads it",
              file));
  const size_t zero = text.find('\0');
  require(zero == std::string::npos,
          fmt::format("{}:1:1: is a binary file, not text: its byte {} is zero", file, zero + 1));
  size_t begin = 0;
  for (int line = 1; begin < text.size(); ++line) {
    const size_t end = std::min(text.find('\n', begin), text.size());
    require(end - begin <= max_line,
            fmt::format("{}:{}:1: the line has {} characters; {} are allowed", file, line, end - begin, max_line));
    begin = end + 1;
  }
}

std::string kind_name(Kind kind) {
  switch (kind) {
    case Kind::boolean:
      return "true or false";
    case Kind::integer:
      return "a whole number";
    case Kind::number:
      return "a number";
    case Kind::text:
      return "a string";
    case Kind::date:
      return "a date or time";
    case Kind::array:
      return "an array";
    case Kind::table:
      break;
  }
  return "a table";
}

// At most 60 bytes, not cut inside a UTF-8 character.
std::string shortened(const std::string& text) {
  if (text.size() <= 60) return text;
  size_t end = 57;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return text.substr(0, end) + "...";
}

// What was found, with the value where that is short.
std::string found(const Value& value) {
  switch (value.kind) {
    case Kind::boolean:
      return value.boolean ? "is true" : "is false";
    case Kind::integer:
      return fmt::format("is the whole number {}", value.integer);
    case Kind::number:
      return fmt::format("is the number {}", value.number);
    case Kind::text:
      return "is the string " + quoted(shortened(value.text));
    case Kind::array:
      return fmt::format("is an array of {}", value.items.size());
    case Kind::date:
    case Kind::table:
      break;
  }
  return "is " + kind_name(value.kind);
}

bool is_number(const Value& value) { return value.kind == Kind::number || value.kind == Kind::integer; }

// Edits (insert, delete, replace, swap neighbours) that turn a into b, upper and lower case alike.
size_t edit_distance(std::string_view a, std::string_view b) {
  const auto same = [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) == std::tolower(static_cast<unsigned char>(y));
  };
  std::vector<size_t> before, last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same(a[i - 1], b[j - 1]) ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && same(a[i - 1], b[j - 2]) && same(a[i - 2], b[j - 1]);
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before = last;
    last = row;
  }
  return last[b.size()];
}

// `"a", "b" or "c"`
std::string listed(std::span<const std::string_view> names) {
  std::string text;
  for (size_t i = 0; i < names.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == names.size() ? " or " : ", ") + quoted(names[i]);
  }
  return text;
}

bool is_bare_key(const std::string& name) {
  return !name.empty() &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; });
}

std::string parent(const std::string& path) {
  const size_t cut = path.find_last_of(".[");
  return cut == std::string::npos ? "" : path.substr(0, cut);
}

// Whether b is a or lies below it.
bool holds(const std::string& a, const std::string& b) {
  if (!b.starts_with(a)) return false;
  return a.empty() || b.size() == a.size() || b[a.size()] == '.' || b[a.size()] == '[';
}

}  // namespace

Value parse(const std::string& text, const std::string& file) {
  check_lines(text, file);
  try {
    return convert(toml::parse(text, file), {file, 1, 1});
  } catch (const toml::parse_error& error) {
    throw InputError(where(place_at(file, error.source().begin)) +
                     "not valid TOML: " + std::string(error.description()));
  }
}

void Faults::locate(const std::string& path, const Place& place) { places_[path] = place; }

Place Faults::place_of(std::string path) const {
  for (;; path = parent(path)) {
    const auto place = places_.find(path);
    if (place != places_.end()) return place->second;
    if (path.empty()) return {};
  }
}

void Faults::add(const std::string& path, const std::string& text) { add(path, place_of(path), text); }

void Faults::add(const std::string& path, const Place& place, const std::string& text) {
  const auto covers = [&path](const Fault& fault) { return !fault.path.empty() && holds(fault.path, path); };
  if (std::none_of(faults_.begin(), faults_.end(), covers)) faults_.push_back({place, path, text});
}

void Faults::append(const std::string& path, const std::string& text) {
  const auto fault = std::ranges::find(faults_, path, &Fault::path);
  if (fault != faults_.end()) fault->text += text;
}

bool Faults::clean(const std::string& path) const {
  return std::none_of(faults_.begin(), faults_.end(), [&path](const Fault& fault) {
    return holds(path, fault.path) || (!fault.path.empty() && holds(fault.path, path));
  });
}

void Faults::throw_if_any() const {
  if (faults_.empty()) return;
  std::vector<Fault> sorted = faults_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Fault& a, const Fault& b) {
    return std::tie(a.place.file, a.place.line, a.place.column) < std::tie(b.place.file, b.place.line, b.place.column);
  });
  std::vector<std::string> lines;
  lines.reserve(sorted.size());
  for (const Fault& fault : sorted) {
    lines.push_back(where(fault.place) + (fault.path.empty() ? "" : fault.path + ": ") + fault.text);
  }
  throw InputError(fmt::format("{}", fmt::join(lines, "\n")));
}

void Faults::note_key(const std::string& path) {
  if (!keys_) return;
  std::string of_any;  // without the numbers of arrays
  for (size_t i = 0; i < path.size(); ++i) {
    of_any += path[i];
    if (path[i] == '[') i = path.find(']', i) - 1;
  }
  keys_->insert(of_any);
}

TableReader::TableReader(const Value& table, std::string path, Faults& faults)
    : table_(&table), path_(std::move(path)), faults_(&faults) {
  faults.locate(path_, table.place);
}

std::string TableReader::path(std::string_view key) const {
  return path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
}

void TableReader::fault(std::string_view key, const std::string& text) { faults_->add(path(key), text); }

const Value* TableReader::find(std::string_view key) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.emplace_back(key);
  for (const auto& [name, value] : table_->entries) {
    if (name != key) continue;
    faults_->locate(path(key), value.place);
    return &value;
  }
  return nullptr;
}

const Value* TableReader::find(std::string_view key, Kind kind, bool required) {
  const Value* value = find(key);
  if (!value) {
    if (required) fault(key, fmt::format("is missing; give {}", kind_name(kind)));
    return nullptr;
  }
  if (value->kind == kind || (kind == Kind::number && value->kind == Kind::integer)) return value;
  fault(key, fmt::format("{}; it must be {}", found(*value), kind_name(kind)));
  return nullptr;
}

Place TableReader::place(std::string_view key) {
  const Value* value = find(key);
  return value ? value->place : table_->place;
}

bool TableReader::has(std::string_view key) { return find(key) != nullptr; }

bool TableReader::is_text(std::string_view key) {
  const Value* value = find(key);
  return value && value->kind == Kind::text;
}

double TableReader::number(std::string_view key, std::optional<double> otherwise) {
  if (otherwise && !has(key)) return *otherwise;
  const Value* value = find(key, Kind::number, true);
  return value ? value->number : nan;
}

int TableReader::integer(std::string_view key, std::optional<int> otherwise) {
  if (otherwise && !has(key)) return *otherwise;
  const Value* value = find(key, Kind::integer, true);
  if (!value) return 0;
  constexpr std::int64_t limit = std::numeric_limits<int>::max();
  if (value->integer >= -limit && value->integer <= limit) return static_cast<int>(value->integer);
  fault(key, fmt::format("{}; that is beyond {}", found(*value), limit));
  return 0;
}

bool TableReader::boolean(std::string_view key, std::optional<bool> otherwise) {
  if (otherwise && !has(key)) return *otherwise;
  const Value* value = find(key, Kind::boolean, true);
  return value && value->boolean;
}

std::string TableReader::text(std::string_view key, const std::optional<std::string>& otherwise) {
  if (otherwise && !has(key)) return *otherwise;
  const Value* value = find(key, Kind::text, true);
  return value ? value->text : "";
}

std::vector<std::string> TableReader::texts(std::string_view key, const std::vector<std::string>& otherwise) {
  if (!has(key)) return otherwise;
  std::vector<std::string> result;
  const Value* array = find(key, Kind::array, true);
  if (!array) return result;
  for (const Value& item : array->items) {
    if (item.kind != Kind::text) faults_->add(path(key), item.place, found(item) + "; it must be an array of strings");
    result.push_back(item.text);
  }
  return result;
}

bool TableReader::numbers(const Value& array, std::string_view key, double* out) {
  for (const Value& item : array.items) {
    if (!is_number(item))
      faults_->add(path(key), item.place, "has an entry that " + found(item) + "; it must be a number");
    if (!is_number(item)) return false;
    *out++ = item.number;
  }
  return true;
}

std::vector<double> TableReader::numbers(std::string_view key) {
  const Value* value = find(key);
  if (!value) return {};
  if (is_number(*value)) return {value->number};
  std::vector<double> result;
  for (const Value& item : value->items) result.push_back(item.number);
  if (value->kind != Kind::array || !std::ranges::all_of(value->items, is_number))
    fault(key, "must be a number or an array of numbers");
  return result;
}

Eigen::Vector3d TableReader::vector(std::string_view key, const std::optional<Eigen::Vector3d>& otherwise) {
  if (otherwise && !has(key)) return *otherwise;
  Eigen::Vector3d wrong = Eigen::Vector3d::Constant(nan);
  const Value* array = find(key, Kind::array, true);
  if (!array) return wrong;
  if (array->items.size() != 3) {
    fault(key, fmt::format("{}; it must be an array of 3 numbers [x, y, z]", found(*array)));
    return wrong;
  }
  Eigen::Vector3d result;
  return numbers(*array, key, result.data()) ? result : wrong;
}

Eigen::Matrix3d TableReader::matrix(std::string_view key, const std::optional<Eigen::Matrix3d>& otherwise) {
  if (otherwise && !has(key)) return *otherwise;
  Eigen::Matrix3d wrong = Eigen::Matrix3d::Constant(nan);
  const Value* array = find(key, Kind::array, true);
  if (!array) return wrong;
  const std::vector<Value>& rows = array->items;
  if (rows.size() == 3 && is_number(rows[0])) return vector(key).asDiagonal();
  const auto is_row = [](const Value& row) { return row.kind == Kind::array && row.items.size() == 3; };
  if (rows.size() != 3 || !std::all_of(rows.begin(), rows.end(), is_row)) {
    fault(key, fmt::format(
                   "{}; it must be 3 rows of 3 numbers [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]], or the 3 diagonal "
                   "values",
                   found(*array)));
    return wrong;
  }
  Eigen::Matrix3d transposed;  // Eigen stores by columns, the file by rows
  for (int i = 0; i < 3; ++i) {
    if (!numbers(rows[static_cast<size_t>(i)], key, transposed.col(i).data())) return wrong;
  }
  return transposed.transpose();
}

size_t TableReader::choice(std::string_view key, std::span<const std::string_view> names, size_t otherwise) {
  if (!has(key)) return otherwise;
  const Value* value = find(key);
  if (value->kind != Kind::text) {
    fault(key, fmt::format("{}; it must be {}", found(*value), listed(names)));
    return otherwise;
  }
  const auto name = std::find(names.begin(), names.end(), value->text);
  if (name != names.end()) return static_cast<size_t>(name - names.begin());
  fault(key, not_among(value->text, names));
  return otherwise;
}

std::optional<TableReader> TableReader::table(std::string_view key, bool required) {
  const Value* value = find(key);
  if (value && value->kind != Kind::table) return in_place_of(*value, path(key));
  if (!find(key, Kind::table, required)) return std::nullopt;
  return TableReader(*value, path(key), *faults_);
}

TableReader TableReader::in_place_of(const Value& other, std::string path) {
  static const Value empty;
  faults_->add(path, other.place, found(other) + "; it must be a table");
  TableReader table(empty, path, *faults_);
  faults_->locate(path, other.place);
  table.is_of_other_kind_ = true;
  return table;
}

std::vector<TableReader> TableReader::tables(std::string_view key) {
  std::vector<TableReader> result;
  const Value* array = find(key);
  if (!array) return result;
  if (array->kind != Kind::array) {
    fault(key, fmt::format("{}; it must be an array of tables, each under [[{}]]", found(*array), key));
    return result;
  }
  if (array->items.size() > max_tables) {
    fault(key, fmt::format("has {} entries; {} are allowed", array->items.size(), max_tables));
    return result;
  }
  for (size_t i = 0; i < array->items.size(); ++i) {
    const Value& item = array->items[i];
    const std::string item_path = fmt::format("{}[{}]", path(key), i);
    result.push_back(item.kind == Kind::table ? TableReader(item, item_path, *faults_) : in_place_of(item, item_path));
  }
  return result;
}

void TableReader::reject_unknown(const std::string& hint) {
  const std::vector<std::string_view> known(known_.begin(), known_.end());
  for (const std::string_view key : known) faults_->note_key(path(key));
  if (is_of_other_kind_ && !known.empty()) faults_->append(path_, fmt::format(" with {}", fmt::join(known, ", ")));
  for (const auto& [name, value] : table_->entries) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    const std::string near = nearest(name, known);
    faults_->add(path(is_bare_key(name) ? name : quoted(name)), value.place,
                 fmt::format("unknown key; {}{} takes {}{}", near.empty() ? "" : "did you mean " + quoted(near) + "? ",
                             path_.empty() ? "the top level" : path_, fmt::join(known, ", "), hint));
  }
}

std::string nearest(std::string_view value, std::span<const std::string_view> names) {
  value = value.substr(0, 100);
  size_t best = std::max<size_t>(1, value.size() / 3) + 1;
  std::string result;
  for (const std::string_view name : names) {
    const size_t distance = edit_distance(value, name);
    if (distance >= best) continue;
    best = distance;
    result = name;
  }
  return result;
}

std::string not_among(const std::string& value, std::span<const std::string_view> names) {
  const std::string near = nearest(value, names);
  return fmt::format("is {}; {}it must be {}", quoted(shortened(value)),
                     near.empty() ? "" : "did you mean " + quoted(near) + "? ", listed(names));
}

std::string quoted(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') result += '\\';
    if (code < 0x20 || code == 0x7f) {
      result += fmt::format("\\u{:04X}", code);
    } else {
      result += c;
    }
  }
  return result + '"';
}

}  // namespace flexboom::toml_reader
