#pragma once

#include "reduction/exports/exports.hpp"

namespace flexboom {

/// A node of a 42 body, or a joint on it.
struct Node42 {
  std::string label;
  int joint = -1;  // index of the joint, of joints
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Matrix3Xd PSI;    // 3 x n, displacement
  Eigen::Matrix3Xd THETA;  // 3 x n, rotation
};

/// Spring and damper of a passive joint, zero at joint angle and displacement zero.
struct PassiveJoint42 {
  Eigen::Vector3d rotation_spring = Eigen::Vector3d::Zero();     // [N m/rad]
  Eigen::Vector3d rotation_damper = Eigen::Vector3d::Zero();     // [N m s/rad]
  Eigen::Vector3d translation_spring = Eigen::Vector3d::Zero();  // [N/m]
  Eigen::Vector3d translation_damper = Eigen::Vector3d::Zero();  // [N s/m]
};

/// What NASA 42 wants of a flexible body, BRF axes. With u the modal speeds, its equation of mode k is
///   Mf u' = -Kf x - Cf u - Pf.a - (Hf + Q x).alpha - w.(R + S x) w - 2 w.Q u + PSI^T F + THETA^T T
/// and Q, R, S are made from L and N by the program.
struct File42 {
  double mass = 0;
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  // about the centre or the joint
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  bool about_centre = false;  // REFPT_CM, else REFPT_JOINT: the BRF origin is the inner joint
  std::vector<Node42> joints;
  std::vector<Node42> nodes;
  Eigen::MatrixXd Mf, Kf, Cf;
  Eigen::Matrix3Xd Pf;                          // 3 x n: int S_k
  Eigen::Matrix3Xd Hf;                          // 3 x n: int u0 x S_k
  std::vector<Eigen::Matrix3d> L;               // n of int S_k u0^T
  std::vector<std::vector<Eigen::Matrix3d>> N;  // n x n of int S_k S_l^T
  PassiveJoint42 joint;
};

std::span<const ExportSetting> settings_42();

/// @throws InputError for a body that is neither clamped nor mean-axis, or has no gram.
File42 file_42(const ReducedBody&, const ExportOptions&);

/// Reads Block_NAME.txt, Flex_NAME.txt, Nodes_NAME.txt and Joint_NAME.txt of a folder, NAME being the folder's own.
/// @throws InputError with file:line:column.
File42 read_42(const std::filesystem::path& folder);

/// Writes these four files.
void write_42(const ReducedBody&, const ExportOptions&, const std::filesystem::path& folder);
std::vector<std::string> cannot_hold_42(const ReducedBody&);
ReadBack read_back_42(const ExportOptions&, const std::filesystem::path&);

}  // namespace flexboom
