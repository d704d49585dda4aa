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
  const std::optional<std::vector<double>> values = to_reals(text);
  if (!values || values->size() != 3) return {};
  const Eigen::Vector3d axis((*values)[0], (*values)[1], (*values)[2]);
  return axis.isZero(0) ? std::nullopt : std::optional(axis);
}

std::string text_of_axis(const Eigen::Vector3d& axis) {
  for (int i = 0; i < 3; ++i)
    if (axis == Eigen::Vector3d::Unit(i)) return std::string(names[static_cast<size_t>(i)]);
  return fmt::format("{},{},{}", axis.x(), axis.y(), axis.z());
}

}  // namespace flexboom
