#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// Reading TOML so that every fault is found in one go and says where it is. The parser itself is behind
/// toml_reader.cpp.
namespace flexboom::toml_reader {

/// A place in a file, counted from 1; line 0: unknown.
struct Place {
  std::string file;
  int line = 0;
  int column = 0;
};

struct Entry;

/// A parsed value. Tables keep the order of the file.
struct Value {
  enum class Kind { boolean, integer, number, text, date, array, table };
  Kind kind = Kind::table;
  Place place;  // of its key, or of itself inside an array
  bool boolean = false;
  std::int64_t integer = 0;
  double number = 0;  // also set for an integer
  std::string text;
  std::vector<Value> items;    // of an array
  std::vector<Entry> entries;  // of a table

  Value();
  ~Value();
  Value(const Value&);
  Value(Value&&) noexcept;
  Value& operator=(const Value&);
  Value& operator=(Value&&) noexcept;
};

struct Entry {
  std::string first;  // the key
  Value second;
};

// A value holds entries that hold values: its members can only be made once both are known.
inline Value::Value() = default;
inline Value::~Value() = default;
inline Value::Value(const Value&) = default;
inline Value::Value(Value&&) noexcept = default;
inline Value& Value::operator=(const Value&) = default;
inline Value& Value::operator=(Value&&) noexcept = default;

/// @throws InputError `file:line:column: what is wrong` for text that is not TOML or not UTF-8.
Value parse(const std::string& text, const std::string& file);

/// The text of a file. @throws InputError when it cannot be read or is larger than any file of ours.
std::string read_text(const std::string& path);

/// As parse, of a file whose first key says that it has this format: the faults of another format are not worth
/// listing.
Value parse_format(const std::string& text, const std::string& file, std::string_view format);

/// Collects faults under key paths such as "bodies[1].segments[0].length". Only the first fault of a key is kept, and
/// none below a key that is faulty itself: what follows from a fault is noise.
class Faults {
 public:
  /// Remembers where a key path stands; the last call wins.
  void locate(const std::string& path, const Place&);

  /// A fault at the place of its path, or of the nearest path above that has a place.
  void add(const std::string& path, const std::string& text);
  void add(const std::string& path, const Place&, const std::string& text);

  /// Goes on with the text of the fault at this path, if there is one.
  void append(const std::string& path, const std::string& text);

  /// Whether nothing was found at this path, above it or below it.
  bool clean(const std::string& path) const;
  bool empty() const { return faults_.empty(); }

  /// @throws InputError with one line per fault, in the order of the file.
  void throw_if_any() const;

  /// From now on, every key that a reader knows is noted there by its path, "bodies[].name".
  void note_keys(std::set<std::string>& keys) { keys_ = &keys; }
  void note_key(const std::string& path);

 private:
  struct Fault {
    Place place;
    std::string path, text;
  };
  Place place_of(std::string path) const;

  std::map<std::string, Place> places_;
  std::vector<Fault> faults_;
  std::set<std::string>* keys_ = nullptr;
};

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
  TableReader in_place_of(const Value& other, std::string path);

  const Value* table_;
  std::string path_;
  Faults* faults_;
  std::vector<std::string> known_;
  bool is_of_other_kind_ = false;
};

/// Adds a fault where the first key is not the format.
void read_format(TableReader&, std::string_view format);

/// `is "X"; it must be "a", "b" or "c"`, with the nearest name first asked for where one is near.
std::string not_among(const std::string& value, std::span<const std::string_view> names);

/// The name that differs by the fewest edits, empty if none is near.
std::string nearest(std::string_view value, std::span<const std::string_view> names);

/// A TOML basic string with its quotes; control characters are escaped, so it is also fit for messages.
std::string quoted(std::string_view text);

}  // namespace flexboom::toml_reader
