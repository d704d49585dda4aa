#pragma once

// A slender boom whose frequencies are those of a clamped Euler-Bernoulli beam.

#include <cmath>
#include <numbers>

namespace flexboom {

/// The rest of a body, behind what a scene says of its model.
inline constexpr char slender_boom[] = R"toml(damping = { rule = "modal", value = 0.002 }
[[bodies.segments]]
shape = "general"
A = 2e-5
Iy = 5e-10
Iz = 1e-10
J = 1e-10
length = 2.0
material = { E = 70e9, nu = 0.3, rho = 2700 }
)toml";

/// Of its n-th mode in the x-y plane [rad/s].
inline double clamped_frequency(double n) {
  const double beta = (n - 0.5) * std::numbers::pi / 2.0;  // over the length; good to 1e-10 from n = 8
  return beta * beta * std::sqrt(70e9 * 1e-10 / (2700 * 2e-5));
}

}  // namespace flexboom
