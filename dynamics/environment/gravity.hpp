#pragma once

#include "dynamics/environment/orbit.hpp"
#include "reduction/body/reduced_body.hpp"

#include <Eigen/Core>

namespace flexboom {

/// Gravity about a point, less what the reference point of the orbit falls with: acceleration + gradient u at a small
/// distance u from it. All in one set of axes.
struct LocalGravity {
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  // [m/s^2]
  Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero();      // symmetric, trace zero [1/s^2]

  /// The same in other axes; A: those -> these.
  LocalGravity in_axes(const Eigen::Matrix3d& A) const {
    return {A.transpose() * acceleration, A.transpose() * gradient * A};
  }
  /// The same about a point at a distance u.
  LocalGravity at(const Eigen::Vector3d& u) const { return {acceleration + gradient * u, gradient}; }
};

/// The gravity that bodies near a moving reference point feel in axes that move with it without turning.
struct OrbitalField {
  Orbit orbit;
  /// The difference of gravity between a body's place and the reference point: all of it, or its linear part.
  bool exact = true;
  /// Of the gradient within a body: error estimates ask what a little more of it would change.
  double strength = 1;

  /// At time t [s], at rho from the reference point (inertial axes) [m]. Allocates nothing.
  /// @throws InputError where `orbit.at` does.
  LocalGravity at(double t, const Eigen::Vector3d& rho) const;
};

/// Resultant of gravity on a body, about its BRF origin, BRF axes.
struct BodyGravity {
  Eigen::Vector3d force;   // [N]
  Eigen::Vector3d torque;  // [N m]
  Eigen::VectorXd modal;   // [N m per unit of q]
};

/// Of a field given about the BRF origin in BRF axes. Within the body the field is linear: what is left out is the part
/// (size of the body)/(distance of the planet) of the gradient. It is least where the field is linear about the mass
/// centre, as LocalGravity::at gives it.
/// @throws InputError if q has not the size n.
BodyGravity body_gravity(const ReducedBody&, const LocalGravity&, const Eigen::VectorXd& q);

}  // namespace flexboom
