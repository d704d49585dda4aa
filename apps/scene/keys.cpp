// The archives that read, check and write.

#include "apps/scene/keys.hpp"

#include "apps/base/toml_writer.hpp"
#include "apps/scene/scene_checks.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace flexboom {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector4d;
using scene_checks::join;
using toml_reader::TableReader;
using toml_writer::toml;

constexpr double repairable_skew = 0.02;  // of the largest entry of an inertia; misprints, not other matrices

// --- reading ---

template <class T>
std::optional<T> otherwise(const Key& k, const T& v) {
  return k.required ? std::nullopt : std::optional(v);
}

void read(KeyReader& r, const Key& k, double& v) { v = r.table().number(k.name, otherwise(k, v)); }
void read(KeyReader& r, const Key& k, int& v) { v = r.table().integer(k.name, otherwise(k, v)); }
void read(KeyReader& r, const Key& k, bool& v) { v = r.table().boolean(k.name, v); }
void read(KeyReader& r, const Key& k, std::string& v) {
  const bool is_of_other_kind = r.has(k.name) && !r.table().is_text(k.name);
  if (!k.words.empty() && is_of_other_kind)
    r.table().choice(k.name, k.words, 0);  // a fault that names the words
  else
    v = r.table().text(k.name, otherwise(k, v));
}
void read(KeyReader& r, const Key& k, Vector3d& v) { v = r.table().vector(k.name, otherwise(k, v)); }
void read(KeyReader& r, const Key& k, std::vector<std::string>& v) { v = r.table().texts(k.name, v); }

void read(KeyReader& r, const Key& k, Choice& v) {
  if (k.required && !r.has(k.name))
    r.table().fault(k.name, fmt::format("is missing; it must be one of \"{}\"", fmt::join(k.words, "\", \"")));
  v.index = r.table().choice(k.name, k.words, v.index);
}

void read(KeyReader& r, const Key& k, NumberOrWord& v) {
  if (!r.has(k.name) && !k.required) return;
  v.word.clear();
  if (r.table().is_text(k.name)) {
    v.word = r.table().text(k.name);
    if (std::ranges::find(k.words, v.word) == k.words.end())
      r.table().fault(k.name,
                      toml_reader::not_among(v.word, k.words) + (v.whole ? ", or a whole number" : ", or a number"));
  } else {
    v.number = v.whole ? r.table().integer(k.name) : r.table().number(k.name);
  }
}

void read(KeyReader& r, const Key& k, Vector4d& v) {
  const std::vector<double> four = r.table().numbers(k.name);
  if (four.size() == 4) {
    v = Eigen::Map<const Vector4d>(four.data());
  } else if (r.has(k.name)) {
    r.table().fault(k.name, "must be a unit quaternion [w, x, y, z], from the axes of b to those of a");
  }
}

// An inertia is symmetric; a matrix is nothing else here.
void read(KeyReader& r, const Key& k, Matrix3d& v) {
  v = r.table().matrix(k.name, otherwise(k, v));
  const double skew = (v - v.transpose()).cwiseAbs().maxCoeff();
  if (!(skew > 0 && skew <= repairable_skew * v.cwiseAbs().maxCoeff())) return;
  r.reading().warnings.push_back(
      fmt::format("{}: not symmetric (entries across the diagonal differ by up to {:g} kg m^2); "
                  "(I + I^T)/2 is used",
                  r.table().path(k.name), skew));
  v = (0.5 * (v + v.transpose())).eval();
}

void read(KeyReader& r, const Key& k, std::vector<double>& v) {
  if (r.has(k.name)) v = r.table().numbers(k.name);
  if (k.required && v.empty() && !r.has(k.name)) r.table().fault(k.name, "is missing; give an array of numbers");
}
void read(KeyReader& r, const Key& k, std::vector<int>& v) {
  if (!r.has(k.name)) return;
  v.clear();
  for (const double number : r.table().numbers(k.name)) {
    constexpr double most = 1e9;
    if (number != std::floor(number) || std::abs(number) > most)
      return r.table().fault(k.name, fmt::format("has {}; it must be whole numbers", number));
    v.push_back(static_cast<int>(number));
  }
}
void read(KeyReader& r, const Key& k, std::optional<double>& v) {
  if (r.has(k.name)) v = r.table().number(k.name);
}
template <class Courses>
void read(KeyReader& r, const Key& k, Courses& v) {
  read_course(r, k.name, v);
}

