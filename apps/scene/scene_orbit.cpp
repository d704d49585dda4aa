#include "apps/scene/scene_orbit.hpp"

#include "dynamics/numerics/rotation.hpp"

#include <cmath>

namespace flexboom {

double OrbitScene::rate() const {
  const Planet earth;
  const double a = (earth.radius + altitude) / (1 - eccentricity);
  return std::sqrt(earth.mu / (a * a * a));
}

Orbit orbit_of(const Scene& scene) {
  const OrbitScene& o = *scene.orbit;
  Planet earth;
  if (o.J2) earth.J2 = earth_J2;
  const double e = o.eccentricity;
  const double eccentric =
      2 * std::atan2(std::sqrt(1 - e) * std::sin(o.anomaly / 2), std::sqrt(1 + e) * std::cos(o.anomaly / 2));
  const OrbitalElements elements = {.semi_major_axis = (earth.radius + o.altitude) / (1 - e),
                                    .eccentricity = e,
                                    .inclination = o.inclination,
                                    .node = o.node,
                                    .periapsis = o.perigee,
                                    .mean_anomaly = eccentric - e * std::sin(eccentric)};
  const Orbit orbit(elements, earth, scene.duration);
  return orbit.in_axes(lvlh_frame(earth, orbit.at(0)).axes);
}

std::optional<OrbitalField> field_of(const Scene& scene) {
  if (!scene.orbit || scene.orbit->gravity == "none") return {};
  return OrbitalField{.orbit = orbit_of(scene), .strength = scene.gravity_strength};
}

Eigen::Vector3d lvlh_angles(const Eigen::Vector4d& attitude, const Orbit& orbit, double t) {
  return roll_pitch_yaw(lvlh_frame(orbit.planet(), orbit.at(t)).axes.transpose() * rotation_matrix(attitude));
}

}  // namespace flexboom
