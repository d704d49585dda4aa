#pragma once

#include "apps/base/toml_faults.hpp"
#include "apps/base/toml_value.hpp"
#include "apps/base/toml_words.hpp"

#include <Eigen/Core>

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Reading TOML so that every fault is found in one go and says where it is. The parser itself is behind
/// toml_value.cpp.
namespace flexboom::toml_reader {

/// The text of a file. @throws InputError when it cannot be read or is larger than any file of ours.
std::string read_text(const std::string& path);

/// What the first key of a file says that its format is; empty where that is another key, or none.
std::string format_of(const std::string& text);

/// As parse, of a file whose first key says that it has this format: the faults of another format are not worth
/// listing.
Value parse_format(const std::string& text, const std::string& file, std::string_view format);

/// Hands out the values of one table and takes note of the keys it was asked for. A value that is missing or of the
/// wrong type is a fault, and the answer is then NaN, 0, false or empty. A default makes a key optional. Ranges are not
/// looked at here.
class TableReader {
 public:
  TableReader(const Value& table, std::string path, Faults&);

  bool has(std::string_view key);
  double number(std::string_view key, std::optional<double> otherwise = {});
  int integer(std::string_view key, std::optional<int> otherwise = {});
  bool boolean(std::string_view key, std::optional<bool> otherwise = {});
  std::string text(std::string_view key, const std::optional<std::string>& otherwise = {});
  std::vector<std::string> texts(std::string_view key, const std::vector<std::string>& otherwise);
  /// One number, or an array of them; absent: none.
  std::vector<double> numbers(std::string_view key);
  Eigen::Vector3d vector(std::string_view key, const std::optional<Eigen::Vector3d>& otherwise = {});

  /// Three rows of three, or the three diagonal values.
  Eigen::Matrix3d matrix(std::string_view key, const std::optional<Eigen::Matrix3d>& otherwise = {});

  /// Whether the key holds a text rather than something else (for keys that take either).
  bool is_text(std::string_view key);

  /// Index of a text among names.
  size_t choice(std::string_view key, std::span<const std::string_view> names, size_t otherwise);

  /// A table below; absent and not required: nothing. Something else in its place is a fault, and the table that is
  /// returned is empty: the fault names the keys that are asked of it.
  std::optional<TableReader> table(std::string_view key, bool required = false);

  /// Entry i of the array of a key, which is a table.
  TableReader table_in(std::string_view key, size_t i);

  /// The tables of an array of tables; absent: empty.
  std::vector<TableReader> tables(std::string_view key);

  /// Makes every key that was not asked for a fault, and names the nearest one that was. `hint` is put behind it.
  void reject_unknown(const std::string& hint = "");

  /// Adds a fault at a key of this table.
  void fault(std::string_view key, const std::string& text);

  std::string path(std::string_view key) const;
  const std::string& path() const { return path_; }
  const Value& value() const { return *table_; }

  /// Place of a key that is there, of the table otherwise.
  Place place(std::string_view key);

 private:
  const Value* find(std::string_view key);
  /// The value of a key if it is there and of that kind; faults otherwise.
  const Value* find(std::string_view key, Value::Kind, bool required);
  bool numbers(const Value& array, std::string_view key, double* out);
  /// Is a number no larger than any quantity? Else it is a fault. What is not finite is for its key to judge.
  bool is_bearable(const Value&, std::string_view key);
  TableReader in_place_of(const Value& other, std::string path);

  const Value* table_;
  std::string path_;
  Faults* faults_;
  std::vector<std::string> known_;
  bool is_of_other_kind_ = false;
};

/// Adds a fault where the first key is not the format.
void read_format(TableReader&, std::string_view format);

}  // namespace flexboom::toml_reader