// --- writing ---

std::string value_text(const Key& k, const Choice& v) { return toml(k.words[v.index]); }
std::string value_text(const Key&, const NumberOrWord& v) {
  return !v.word.empty() ? toml(v.word) : v.whole ? fmt::format("{}", v.number) : toml(v.number);
}
std::string value_text(const Key&, const std::optional<double>& v) { return toml(*v); }
std::string value_text(const Key&, const CourseScene& v) { return toml(v); }
std::string value_text(const Key&, const std::vector<CourseScene>& v) {
  return v.size() == 1 ? toml(v[0]) : fmt::format("[{}, {}]", toml(v.at(0)), toml(v.at(1)));
}
std::string value_text(const Key&, const std::array<CourseScene, 3>& v) {
  return fmt::format("[{}, {}, {}]", toml(v[0]), toml(v[1]), toml(v[2]));
}
template <class T>
std::string value_text(const Key&, const T& v) {
  return toml(v);
}

bool is_given(const CourseScene& c) { return c.given(); }
bool is_given(const std::vector<CourseScene>& c) { return !c.empty(); }
bool is_given(const std::optional<double>& v) { return v.has_value(); }
template <class T>
bool is_given(const T&) {
  return true;
}

}  // namespace

void KeyReader::item(const Key& key, const AnyKeyValue& any) {
  std::visit([&](const auto& item) { read(*this, key, *item.value); }, any);
}

void KeyReader::below(const Key& key, const Tables& tables) {
  const auto take = [&](TableReader& table, size_t i) {
    KeyReader reader(table, reading_);
    tables.keys(reader, i);
    reader.finish();
  };
  if (tables.many) {
    std::vector<TableReader> found = table_.tables(key.name);
    tables.make(found.size());
    for (size_t i = 0; i < found.size(); ++i) take(found[i], i);
  } else if (auto found = table_.table(key.name, key.required)) {
    tables.make(1);
    take(*found, 0);
  }
}

void KeyReader::finish() {
  if (!takes_any_key_) table_.reject_unknown(hint_);
}

void KeyChecker::item(const Key& key, const AnyKeyValue& any) {
  const std::string unit = key.unit.empty() ? "" : ' ' + std::string(key.unit), path = join(path_, key.name);
  if (const auto* word = std::get_if<KeyValue<std::string>>(&any); word && !key.words.empty())
    scene_checks::check_name_among(faults_, path, *word->value, key.words);
  std::visit(
      [&](const auto& item) {
        if (item.check) item.check(faults_, path, *item.value, unit);
      },
      any);
}

void KeyChecker::below(const Key& key, const Tables& tables) {
  for (size_t i = 0; i < tables.count; ++i) {
    const std::string path = join(path_, key.name);
    KeyChecker checker(faults_, tables.many ? fmt::format("{}[{}]", path, i) : path);
    tables.keys(checker, i);
  }
}

void KeyWriter::add(std::string_view key, const std::string& value, std::string_view comment) {
  if (in_one_line_)
    keys_ += fmt::format("{}{} = {}", keys_.empty() ? "" : ", ", key, value);
  else
    keys_ += fmt::format("{} = {}{}{}\n", key, value, comment.empty() ? "" : "  # ", comment);
}

void KeyWriter::item(const Key& key, const AnyKeyValue& any) {
  std::visit(
      [&](const auto& item) {
        if (is_given(*item.value)) add(key.name, value_text(key, *item.value), key.unit);
      },
      any);
}

void KeyWriter::below(const Key& key, const Tables& tables) {
  const std::string path = join(path_, key.name);
  for (size_t i = 0; i < tables.count; ++i) {
    KeyWriter writer(path, !tables.name.empty());
    tables.keys(writer, i);
    if (!tables.name.empty())
      add(key.name, "{ " + std::move(writer).text() + " }", "");
    else
      tables_ += fmt::format(fmt::runtime(tables.many ? "\n[[{}]]\n{}" : "\n[{}]\n{}"), path, std::move(writer).text());
  }
}

}  // namespace flexboom
