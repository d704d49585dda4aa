#include "apps/base/toml_reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <limits>

namespace flexboom::toml_reader {
namespace {

using Kind = Value::Kind;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr size_t max_tables = 2000;  // of one array; names are compared in pairs

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
      return "is the string " + in_quotes(shortened(value.text));
    case Kind::array:
      return fmt::format("is an array of {}", value.items.size());
    case Kind::date:
    case Kind::table:
      break;
  }
  return "is " + kind_name(value.kind);
}

bool is_number(const Value& value) { return value.kind == Kind::number || value.kind == Kind::integer; }

bool is_bare_key(const std::string& name) {
  return !name.empty() &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; });
}

}  // namespace

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
  if (!value || !is_bearable(*value, key)) return nan;
  return value->number;
}

bool TableReader::is_bearable(const Value& value, std::string_view key) {
  constexpr double most = 1e30;  // ten of them can be multiplied
  const bool bearable = !(std::abs(value.number) > most) || !std::isfinite(value.number);
  if (!bearable)
    faults_->add(path(key), value.place,
                 fmt::format("is the number {}; no quantity in SI units is beyond {}", value.number, most));
  return bearable;
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
    if (!is_number(item) || !is_bearable(item, key)) return false;
    *out++ = item.number;
  }
  return true;
}

std::vector<double> TableReader::numbers(std::string_view key) {
  const Value* value = find(key);
  if (!value) return {};
  if (is_number(*value)) return {number(key)};
  std::vector<double> result;
  for (const Value& item : value->items) result.push_back(is_bearable(item, key) ? item.number : nan);
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

TableReader TableReader::table_in(std::string_view key, size_t i) {
  return TableReader(find(key)->items.at(i), fmt::format("{}[{}]", path(key), i), *faults_);
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
    faults_->add(path(is_bare_key(name) ? name : in_quotes(name)), value.place,
                 fmt::format("unknown key; {}{} takes {}{}", question(name, known),
                             path_.empty() ? "the top level" : path_, fmt::join(known, ", "), hint));
  }
}

}  // namespace flexboom::toml_reader
