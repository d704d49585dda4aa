#pragma once

#include <Eigen/Core>

namespace flexboom {

/// A planet with an axis of symmetry. Defaults: the Earth (mu, radius and J2 of EGM96 / WGS84); J2 = 0: a point mass.
struct Planet {
  double mu = 3.986004418e14;                       // G M [m^3/s^2]
  double radius = 6378137;                          // equatorial [m]
  double J2 = 0;                                    // oblateness [-]; the Earth: earth_J2
  Eigen::Vector3d pole = Eigen::Vector3d::UnitZ();  // unit, inertial axes
};
constexpr double earth_J2 = 1.08262668e-3;

/// Acceleration of gravity at r from the planet's centre (inertial axes) [m/s^2].
Eigen::Vector3d gravity(const Planet&, const Eigen::Vector3d& r);

/// The part of it that J2 makes.
Eigen::Vector3d oblateness_gravity(const Planet&, const Eigen::Vector3d& r);

/// gravity(R + rho) - gravity(R), good to round-off of itself at any rho: no large numbers are subtracted.
/// Encke's method: Battin, An Introduction to the Mathematics and Methods of Astrodynamics, 1999, eq. 8.62.
Eigen::Vector3d differential_gravity(const Planet&, const Eigen::Vector3d& R, const Eigen::Vector3d& rho);

/// d(gravity)/dr at r: symmetric, trace zero [1/s^2]. A point mass: mu/r^3 (3 c c^T - I), c = r/|r|.
Eigen::Matrix3d gravity_gradient(const Planet&, const Eigen::Vector3d& r);

}  // namespace flexboom
