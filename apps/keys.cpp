// The archives: read, check, write, document.

#include "apps/keys.hpp"

#include "apps/scene_checks.hpp"
#include "apps/scene_keys.hpp"

#include <fmt/format.h>

#include <cmath>

namespace flexboom {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector4d;
using toml_reader::TableReader;
using toml_writer::toml;

constexpr double repairable_skew = 0.02;  // of the largest entry of an inertia; misprints, not other matrices

void read(TableReader& t, const Key& k, double& v) {
  v = t.number(k.name, k.required ? std::nullopt : std::optional(v));
}
void read(TableReader& t, const Key& k, int& v) { v = t.integer(k.name, k.required ? std::nullopt : std::optional(v)); }
void read(TableReader& t, const Key& k, bool& v) { v = t.boolean(k.name, v); }
void read(TableReader& t, const Key& k, std::string& v) {
  v = t.text(k.name, k.required ? std::nullopt : std::optional(v));
}
void read(TableReader& t, const Key& k, Vector3d& v) {
  v = t.vector(k.name, k.required ? std::nullopt : std::optional(v));
}
void read(TableReader& t, const Key& k, Vector4d& v) {
  const std::vector<double> four = t.numbers(k.name);
  if (four.size() == 4) {
    v = Eigen::Map<const Vector4d>(four.data());
  } else if (t.has(k.name)) {
    t.fault(k.name, "must be a unit quaternion [w, x, y, z], from the axes of b to those of a");
  }
}
void read(TableReader& t, const Key& k, Matrix3d& v) {
  v = t.matrix(k.name, k.required ? std::nullopt : std::optional(v));
}
void read(TableReader& t, const Key& k, std::vector<std::string>& v) { v = t.texts(k.name, v); }
void read(TableReader& t, const Key& k, std::vector<double>& v) {
  if (t.has(k.name)) v = t.numbers(k.name);
}
void read(TableReader& t, const Key& k, PlaceScene& v) {
  if (k.required || t.has(k.name)) v = read_place(t, k.name);
}
void read(TableReader& t, const Key& k, CourseScene& v) { v = read_course(t, k.name); }
void read(TableReader& t, const Key& k, std::vector<CourseScene>& v) { v = read_courses(t, k.name); }
void read(TableReader& t, const Key& k, std::array<CourseScene, 3>& v) { v = read_three_courses(t, k.name); }

// An inertia is symmetric; a matrix is nothing else here.
void repair(TableReader& table, const Key& key, Matrix3d& inertia, std::vector<std::string>& warnings) {
  const double scale = inertia.cwiseAbs().maxCoeff();
  const double skew = (inertia - inertia.transpose()).cwiseAbs().maxCoeff();
  if (!(skew > 0 && skew <= repairable_skew * scale)) return;
  warnings.push_back(
      fmt::format("{}: not symmetric (entries across the diagonal differ by up to {:g} kg m^2); "
                  "(I + I^T)/2 is used",
                  table.path(key.name), skew));
  inertia = (0.5 * (inertia + inertia.transpose())).eval();
}

std::string brief(const Vector3d& v) {
  return v.isZero(0) ? "zero" : fmt::format("[{:g}, {:g}, {:g}]", v.x(), v.y(), v.z());
}
std::string brief(const Vector4d& v) { return fmt::format("[{:g}, {:g}, {:g}, {:g}]", v[0], v[1], v[2], v[3]); }
std::string brief(const Matrix3d&) { return "zero"; }
std::string brief(double v) { return fmt::format("{:g}", v); }
std::string brief(int v) { return fmt::format("{}", v); }
std::string brief(bool v) { return v ? "true" : "false"; }
std::string brief(const std::string& v) { return v.empty() ? "none" : '`' + toml(v) + '`'; }
template <class T>
std::string brief(const std::vector<T>& v) {
  return v.empty() ? "none" : "";
}
std::string brief(const PlaceScene&) { return "none"; }
std::string brief(const CourseScene&) { return "none"; }
std::string brief(const std::array<CourseScene, 3>&) { return "zero"; }

bool is_given(const CourseScene& c) { return c.given(); }
bool is_given(const std::vector<CourseScene>& c) { return !c.empty(); }
template <class T>
bool is_given(const T&) {
  return true;
}

}  // namespace

void KeyReader::item(const Key& key, const AnyKeyValue& any) {
  std::visit(
      [&](const auto& item) {
        read(table_, key, *item.value);
        if constexpr (std::is_same_v<decltype(item.value), Matrix3d*>)
          if (warnings_) repair(table_, key, *item.value, *warnings_);
      },
      any);
}

void KeyChecker::item(const Key& key, const AnyKeyValue& any) {
  const std::string unit = key.unit.empty() ? "" : ' ' + std::string(key.unit);
  std::visit(
      [&](const auto& item) {
        if (item.check) item.check(faults_, scene_checks::join(path_, key.name), *item.value, unit);
      },
      any);
}

void KeyWriter::item(const Key& key, const AnyKeyValue& any) {
  std::visit(
      [&](const auto& item) {
        if (is_given(*item.value)) out_.raw(key.name, toml(*item.value), key.unit);
      },
      any);
}

void KeyTable::item(const Key& key, const AnyKeyValue& any) {
  const std::string otherwise = key.required ? ""
                                : !key.otherwise.empty()
                                    ? std::string(key.otherwise)
                                    : std::visit([](const auto& i) { return brief(*i.value); }, any);
  text_ += fmt::format("| `{}` | {} | {} | {} |\n", key.name, key.unit, key.what, otherwise);
}

}  // namespace flexboom
