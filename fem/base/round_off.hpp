#pragma once

namespace flexboom {

/// Relative difference between two numbers that are meant to be equal.
inline constexpr double relative_round_off = 1e-12;

}  // namespace flexboom
