#pragma once

#include "apps/base/toml_reader.hpp"
#include "apps/scene/scene.hpp"

#include <Eigen/Core>

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

/// One description per key of scenes and bodies: `keys(Archive&, Struct&)` says the keys of a struct once, archives
/// read, check, write and document them. A default is what the struct has by itself. Internal to `apps`.
namespace flexboom {

struct Key {
  std::string_view name;
  std::string_view unit;  // empty: none
  std::string_view what;  // for the tables of meshes/README.md
  bool required = false;
  std::string_view otherwise{};                  // the default in words, where it is not that of the struct
  std::span<const std::string_view> words = {};  // that a text may be; empty: any
};

/// Which of the words of its key.
struct Choice {
  size_t index = 0;
};

/// One of the words of its key, or a number where there is no word.
struct NumberOrWord {
  double number = 0;
  std::string word;
  bool whole = false;
};

/// Adds a fault at the path of a value that is out of its range. `unit` has a space in front.
template <class T>
using Check = void (*)(toml_reader::Faults&, const std::string& path, const T& value, std::string_view unit);

template <class T>
struct KeyValue {
  T* value;
  Check<T> check;  // nullptr: every value is right
};

/// The kinds of values that a key may have.
using AnyKeyValue =
    std::variant<KeyValue<double>, KeyValue<int>, KeyValue<bool>, KeyValue<std::string>, KeyValue<Choice>,
                 KeyValue<NumberOrWord>, KeyValue<Eigen::Vector3d>, KeyValue<Eigen::Vector4d>,
                 KeyValue<Eigen::Matrix3d>, KeyValue<std::vector<std::string>>, KeyValue<std::vector<double>>,
                 KeyValue<std::vector<int>>, KeyValue<std::optional<double>>, KeyValue<CourseScene>,
                 KeyValue<std::vector<CourseScene>>, KeyValue<std::array<CourseScene, 3>>>;

class Archive;
class KeyReader;

/// Tables below a key.
struct Tables {
  bool many = false;                           // an array of tables
  std::string_view name;                       // of a table that is written in one line and documented under this name
  size_t count = 0;                            // that there are
  std::function<void(size_t)> make;            // so many of them
  std::function<void(Archive&, size_t)> keys;  // of one of them; beyond the last: of one with all its defaults
};

class Archive {
 public:
  enum class Use { read, check, write, document };

  virtual ~Archive() = default;
  virtual Use use() const = 0;
  virtual KeyReader* reader() { return nullptr; }

  template <class T>
  void key(const Key& key, T& value, std::type_identity_t<Check<T>> check = nullptr) {
    item(key, KeyValue<T>{&value, check});
  }

  /// A text that is one of these words, or an enumeration whose values have these names in their order.
  template <class T>
  void choice(Key key, std::span<const std::string_view> words, T& value) {
    key.words = words;
    if constexpr (std::is_same_v<T, std::string>) {
      item(key, KeyValue<T>{&value, nullptr});
    } else {
      Choice choice{static_cast<size_t>(value)};
      item(key, KeyValue<Choice>{&choice, nullptr});
      value = static_cast<T>(choice.index);
    }
  }

  /// A number, or one of these words.
  void choice_or_number(Key key, std::span<const std::string_view> words, NumberOrWord& value,
                        Check<NumberOrWord> check = nullptr) {
    key.words = words;
    item(key, KeyValue<NumberOrWord>{&value, check});
  }

  /// A table. With a name it is written in one line.
  template <class T, class F>
  void table(const Key& key, T& value, F keys, std::string_view name = "", bool there = true) {
    const auto one = [&](Archive& a, size_t) { keys(a, value); };
    below(key, {.many = false, .name = name, .count = there ? 1u : 0u, .make = [](size_t) {}, .keys = one});
  }
  template <class T, class F>
  void table(const Key& key, std::optional<T>& value, F keys, std::string_view name = "") {
    const auto one = [&](Archive& a, size_t) {
      T blank{};
      keys(a, value ? *value : blank);
    };
    below(
        key,
        {.many = false, .name = name, .count = value ? 1u : 0u, .make = [&](size_t) { value.emplace(); }, .keys = one});
  }
  template <class T, class F>
  void tables(const Key& key, std::vector<T>& values, F keys) {
    const auto one = [&](Archive& a, size_t i) {
      T blank{};
      keys(a, i < values.size() ? values[i] : blank);
    };
    below(key,
          {.many = true, .name = "", .count = values.size(), .make = [&](size_t n) { values.resize(n); }, .keys = one});
  }

