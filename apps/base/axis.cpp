#include "apps/base/axis.hpp"

#include "fem/base/text_reader.hpp"

#include <fmt/format.h>

#include <array>
#include <string_view>

namespace flexboom {
namespace {

constexpr std::array<std::string_view, 3> names = {"x", "y", "z"};

}  // namespace

std::optional<Eigen::Vector3d> axis_of(const std::string& text) {
  for (int i = 0; i < 3; ++i)
    if (text == names[static_cast<size_t>(i)]) return Eigen::Vector3d::Unit(i);
  Eigen::Vector3d axis;
  size_t from = 0;
  for (int i = 0; i < 3; ++i) {
    const size_t comma = text.find(',', from);
    if ((comma == std::string::npos) != (i == 2)) return {};
    const auto value = to_real(text.substr(from, comma - from));
    if (!value) return {};
    axis[i] = *value, from = comma + 1;
  }
  if (!axis.allFinite() || axis.isZero(0)) return {};
  return axis;
}

std::string text_of_axis(const Eigen::Vector3d& axis) {
  for (int i = 0; i < 3; ++i)
    if (axis == Eigen::Vector3d::Unit(i)) return std::string(names[static_cast<size_t>(i)]);
  return fmt::format("{},{},{}", axis.x(), axis.y(), axis.z());
}

}  // namespace flexboom
