#pragma once

#include "reduction/body/reduced_body.hpp"

#include <string_view>

namespace flexboom {

/// What other programs want of `ReducedBody::gram`: its 3 x 3 blocks, not symmetrised.
class RawIntegrals {
 public:
  /// The body must outlive this. @throws InputError when it has no gram, naming the format that wants it.
  RawIntegrals(const ReducedBody&, std::string_view format);

  /// sum dm S_k u0^T [kg m per coordinate]: L_ij^k of NASA 42.
  Eigen::Matrix3d S_u0(Eigen::Index k) const { return gram_.block<3, 3>(4 + 3 * k, 1); }

  /// sum dm S_k S_l^T: N_ij^kl of NASA 42.
  Eigen::Matrix3d S_S(Eigen::Index k, Eigen::Index l) const { return gram_.block<3, 3>(4 + 3 * k, 4 + 3 * l); }

  /// sum dm tilde(u0) tilde(S_k) = W^T - tr W I with W = sum dm u0 S_k^T.
  Eigen::Matrix3d tilde_u0_tilde_S(Eigen::Index k) const { return tilde_tilde(S_u0(k).transpose()); }

  /// sum dm tilde(S_k) tilde(S_l).
  Eigen::Matrix3d tilde_S_tilde_S(Eigen::Index k, Eigen::Index l) const { return tilde_tilde(S_S(k, l)); }

 private:
  // tilde(a) tilde(b) = b a^T - (a . b) I
  static Eigen::Matrix3d tilde_tilde(const Eigen::Matrix3d& ab) {
    return ab.transpose() - ab.trace() * Eigen::Matrix3d::Identity();
  }

  const Eigen::MatrixXd& gram_;
};

/// The same body in other coordinates: q = T q', T (n x n) regular. Everything the body has goes along (shapes, gram,
/// geometric stiffness, damping); the coordinate table stays, line by line.
/// @throws InputError when the body has no gram.
ReducedBody in_coordinates(const ReducedBody&, const Eigen::MatrixXd& T);

/// Coordinates of unit modal mass: q = T q' with T^T Me T = I and T^T Ke T = diag(lambda). Only scaled where Me and Ke
/// are diagonal already, else the modes of (Me, Ke) in ascending order, whose coordinate table says "mode". Each has
/// the sign of the coordinate that it has most of.
struct ModalCoordinates {
  Eigen::MatrixXd T;
  Eigen::VectorXd lambda;  // omega^2 [rad^2/s^2]
  std::vector<Coordinate> coordinates;
};
ModalCoordinates modal_coordinates(const ReducedBody&);

/// The same body in coordinates of unit modal mass.
/// @throws InputError when the body has no gram.
ReducedBody with_unit_modal_mass(const ReducedBody&);

/// A name without white space, quotes and commas, "_" instead; not empty.
std::string plain_name(std::string_view name);

}  // namespace flexboom
