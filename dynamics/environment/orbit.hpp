#pragma once

#include "dynamics/environment/gravity_field.hpp"

#include <Eigen/Core>

#include <memory>

namespace flexboom {

/// Osculating elements at t = 0, in inertial axes with z along the planet's pole. Angles in rad.
struct OrbitalElements {
  double semi_major_axis = 0;  // [m]
  double eccentricity = 0;     // [0, 1)
  double inclination = 0;
  double node = 0;       // right ascension of the ascending node
  double periapsis = 0;  // argument of periapsis
  double mean_anomaly = 0;
};

/// Circular orbit at an altitude [m] above the equatorial radius, at its ascending node at t = 0.
OrbitalElements circular_orbit(double altitude, double inclination, const Planet& = {});

/// A place on an orbit, from the planet's centre, inertial axes.
struct OrbitState {
  Eigen::Vector3d position;  // [m]
  Eigen::Vector3d velocity;  // [m/s]
};

/// Two-body motion from r, v: t later (or before, t < 0), to round-off. r x v must not vanish; v below escape velocity.
OrbitState kepler(double mu, const OrbitState&, double t);

/// Motion of a reference point around a planet. A point mass: closed form, for all times. With J2: the difference from
/// a two-body orbit (Encke) integrated once at construction, from t = 0 to `duration`, and kept as polynomials. Never
/// changes; reading it allocates nothing.
class Orbit {
 public:
  /// Elements refer to a pole along z; `planet.pole` must be that. `tolerance`: error per step, relative to the radius.
  /// @throws InputError for elements of no ellipse, an orbit below the surface's half radius, or J2 without a duration;
  /// NumericalError when the integration fails.
  Orbit(const OrbitalElements&, const Planet&, double duration = 0, double tolerance = 1e-15);

  /// The same orbit with all vectors in other inertial axes; columns of `axes`: the new ones in the old.
  Orbit in_axes(const Eigen::Matrix3d& axes) const;

  const Planet& planet() const { return planet_; }

  /// @throws InputError with J2 outside [0, duration] s.
  OrbitState at(double t) const;

 private:
  struct Path;
  std::shared_ptr<const Path> path_;
  Planet planet_;
  Eigen::Matrix3d axes_ = Eigen::Matrix3d::Identity();  // of the path -> those asked for
};

/// Local-vertical local-horizontal frame: z to the planet, y against the orbit's normal, x completes (along the
/// velocity on a circle).
struct LvlhFrame {
  Eigen::Matrix3d axes;                  // columns x, y, z: LVLH -> inertial
  Eigen::Vector3d angular_velocity;      // against inertial space, LVLH axes [rad/s]
  Eigen::Vector3d angular_acceleration;  // its rate, LVLH axes [rad/s^2]
};
LvlhFrame lvlh_frame(const Planet&, const OrbitState&);

/// Roll, pitch, yaw (3-2-1: yaw about z, then pitch about y, then roll about x) [rad] of a rotation matrix body ->
/// frame.
Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d&);

}  // namespace flexboom
