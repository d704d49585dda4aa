#pragma once

#include "reduction/exports/exports.hpp"

namespace flexboom {

/// The linear model that attitude control toolboxes want of an appendage. x is the motion of the BRF origin (3
/// displacements, 3 rotations, BRF axes). W is the force and torque that the base exerts there. With unit modal masses,
///   W = M_r x'' + L_P q'',   q'' + diag(2 zeta omega) q' + diag(omega^2) q = -L_P^T x''
struct CouplingFile {
  std::string name;
  std::string frame;
  double mass = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  // about the BRF origin
  std::vector<std::string> kinds;                     // one per mode
  Eigen::VectorXd omega;                              // [rad/s]
  Eigen::VectorXd zeta;                               // [-]; 0 of modes without frequency
  Eigen::MatrixXd damping;                            // n x n [1/s]: diag(2 zeta omega) and what is beside it
  Eigen::MatrixXd L_P;                                // 6 x n: Ct above Cr0
  Eigen::MatrixXd residual;                           // 6 x 6: M_r - L_P L_P^T, the inertia above all modes
  std::vector<Marker> markers;                        // shapes in the same coordinates
};

CouplingFile coupling_file(const ReducedBody&);

/// Reads the JSON file. @throws InputError naming the file and what is wrong.
CouplingFile read_coupling(const std::filesystem::path&);

/// Writes PATH (JSON), and beside it NAME.modes.csv (one line per mode) and NAME.rigid.csv (name,value).
void write_coupling(const ReducedBody&, const ExportOptions&, const std::filesystem::path&);
std::vector<std::string> coupling_cannot_hold(const ReducedBody&);
ReadBack coupling_read_back(const ExportOptions&, const std::filesystem::path&);

}  // namespace flexboom
