#pragma once

#include "reduction/exports/exports.hpp"

#include <map>

namespace flexboom {

/// Data of an MBDyn modal element file, in the axes of the modal node, which is the BRF: record groups 1 to 19.
struct MbdynFile {
  std::vector<std::string> labels;  // of the nodes: markers, then the mass points of group 11
  Eigen::Matrix3Xd positions;
  std::vector<Eigen::MatrixXd> shapes;  // one per node: 6 x n, displacements and rotations
  Eigen::MatrixXd mass, stiffness, damping;
  double m = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  // about the centre
  std::vector<double> masses;                         // group 11, one per node; empty without it
  // Groups 14 to 18, empty without them. Modal.cc builds the same from the nodal masses of group 11.
  Eigen::MatrixXd Inv3;  // 3 x n: int S_j
  Eigen::MatrixXd Inv4;  // 3 x n: int u0 x S_j
  Eigen::MatrixXd Inv8;  // 3 x 3n: -int tilde(u0) tilde(S_j)
  Eigen::MatrixXd Inv5;  // 3 x n n: int S_j x S_k, k counts faster
  Eigen::MatrixXd Inv9;  // 3 x 3n n: int tilde(S_j) tilde(S_k), k counts faster
  /// Group 19: stiffness per unit of load. Loads 1..6 are omega_x^2, omega_y^2, omega_z^2, omega_x omega_y, omega_y
  /// omega_z, omega_z omega_x. Loads 7..9 are angular acceleration, 10..12 acceleration less gravity. From 13 on they
  /// are forces and torques at the nodes, six each.
  std::map<int, Eigen::MatrixXd> stiffening;
};

std::span<const ExportSetting> mbdyn_settings();

/// What the file of that body holds. @throws InputError without markers, or without gram where invariants are wanted.
MbdynFile mbdyn_file(const ReducedBody&, const ExportOptions&);

/// Invariants 3, 4, 5, 8 and 9 as modal.cc sums them over the nodal masses, in place of what groups 14 to 18 hold.
void sum_nodal_masses(MbdynFile&);

/// Reads a file of modal element data: any order of groups, any comments. @throws InputError with file:line:column.
MbdynFile read_mbdyn(const std::filesystem::path&);

/// Writes PATH and, with the ending .modal, a template of the nodes and the joint that use it.
void write_mbdyn(const ReducedBody&, const ExportOptions&, const std::filesystem::path&);
std::vector<std::string> mbdyn_cannot_hold(const ReducedBody&);
ReadBack mbdyn_read_back(const ExportOptions&, const std::filesystem::path&);

}  // namespace flexboom
