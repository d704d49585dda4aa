#pragma once

#include "apps/scene.hpp"
#include "apps/toml_reader.hpp"
#include "apps/toml_writer.hpp"

#include <Eigen/Core>

#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

/// One description per key of a scene: `keys(Archive&, Struct&)` says the keys of a struct once, archives read, check,
/// write and document them. A default is what the struct has by itself. Internal to `apps`.
namespace flexboom {

std::string toml(const PlaceScene&);
std::string toml(const CourseScene&);
std::string toml(const std::vector<CourseScene>&);
std::string toml(const std::array<CourseScene, 3>&);

struct Key {
  std::string_view name;
  std::string_view unit;  // empty: none
  std::string_view what;  // for the tables of meshes/README.md
  bool required = false;
  std::string_view otherwise = "";  // the default in words, where it is not that of the struct
};

/// Adds a fault at the path of a value that is out of its range. `unit` has a space in front.
template <class T>
using Check = void (*)(toml_reader::Faults&, const std::string& path, const T& value, std::string_view unit);

template <class T>
struct KeyValue {
  T* value;
  Check<T> check;  // nullptr: every value is right
};

/// The kinds of values that a scene may have.
using AnyKeyValue =
    std::variant<KeyValue<double>, KeyValue<int>, KeyValue<bool>, KeyValue<std::string>, KeyValue<Eigen::Vector3d>,
                 KeyValue<Eigen::Vector4d>, KeyValue<Eigen::Matrix3d>, KeyValue<std::vector<std::string>>,
                 KeyValue<std::vector<double>>, KeyValue<PlaceScene>, KeyValue<CourseScene>,
                 KeyValue<std::vector<CourseScene>>, KeyValue<std::array<CourseScene, 3>>>;

class Archive {
 public:
  virtual ~Archive() = default;

  template <class T>
  void key(const Key& key, T& value, std::type_identity_t<Check<T>> check = nullptr) {
    item(key, KeyValue<T>{&value, check});
  }

  /// Are values taken from a file? Defaults that follow from other keys are set then.
  virtual bool reads() const { return false; }

 protected:
  virtual void item(const Key&, const AnyKeyValue&) = 0;
};

// apps/scene_language.cpp
void settings_keys(Archive&, Scene&);  // of the top level
void accuracy_keys(Archive&, Scene&);
void integrator_keys(Archive&, Scene&);
void initial_keys(Archive&, Scene&);
void orbit_keys(Archive&, OrbitScene&);
void hub_keys(Archive&, HubScene&);
void hinge_keys(Archive&, HingeScene&);
void rigid_keys(Archive&, RigidScene&);
void damping_keys(Archive&, DampingRule&);
void solid_keys(Archive&, SolidOptions&);
void grading_keys(Archive&, SolidGrading&);
void joint_keys(Archive&, JointScene&);
void spring_keys(Archive&, SpringScene&);
void load_keys(Archive&, LoadScene&);
void wheel_keys(Archive&, WheelScene&);
void turn_keys(Archive&, TurnScene&);

/// Reads what a table has. Every key of `value` that the table lacks stays as it is.
class KeyReader : public Archive {
 public:
  KeyReader(toml_reader::TableReader& table, std::vector<std::string>* warnings) : table_(table), warnings_(warnings) {}
  bool reads() const override { return true; }

 protected:
  void item(const Key&, const AnyKeyValue&) override;

 private:
  toml_reader::TableReader& table_;
  std::vector<std::string>* warnings_;  // nullptr: an inertia is not repaired
};

class KeyChecker : public Archive {
 public:
  KeyChecker(toml_reader::Faults& faults, std::string path) : faults_(faults), path_(std::move(path)) {}

 protected:
  void item(const Key&, const AnyKeyValue&) override;

 private:
  toml_reader::Faults& faults_;
  std::string path_;
};

/// Writes every key; functions of time only where they are given.
class KeyWriter : public Archive {
 public:
  explicit KeyWriter(toml_writer::Writer& out) : out_(out) {}

 protected:
  void item(const Key&, const AnyKeyValue&) override;

 private:
  toml_writer::Writer& out_;
};

/// Rows of a Markdown table.
class KeyTable : public Archive {
 public:
  std::string text() && { return std::move(text_); }

 protected:
  void item(const Key&, const AnyKeyValue&) override;

 private:
  std::string text_ = "| key | unit | meaning | default |\n|---|---|---|---|\n";
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
void write_keys(toml_writer::Writer& out, const char* header, const T& value, std::type_identity_t<Keys<T>> keys) {
  if (*header) out.table(header);
  KeyWriter writer(out);
  keys(writer, const_cast<T&>(value));
}

/// Reads a whole table, whose other keys are faults.
template <class T>
void read_keys(toml_reader::TableReader& table, T& value, std::type_identity_t<Keys<T>> keys,
               std::vector<std::string>* warnings = nullptr) {
  KeyReader reader(table, warnings);
  keys(reader, value);
  table.reject_unknown();
}

/// The tables of meshes/README.md.
std::string key_tables();

}  // namespace flexboom
