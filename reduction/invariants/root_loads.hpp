#pragma once

#include "reduction/body/reduced_body.hpp"

#include <Eigen/Core>

#include <string>
#include <vector>

namespace flexboom {

/// Inertia of a body with elastic coordinates q, about the BRF origin: mc(q), J(q), Cr(q) (Shabana 2013, ch. 5).
struct DeformedInertia {
  Eigen::Vector3d mc;   // [kg m]
  Eigen::Matrix3d J;    // [kg m^2]
  Eigen::Matrix3Xd Cr;  // 3 x n
};
DeformedInertia deformed_inertia(const ReducedBody&, const Eigen::VectorXd& q);

/// How a body moves: its BRF and its elastic coordinates, in BRF axes. Empty q, q_dot, q_ddot are zero.
struct BodyMotion {
  Eigen::Vector3d v = Eigen::Vector3d::Zero();      // velocity of the BRF origin [m/s]; loads do not depend on it
  Eigen::Vector3d omega = Eigen::Vector3d::Zero();  // angular velocity [rad/s]
  Eigen::Vector3d a = Eigen::Vector3d::Zero();      // acceleration of the BRF origin less gravity [m/s^2]
  Eigen::Vector3d alpha = Eigen::Vector3d::Zero();  // angular acceleration [rad/s^2]
  Eigen::VectorXd q{}, q_dot{}, q_ddot{};
};

/// Momenta about the BRF origin and kinetic energy, in BRF axes.
struct BodyMomenta {
  Eigen::Vector3d linear;   // [kg m/s]
  Eigen::Vector3d angular;  // [N m s]
  double kinetic = 0;       // [J]
};
/// @throws InputError when q or q_dot is neither empty nor of size n.
BodyMomenta momenta(const ReducedBody&, const BodyMotion&);

/// A force [N] and a torque [N m] on a marker, BRF axes.
struct MarkerLoad {
  std::string marker;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
};

/// Force [N] and moment [N m] on a body at its BRF origin, BRF axes.
struct RootLoads {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
};

/// What the carrier of a body exerts on it at its root, the BRF origin, so that it moves like this under the given
/// marker loads. It is the rates of the body's momenta less the loads (first two rows of eqs. 7-9). The carrier feels
/// the opposite. All rigid inertia is in it, so what the modes leave out is missing from q_ddot alone. Forces on
/// markers act where the marker has gone: at position + S q.
/// @throws InputError when q, q_dot or q_ddot is neither empty nor of size n, or for a marker that does not exist.
RootLoads root_loads(const ReducedBody&, const BodyMotion&, const std::vector<MarkerLoad>& = {});

/// Part of each coordinate in the root loads, 6 x n: the carrier holds a clamped body that vibrates with q_k alone by
/// -omega_k^2 (Ct_k; Cr0_k) q_k; here omega_k^2 (Ct_k; Cr0_k) [N, N m per unit of q_k]. Zero where a coordinate has no
/// frequency.
Eigen::MatrixXd root_load_participation(const ReducedBody&);

}  // namespace flexboom
