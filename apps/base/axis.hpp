#pragma once

#include <Eigen/Core>

#include <optional>
#include <string>

namespace flexboom {

/// "x", "y", "z", or "X,Y,Z" of a direction, of any length. Nothing for another text and for 0,0,0.
std::optional<Eigen::Vector3d> axis_of(const std::string& text);

/// That text of an axis.
std::string text_of_axis(const Eigen::Vector3d&);

}  // namespace flexboom
