#include "reduction/body/rigid_motion.hpp"

#include "reduction/body/tilde.hpp"

namespace flexboom {

Eigen::MatrixXd rigid_coupling(const ReducedBody& body) {
  Eigen::MatrixXd L(6, body.n());
  L << body.Ct, body.Cr0;
  return L;
}

Eigen::Matrix<double, 6, 6> rigid_mass(const ReducedBody& body) {
  Eigen::Matrix<double, 6, 6> M_r;
  M_r << body.m * Eigen::Matrix3d::Identity(), -tilde(body.mc0), tilde(body.mc0), body.J0;
  return M_r;
}

}  // namespace flexboom
