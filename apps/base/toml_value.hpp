#pragma once

#include <cstdint>
#include <string>
#include <vector>

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

/// `file:line:column: `, as far as they are known.
std::string where(const Place&);

}  // namespace flexboom::toml_reader
