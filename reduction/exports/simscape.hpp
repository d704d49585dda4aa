#pragma once

#include "reduction/exports/exports.hpp"

#include <Eigen/Core>

#include <filesystem>
#include <string>
#include <vector>

namespace flexboom {

/// What the block "Reduced Order Flexible Solid" of Simscape Multibody is given, SI, one reference frame (the BRF).
/// Degrees of freedom: Tx Ty Tz Rx Ry Rz of each interface in the order of P, then the fixed-interface modes.
struct SimscapeModel {
  std::vector<std::string> interfaces;  // F names
  Eigen::MatrixXd P;                    // F x 3, origins of the interface frames [m]
  Eigen::MatrixXd Q;                    // F x 4, their unit quaternions (w, x, y, z): along the BRF
  Eigen::MatrixXd K;                    // (6F + modes) square
  Eigen::MatrixXd M;
  Eigen::MatrixXd C;

  /// The six rigid motions of the interfaces (columns: translations, rotations about the BRF origin), (6F + modes) x 6.
  Eigen::MatrixXd rigid_motions() const;
};

/// How close K is to what a free body must have.
struct SimscapeRank {
  int deficiency = 0;          // of K: 6 of a free body
  double rigid_residual = 0;   // |K R| / |K| |R|, each freedom in units of its stiffness
  double largest_zero_hz = 0;  // of the frequencies of (K, M) counted as zero
  double first_elastic_hz = 0;
};
SimscapeRank rank_of_stiffness(const SimscapeModel&);

/// @throws InputError unless the body is of frame "free", its interfaces keep all six components and its coordinates
/// are their motions. That is Craig-Bampton, before any change of coordinates. The message says how to make such a
/// body.
SimscapeModel simscape_model(const ReducedBody&);

/// The model as a MAT file of level 5: variables P, Q, K, M, C, and for people `interfaces`, `units`, `program`.
/// @throws InputError as simscape_model, and when the file cannot be written or K has not the rank deficiency 6.
void write_simscape(const ReducedBody&, const ExportOptions&, const std::filesystem::path&);

/// What of this body the block does not take, one sentence each, and what was found of the rank of K.
std::vector<std::string> simscape_cannot_hold(const ReducedBody&);

/// @throws InputError naming the variable that is missing or of the wrong size.
SimscapeModel read_simscape(const std::filesystem::path&);

/// The mass properties from the rigid motions R of the interfaces: R^T M R and R^T M.
ReadBack simscape_read_back(const ExportOptions&, const std::filesystem::path&);

}  // namespace flexboom
