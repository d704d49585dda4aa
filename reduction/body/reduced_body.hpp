#pragma once

#include <Eigen/Core>

#include <array>
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

/// Geometric stiffness of loads on one marker, per newton and newton metre along the axes of the BRF, n x n each.
struct MarkerStiffness {
  std::string marker;
  std::vector<Eigen::MatrixXd> force;   // 3
  std::vector<Eigen::MatrixXd> torque;  // 3
};

/// Geometric stiffness per unit of each load, n x n each. Empty where it was not computed. The stiffness of the moving
/// body is Ke + sum load * matrix.
struct GeometricStiffness {
  // omega_x^2, omega_y^2, omega_z^2, omega_x omega_y, omega_y omega_z, omega_z omega_x
  std::vector<Eigen::MatrixXd> spin;
  std::vector<Eigen::MatrixXd> acceleration;          // 3, of the BRF origin [per m/s^2]
  std::vector<Eigen::MatrixXd> angular_acceleration;  // 3, of the BRF [per rad/s^2]
  std::vector<MarkerStiffness> markers;
};

/// One line of the coordinate table.
struct Coordinate {
  std::string kind;          // "bending_y", ..., "interface", "attachment"
  double frequency_hz = 0;   // of the body under its reference condition; 0 of interface coordinates
  std::string interface {};  // whose motion or load it is, of interface and attachment coordinates
  std::string direction{};   // "ux" .. "rz" of an interface coordinate, "Fx" .. "Mz" of an attachment
};

/// A place where a body is joined to others; a marker of the same name lies there.
struct Interface {
  std::string name;
  std::array<bool, 6> components = {true, true, true, true, true, true};  // kept: ux uy uz rx ry rz, BRF axes
  int first_coordinate = -1;  // the kept components are consecutive coordinates from here; -1: none (it is clamped)
};

/// A check of a body against an independent route.
struct BodyCheck {
  std::string name;
  double value = 0;
  double reference = 0;
  double relative_error = 0;
  bool passed = false;
};

/// Where a body came from.
struct Provenance {
  std::string program;    // "flexboom 0.1.0"
  std::string libraries;  // with versions, one line
  std::string source;     // file of the model
  std::string mesh_hash;  // of nodes, elements, properties and sets; empty of closed forms
  std::string options;    // what was asked, one line
  std::string doubts;     // materials of the mesh that are none in SI units, one line; empty: all are
};

/// The body for pictures and for programs that want nodes: points (BRF) and the shapes there. Beams have lines, solids
/// the triangles of their surface.
struct DisplayShape {
  Eigen::Matrix3Xd points;                    // 3 x N [m]
  std::vector<Eigen::Matrix3Xd> S;            // N entries, 3 x n
  std::vector<Eigen::Matrix3Xd> S_theta;      // N entries, 3 x n, rotations; empty where nodes have none
  std::vector<std::vector<int>> lines;        // polylines over the points
  std::vector<std::array<int, 3>> triangles;  // outward normal by the right hand
};

/// A reduced flexible body: modal invariants over the undeformed body, in BRF axes, about the BRF origin (Shabana 2013,
/// ch. 5; eqs. 6, 7). A rigid body has n = 0. Units: SI; a coordinate q_k has the unit that makes S_k q_k metres.
struct ReducedBody {
  std::string name;
  std::string structure;          // "rigid", "eq14", "beam", "solid"
  std::string frame = "clamped";  // reference condition: "clamped", "mean-axis"; "free": coordinates hold rigid motions

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

  /// sum dm z z^T with z = (1, u0, S_1, ..., S_n), (4 + 3n) square: what the integrals above are functions of, and what
  /// other programs want in other combinations. Empty where it is not known.
  Eigen::MatrixXd gram;

  std::vector<Coordinate> coordinates;
  std::vector<Interface> interfaces;
  std::vector<Marker> markers;
  DisplayShape display;
  Provenance provenance;
  std::vector<BodyCheck> certificate;
  int full_freedoms = 0;  // unknowns of the model it came from (0: closed form)

  int n() const { return static_cast<int>(Me.rows()); }

  /// Frequency of a coordinate alone, all others held [rad/s]; 0 where its stiffness is none, or below by round-off.
  double frequency(Eigen::Index k) const;

  /// Sizes agree, m > 0, J0 is an inertia, Me is positive definite, no marker or interface is there twice, interfaces
  /// lie within the coordinates.
  /// @throws InputError naming the field.
  void validate() const;
};

/// A body with n coordinates whose integrals all have their sizes and are zero: where every maker of bodies starts.
ReducedBody blank_body(std::string name, int n);

/// Sets m, mc0, J0, Ct, Cr0, Cr1, Me, J1 and J2 from `gram` of that body, and keeps it.
void set_invariants(ReducedBody&, Eigen::MatrixXd gram);

/// -sum dm tilde(c) tilde(c) of the mass m in its centre c: J0 about the origin = inertia about the centre + this.
Eigen::Matrix3d centre_inertia(double m, const Eigen::Vector3d& mc0);

/// A rigid body of mass m [kg], first moment and inertia about its BRF origin.
ReducedBody rigid_body(std::string name, double m, const Eigen::Vector3d& mc0, const Eigen::Matrix3d& J0);

/// Marker of that name. @throws InputError listing those that exist.
const Marker& marker(const ReducedBody&, const std::string& name);

/// How De is made. "modal": 2 zeta omega for every mode of (Ke, Me), which is De_kk = 2 zeta omega_k Me_kk where the
/// coordinates are those modes. "loss-factor": the same with zeta = value / 2. "rayleigh": De = alpha Me + beta Ke.
/// "none": zero.
struct DampingRule {
  std::string name = "none";
  double value = 0;  // zeta or eta [-]
  double alpha = 0;  // [1/s]
  double beta = 0;   // [s]
};

/// Sets De. @throws InputError for an unknown rule or a negative value.
void apply_damping(ReducedBody&, const DampingRule&);

}  // namespace flexboom
