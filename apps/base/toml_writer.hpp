#pragma once

#include "apps/base/toml_reader.hpp"

#include <fmt/format.h>
#include <Eigen/Core>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// Writing TOML that reads back bit for bit. Internal to `apps`.
namespace flexboom::toml_writer {

// The shortest decimal that reads back to the same double, always recognisable as a float.
inline std::string toml(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".ein") == std::string::npos) text += ".0";
  return text;
}
inline std::string toml(bool value) { return value ? "true" : "false"; }
inline std::string toml(int value) { return fmt::format("{}", value); }
inline std::string toml(const std::string& value) { return toml_reader::in_quotes(value); }
inline std::string toml(std::string_view value) { return toml_reader::in_quotes(value); }
inline std::string toml(const Eigen::Vector3d& v) {
  return fmt::format("[{}, {}, {}]", toml(v.x()), toml(v.y()), toml(v.z()));
}
inline std::string toml(const Eigen::Vector4d& v) {
  return fmt::format("[{}, {}, {}, {}]", toml(v[0]), toml(v[1]), toml(v[2]), toml(v[3]));
}
inline std::string toml(const Eigen::Matrix3d& m) {
  const auto row = [&m](int i) { return toml(Eigen::Vector3d(m.row(i))); };
  return fmt::format("[\n  {},\n  {},\n  {},\n]", row(0), row(1), row(2));
}
template <class T>
std::string toml(const std::vector<T>& values) {
  std::string text = "[";
  for (const T& value : values) text += (text.size() > 1 ? ", " : "") + toml(value);
  return text + "]";
}

class Writer {
 public:
  void table(const char* header) { text_ += fmt::format("\n{}\n", header); }

  template <class T>
  void key(std::string_view name, const T& value, const char* comment = "") {
    text_ += fmt::format("{} = {}{}{}\n", name, toml(value), *comment ? "  # " : "", comment);
  }

  std::string text() && { return std::move(text_); }

 private:
  std::string text_;
};

}  // namespace flexboom::toml_writer