  /// Keys of the same table that are documented under a name of their own.
  virtual void part(std::string_view /*name*/, const std::function<void(Archive&)>& keys) { keys(*this); }

 protected:
  virtual void item(const Key&, const AnyKeyValue&) = 0;
  virtual void below(const Key&, const Tables&) = 0;
};

// apps/scene/scene_language.cpp
void scene_keys_of_file(Archive&, Scene&);
void shorthand_keys(Archive&, Scene&);  // [hub], [initial], [[hinges]]
void rigid_keys(Archive&, RigidScene&);
void place_keys(Archive&, PlaceScene&);
void turn_from_rest_keys(Archive&, Manoeuvre&);
void timed_turn_keys(Archive&, Manoeuvre&);
void time_table_keys(Archive&, TimeTable&);

// apps/scene/body_language.cpp
void body_keys(Archive&, BodyScene&);  // of a [[bodies]] entry
void boom_keys(Archive&, BodyScene&);  // of a body file

/// What reading fills besides the values.
struct Reading {
  toml_reader::Faults faults;
  std::vector<std::string> warnings;
  std::filesystem::path folder;  // that `file` of a body is relative to
};

/// Reads what a table has. Every key that the table lacks leaves its value as it is.
class KeyReader : public Archive {
 public:
  KeyReader(toml_reader::TableReader table, Reading& reading) : table_(std::move(table)), reading_(reading) {}
  Use use() const override { return Use::read; }
  KeyReader* reader() override { return this; }

  toml_reader::TableReader& table() { return table_; }
  Reading& reading() { return reading_; }
  bool has(std::string_view key) { return table_.has(key); }

  /// Put behind the message of an unknown key.
  void hint(std::string text) { hint_ = std::move(text); }
  /// It is not known which other keys belong here.
  void take_any_key() { takes_any_key_ = true; }
  /// Every key that was not asked for is a fault.
  void finish();

 protected:
  void item(const Key&, const AnyKeyValue&) override;
  void below(const Key&, const Tables&) override;

 private:
  toml_reader::TableReader table_;
  Reading& reading_;
  std::string hint_;
  bool takes_any_key_ = false;
};

class KeyChecker : public Archive {
 public:
  KeyChecker(toml_reader::Faults& faults, std::string path) : faults_(faults), path_(std::move(path)) {}
  Use use() const override { return Use::check; }

 protected:
  void item(const Key&, const AnyKeyValue&) override;
  void below(const Key&, const Tables&) override;

 private:
  toml_reader::Faults& faults_;
  std::string path_;
};

/// TOML that reads back bit for bit: every key; functions of time only where they are given.
class KeyWriter : public Archive {
 public:
  /// `path`: of the tables below; in one line: "a = 1, b = 2".
  explicit KeyWriter(std::string path = "", bool in_one_line = false)
      : path_(std::move(path)), in_one_line_(in_one_line) {}
  Use use() const override { return Use::write; }
  std::string text() && { return keys_ + tables_; }

 protected:
  void item(const Key&, const AnyKeyValue&) override;
  void below(const Key&, const Tables&) override;

 private:
  void add(std::string_view key, const std::string& value, std::string_view comment);

  std::string path_;
  bool in_one_line_;
  std::string keys_, tables_;  // a table's own keys stand before the tables below
};

template <class T>
using Keys = void (*)(Archive&, T&);

/// No archive but the reader changes a value.
template <class T>
void check_keys(toml_reader::Faults& faults, const std::string& path, const T& value,
                std::type_identity_t<Keys<T>> keys) {
  KeyChecker checker(faults, path);
  keys(checker, const_cast<T&>(value));
}

template <class T>
std::string in_one_line(const T& value, std::type_identity_t<Keys<T>> keys) {
  KeyWriter writer("", true);
  keys(writer, const_cast<T&>(value));
  return "{ " + std::move(writer).text() + " }";
}

/// Reads a whole table, whose other keys are faults.
template <class T>
void read_keys(toml_reader::TableReader table, Reading& reading, T& value, std::type_identity_t<Keys<T>> keys) {
  KeyReader reader(std::move(table), reading);
  keys(reader, value);
  reader.finish();
}

/// Functions of time (apps/scene/time_course_keys.cpp).
void read_course(KeyReader&, std::string_view key, CourseScene&);
void read_course(KeyReader&, std::string_view key, std::vector<CourseScene>&);
void read_course(KeyReader&, std::string_view key, std::array<CourseScene, 3>&);
std::string toml(const CourseScene&);

}  // namespace flexboom
