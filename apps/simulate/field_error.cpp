#include "apps/simulate/field_error.hpp"

#include "dynamics/environment/gravity_field.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace flexboom {

FieldError field_error(const Scene& scene, const std::vector<PreparedBody>& bodies) {
  if (!scene.orbit || scene.orbit->gravity == "none") return {};
  constexpr double per_size = 5;
  const Planet planet;
  const double r = planet.radius + scene.orbit->altitude, n = std::sqrt(planet.mu / (r * r * r));
  double mass = 0, unequal = 0, size = 0;
  for (const PreparedBody& p : bodies) {
    const Eigen::Matrix3d J = p.body.J0 - centre_inertia(p.body.m, p.body.mc0);
    const Eigen::Vector3d principal =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(J, Eigen::EigenvaluesOnly).eigenvalues();
    mass += p.body.m;
    unequal += principal[2] - principal[0];
    size = std::max(size, std::sqrt(principal.sum() / (2 * p.body.m)));
  }
  const double pull = 1.5 * n * n * unequal / (mass * r), T = scene.duration;
  // A constant pull along r or the path (Clohessy and Wiltshire): an offset, and a drift along the path.
  return {per_size * size / r, std::min(pull * T * T / 2, 2 * pull / (n * n) * (n * T + 1)),
          std::min(pull * T, 4 * pull / n)};
}

}  // namespace flexboom
