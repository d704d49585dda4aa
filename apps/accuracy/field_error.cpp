#include "apps/accuracy/field_error.hpp"

#include "dynamics/environment/gravity_field.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace flexboom {

FieldError field_error(const Scene& scene, const std::vector<PreparedBody>& bodies) {
  if (!scene.orbit || scene.orbit->gravity == "none") return {};
  constexpr double per_size = 10;
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
    for (const Marker& m : p.body.markers) size = std::max(size, (m.position - p.body.mc0 / p.body.m).norm() / 2);
  }
  const double pull = 1.5 * n * n * unequal / (mass * r), T = scene.duration;
  // A constant pull along the path drifts the other way, by three times as much (Clohessy and Wiltshire).
  return {per_size * size / r, 1.5 * pull * T * T, 3 * pull * T, n * T};
}

}  // namespace flexboom
