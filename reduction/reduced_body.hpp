#pragma once

#include <Eigen/Core>

#include <string>
#include <vector>

namespace flexboom {

/// A named point of a body with its shapes.
struct Marker {
  std::string name;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // BRF [m]
  Eigen::Matrix3Xd S;                                  // 3 x n, displacement [m per coordinate]
  Eigen::Matrix3Xd S_theta;                            // 3 x n, rotation [rad per coordinate]
};

/// Geometric stiffness per unit of each load, n x n each. Empty where it was not computed.
struct GeometricStiffness {
  // omega_x^2, omega_y^2, omega_z^2, omega_x omega_y, omega_y omega_z, omega_z omega_x
  std::vector<Eigen::MatrixXd> spin;
  std::vector<Eigen::MatrixXd> acceleration;          // 3
  std::vector<Eigen::MatrixXd> angular_acceleration;  // 3
};

/// One line of the coordinate table.
struct Coordinate {
  std::string kind;         // "bending_y", ...
  double frequency_hz = 0;  // of the clamped body
};

/// Lines along the body for pictures: points (BRF) and the shapes there.
struct DisplayShape {
  Eigen::Matrix3Xd points;              // 3 x N [m]
  std::vector<Eigen::Matrix3Xd> S;      // N entries, 3 x n
  std::vector<std::vector<int>> lines;  // polylines over the points
};

/// A reduced flexible body: modal invariants over the undeformed body, in BRF axes, about the BRF origin (Shabana 2013,
/// ch. 5; FORMULATION 2). A rigid body has n = 0. Units: SI; a coordinate q_k has the unit that makes S_k q_k metres.
struct ReducedBody {
  std::string name;
  std::string structure;          // "rigid", "eq14", "beam"
  std::string frame = "clamped";  // reference condition

  double m = 0;                                   // integral of rho
  Eigen::Vector3d mc0 = Eigen::Vector3d::Zero();  // rho u0
  Eigen::Matrix3d J0 = Eigen::Matrix3d::Zero();   // -rho tilde(u0) tilde(u0)
  Eigen::Matrix3Xd Ct;                            // rho S, 3 x n
  Eigen::Matrix3Xd Cr0;                           // rho tilde(u0) S, 3 x n
  std::vector<Eigen::Matrix3Xd> Cr1;              // n of: rho tilde(S_k) S, 3 x n
  Eigen::MatrixXd Me;                             // rho S^T S, n x n
  std::vector<Eigen::Matrix3d> J1;                // n of: -rho (tilde(u0) tilde(S_k) + tilde(S_k) tilde(u0))
  std::vector<std::vector<Eigen::Matrix3d>> J2;   // n x n of: -rho tilde(S_k) tilde(S_l), symmetrised in k, l
  Eigen::MatrixXd Ke;                             // n x n
  Eigen::MatrixXd De;                             // n x n
  GeometricStiffness Kg;

  std::vector<Coordinate> coordinates;
  std::vector<Marker> markers;
  DisplayShape display;
  int full_freedoms = 0;  // unknowns of the model it came from (0: closed form)

  int n() const { return static_cast<int>(Me.rows()); }

  /// Sizes agree, m > 0, J0 is an inertia, Me is positive definite.
  /// @throws InputError naming the field.
  void validate() const;
};

/// A body with n coordinates whose integrals all have their sizes and are zero: where every maker of bodies starts.
ReducedBody blank_body(std::string name, int n);

/// A rigid body of mass m [kg], first moment and inertia about its BRF origin.
ReducedBody rigid_body(std::string name, double m, const Eigen::Vector3d& mc0, const Eigen::Matrix3d& J0);

/// Marker of that name. @throws InputError listing those that exist.
const Marker& marker(const ReducedBody&, const std::string& name);

/// How De is made. "modal": De_kk = 2 zeta omega_k Me_kk. "loss-factor": the same with zeta = value / 2.
/// "rayleigh": De = alpha Me + beta Ke. "none": zero.
struct DampingRule {
  std::string name = "none";
  double value = 0;  // zeta or eta [-]
  double alpha = 0;  // [1/s]
  double beta = 0;   // [s]
};

/// Sets De. @throws InputError for an unknown rule or a negative value.
void apply_damping(ReducedBody&, const DampingRule&);

}  // namespace flexboom
